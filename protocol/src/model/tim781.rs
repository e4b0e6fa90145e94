//! SICK TiM781: 270°, 15 Hz, 25 m.

use super::Model;
use super::family::TIM;

pub(super) static TIM781: Model = Model {
    name: "tim781",
    title: "TiM781",
    ident_name: "TiM781",
    type_code: "TiM781-2174101",
    order_number: "1096807",

    evidence: &[
        "angles, scan mode and number of points: public clients and the telegram reference",
        "everything else is the recorded TiM781S's; no TiM781 was recorded",
        "farthest range: not verified",
    ],
    ..TIM
};
