//! SICK LMS151: outdoor, 270°, 50 m.

use super::Model;
use super::family::LMS1XX;

pub(super) static LMS151: Model = Model {
    name: "lms151",
    title: "LMS151",
    type_code: "LMS151-10100",
    order_number: "1047607",
    max_range_m: 50.0,
    evidence: &[
        "all but the names and the farthest range is the recorded LMS111's; no LMS151 was recorded",
        "farthest range: not verified",
    ],
    ..LMS1XX
};
