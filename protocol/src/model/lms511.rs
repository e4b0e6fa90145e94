//! SICK LMS511 PRO: outdoor, 190°, five echoes.

use super::Model;
use super::family::LMS5XX;

pub(super) static LMS511: Model = Model {
    name: "lms511",
    title: "LMS511",
    type_code: "LMS511-10100 PRO",
    order_number: "1046135",
    ..LMS5XX
};
