//! SICK LMS500 PRO: indoor, 190°, five echoes.

use super::family::LMS5XX;
use super::{Model, optics};

pub(super) static LMS500: Model = Model {
    name: "lms500",
    title: "LMS500",
    type_code: "LMS500-20000 PRO",
    order_number: "1047781",
    optics: optics::LMS5XX_HR,
    evidence: &[
        "all but the names is the recorded LMS511's; no LMS500 was recorded",
        "pairs of frequency and resolution: the values are the manual's, the pairs are not verified",
    ],
    ..LMS5XX
};
