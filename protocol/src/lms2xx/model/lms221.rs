//! SICK LMS221: outdoor.

use super::Model;
use super::family::OUTDOOR;

pub(super) static LMS221: Model =
    Model { name: "lms221", title: "LMS221", type_text: "LMS221;302063;X01.27 ", ..OUTDOOR };
