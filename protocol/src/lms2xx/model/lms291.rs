//! SICK LMS291-S05: outdoor.

use super::Model;
use super::family::OUTDOOR;

pub(super) static LMS291: Model =
    Model { name: "lms291", title: "LMS291-S05", type_text: "LMS291;S05;X01.27 ", ..OUTDOOR };
