//! Flags that say in which state the virtual scanner is, and how it behaves.

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use rowscan_bench::{DeviceSpec, Ident, StartState};
use rowscan_emulator::LineChange;
use rowscan_protocol::device::{Profile, Start};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::time::SimTime;

use super::Failure;

/// The longest text that a scanner says of itself here: all that are known have 21 characters or fewer.
const LONGEST_TOLD: usize = 40;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Device")]
pub(super) struct DeviceArgs {
    /// Whether it takes the time a real one takes
    #[arg(long, default_value = "bench", value_parser = profile_parser())]
    profile: Profile,
    /// The state it is found in [default: streaming; power-up with --profile field]
    #[arg(long, value_name = "STATE", value_parser = start_parser())]
    start: Option<String>,
    /// Keep saved settings (mEEwriteall; LMS2xx: 77) in this file, and begin with what it holds
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// A login stops the scans until Run or LMCstartmeas, as the manual has it
    #[arg(long)]
    strict_login: bool,
    /// Seconds it has been on already: where its clock stands
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = uptime)]
    uptime: f64,
    /// How much too fast its clock runs, parts per million
    #[arg(long, value_name = "PPM", default_value_t = 0, allow_negative_numbers = true,
          value_parser = clap::value_parser!(i32).range(-100_000..=100_000))]
    clock_ppm: i32,
    /// Switch a digital input, at a second of simulated time; repeatable: `1=on`, `2=off@3.5`
    #[arg(long, value_name = "N=on|off[@SECONDS]")]
    input: Vec<LineArg>,
    /// Switch a digital output; as --input
    #[arg(long, value_name = "N=on|off[@SECONDS]")]
    output: Vec<LineArg>,
    /// Evaluation field 1: infringed while anything is nearer than this; repeated: field 2 and on
    #[arg(long, value_name = "METRES", value_parser = field_mm)]
    field: Vec<u16>,
    /// Seconds from power-up to the first answer, in place of the model's [--profile field]
    #[arg(long, value_name = "SECONDS", value_parser = duration)]
    boot_s: Option<Duration>,
    /// Seconds that saving takes (mEEwriteall; LMS2xx: 77), in place of the model's [--profile field]
    #[arg(long, value_name = "SECONDS", value_parser = duration)]
    save_s: Option<Duration>,
    /// Dirt on the front screen: 0 clean, 1 warning, 2 error, 3 serious error [default: the scene's]
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(0..=3))]
    contamination: Option<u8>,
    /// What FirmwareVersion says, in place of the model's own; of an LMS2xx, whose firmware it is: V02.10, V02.30 or X01.27
    #[arg(long, value_name = "VERSION", value_parser = told)]
    firmware: Option<String>,
    /// What DeviceIdent says, in place of the model's own: name and version, such as `LMS10x_FieldEval V1.80-01.02.2012`
    #[arg(long, value_name = "NAME VERSION", value_parser = ident)]
    ident: Option<Ident>,
    /// The comment in its scan telegrams, where a client asks for it
    #[arg(long, value_name = "TEXT", default_value = "")]
    comment: String,
}

/// Profiles by name.
fn profile_parser() -> impl TypedValueParser<Value = Profile> {
    let named = Profile::NAMED.iter().map(|(name, about, _)| PossibleValue::new(*name).help(*about));
    PossibleValuesParser::new(named).map(|name| Profile::by_name(&name).unwrap_or_default())
}

/// States by name: those of CoLa scanners, then what only an LMS2xx has.
fn start_parser() -> PossibleValuesParser {
    let cola = Start::NAMED.iter().map(|(name, about, _)| (*name, *about));
    let lms2xx = lms2xx::device::Start::NAMED.iter().map(|(name, about, _)| (*name, *about));
    let only_lms2xx = lms2xx.filter(|(name, _)| Start::by_name(name).is_none());
    let named = cola.chain(only_lms2xx).map(|(name, about)| PossibleValue::new(name).help(about));
    PossibleValuesParser::new(named)
}

/// `1=on@2.5`
#[derive(Clone, Copy, Debug, PartialEq)]
struct LineArg {
    number: u8,
    on: bool,
    at: SimTime,
}

impl FromStr for LineArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected a line such as `1=on` or `2=off@3.5`, found `{text}`");
        let (number, rest) = text.split_once('=').ok_or_else(wrong)?;
        let (state, seconds) = rest.split_once('@').unwrap_or((rest, "0"));
        let on = match state {
            "on" => true,
            "off" => false,
            _ => return Err(wrong()),
        };
        let seconds =
            seconds.parse().ok().and_then(|s| Duration::try_from_secs_f64(s).ok()).ok_or_else(wrong)?;
        Ok(Self { number: number.parse().map_err(|_| wrong())?, on, at: SimTime::ZERO + seconds })
    }
}

fn uptime(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("expected seconds, found `{text}`"))?;
    // A hundred years; the device's own clock wraps after 71 minutes anyway.
    match (0.0..=3.2e9).contains(&seconds) {
        true => Ok(seconds),
        false => Err(format!("expected 0 to 3200000000 seconds, found `{text}`")),
    }
}

/// An hour at most: no scanner takes longer.
fn duration(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.0..=3600.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| format!("expected 0 to 3600 seconds, found `{text}`"))
}

/// A text that a scanner says of itself.
fn told(text: &str) -> Result<String, String> {
    let is_told = |text: &str| text.bytes().all(|byte| matches!(byte, b' '..=b'~'));
    match text.len() {
        1..=LONGEST_TOLD if is_told(text) => Ok(text.to_owned()),
        length => Err(format!(
            "expected 1 to {LONGEST_TOLD} letters, digits and signs of ASCII, found {length} bytes"
        )),
    }
}

/// `LMS10x_FieldEval V1.80-01.02.2012`
fn ident(text: &str) -> Result<Ident, String> {
    let told = told(text)?;
    let (name, version) = told.trim().rsplit_once(' ').ok_or_else(|| {
        format!("expected a name and a version, such as `LMS10x_FieldEval V1.80-01.02.2012`, found `{text}`")
    })?;
    Ok(Ident { name: name.trim_end().to_owned(), version: version.to_owned() })
}

fn field_mm(text: &str) -> Result<u16, String> {
    let millimetres = text.parse::<f64>().map(|metres| (metres * 1000.0).round());
    match millimetres {
        Ok(millimetres) if (1.0..=65_535.0).contains(&millimetres) => Ok(millimetres as u16),
        _ => Err(format!("expected 0.001 to 65.535 metres, found `{text}`")),
    }
}

impl DeviceArgs {
    /// Whether it keeps its settings in a file.
    pub(super) fn keeps_state(&self) -> bool {
        self.state.is_some()
    }

    /// A device of `model` as these flags have it.
    pub(super) fn spec(&self, model: AnyModel) -> Result<DeviceSpec, Failure> {
        let lines = |args: &[LineArg], output: bool| -> Vec<LineChange> {
            let change =
                move |arg: &LineArg| LineChange { at: arg.at, output, number: arg.number, on: arg.on };
            args.iter().map(change).collect()
        };
        Ok(DeviceSpec {
            profile: self.profile,
            start: self.start.as_deref().map(|name| start_state(name, model)).transpose()?,
            state: self.state.clone(),
            strict_login: self.strict_login,
            uptime: Duration::from_secs_f64(self.uptime),
            clock_ppm: self.clock_ppm,
            line_changes: [lines(&self.input, false), lines(&self.output, true)].concat(),
            fields_mm: self.field.clone(),
            boot: self.boot_s,
            save: self.save_s,
            contamination: self.contamination,
            comment: self.comment.clone(),
            ident: self.ident.clone(),
            firmware: self.firmware.clone(),
            ..DeviceSpec::default()
        })
    }
}

/// The state of this name that a device of `model` can be found in.
fn start_state(name: &str, model: AnyModel) -> Result<StartState, Failure> {
    let (found, family) = match model {
        AnyModel::Cola(_) => (Start::by_name(name).map(StartState::Cola), "a CoLa scanner"),
        AnyModel::Lms2xx(_) => (lms2xx::device::Start::by_name(name).map(StartState::Lms2xx), "an LMS2xx"),
    };
    found.ok_or_else(|| {
        Failure::Usage(format!("--start: {family} has no such state; see `rowscan emulate --help`"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_number_a_state_and_maybe_a_time() {
        let line = |number, on, ns| Ok(LineArg { number, on, at: SimTime(ns) });
        assert_eq!("1=on".parse(), line(1, true, 0));
        assert_eq!("2=off@3.5".parse(), line(2, false, 3_500_000_000));
        for nonsense in ["", "1", "1=yes", "x=on", "1=on@soon", "1=on@-1", "300=on"] {
            assert!(nonsense.parse::<LineArg>().is_err(), "{nonsense}");
        }
    }
}
