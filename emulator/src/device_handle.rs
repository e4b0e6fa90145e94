//! A scanner's device in the hands of another interface than CoLa: REST.

use std::sync::Weak;

use rowscan_protocol::device::Device;
use rowscan_protocol::time::SimTime;

use crate::shared::Shared;

/// Reaches a scanner's device, and does not keep the scanner running.
#[derive(Clone, Debug)]
pub struct DeviceHandle(pub(crate) Weak<Shared>);

impl DeviceHandle {
    /// Lets `ask` have the device as it is now, with what goes wrong with it, and has everybody notice what has changed. What is awaited afterwards: whether
    /// settings that were saved are in the scanner's file. The scanner is gone: `ask` is not called, and it is false.
    pub fn ask(
        &self,
        ask: &mut dyn FnMut(&mut Device, SimTime),
    ) -> impl Future<Output = bool> + Send + use<> {
        let shared = self.0.upgrade();
        let saved = shared.as_ref().map(|shared| shared.ask(ask));
        async move {
            let (Some(shared), Some(saved)) = (shared, saved) else { return false };
            match (saved, &shared.config.state) {
                (Some(settings), Some(file)) => file.keep(settings).await.is_ok(),
                _ => true,
            }
        }
    }
}
