//! Why a number is not told.

use std::fmt;

use serde::{Serialize, Serializer};

/// Declares the reasons once: variant, number on the bus, code, words.
macro_rules! reasons {
    ($( $variant:ident = $number:literal, $code:literal, $words:literal; )+) => {
        /// Why a number is not told. Serialises as its code.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum Withheld {
            $( #[doc = $words] $variant, )+
        }

        impl Withheld {
            /// All of them.
            pub const ALL: &'static [Self] = &[$( Self::$variant, )+];

            /// What a CAN signal may say of a number: 0 where it is told, else the reason's number with its name.
            pub const CHOICES: &'static [(u64, &'static str)] =
                &[(0, "Told"), $( ($number, stringify!($variant)), )+ (255, "NotAvailable")];

            /// One word to branch on. Where a warning has the same cause, it has the same code.
            pub fn code(self) -> &'static str {
                match self { $( Self::$variant => $code, )+ }
            }

            /// Its number in CAN frames; never 0.
            pub fn number(self) -> u8 {
                match self { $( Self::$variant => $number, )+ }
            }

            fn words(self) -> &'static str {
                match self { $( Self::$variant => $words, )+ }
            }
        }
    };
}

reasons! {
    NoRig = 1, "no_rig", "no rig says where the scanner sits";
    NothingValid = 2, "nothing_valid", "no valid scan came";
    NoTime = 3, "no_time", "neither clock nor frequency tells how long scans took";
    NoEncoder = 4, "no_encoder", "the advance is the encoder's alone, and scans had no reading of it";
    TooMuchExcluded = 5, "too_much_excluded", "more of the row than the rig allows has no valid scan";
    NoFoliage = 6, "no_foliage", "much of what was hit is denser than any foliage";
    EchoUnknown = 7, "echo_unknown", "nobody knows which echo the scans hold";
    Refused = 8, "refused", "far outside the range that the calibration was fitted on";
    CalibratedOnRays = 9, "calibrated_on_rays", "the calibration's regression is of rays, and the beams have a width";
    Uncalibrated = 10, "uncalibrated", "only a calibration gives it";
    NoShares = 11, "no_shares", "remission is not read, or the calibration has no scale for it at this distance";
    NoSpacing = 12, "no_spacing", "the rig knows no row spacing or no tree spacing";
    NotScanned = 13, "not_scanned", "no metre of row was scanned";
    Stale = 14, "stale", "no valid scan has come lately";
    OpticsUnknown = 15, "optics_unknown", "the rig does not say how wide the scanner's beams are";
    WeakRegression = 16, "weak_regression", "the calibration's regression tells less than half of what rows differ by";
    SharesDisagree = 17, "shares_disagree", "shares of spots and contact agree otherwise than on the calibration's rows";
    NoWitness = 18, "no_witness", "the calibration does not say how shares of spots and contact agree";
    CardTooShort = 19, "card_too_short", "the card was measured at too few ranges";
    CardLaw = 20, "card_law", "other cards refute that remission goes by the logarithm of power";
    EncoderStuck = 21, "encoder_stuck", "scans that are of one place by the encoder differ as places far apart do";
    EncoderSpeed = 22, "encoder_speed", "the speed by the encoder is a quarter, or four times, of the rig's and beyond";
    EncoderJumped = 23, "encoder_jumped", "the encoder's count jumped as no tractor drives in more than 3 % of the scans";
    UnknownBeams = 24, "unknown_beams", "too many of the beams that look at the row have no range that could be known";
    GroundSlope = 25, "ground_slope", "the ground rises more than 5° otherwise than the rig says";
    MostlyWood = 26, "mostly_wood", "three fifths and more of what was met is wood, as the calibration's rows have it or by the row's class";
    GroundAsCanopy = 27, "ground_as_canopy", "ground lies among what counts as canopy";
    GroundLevel = 28, "ground_level", "the ground lies so far below where the rig has it that leaves count as ground";
    OutOfSight = 29, "out_of_sight", "no beam leads to most of the row";
    GroundSilent = 30, "ground_silent", "beams that the rig leads to the ground met none";
    VoxelEdge = 31, "voxel_edge", "the calibration was fitted in voxels of quite another edge";
    TooFewBeams = 32, "too_few_beams", "too few beams passed most of the voxels that were hit";
    TooManyLeaves = 33, "too_many_leaves", "more was met on the ground's area than any orchard has leaves";
    RowElsewhere = 34, "row_elsewhere", "the canopy does not lie about the rig's row axis";
    MostlyUnseen = 35, "mostly_unseen", "too few beams reached half of the row";
    CanopyAtScanner = 36, "canopy_at_scanner", "much of the canopy lies where the scanner was driven";
    OtherBeams = 37, "other_beams", "the scans are of other beams than the rig says: rays for a scanner's, or a scanner's for rays";
    InTheAir = 38, "in_the_air", "rain, snow, fog or dust returns many of the beams before they reach the row";
    RidesAlong = 39, "rides_along", "something that rides with the scanner returns its beams before they reach the row";
    StoodStill = 40, "stood_still", "the way goes on between scans that are of one place";
    OtherMount = 41, "other_mount", "the calibration's regression is of rows seen from another distance or height";
    OtherSpacing = 42, "other_spacing", "the calibration's regression is of rows whose trees stand farther apart, or nearer";
    UnevenTrees = 43, "uneven_trees", "trees differ by too much for a regression on their row's mean";
}

impl fmt::Display for Withheld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

impl std::error::Error for Withheld {}

impl Serialize for Withheld {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_codes_tell_reasons_apart() {
        let numbers: Vec<u8> = Withheld::ALL.iter().map(|why| why.number()).collect();
        assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]) && numbers[0] > 0, "{numbers:?}");
        let mut codes: Vec<&str> = Withheld::ALL.iter().map(|why| why.code()).collect();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), Withheld::ALL.len());
    }
}
