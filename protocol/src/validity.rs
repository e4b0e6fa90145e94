//! Whether a scan can be believed: what the device says of itself, and why a telegram gives no scan.

use alloc::string::String;
use alloc::vec::Vec;

/// What the device says of itself in a scan telegram, the worst first to be told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceStatus {
    /// No complaint.
    #[default]
    Ok,
    /// The window is dirty, and the device still measures: contamination level 1.
    ContaminationWarning,
    /// The window is too dirty to measure through: contamination levels 2 and 3.
    ContaminationError,
    /// The device reports an error of its own.
    Error,
}

impl DeviceStatus {
    /// All, in the order of their numbers in tables.
    pub const ALL: [Self; 4] = [Self::Ok, Self::ContaminationWarning, Self::ContaminationError, Self::Error];

    /// Its number in tables: 0 ok, 1 a contamination warning, 2 a contamination error, 3 an error.
    pub fn number(self) -> u8 {
        self as u8
    }

    /// The status of that number in tables.
    pub fn of_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The two status bytes of `LMDscandata` that say so; [`of_scandata`](Self::of_scandata) backwards.
    pub fn scandata(self) -> [u8; 2] {
        match self {
            Self::Ok => [0, 0],
            Self::Error => [0, 1],
            Self::ContaminationWarning => [0, 2],
            Self::ContaminationError => [0, 4],
        }
    }

    /// From the two status bytes of `LMDscandata`. SICK's manuals have them in the second: 1 is an error, 2 a contamination warning, 4 a contamination
    /// error. Recorded devices set bit 0 of the first in the first scans after a start, while the laser is off; that is an error here, too. A bit means
    /// the same in either byte.
    pub fn of_scandata(bytes: [u8; 2]) -> Self {
        let [first, second] = bytes;
        match first | second {
            bits if bits & 1 != 0 && bits & 4 == 0 => Self::Error,
            bits if bits & 4 != 0 => Self::ContaminationError,
            bits if bits & 2 != 0 => Self::ContaminationWarning,
            _ => Self::Ok,
        }
    }

    /// From the status byte of an LMS2xx: bits 0 to 2 are 3 for an error and 4 for a fatal one, bit 7 is pollution.
    ///
    /// Pollution is one bit: the device keeps sending values up to its pollution error, which comes as an error.
    pub fn of_lms2xx(status: u8) -> Self {
        match (status & 0b111, status >> 7) {
            (3.., 1) => Self::ContaminationError,
            (3.., _) => Self::Error,
            (_, 1) => Self::ContaminationWarning,
            _ => Self::Ok,
        }
    }
}

/// Why a scan telegram that passed its checksum gives no scan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScanFault {
    /// Its fields cannot be read.
    #[error("its fields cannot be read: {reason}")]
    Fields {
        /// Why, in words.
        reason: String,
    },
    /// It has no ranges.
    #[error("it has no DIST channel ({channels} other channels): enable one with LMDscandatacfg")]
    NoDistance {
        /// Channels it has.
        channels: usize,
    },
    /// Ranges scaled so are no ranges.
    #[error("its scale factor is {value}, expected {LEAST_SCALE} to {LARGEST_SCALE}")]
    ScaleFactor {
        /// Found.
        value: f32,
    },
    /// Ranges moved so are no ranges.
    #[error("its scale offset is {value} mm, expected at most {LARGEST_OFFSET_MM} either way")]
    ScaleOffset {
        /// Found.
        value: f32,
    },
    /// All beams would point the same way.
    #[error("its angular step is 0")]
    AngularStep,
    /// It is a part of a scan of an unknown angle and resolution.
    #[error(
        "it is a part of a scan, and no reply tells the scan's angle and resolution (3B, or 31 to the status), so nobody knows where its beams point: record from \
         before the request for it (20 27, 20 28, 20 36), with a request for the status, or ask for whole scans (20 24)"
    )]
    PartOfUnknownScan,
    /// It has no beams.
    #[error("it has no beams")]
    NoBeams,
    /// The beams point where no scanner can.
    #[error(
        "its beams go from {start_deg}° to {stop_deg}°, expected within {LEAST_ANGLE_DEG}° to {LARGEST_ANGLE_DEG}° and at most one turn"
    )]
    Field {
        /// The first beam.
        start_deg: f64,
        /// The last beam.
        stop_deg: f64,
    },
    /// A part of it came twice, and said two things.
    #[error(
        "segment {segment} of turn {turn} came twice with different contents: two scanners with one serial number send here, or something on the way changes \
         datagrams; expected a UDP port for each scanner (?udp=PORT), and a serial number (emulate --serial-number)"
    )]
    Contradicted {
        /// The part.
        segment: u64,
        /// Its turn.
        turn: u64,
    },
}

/// The smallest scale factor believed; the devices known send 0.1 to 2.
pub const LEAST_SCALE: f32 = 0.001;
/// The largest: with it, 16 bits of millimetres reach a kilometre.
pub const LARGEST_SCALE: f32 = 16.0;
/// The largest offset believed, millimetres.
pub const LARGEST_OFFSET_MM: f32 = 1_000_000.0;
/// The least device angle believed.
pub const LEAST_ANGLE_DEG: f64 = -360.0;
/// The largest.
pub const LARGEST_ANGLE_DEG: f64 = 540.0;

impl ScanFault {
    /// One word to count and branch on.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Fields { .. } => "fields",
            Self::NoDistance { .. } => "no_distance",
            Self::ScaleFactor { .. } => "scale_factor",
            Self::ScaleOffset { .. } => "scale_offset",
            Self::AngularStep => "angular_step",
            Self::NoBeams => "no_beams",
            Self::PartOfUnknownScan => "part_of_unknown_scan",
            Self::Field { .. } => "field",
            Self::Contradicted { .. } => "contradicted",
        }
    }
}

/// Faults counted by cause, each with the first that was seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaultCounts(Vec<(ScanFault, u64)>);

impl FaultCounts {
    /// Counts one; true if it is the first of its cause.
    pub fn count(&mut self, fault: &ScanFault) -> bool {
        match self.0.iter_mut().find(|(first, _)| first.code() == fault.code()) {
            Some((_, count)) => {
                *count += 1;
                false
            }
            None => {
                self.0.push((fault.clone(), 1));
                true
            }
        }
    }

    /// The first fault of each cause, and how many there were, in the order of their first.
    pub fn iter(&self) -> impl Iterator<Item = (&ScanFault, u64)> {
        self.0.iter().map(|(fault, count)| (fault, *count))
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.0.iter().map(|(_, count)| count).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_bit_counts_in_either_byte() {
        // By the three bits: 1 an error, 2 a warning, 4 a contamination error, which tells more than an error does.
        let expected = [
            DeviceStatus::Ok,
            DeviceStatus::Error,
            DeviceStatus::ContaminationWarning,
            DeviceStatus::Error,
            DeviceStatus::ContaminationError,
            DeviceStatus::ContaminationError,
            DeviceStatus::ContaminationError,
            DeviceStatus::ContaminationError,
        ];
        for (first, second) in (0..8).flat_map(|first| (0..8).map(move |second| (first, second))) {
            let found = DeviceStatus::of_scandata([first, second]);
            assert_eq!(found, expected[usize::from(first | second)], "{first:02X} {second:02X}");
        }
    }

    #[test]
    fn an_lms2xx_tells_severity_and_pollution() {
        for (status, expected) in [
            (0x10, DeviceStatus::Ok),
            (0x30, DeviceStatus::Ok),
            (0x12, DeviceStatus::Ok),
            (0x90, DeviceStatus::ContaminationWarning),
            (0x13, DeviceStatus::Error),
            (0x14, DeviceStatus::Error),
            (0x93, DeviceStatus::ContaminationError),
        ] {
            assert_eq!(DeviceStatus::of_lms2xx(status), expected, "{status:02X}");
        }
    }

    #[test]
    fn faults_are_counted_by_cause() {
        let mut counts = FaultCounts::default();
        assert!(counts.count(&ScanFault::ScaleFactor { value: 0.0 }));
        assert!(!counts.count(&ScanFault::ScaleFactor { value: f32::NAN }));
        assert!(counts.count(&ScanFault::AngularStep));
        let told: Vec<_> = counts.iter().map(|(fault, count)| (fault.code(), count)).collect();
        assert_eq!((told, counts.total()), (alloc::vec![("scale_factor", 2), ("angular_step", 1)], 3));
    }
}
