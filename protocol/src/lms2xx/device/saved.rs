//! The configuration block as text: what a device keeps over the program's end.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::Device;
use crate::lms2xx::configuration::{Configuration, LENGTH};

/// First word of the text.
const HEADING: &str = "LMS2xx configuration";

/// Why a text holds no configuration block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SavedBlockError {
    /// Another text.
    #[error("it holds no configuration of an LMS2xx; expected `{HEADING} …`")]
    Foreign,
    /// Not 34 bytes in hex; 32 for old firmware.
    #[error(
        "its configuration is not a block of this firmware's length in hex ({LENGTH} bytes; 32 with --firmware V02.10)"
    )]
    Block,
    /// No device takes these values.
    #[error("its unit or measuring mode is none that a device has")]
    Values,
}

impl Device {
    /// What it would keep, to be handed to [`Device::restore`].
    pub fn saved_settings(&self) -> String {
        let mut text = String::from(HEADING);
        self.configuration.bytes().iter().for_each(|byte| text += &format!(" {byte:02X}"));
        text.push('\n');
        text
    }

    /// Takes over what another run has kept.
    pub fn restore(&mut self, text: &str) -> Result<(), SavedBlockError> {
        let hex = text.strip_prefix(HEADING).ok_or(SavedBlockError::Foreign)?;
        let mut bytes = hex.split_ascii_whitespace().map(|byte| match byte.len() {
            2 => u8::from_str_radix(byte, 16).map_err(|_| SavedBlockError::Block),
            _ => Err(SavedBlockError::Block),
        });
        // Not more than is needed to see that it is too long.
        let block = bytes.by_ref().take(LENGTH + 1).collect::<Result<Vec<u8>, _>>()?;
        let configuration = Configuration::of(&block)
            .filter(|_| block.len() == self.firmware.block_length())
            .ok_or(SavedBlockError::Block)?;
        if configuration.unit().is_none() || !configuration.measuring_mode().is_known() {
            return Err(SavedBlockError::Values);
        }
        self.configuration = configuration;
        Ok(())
    }
}
