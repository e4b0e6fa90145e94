//! SICK TiM561: 270°, 15 Hz, 10 m.

use super::Model;
use super::family::TIM5XX;

pub(super) static TIM561: Model = Model {
    name: "tim561",
    title: "TiM561",
    ident_name: "TiM561",
    type_code: "TiM561-2050101",
    order_number: "1071419",
    max_range_m: 10.0,
    ..TIM5XX
};
