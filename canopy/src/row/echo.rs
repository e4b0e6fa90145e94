//! Which echo the row's scans hold.

use rowscan_protocol::rig::EchoChoice;

use super::Row;
use crate::parameters::Parameters;
use crate::voxels::Voxels;

impl Row {
    /// What it is measured by.
    pub(crate) fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The scans, of which none has come yet, hold this echo. False of beams without a width: every echo is the first.
    pub(crate) fn tell_echo(&mut self, echo: EchoChoice) -> bool {
        let Some(footprint) = &mut self.parameters.footprint else { return false };
        let before = footprint.echo.replace(echo);
        // Where nobody knows, all is made ready for first echoes.
        if before.unwrap_or(EchoChoice::First) != echo {
            self.voxels = Voxels::new(&self.frame, self.row_spacing_m, &self.parameters);
            let asked = std::mem::take(&mut self.asked);
            self.measure(&asked);
        }
        true
    }

    /// The echo that its scans hold, of beams with a width.
    pub(crate) fn echo(&self) -> Option<EchoChoice> {
        self.parameters.footprint.and_then(|footprint| footprint.echo)
    }

    /// Which echo its scans hold is not known after all.
    pub(crate) fn forget_echo(&mut self) {
        if let Some(footprint) = &mut self.parameters.footprint {
            footprint.echo = None;
        }
    }

    /// Whether the beams have a width, and nobody knows which echo their scans hold.
    pub(crate) fn lacks_the_echo(&self) -> bool {
        self.parameters.footprint.is_some_and(|footprint| footprint.echo.is_none())
    }
}
