//! What a command's effect is: traits that [`super::effect`] implements for the telegrams a device answers.

use super::access::Access;
use super::state::Device;
use crate::telegram::{Method, SopasError, Variable};
use crate::time::SimTime;

/// All a command may read and change.
pub(super) struct Context<'a> {
    pub(super) device: &'a mut Device,
    pub(super) access: &'a mut Access,
    pub(super) now: SimTime,
}

/// A variable's value, as the device has it now.
pub(super) trait Readable: Variable {
    fn get(context: &Context<'_>) -> Self;
}

/// What writing a variable does.
pub(super) trait Writable: Readable {
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError>;
}

/// What calling a method does.
pub(super) trait Callable: Method {
    fn call(self, context: &mut Context<'_>) -> Result<Self::Reply, SopasError>;
}
