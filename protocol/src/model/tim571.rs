//! SICK TiM571: 270°, 15 Hz, 25 m.

use super::family::TIM;
use super::{Evaluations, Model};

pub(super) static TIM571: Model = Model {
    name: "tim571",
    title: "TiM571",
    type_code: "TiM571-2050101",
    order_number: "1075091",

    fields: 0,
    evaluations: Evaluations { always: 0, most: 1 },
    evidence: &[
        "angles, scan mode and number of points: public clients and the telegram reference",
        "everything else is the recorded TiM781S's; no TiM571 was recorded",
        "farthest range: not verified",
    ],
    ..TIM
};
