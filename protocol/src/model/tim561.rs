//! SICK TiM561: 270°, 15 Hz, 10 m.

use super::family::TIM;
use super::{Evaluations, Model};

pub(super) static TIM561: Model = Model {
    name: "tim561",
    title: "TiM561",
    type_code: "TiM561-2050101",
    order_number: "1071419",
    max_range_m: 10.0,
    fields: 0,
    evaluations: Evaluations { always: 0, most: 1 },
    evidence: &[
        "angles, scan mode and number of points: public clients and the telegram reference",
        "everything else is the recorded TiM781S's; no TiM561 was recorded",
        "farthest range: not verified",
    ],
    ..TIM
};
