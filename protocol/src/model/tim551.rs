//! SICK TiM551: 270°, 15 Hz, 1° steps, 10 m.

use super::family::TIM5XX;
use super::{Model, mode, optics};
use crate::optics::{Fact, Optics, Spot};

pub(super) static TIM551: Model = Model {
    name: "tim551",
    title: "TiM551",
    ident_name: "TiM551",
    type_code: "TiM551-2050001",
    order_number: "1060445",
    modes: &[mode(15, 10_000)],
    default_mode: mode(15, 10_000),
    max_range_m: 10.0,
    // Its steps of 1° take longer.
    optics: Optics { spot: Spot { sweep_mrad: Fact::from("S5", 17.5), ..optics::TIM.spot }, ..optics::TIM },
    emulates: &[
        "15 Hz/1°; LMPoutputRange cuts the full grid",
        "a beam without an echo reads 2 with remission 0, as the recorded TiM781S has it; 16-bit remission out of the box",
        "scans carry the device's name, `not defined` out of the box, whether LMDscandatacfg asks for it or not",
        "the scan counter keeps counting over LMCstartmeas",
    ],
    evidence: &[
        "angles, scan mode and number of points: the telegram reference",
        "DeviceIdent, FirmwareVersion and the name in scans: as a TiM561 and a TiM571 have them, by public programs",
        "everything else is the recorded TiM781S's; no TiM551 was recorded, and no client's start-up was captured with one",
        "farthest range: not verified",
    ],
    ..TIM5XX
};
