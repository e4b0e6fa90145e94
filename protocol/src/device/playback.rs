//! A device whose scans come from a recording: it is set as the recorded one was, and stays so.

use crate::angle::BeamGrid;
use crate::frame::Dialect;
use crate::model::ScanMode;
use crate::rig::EchoChoice;
use crate::telegram::fr_echo_filter;
use crate::telegram::lmd_scandata::ANGLES;
use crate::telegram::lmd_scandatacfg::{
    ANGLE_TABLE, REMISSION, REMISSION_8_BIT, REMISSION_16_BIT, ScanDataConfig,
};
use crate::telegram::wire::LowHigh;
use crate::telegram::{Channel, Kind, LmdScandata, SopasError, Telegram, Variable};
use crate::time::SimTime;

use super::access::Access;
use super::answer::write_saved;
use super::command::by_name;
use super::context::Context;
use super::recorded::{Echo, Recorded};
use super::refusal::Fault;
use super::settings::{OutputCut, Settings};
use super::state::Device;

/// Which echo recorded turns of one echo a beam hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EchoOfTurns {
    /// This one.
    One(EchoChoice),
    /// Nothing tells; it is the first or the last, and a client may say which it takes it for.
    Untold,
    /// Some turns hold another one than the rest: FREchoFilter can be neither read nor written.
    Changing,
}

impl Device {
    /// Becomes the device that sent `scan`: serial number, scan mode, range and contents are the scan's, other settings those of the recorded
    /// replies and of the writes that were accepted, `values` (`sRA`, `sWN`) in their order, as far as this model takes them. `echo` is the code of
    /// FREchoFilter that the scans were made with; without one it can be neither read nor written ([`Fault::EchoNotRecorded`]), unless scans of several echoes
    /// tell it.
    ///
    /// Afterwards its scans and events come from the recording. A setting that wants what the recorded scans do not have is refused
    /// ([`Fault::FixedByRecording`]); one that wants less is taken, and scans are [cut to measure](Self::cut_to_measure). It sends no events of its own.
    pub fn play_back<'a>(
        &mut self,
        scan: &LmdScandata,
        values: impl IntoIterator<Item = Telegram<'a>>,
        echo: Option<u8>,
    ) {
        self.recorded = None;
        let mut asked = None;
        for Telegram { kind, name, args } in values {
            if matches!(kind, Kind::Ra | Kind::Wn) && by_name(name).is_some_and(|command| command.is_replayed)
            {
                let mut access = Access::new(Dialect::B);
                let mut context = Context { device: self, access: &mut access, now: SimTime::ZERO };
                // A value this model does not have is answered from the recording only.
                let taken = write_saved(&mut context, name, args).is_ok();
                if taken && kind == Kind::Wn && name == ScanDataConfig::NAME {
                    asked = Some(self.settings.scan_data.clone());
                }
            }
        }
        self.identity.serial_number = scan.serial_number;
        self.settings.scan_data = contents(scan, &self.settings.scan_data);
        let has_several = self.settings.scan_data.channels.0.count_ones() > 1;
        let echo = if has_several { Some(fr_echo_filter::ALL) } else { echo };
        if self.model.echoes > 1 {
            self.settings.echo_filter = echo.unwrap_or(fr_echo_filter::FIRST);
        }
        let is_known = echo.is_some() || self.model.echoes == 1;
        if let Some(channel) = scan.channels16.first() {
            self.settings.mode = ScanMode { frequency_centihz: scan.scan_frequency, step: channel.step };
            let beams = i64::try_from(channel.values.len()).unwrap_or_default();
            let swept = (crate::angle::exact_step_deg(channel.step) * 10_000.0 * (beams - 1) as f64) as i32;
            let cut =
                OutputCut { start: channel.start_angle, stop: channel.start_angle.saturating_add(swept) };
            if cut.is_within(self.model)
                && !cut.is_full(self.model)
                && !self.model.has_turn(channel.start_angle, channel.values.len())
            {
                self.settings.output_range = cut;
            }
        }
        self.record(asked, if is_known { Echo::Known } else { Echo::Unknown });
    }

    /// Becomes the device whose turns are recorded as Compact telegrams of these echoes a beam; its mode and echoes stay so, as with
    /// [`play_back`](Self::play_back). Of one echo a beam, `echo` says which it is.
    pub fn play_back_turns(&mut self, serial_number: u32, mode: ScanMode, echoes: usize, echo: EchoOfTurns) {
        self.identity.serial_number = serial_number;
        self.settings.mode = mode;
        let (code, known) = match echo {
            _ if echoes > 1 => (fr_echo_filter::ALL, Echo::Known),
            EchoOfTurns::One(EchoChoice::First) => (fr_echo_filter::FIRST, Echo::Known),
            EchoOfTurns::One(EchoChoice::Last) => (fr_echo_filter::LAST, Echo::Known),
            EchoOfTurns::Untold => (fr_echo_filter::FIRST, Echo::FirstOrLast),
            EchoOfTurns::Changing => (fr_echo_filter::FIRST, Echo::Unknown),
        };
        self.settings.echo_filter = code;
        self.record(None, known);
    }

    /// The settings as they are now are those of the recorded scans.
    fn record(&mut self, asked: Option<ScanDataConfig>, echo: Echo) {
        self.saved = self.settings.clone();
        self.recorded = Some(Recorded { sent: self.settings.clone(), asked, echo });
    }

    /// True if nothing in the recording tells which echo its scans hold.
    pub(super) fn lacks_the_echo(&self) -> bool {
        self.recorded.as_ref().is_some_and(|recorded| recorded.echo == Echo::Unknown)
    }

    /// Sets the scan that a poll (`sRN LMDscandata`) returns.
    pub fn show_scan(&mut self, scan: LmdScandata) {
        self.last_scan = scan;
        self.has_scan = true;
    }

    /// Undoes a change of settings that the recording cannot honour.
    pub(super) fn keep_scans(&mut self, before: Settings) -> Result<(), SopasError> {
        let honoured = self
            .recorded
            .as_ref()
            .is_none_or(|recorded| recorded.honours(&self.settings, self.model, self.mirror().beams));
        if !honoured {
            self.settings = before;
            self.fixed += 1;
            return Err(Fault::FixedByRecording.into());
        }
        Ok(())
    }

    /// True if less was asked for than the recorded scans have.
    pub fn is_cut(&self) -> bool {
        let full = self.mirror().beams;
        let same = |recorded: &Recorded| {
            let settings = recorded.in_terms_of_scans(&self.settings);
            recorded.sent.are_within(&settings, self.model, recorded.echo, full)
        };
        self.recorded.as_ref().is_some_and(|recorded| !same(recorded))
    }

    /// Leaves out of a recorded scan what was not asked for: channels, beams, blocks.
    pub fn cut_to_measure(&self, scan: &mut LmdScandata) {
        let wanted = &self.settings.scan_data;
        let echoes = self.settings.delivered_echoes(self.model);
        let has = |name: [u8; 5]| match name {
            [b'D', b'I', b'S', b'T', digit] => is_in(echoes, digit),
            [b'R', b'S', b'S', b'I', digit] => wanted.remission & REMISSION != 0 && is_in(echoes, digit),
            _ if name == ANGLES.0 => wanted.remission & ANGLE_TABLE != 0,
            _ => true,
        };
        scan.channels16.retain(|channel| has(channel.name.0));
        scan.channels8.retain(|channel| has(channel.name.0));
        if !self.settings.output_range.is_full(self.model) {
            scan.channels16.iter_mut().for_each(|channel| self.settings.output_range.cut(channel));
            scan.channels8.iter_mut().for_each(|channel| self.settings.output_range.cut(channel));
        }
        let mut encoder = 0;
        scan.encoders.retain(|_| {
            encoder += 1;
            wanted.encoders.0 >> (encoder - 1) & 1 == 1
        });
        scan.position = scan.position.filter(|_| wanted.position);
        scan.name = scan.name.take().filter(|_| wanted.device_name || self.model.names_itself);
        scan.comment = scan.comment.take().filter(|_| wanted.comment);
        scan.time = scan.time.filter(|_| wanted.time);
    }
}

/// Whether the echo of this digit is in the mask.
fn is_in(echoes: u16, digit: u8) -> bool {
    let echo = u32::from(digit.wrapping_sub(b'1'));
    echoes.checked_shr(echo).is_some_and(|echoes| echoes & 1 == 1)
}

impl OutputCut {
    /// Leaves out of a channel the beams outside the cut.
    fn cut<T>(self, channel: &mut Channel<T>) {
        let count = u16::try_from(channel.values.len()).unwrap_or(u16::MAX);
        let sent = BeamGrid { start: channel.start_angle, step: channel.step, count };
        let (first, kept) = self.beams(sent);
        channel.values.truncate(first + kept.len());
        channel.values.drain(..first.min(channel.values.len()));
        channel.start_angle = kept.start;
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
    let has_angles = scan.channels16.iter().any(|channel| channel.name == ANGLES);
    let narrow = scan.channels8.iter().any(|channel| channel.name.0.starts_with(b"RSSI"));
    ScanDataConfig {
        channels: LowHigh(channels.max(1)),
        remission: if wide || narrow { REMISSION } else { 0 } | if has_angles { ANGLE_TABLE } else { 0 },
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
