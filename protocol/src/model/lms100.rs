//! SICK LMS100: indoor, 270°, 20 m.

use super::Model;
use super::family::LMS1XX;

pub(super) static LMS100: Model = Model {
    name: "lms100",
    title: "LMS100",
    type_code: "LMS100-10000",
    order_number: "1041113",
    evidence: &["all but the names is the recorded LMS111's; no LMS100 was recorded"],
    ..LMS1XX
};
