//! Random numbers keyed by their purpose, so that none depends on another or on earlier calls.

/// What a random number is drawn for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stage {
    /// What this turn adds to the deviations of scans' times.
    Period = 0,
    /// From a scan to its transmission.
    Delay = 1,
    /// How far a segment's start is off its even place.
    SegmentStart = 2,
    /// The same of its stop.
    SegmentStop = 3,
    /// From a segment's start to the transmission of its telegram.
    SegmentTransmit = 4,
}

/// The random numbers of one scanner.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Random {
    seed: u64,
    scanner: u32,
}

impl Random {
    /// Those of the rig's scanner number `scanner`, from 0.
    pub(super) fn new(seed: u64, scanner: u32) -> Self {
        Self { seed, scanner }
    }

    /// 64 random bits for mirror turn `turn`. Part of the seed's contract: scanner 0 and stage 0 leave the seed as it is.
    pub(super) fn bits(self, stage: Stage, turn: u64) -> u64 {
        let key = match (u64::from(self.scanner), stage as u64) {
            (0, 0) => self.seed,
            (scanner, stage) => mix(self.seed ^ mix(stage << 32 | scanner)),
        };
        mix(key ^ mix(turn))
    }

    /// Uniform from 0 to below 1.
    pub(super) fn unit(self, stage: Stage, turn: u64) -> f64 {
        (self.bits(stage, turn) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Between -1 and 1, large values more often than small ones: its variance is 1/2. Sums of few of them vary much and stay within narrow
    /// bounds, as mirrors do.
    pub(super) fn two_sided(self, stage: Stage, turn: u64) -> f64 {
        let bits = self.bits(stage, turn);
        let half = |bits: u64| (bits & 0x7FFF_FFFF) as f64 * (1.0 / (1u64 << 31) as f64);
        let size = half(bits).max(half(bits >> 31));
        if bits >> 63 == 0 { size } else { -size }
    }
}

/// The finaliser of splitmix64 (Steele, Lea, Flood 2014).
fn mix(key: u64) -> u64 {
    let key = key.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let key = (key ^ key >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let key = (key ^ key >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    key ^ key >> 31
}
