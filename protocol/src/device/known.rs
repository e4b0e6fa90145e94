//! The commands of a model, and the values of those that are variables.

use super::command::{Command, by_name};
use super::context::Context;
use super::refusal::Fault;
use super::state::Device;
use crate::telegram::wire::Writer;
use crate::telegram::{Args, SopasError};

/// The command called `name`, if this model has it.
pub(super) fn known(device: &Device, name: &str) -> Option<&'static Command> {
    by_name(name).filter(|_| device.model.has(name))
}

/// Reads a variable of the command table.
pub(super) fn read_command(
    context: &Context<'_>,
    name: &str,
    writer: &mut Writer<'_>,
) -> Result<(), SopasError> {
    known(context.device, name).and_then(|command| command.read).ok_or(Fault::NoVariable)?(context, writer)
}

/// Writes one.
pub(super) fn write_command(context: &mut Context<'_>, name: &str, args: Args<'_>) -> Result<(), SopasError> {
    known(context.device, name).and_then(|command| command.write).ok_or(Fault::NoVariable)?(context, args)
}
