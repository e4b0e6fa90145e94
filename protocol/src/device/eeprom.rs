//! Saved settings as text, for a host program that keeps them in a file: one `sWN` a line, in CoLa A, as a client would write them.
//!
//! ```text
//! rowscan settings 1 lms111
//! sWN LMPscancfg 9C4 1 9C4 FFF92230 225510
//! sWN LMDscandatacfg 1 0 0 0 0 0 0 0 0 0 1 1
//! …
//! end 5A
//! ```
//! The last line holds the XOR of all bytes before it, so that a truncated file is detected.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::access::Access;
use super::answer::{read_saved, write_saved};
use super::command::{COMMANDS, by_name};
use super::context::Context;
use super::effect::scanning::set_mode;
use super::state::Device;
use crate::frame::Dialect;
use crate::telegram::eihst_cola::HostDialect;
use crate::telegram::lmp_scancfg::{self, ScanConfig};
use crate::telegram::wire::Writer;
use crate::telegram::{Args, Kind, Telegram, Variable};
use crate::time::SimTime;

/// How a file of settings begins.
const MAGIC: &str = "rowscan settings 1 ";
/// How its last line begins.
const END: &str = "end ";

/// Saved settings that cannot be restored.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SavedSettingsError {
    /// Not such a file.
    #[error("expected a first line `rowscan settings 1 MODEL`: not a file of scanner settings")]
    Foreign,
    /// Another model's.
    #[error("the settings are those of a {found}, this is a {expected}")]
    OtherModel {
        /// This device.
        expected: &'static str,
        /// Whose settings they are.
        found: String,
    },
    /// Cut off, or changed by hand.
    #[error("the last line's check does not fit: the file is torn or was edited")]
    Torn,
    /// A line the device refuses.
    #[error("line {line} is not a setting of this model: `{text}`")]
    Line {
        /// Counted from 1.
        line: usize,
        /// Its text.
        text: String,
    },
}

impl Device {
    /// What mEEwriteall has saved, as text.
    pub fn saved_settings(&self) -> String {
        let mut device = self.clone();
        device.settings = self.saved.clone();
        let mut access = Access::new(Dialect::A);
        let context = Context { device: &mut device, access: &mut access, now: SimTime::ZERO };
        let mut text = format!("{MAGIC}{}\n", self.model.name);
        for name in COMMANDS.iter().filter(|command| command.is_saved).map(|command| command.name) {
            let mut line = Vec::new();
            let is_set = name != HostDialect::NAME || self.host_dialect.is_some();
            if is_set && read_saved(&context, name, &mut line).is_ok() {
                // A line break within a name would tear the line.
                text.extend(line.iter().map(|&byte| if byte < b' ' { '?' } else { char::from(byte) }));
                text.push('\n');
            }
        }
        self.write_variables(&context, &mut text);
        let check = check(&text);
        text.push_str(&format!("{END}{check:02X}\n"));
        text
    }

    /// Appends the lines of the variables that REST has, too.
    fn write_variables(&self, context: &Context<'_>, text: &mut String) {
        let saved = self.variables().filter(|variable| variable.is_saved());
        for variable in saved {
            let mut line = Vec::new();
            let written =
                variable.read(context, &mut Writer::begin(Dialect::A, Kind::Wn, variable.name, &mut line));
            if written.is_ok() {
                text.extend(line.iter().copied().map(char::from));
                text.push('\n');
            }
        }
    }

    /// Restores saved settings, as after a restart. After an error nothing has changed.
    pub fn restore(&mut self, text: &str) -> Result<(), SavedSettingsError> {
        let model = text.strip_prefix(MAGIC).ok_or(SavedSettingsError::Foreign)?;
        let model = model.lines().next().unwrap_or_default();
        if model != self.model.name {
            return Err(SavedSettingsError::OtherModel { expected: self.model.name, found: model.into() });
        }
        let (body, end) = text.rsplit_once(END).ok_or(SavedSettingsError::Torn)?;
        if end != format!("{:02X}\n", check(body)) {
            return Err(SavedSettingsError::Torn);
        }
        let mut device = self.clone();
        for (index, line) in body.lines().enumerate().skip(1) {
            device
                .restore_line(line)
                .ok_or_else(|| SavedSettingsError::Line { line: index + 1, text: line.into() })?;
        }
        device.saved = device.settings.clone();
        *self = device;
        Ok(())
    }

    fn restore_line(&mut self, line: &str) -> Option<()> {
        // Device texts are Latin-1.
        let payload: Vec<u8> =
            line.chars().map(|c| u8::try_from(u32::from(c)).ok()).collect::<Option<_>>()?;
        let Telegram { kind: Kind::Wn, name, args } = Telegram::parse(Dialect::A, &payload).ok()? else {
            return None;
        };
        if name == ScanConfig::NAME {
            return (set_mode(self, &args.decode().ok()?) == lmp_scancfg::OK).then_some(());
        }
        let args = Args { dialect: Dialect::A, ..args };
        let variable = self.variable(name).filter(|variable| variable.is_saved());
        if let Some(variable) = variable {
            let mut access = Access::new(Dialect::A);
            let mut context = Context { device: self, access: &mut access, now: SimTime::ZERO };
            return variable.write(&mut context, args).ok();
        }
        let known = by_name(name).is_some_and(|command| command.is_saved);
        let mut access = Access::new(Dialect::A);
        let mut context = Context { device: self, access: &mut access, now: SimTime::ZERO };
        known.then(|| write_saved(&mut context, name, args).ok())?
    }
}

fn check(text: &str) -> u8 {
    text.bytes().fold(0, |check, byte| check ^ byte)
}
