//! What the models share. A model's file holds the differences.

use core::time::Duration;

use super::{Model, Times, Variant, optics};
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::firmware::Firmware;
use crate::lms2xx::values::{MeasuringMode, Unit};

pub(super) const fn variant(angle_deg: u16, step_centideg: u16) -> Variant {
    Variant { angle_deg, step_centideg }
}

/// LMS211, LMS221, LMS291: outdoor, centimetres out of the box.
pub(super) const OUTDOOR: Model = Model {
    name: "",
    title: "",
    type_text: "",
    firmware: Firmware::X0127,
    outdoor: true,
    variants: &[variant(180, 100), variant(180, 50), variant(100, 100), variant(100, 50), variant(100, 25)],
    default_variant: variant(180, 50),
    turn_step_centideg: 100,
    takes_variants: true,
    reflectivity: false,
    bytes_a_turn: 508,
    configuration: Configuration::new(MeasuringMode(0), Unit::Cm),
    min_range_m: 0.05,
    max_range_m: 80.0,
    optics: optics::OUTDOOR,
    times: Times {
        boot: Duration::from_secs(15),
        save: Duration::from_millis(400),
        new_unit: Duration::from_secs(7),
    },
    emulates: &[
        "180° and 100°; 0.5° and 0.25° scans are two and four mirror turns, each with its own place of the tractor; partial scans (2A, 30 08) over 180° whatever the variant",
        "values on request and as a stream: all, every 2nd or 20th, mean of 2 to 250, sub-range, mean of a sub-range, partial scans, smallest values, range and reflectivity by parts, with fields, Cartesian; cm and mm; measuring modes 0 to 6, 0D to 0F, 3F; scan index and telegram index",
        "two sets of three fields, configured (40), taught in (46) or circles by --field METRES: flags in the values, outputs (4A) with multiple evaluation and blanking; none at 0.25°",
        "--contamination 1 to 3: channels of the status, status byte, errors 18 and 19",
        "power-on text, installation and diagnostic mode, passwords, variant, both parts of the configuration, status, errors, counters, field set, outputs, permanent rate, reset, four rates",
        "a request interrupts what is being sent; with `--profile bench` a telegram with a pause of 0.5 s inside it is dropped, with `field` one of 6 ms, and bytes closer than 55 µs at 500 000 bits a second are lost",
        "at 500 000 bits a second at most 508 bytes leave in one mirror turn (559 on an S14): a telegram of 732 bytes pauses until the next",
        "older firmware by --firmware: V02.10 has a configuration block of 32 bytes and no indices",
    ],
    not_emulated: &[
        "navigation records (2E, not described): 92",
        "contours, restart and dazzle evaluation, dynamic fields, the positioning aid's effect: kept or answered, without effect",
        "calibration values of the status and operating hours: constant; no other errors than dirt",
        "an address other than 0",
    ],
    evidence: &[
        "frames, commands, replies, defaults, firmware marks: SICK's telegram listing 8007954 (2006) and Quick Manual (2002); captured start-ups of public clients",
        "a beam without an echo reads 4 below the top of its range: the most frequent code in recordings of an LMS200",
        "type key of the S05 and S14 (six digits in the listing's form): not known, the short form public clients look for is sent",
        "measuring modes 0D and 0E are reserved in the listing; a public client sets them for range with remission (75, 2B), and the Quick Manual prints a device in 0D: taken, read as 15 bits",
        "77 takes 0.4 s, and the listing's 7 s where the unit changes: 0.4 s is assumed, below the patience of two public clients; boot time: at most 60 s in the listing, 15 s not verified",
        "a variant set by 3B is lost at power-on unless 66 02 was sent, 92 for 77, 66, 42, 7C outside the installation mode: the listing leaves them open",
        "V02.10 with a block of 32 bytes: the Quick Manual of its time; the listing says 34 from V2.10 on",
    ],
};
