//! Who else looks on: other programs than the page, told of every scan.

use rowscan_emulator::Sight;
use rowscan_protocol::scan::Scan;

use crate::gauges::Gauges;
use crate::strip::Metre;

/// Told of everything that is shown. Every call returns at once: whoever is slow must lose something, and hold nobody up.
pub trait Onlooker: Send + Sync {
    /// A scan has come.
    fn scan(&self, seen: &Seen<'_>);

    /// What scanner number `scanner` has measured, metre by metre, from the first that is kept.
    fn measured(&self, scanner: usize, metres: &[Metre]);
}

/// A scan, and how things are when it comes.
#[derive(Clone, Copy)]
pub struct Seen<'a> {
    /// Number of the scanner.
    pub scanner: usize,
    /// Seconds: simulated ones, or since the source began.
    pub at_s: f64,
    /// What its telegram says.
    pub scan: &'a Scan,
    /// Where the beams went out, where that is known.
    pub sight: Option<Sight>,
    /// Tractor and scanners.
    pub gauges: &'a dyn Gauges,
}

impl std::fmt::Debug for Seen<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Seen")
            .field("scanner", &self.scanner)
            .field("at_s", &self.at_s)
            .finish_non_exhaustive()
    }
}
