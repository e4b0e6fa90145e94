//! The canopy sensor's own messages, in the range for proprietary broadcasts: eight values of one byte a frame, so that a frame
//! every 50 ms costs little.

use rowscan_canopy::estimate::LeafAreaEstimator;
use rowscan_canopy::window::{BANDS, Window};
use rowscan_canopy::{LeafWindow, Withheld};

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
        Signal::new("LeafArea", 8, 8, 0.1, "m2/m").about(
            "one-sided, of the last whole slices; CanopyLeafStatus says of which, or why there is none",
        ),
        Signal::new("CanopyVolume", 16, 8, 0.02, "m3/m")
            .about("outline of the side seen, in cells of 0.1 m, up to the row axis: half of volume_m3"),
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
    about: "leaf area per metre of row in eight bands of 0.5 m height, the lowest first: the summary's (proprietary B)",
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

/// What the leaf area stands for, or why there is none.
pub const LEAF_STATUS: Message = Message {
    name: "CanopyLeafStatus",
    pgn: 65_301,
    priority: 4,
    period_ms: Some(100),
    len: 8,
    source: CANOPY_ADDRESS,
    about: "what the leaf area of the summary stands for, or why it is not available (proprietary B)",
    signals: &[
        Signal::choice("LeafAreaWithheld", 0, 8, &STATUSES),
        Signal::choice("LeafAreaEstimator", 8, 8, ESTIMATORS),
        Signal::new("LeafWindowLength", 16, 8, 0.01, "m").about("metres of row the leaf area stands for"),
        Signal::new("LeafWindowBehind", 24, 8, 0.01, "m").about("from the window's end on to the scanner"),
    ],
};

/// What [`LEAF_STATUS`] says where the leaf area or its index is known, and larger than its field of [`SUMMARY`] can say.
const BEYOND_FIELD: (u64, &str) = (250, "BeyondField");

/// Why there is no leaf area: the reasons of every estimate, and the bus's own before "not available", the last.
const STATUSES: [(u64, &str); Withheld::CHOICES.len() + 1] = {
    let last = Withheld::CHOICES.len() - 1;
    let mut all = [Withheld::CHOICES[last]; Withheld::CHOICES.len() + 1];
    let mut place = 0;
    while place < last {
        all[place] = Withheld::CHOICES[place];
        place += 1;
    }
    all[last] = BEYOND_FIELD;
    all
};

/// Numbers of [`LeafAreaEstimator`] on the bus.
const ESTIMATORS: &[(u64, &str)] = &[
    (0, "ContactRaw"),
    (1, "ContactCalibrated"),
    (2, "ContactRawSpotCorrected"),
    (3, "ContactCalibratedSpotCorrected"),
    (4, "ShareCalibrated"),
    (255, "NotAvailable"),
];

fn number_of(estimator: LeafAreaEstimator) -> f64 {
    match estimator {
        LeafAreaEstimator::ContactRaw => 0.0,
        LeafAreaEstimator::ContactCalibrated => 1.0,
        LeafAreaEstimator::ContactRawSpotCorrected => 2.0,
        LeafAreaEstimator::ContactCalibratedSpotCorrected => 3.0,
        LeafAreaEstimator::ShareCalibrated => 4.0,
    }
}

/// What the canopy sensor says about a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CanopyReport {
    /// The canopy just driven past, or why nothing is told of it.
    pub window: Result<Window, Withheld>,
    /// Ground speed, m/s.
    pub speed_m_s: Option<f64>,
    /// Raw value of the advance's source.
    pub advance_source: Option<f64>,
}

impl Default for CanopyReport {
    fn default() -> Self {
        Self { window: Err(Withheld::NothingValid), speed_m_s: None, advance_source: None }
    }
}

impl CanopyReport {
    fn leaf(&self) -> Result<LeafWindow, Withheld> {
        self.window.and_then(|window| window.leaf)
    }

    /// [`SUMMARY`] of it.
    pub fn summary(&self) -> Payload {
        let (window, leaf) = (self.window.ok(), self.leaf());
        let per_metre = |of: &dyn Fn(&Window) -> f64| window.and_then(|window| window.per_metre(of(&window)));
        SUMMARY.encode(&[
            per_metre(&Window::impacted_m2),
            leaf.map(|leaf| leaf.m2_per_m()).ok(),
            per_metre(&|window| window.volume_m3),
            leaf.and_then(|leaf| leaf.lai()).ok(),
            window.and_then(|window| window.height_m),
            self.speed_m_s.map(f64::abs),
            self.advance_source,
            window.map(|window| window.length_m),
        ])
    }

    /// [`IMPACTED_BANDS`] of it.
    pub fn impacted_bands(&self) -> Payload {
        let bands = self.window.map(|window| window.bands_m2.map(|area_m2| window.per_metre(area_m2)));
        IMPACTED_BANDS.encode(&bands.unwrap_or([None; BANDS]))
    }

    /// [`LEAF_BANDS`] of it.
    pub fn leaf_bands(&self) -> Payload {
        let bands = self.leaf().map(|leaf| leaf.bands_m2_per_m().map(Some));
        LEAF_BANDS.encode(&bands.unwrap_or([None; BANDS]))
    }

    /// [`LEAF_STATUS`] of it.
    pub fn leaf_status(&self) -> Payload {
        let leaf = self.leaf();
        let told = leaf.ok();
        let fits = |name: &str, value: Option<f64>| {
            SUMMARY.signal(name).zip(value).is_none_or(|(signal, value)| signal.can_say(value))
        };
        let status = match leaf {
            Err(why) => f64::from(why.number()),
            Ok(leaf) if fits("LeafArea", Some(leaf.m2_per_m())) && fits("LeafAreaIndex", leaf.lai().ok()) => {
                0.0
            }
            Ok(_) => BEYOND_FIELD.0 as f64,
        };
        LEAF_STATUS.encode(&[
            Some(status),
            told.map(|leaf| number_of(leaf.estimator)),
            told.map(|leaf| leaf.length_m()),
            told.map(|leaf| leaf.behind_m),
        ])
    }
}
