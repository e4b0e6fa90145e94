//! A change of settings, whatever language it is asked for in.

use super::context::Context;
use crate::telegram::SopasError;

/// Changes settings, and undoes the change where the scans of a recording cannot honour it. Every write passes here.
pub(super) fn change(
    context: &mut Context<'_>,
    write: impl FnOnce(&mut Context<'_>) -> Result<(), SopasError>,
) -> Result<(), SopasError> {
    let before = context.device.recorded.is_some().then(|| context.device.settings.clone());
    write(context)?;
    before.map_or(Ok(()), |before| context.device.keep_scans(before))
}
