//! What tractor and scanners tell of themselves. What is not known is left out, and the page says so.

use serde::Serialize;

/// Where the numbers come from. Every call returns at once.
pub trait Gauges: Send + Sync {
    /// The tractor, where there is one.
    fn tractor(&self) -> Option<TractorGauge> {
        None
    }

    /// Where the GNSS receiver says it is, if it knows.
    fn fix(&self) -> Option<FixGauge> {
        None
    }

    /// The scanners, in the order of [`About::scanners`](crate::About).
    fn scanners(&self) -> Vec<ScannerGauge>;
}

/// The tractor at one moment. Scene frame, metres, radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TractorGauge {
    /// Simulated seconds.
    pub at_s: f64,
    /// Across the rows.
    pub x_m: f64,
    /// Along the rows.
    pub y_m: f64,
    /// Above level ground.
    pub up_m: f64,
    /// Clockwise from +Y as seen from above.
    pub heading_rad: f64,
    /// Right side down.
    pub roll_rad: f64,
    /// Nose up.
    pub pitch_rad: f64,
    /// Since the start of the drive, over ground.
    pub way_m: f64,
    /// It drives; before, it waits for a taker.
    pub has_begun: bool,
    /// How fast it is, as each instrument has it.
    pub speeds: Speeds,
}

/// A position by the GNSS receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FixGauge {
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
    /// Above the ellipsoid, metres.
    pub altitude_m: f64,
}

/// One speed, by who measures it; m/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Speeds {
    /// The true one.
    pub ground_m_s: Option<f64>,
    /// By the wheel's encoder.
    pub wheel_m_s: Option<f64>,
    /// By the GNSS receiver.
    pub gnss_m_s: Option<f64>,
}

/// What a scanner has done. Counts since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ScannerGauge {
    /// Scan telegrams: sent, or received.
    pub scans: Option<u64>,
    /// Scans that never came, or that clients were too slow for.
    pub lost: Option<u64>,
    /// Scans that came twice.
    pub repeated: Option<u64>,
    /// Telegrams that were no telegrams.
    pub bad: Option<u64>,
    /// Scans that the host was too slow for.
    pub missed: Option<u64>,
    /// Connections and settings turned away.
    pub refused: Option<u64>,
    /// Clients connected.
    pub clients: Option<u64>,
}
