//! A device whose scans come from a recording: it is set as the recorded one was, and stays so.

use crate::frame::Dialect;
use crate::model::ScanMode;
use crate::telegram::lmd_scandatacfg::{REMISSION_8_BIT, REMISSION_16_BIT, ScanDataConfig};
use crate::telegram::wire::LowHigh;
use crate::telegram::{Kind, LmdScandata, SopasError, Telegram};
use crate::time::SimTime;

use super::access::Access;
use super::answer::write_saved;
use super::command::by_name;
use super::context::Context;
use super::refusal::Fault;
use super::settings::{OutputCut, Settings};
use super::state::Device;

impl Device {
    /// Becomes the device that sent `scan`: serial number, scan mode, range and contents are the scan's, other settings those of the recorded
    /// replies `values` (`sRA`), as far as this model takes them.
    ///
    /// Afterwards its scans and events come from the recording. A setting that would change them is refused
    /// ([`Fault::FixedByRecording`]), and it sends no events of its own.
    pub fn play_back<'a>(&mut self, scan: &LmdScandata, values: impl IntoIterator<Item = Telegram<'a>>) {
        self.plays_back = false;
        for Telegram { kind, name, args } in values {
            if kind == Kind::Ra && by_name(name).is_some_and(|command| command.is_replayed) {
                let mut access = Access::new(Dialect::B);
                let mut context = Context { device: self, access: &mut access, now: SimTime::ZERO };
                // A value this model does not have is answered from the recording only.
                let _ = write_saved(&mut context, name, args);
            }
        }
        self.identity.serial_number = scan.serial_number;
        self.settings.scan_data = contents(scan, &self.settings.scan_data);
        if let Some(channel) = scan.channels16.first() {
            self.settings.mode = ScanMode { frequency_centihz: scan.scan_frequency, step: channel.step };
            let beams = i64::try_from(channel.values.len()).unwrap_or_default();
            let swept = (crate::angle::exact_step_deg(channel.step) * 10_000.0 * (beams - 1) as f64) as i32;
            let cut =
                OutputCut { start: channel.start_angle, stop: channel.start_angle.saturating_add(swept) };
            if cut.is_within(self.model) && !cut.is_full(self.model) {
                self.settings.output_range = cut;
            }
        }
        self.saved = self.settings.clone();
        self.plays_back = true;
    }

    /// Sets the scan that a poll (`sRN LMDscandata`) returns.
    pub fn show_scan(&mut self, scan: LmdScandata) {
        self.last_scan = scan;
        self.has_scan = true;
    }

    /// Undoes a change of settings that the recording cannot honour.
    pub(super) fn keep_scans(&mut self, before: Settings) -> Result<(), SopasError> {
        let same = self.settings.shapes_scans_like(&before, self.model, self.mirror().beams);
        if self.plays_back && !same {
            self.settings = before;
            self.fixed += 1;
            return Err(Fault::FixedByRecording.into());
        }
        Ok(())
    }
}

/// The contents that LMDscandatacfg must have asked for.
fn contents(scan: &LmdScandata, known: &ScanDataConfig) -> ScanDataConfig {
    let mut channels = 0;
    for name in scan.channels16.iter().map(|channel| channel.name.0).filter(|name| name.starts_with(b"DIST"))
    {
        let [.., digit] = name;
        channels |= 1_u16.checked_shl(u32::from(digit.wrapping_sub(b'1'))).unwrap_or_default();
    }
    let wide = scan.channels16.iter().any(|channel| channel.name.0.starts_with(b"RSSI"));
    let narrow = scan.channels8.iter().any(|channel| channel.name.0.starts_with(b"RSSI"));
    ScanDataConfig {
        channels: LowHigh(channels.max(1)),
        remission: u8::from(wide || narrow),
        resolution: match (wide, narrow) {
            (true, _) => REMISSION_16_BIT,
            (false, true) => REMISSION_8_BIT,
            (false, false) => known.resolution,
        },
        encoders: LowHigh((1_u16 << scan.encoders.len().min(2)) - 1),
        position: scan.position.is_some(),
        device_name: scan.name.is_some(),
        comment: scan.comment.is_some(),
        time: scan.time.is_some(),
        ..known.clone()
    }
}

impl Settings {
    /// True if scans made with either are the same: what is off may be set to anything.
    fn shapes_scans_like(
        &self,
        other: &Self,
        model: &crate::model::Model,
        full: crate::angle::BeamGrid,
    ) -> bool {
        let contents = |settings: &Self| {
            let contents = settings.scan_data.clone();
            match contents.remission {
                0 => ScanDataConfig { resolution: REMISSION_8_BIT, ..contents },
                _ => contents,
            }
        };
        let range = |settings: &Self| match settings.output_range.is_full(model) {
            true => None,
            false => Some(settings.output_range.beams(full)),
        };
        let filters = |settings: &Self| {
            let filters = settings.filters;
            (
                filters.mean.active.then_some(filters.mean),
                filters.median.active.then_some(filters.median),
                filters.particle.active.then_some(filters.particle),
            )
        };
        self.mode == other.mode
            && contents(self) == contents(other)
            && range(self) == range(other)
            && filters(self) == filters(other)
            && self.suppression == other.suppression
            && (model.echoes == 1 || self.echo_filter == other.echo_filter)
            && (self.scan_data.encoders.0 == 0 || self.encoder == other.encoder)
            && self.applications.ranging == other.applications.ranging
    }
}
