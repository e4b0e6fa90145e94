//! What a device answers: the rules that all commands share.

use alloc::vec::Vec;

use super::change::change;
use super::command::{Command, by_event};
use super::context::{Context, Readable};
use super::event::DeviceEvent;
use super::known::known;
use super::refusal::Fault;
use super::variable::{self, Access, Variable};
use crate::frame::Dialect;
use crate::telegram::wire::Writer;
use crate::telegram::{Args, Kind, SopasError, Telegram, device_ident, encode, encode_empty, field_nnn};

/// The user level that writes need.
const CLIENT: u8 = 3;

/// Does what `telegram` asks and appends the reply's payload.
pub(super) fn answer(context: &mut Context<'_>, telegram: &Telegram<'_>, out: &mut Vec<u8>) {
    let start = out.len();
    if let Err(error) = try_answer(context, telegram, out) {
        out.truncate(start);
        refuse(telegram.args.dialect, error, out);
    }
}

/// Appends the payload of `sFA`.
pub(super) fn refuse(dialect: Dialect, error: SopasError, out: &mut Vec<u8>) {
    encode(dialect, Kind::Fa, "", &error.code(), out);
}

fn try_answer(
    context: &mut Context<'_>,
    telegram: &Telegram<'_>,
    out: &mut Vec<u8>,
) -> Result<(), SopasError> {
    let Telegram { kind, name, args } = *telegram;
    if let Some(variable) = variable::by_name(context, name)
        && let Kind::Rn | Kind::Wn = kind
    {
        return answer_variable(context, variable, telegram, out);
    }
    let command = known(context.device, name);
    match kind {
        Kind::Rn if command.is_none() => read_field(context, name, args, out),
        Kind::Rn => {
            let read = command.and_then(|command| command.read).ok_or(Fault::NoVariable)?;
            read(context, &mut Writer::begin(args.dialect, Kind::Ra, name, out))
        }
        Kind::Ri if name == device_ident::INDEX => {
            let ident = device_ident::DeviceIdent::get(context);
            encode(args.dialect, Kind::Ra, name, &ident, out);
            Ok(())
        }
        Kind::Ri => Err(Fault::NoVariable.into()),
        Kind::Wn => {
            let command = command.filter(|command| command.read.is_some()).ok_or(Fault::NoVariable)?;
            let write = command.write.ok_or(Fault::ReadOnly)?;
            if context.access.level < CLIENT {
                return Err(Fault::WriteWithoutLogin.into());
            }
            change(context, |context| write(context, args))?;
            let blank = !context.device.model.replies_without_blank.contains(&name);
            encode_empty(args.dialect, Kind::Wa, name, blank, out);
            Ok(())
        }
        Kind::Mn => {
            let (level, call) = command.and_then(|command| command.call).ok_or(Fault::NoMethod)?;
            if context.access.level < level {
                return Err(Fault::CallWithoutLogin.into());
            }
            call(context, args, out)
        }
        Kind::En => {
            let event = command.and_then(|command| command.event).ok_or(Fault::NoEvent)?;
            let on = args.decode::<bool>()?;
            context.access.subscriptions.set(event, on);
            encode(args.dialect, Kind::Ea, name, &on, out);
            Ok(())
        }
        Kind::Ra | Kind::Wa | Kind::Ma | Kind::An | Kind::Ea | Kind::Sn | Kind::Fa => {
            Err(Fault::NoCommand.into())
        }
    }
}

/// Reads or writes a variable that REST has, too.
fn answer_variable(
    context: &mut Context<'_>,
    variable: &Variable,
    telegram: &Telegram<'_>,
    out: &mut Vec<u8>,
) -> Result<(), SopasError> {
    let Telegram { kind, name, args } = *telegram;
    if kind == Kind::Rn {
        return variable.read(context, &mut Writer::begin(args.dialect, Kind::Ra, name, out));
    }
    if variable.access == Access::ReadOnly {
        return Err(Fault::ReadOnly.into());
    }
    if context.access.level < CLIENT {
        return Err(Fault::WriteWithoutLogin.into());
    }
    change(context, |context| variable.write(context, args))?;
    encode_empty(args.dialect, Kind::Wa, name, true, out);
    Ok(())
}

/// Applies one line of saved settings, as a write of a logged-in client would.
pub(super) fn write_saved(context: &mut Context<'_>, name: &str, args: Args<'_>) -> Result<(), SopasError> {
    let write = known(context.device, name).and_then(|command| command.write);
    write.ok_or(Fault::NoVariable)?(context, args)
}

/// Appends the payload `sWN name value` that would set a variable to what it is now.
pub(super) fn read_saved(context: &Context<'_>, name: &str, out: &mut Vec<u8>) -> Result<(), SopasError> {
    let read = known(context.device, name).and_then(|command| command.read).ok_or(Fault::NoVariable)?;
    read(context, &mut Writer::begin(Dialect::A, Kind::Wn, name, out))
}

/// Appends the payload `sSN name value` of a variable that can be subscribed to.
pub(super) fn write_event(event: DeviceEvent, context: &Context<'_>, out: &mut Vec<u8>) {
    if let Some(Command { name, read: Some(read), .. }) = by_event(event) {
        // No event is told before it has happened, so its value can be read.
        let _ = read(context, &mut Writer::begin(context.access.dialect, Kind::Sn, name, out));
    }
}

/// Every evaluation field is one that nobody has set.
fn read_field(
    context: &Context<'_>,
    name: &str,
    args: Args<'_>,
    out: &mut Vec<u8>,
) -> Result<(), SopasError> {
    let slot = field_nnn::slot(name).ok_or(Fault::NoVariable)?;
    if slot >= context.device.model.fields {
        return Err(Fault::NoVariable.into());
    }
    let device = &*context.device;
    match field_nnn::Shape::of_slot(slot, device.model) {
        Some(empty) => encode(args.dialect, Kind::Ra, name, &empty, out),
        None => encode(args.dialect, Kind::Ra, name, &field_nnn::Field::unused(args.dialect), out),
    }
    Ok(())
}
