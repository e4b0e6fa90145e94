//! The variables of scanners with Compact output: one row each, which CoLa and REST are both served by.
//!
//! A row says what parts the value has, how wide they are on CoLa's wire, what REST calls them, which values they take, and what the variable does.
//! Where CoLa scanners of old have the same command (FREchoFilter, DeviceIdent, …), the row names its parts and the command answers.

mod shape;
mod stored;
mod table;

pub use shape::{Kind, Part, Value};
pub(super) use stored::Stored;
use table::Source;
pub use table::{Access, VARIABLES, Variable};
pub(super) use table::{LAYERS, Own};

use alloc::vec::Vec;

use super::context::Context;
use super::effect::compact;
use super::known::{read_command, write_command};
use super::refusal::Fault;
use crate::frame::Dialect;
use crate::model::Model;
use crate::telegram::wire::{Reader, Writer};
use crate::telegram::{Args, Kind as TelegramKind, SopasError, Telegram};

/// The variable called `name`; none where the model has none of these.
pub(super) fn by_name(context: &Context<'_>, name: &str) -> Option<&'static Variable> {
    context.device.variable(name)
}

impl Variable {
    /// Its value now, part by part.
    pub(super) fn value(&self, context: &Context<'_>) -> Result<Vec<Value>, SopasError> {
        match self.source {
            Source::Stored(_) => Ok(context.device.settings.variables.of(self).to_vec()),
            Source::Own(own) => Ok(compact::get(own, context)),
            Source::Command => {
                let mut payload = Vec::new();
                read_command(
                    context,
                    self.name,
                    &mut Writer::begin(Dialect::A, TelegramKind::Ra, self.name, &mut payload),
                )?;
                let telegram = Telegram::parse(Dialect::A, &payload).map_err(|_| Fault::NoVariable)?;
                self.read_parts(&mut telegram.args.reader())
            }
        }
    }

    /// Sets its value, as a client that may do so.
    pub(super) fn set(&self, context: &mut Context<'_>, value: Vec<Value>) -> Result<(), SopasError> {
        if !self.takes(context.device.model, &value) {
            return Err(Fault::NoSuchCode.into());
        }
        match self.source {
            Source::Stored(_) => {
                context.device.settings.variables.set(self, value);
                Ok(())
            }
            Source::Own(own) => compact::set(own, context, &value),
            Source::Command => {
                let mut payload = Vec::new();
                self.write_parts(
                    &value,
                    &mut Writer::begin(Dialect::A, TelegramKind::Wn, self.name, &mut payload),
                );
                let telegram = Telegram::parse(Dialect::A, &payload).map_err(|_| Fault::NoVariable)?;
                write_command(context, self.name, telegram.args)
            }
        }
    }

    /// `sRN`: appends the value.
    pub(super) fn read(&self, context: &Context<'_>, writer: &mut Writer<'_>) -> Result<(), SopasError> {
        if let Source::Command = self.source {
            return read_command(context, self.name, writer);
        }
        let value = self.value(context)?;
        self.write_parts(&value, writer);
        Ok(())
    }

    /// `sWN`: takes the value.
    pub(super) fn write(&self, context: &mut Context<'_>, args: Args<'_>) -> Result<(), SopasError> {
        if let Source::Command = self.source {
            return write_command(context, self.name, args);
        }
        let mut reader = args.reader();
        let value = self.read_parts(&mut reader)?;
        reader.end()?;
        self.set(context, value)
    }

    /// Whether each part takes its value on a scanner of `model`.
    pub fn takes(&self, model: &Model, value: &[Value]) -> bool {
        value.len() == self.parts.len()
            && self.parts.iter().zip(value).all(|(part, value)| part.kind.takes_of(model, value))
    }

    fn read_parts(&self, reader: &mut Reader<'_>) -> Result<Vec<Value>, SopasError> {
        self.parts.iter().map(|part| part.kind.read(reader).map_err(SopasError::from)).collect()
    }

    fn write_parts(&self, value: &[Value], writer: &mut Writer<'_>) {
        self.parts.iter().zip(value).for_each(|(part, value)| part.kind.write(value, writer));
    }
}
