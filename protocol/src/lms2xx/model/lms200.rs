//! SICK LMS200: indoor, 180°, millimetres out of the box.

use super::family::OUTDOOR;
use super::{Model, optics};
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::firmware::Firmware;
use crate::lms2xx::values::{MeasuringMode, Unit};

pub(super) static LMS200: Model = Model {
    name: "lms200",
    title: "LMS200",
    type_text: "LMS200;301063;V02.30 ",
    firmware: Firmware::V0230,
    outdoor: false,
    optics: optics::INDOOR,
    configuration: Configuration::new(MeasuringMode(0), Unit::Mm),
    ..OUTDOOR
};
