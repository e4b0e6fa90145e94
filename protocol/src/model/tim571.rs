//! SICK TiM571: 270°, 15 Hz, 25 m.

use super::Model;
use super::family::TIM5XX;

pub(super) static TIM571: Model = Model {
    name: "tim571",
    title: "TiM571",
    ident_name: "TiM571",
    type_code: "TiM571-2050101",
    order_number: "1075091",
    ..TIM5XX
};
