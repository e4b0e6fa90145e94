//! SICK LMS211: outdoor.

use super::Model;
use super::family::OUTDOOR;

pub(super) static LMS211: Model =
    Model { name: "lms211", title: "LMS211", type_text: "LMS211;30206;V02.30 ", ..OUTDOOR };
