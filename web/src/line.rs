//! One line of a scanner as the page draws it.

use rowscan_emulator::{SeenLine, Sight};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::validity::DeviceStatus;
use rowscan_scenes::Class;

/// One line of a scanner. As many ranges as beams; remissions and classes as many, or none.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Line {
    /// Seconds: simulated ones, or since the source began.
    pub(crate) at_s: f64,
    /// The number in its telegram.
    pub(crate) counter: u16,
    /// What the device says of itself.
    pub(crate) status: DeviceStatus,
    /// Mirror turns a second, as the telegram tells; 0 where it does not.
    pub(crate) frequency_hz: f64,
    /// Device angle of beam 0, degrees.
    pub(crate) start_deg: f64,
    /// From beam to beam, degrees.
    pub(crate) step_deg: f64,
    /// First echo, metres; infinite where there was none.
    pub(crate) range_m: Vec<f32>,
    /// First echo, in the device's own digits.
    pub(crate) remission: Vec<u16>,
    /// What each beam met, where that is known.
    pub(crate) classes: Vec<Class>,
    /// Where the beams went out, where that is known.
    pub(crate) sight: Option<Sight>,
}

impl Line {
    /// What a telegram says.
    pub(crate) fn of_scan(at_s: f64, scan: &Scan) -> Self {
        let echo = scan.echoes.first();
        Self {
            at_s,
            counter: scan.telegram_counter,
            status: scan.status,
            frequency_hz: scan.scan_frequency_hz,
            start_deg: scan.beams.angle_deg(0),
            step_deg: scan.beams.step_deg(),
            range_m: echo
                .map(|echo| echo.range_m.iter().map(|range| *range as f32).collect())
                .unwrap_or_default(),
            remission: echo.map(|echo| echo.remission.clone()).unwrap_or_default(),
            classes: Vec::new(),
            sight: None,
        }
    }

    /// What an emulated scanner's telegram says, and what only the emulator knows.
    pub(crate) fn of_seen(seen: &SeenLine) -> Self {
        let line = Self::of_scan(seen.at.as_secs_f64(), &seen.scan);
        // What the telegram leaves out was not met, whatever stands there.
        let classes = line.range_m.iter().zip(&seen.classes);
        let classes =
            classes.map(|(range, class)| if range.is_finite() { *class } else { Class::None }).collect();
        Self { classes, sight: Some(seen.sight), ..line }
    }
}
