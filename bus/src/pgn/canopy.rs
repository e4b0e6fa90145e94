//! The canopy sensor's own messages, in the range for proprietary broadcasts: eight values of one byte a frame, so that a frame
//! every 50 ms costs little.

use rowscan_canopy::window::{BANDS, Window};

use super::CANOPY_ADDRESS;
use crate::message::{Message, Payload, Signal};

/// What has just been driven past, in eight values.
pub const SUMMARY: Message = Message {
    name: "CanopySummary",
    pgn: 65_296,
    priority: 4,
    period_ms: Some(100),
    len: 8,
    source: CANOPY_ADDRESS,
    about: "the canopy just driven past, per metre of row (proprietary B)",
    signals: &[
        Signal::new("ImpactedArea", 0, 8, 0.02, "m2/m").about("I_T, paper eq. 4"),
        Signal::new("LeafArea", 8, 8, 0.1, "m2/m").about("one-sided, by the calibration's regression on I_T"),
        Signal::new("CanopyVolume", 16, 8, 0.02, "m3/m")
            .about("outline of the side seen, up to the row axis"),
        Signal::new("LeafAreaIndex", 24, 8, 0.04, "").about("leaf area over row spacing"),
        Signal::new("CanopyHeight", 32, 8, 0.02, "m").about("highest return"),
        Signal::new("GroundSpeed", 40, 8, 0.02, "m/s").about("by the source of the advance; magnitude"),
        Signal::choice(
            "AdvanceSource",
            48,
            8,
            &[(0, "Constant"), (1, "Encoder"), (2, "Gnss"), (3, "Can"), (255, "NotAvailable")],
        ),
        Signal::new("WindowLength", 56, 8, 0.01, "m").about("metres of row these values stand for"),
    ],
};

const AREA: Signal = Signal::new("ImpactedBand", 0, 8, 0.005, "m2/m");
const LEAF: Signal = Signal::new("LeafBand", 0, 8, 0.02, "m2/m");

/// One signal a band of height; band 0 is the lowest.
const fn bands(names: [&'static str; BANDS], of: Signal) -> [Signal; BANDS] {
    let mut signals = [of; BANDS];
    let mut band = 0;
    while band < BANDS {
        signals[band].name = names[band];
        signals[band].start = 8 * band as u16;
        band += 1;
    }
    signals
}

/// Impacted area by height.
pub const IMPACTED_BANDS: Message = Message {
    name: "CanopyImpactedBands",
    pgn: 65_297,
    priority: 4,
    period_ms: Some(50),
    len: 8,
    source: CANOPY_ADDRESS,
    about: "impacted area per metre of row in eight bands of 0.5 m height, the lowest first (proprietary B)",
    signals: &bands(
        [
            "ImpactedBand0",
            "ImpactedBand1",
            "ImpactedBand2",
            "ImpactedBand3",
            "ImpactedBand4",
            "ImpactedBand5",
            "ImpactedBand6",
            "ImpactedBand7",
        ],
        AREA,
    ),
};

/// Leaf area by height.
pub const LEAF_BANDS: Message = Message {
    name: "CanopyLeafBands",
    pgn: 65_298,
    priority: 4,
    period_ms: Some(50),
    len: 8,
    source: CANOPY_ADDRESS,
    about: "leaf area per metre of row in eight bands of 0.5 m height: the summary's, shared out by impacted area (proprietary B)",
    signals: &bands(
        [
            "LeafBand0",
            "LeafBand1",
            "LeafBand2",
            "LeafBand3",
            "LeafBand4",
            "LeafBand5",
            "LeafBand6",
            "LeafBand7",
        ],
        LEAF,
    ),
};

/// What the canopy sensor says about a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CanopyReport {
    /// The canopy just driven past; `None` while it is not seen.
    pub window: Option<Window>,
    /// One-sided leaf area per metre; `None` without a calibration.
    pub leaf_area_m2_per_m: Option<f64>,
    /// Distance between rows, metres.
    pub row_spacing_m: Option<f64>,
    /// Ground speed, m/s.
    pub speed_m_s: Option<f64>,
    /// Raw value of the advance's source.
    pub advance_source: Option<f64>,
}

impl CanopyReport {
    /// [`SUMMARY`] of it.
    pub fn summary(&self) -> Payload {
        let window = self.window.as_ref();
        let per_metre = |of: &dyn Fn(&Window) -> f64| window.and_then(|window| window.per_metre(of(window)));
        let lai = self.leaf_area_m2_per_m.zip(self.row_spacing_m).map(|(leaf, spacing)| leaf / spacing);
        SUMMARY.encode(&[
            per_metre(&Window::impacted_m2),
            self.leaf_area_m2_per_m,
            per_metre(&|window| window.volume_m3),
            lai,
            window.and_then(|window| window.height_m),
            self.speed_m_s.map(f64::abs),
            self.advance_source,
            window.map(|window| window.length_m),
        ])
    }

    /// [`IMPACTED_BANDS`] of it.
    pub fn impacted_bands(&self) -> Payload {
        IMPACTED_BANDS.encode(&self.bands(|window, area_m2| window.per_metre(area_m2)))
    }

    /// [`LEAF_BANDS`] of it.
    pub fn leaf_bands(&self) -> Payload {
        let share = |window: &Window, area_m2: f64| {
            let all_m2 = window.impacted_m2();
            if all_m2 > 0.0 { area_m2 / all_m2 } else { 0.0 }
        };
        let leaf =
            |window: &Window, area_m2| self.leaf_area_m2_per_m.map(|leaf| leaf * share(window, area_m2));
        LEAF_BANDS.encode(&self.bands(leaf))
    }

    /// A value a band of height.
    fn bands(&self, of: impl Fn(&Window, f64) -> Option<f64>) -> [Option<f64>; BANDS] {
        self.window.map_or([None; BANDS], |window| window.bands_m2.map(|area_m2| of(&window, area_m2)))
    }
}
