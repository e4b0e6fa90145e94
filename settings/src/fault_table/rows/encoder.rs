//! Faults of the wheel encoder: what is counted is not what was driven.

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::vehicle::EncoderFault;

const SHARE: Form = Form::Number(0.0, 1.0);

/// What is counted is not what was driven.
pub(super) const ROW: Row = Row {
    name: "encoder",
    family: Family::Vehicle,
    parameters: &[
        Parameter::new(
            "slip",
            Form::Number(-0.5, 0.95),
            "0",
            "the wheel slips by this share of the way that it rolls",
        ),
        Parameter::new("missed", SHARE, "0", "share of the ticks that are missed"),
        Parameter::new("extra", SHARE, "0", "share of the ticks that are counted twice"),
        Parameter::new("stuck", Form::Flag, "false", "no ticks"),
        Parameter::new("reversed", Form::Flag, "false", "counts the other way"),
        Parameter::new(
            "wrap",
            Form::Flag,
            "false",
            "the count is set to 10 below 2^32 at the beginning, so that it soon wraps",
        ),
        Parameter::new("cable_out", Form::Flag, "false", "the cable is out: no ticks"),
    ],
    about: "What the scanners' encoder input counts is not what was driven. The tractor goes on as it does; afterwards the count goes on from where it is.",
    reports: "implausible advance, source changed",
    recovery: "falls back, `advance_source`",
    make: |settings| {
        let share = |key| Ok(settings.number(key)?.unwrap_or(0.0));
        let fault = EncoderFault {
            slip: share("slip")?,
            missed: share("missed")?,
            extra: share("extra")?,
            stuck: settings.flag("stuck")?,
            reversed: settings.flag("reversed")?,
            wrap: settings.flag("wrap")?,
            cable_out: settings.flag("cable_out")?,
        };
        if fault == EncoderFault::default() {
            return Err(settings.refuse("expected one of `slip`, `missed`, `extra`, `stuck`, `reversed`, `wrap`, `cable_out`: without any nothing would happen"));
        }
        Ok(PartFault::Encoder(fault))
    },
};
