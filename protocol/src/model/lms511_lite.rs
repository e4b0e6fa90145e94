//! SICK LMS511 Lite: outdoor, 190°, fewer scan modes.

use super::family::LMS5XX;
use super::{Model, mode, optics};

pub(super) static LMS511_LITE: Model = Model {
    name: "lms511-lite",
    title: "LMS511-Lite",
    ident_name: "LMS5xx_FieldEval_LITE",
    type_code: "LMS511-22100 Lite",
    order_number: "1054155",
    modes: &[mode(25, 2500), mode(50, 5000), mode(75, 10_000)],
    default_mode: mode(25, 2500),
    optics: optics::LMS5XX_HR,
    echoes: 2,
    emulates: &[
        "25 Hz/0.25°, 50 Hz/0.5°, 75 Hz/1°; LMPoutputRange cuts the full grid",
        "one or two echoes, echo filter, encoder block from DO3And4Fnc, LICencset, LICsrc and LICencres",
        "telegram version 0; the first scan after LMCstartmeas carries device status 1",
    ],
    evidence: &[
        "angles, frequencies and resolutions are the manual's; their pairs are not verified",
        "two echoes, and LITE in DeviceIdent: not verified",
        "everything else is the recorded LMS511 PRO's; no Lite was recorded",
    ],
    ..LMS5XX
};
