//! SICK LMS111: outdoor, 270°, 20 m.

use super::Model;
use super::family::LMS1XX;

pub(super) static LMS111: Model =
    Model { name: "lms111", title: "LMS111", type_code: "LMS111-10100", order_number: "1041114", ..LMS1XX };
