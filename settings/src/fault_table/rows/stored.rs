//! What a device is found with: somebody had it before.

use crate::fault_table::device::{DeviceFault, Stored};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};

const DIALECTS: &[&str] = &["a", "b"];

/// The settings of somebody before.
pub(super) const ROW: Row = Row {
    name: "stored",
    family: Family::Device,
    parameters: &[
        Parameter::new(
            "dialect",
            Form::Word(DIALECTS),
            "unchanged",
            "the dialect that was stored; it decides over a strict device",
        ),
        Parameter::new(
            "rate",
            Form::Whole(9_600, 500_000),
            "unchanged",
            "LMS2xx: the rate that was stored, bits a second: 9600, 19200, 38400 or 500000",
        ),
        Parameter::new(
            "config",
            Form::Flag,
            "false",
            "CoLa: remission, other channels and a narrower range of angles were set and saved",
        ),
        Parameter::new("streaming", Form::Flag, "false", "LMS2xx: it streams already"),
        Parameter::new(
            "other_client",
            Form::Flag,
            "false",
            "CoLa: a client is gone that stopped the measurement",
        ),
    ],
    about: "The device is as another program left it. The end leaves it so.",
    reports: "the state that was found",
    recovery: "normalises it",
    make: |settings| {
        let stored = Stored {
            dialect: settings.word("dialect")?.and_then(|word| word.chars().next()),
            rate: settings.whole("rate")?.and_then(|rate| u32::try_from(rate).ok()),
            config: settings.flag("config")?,
            streaming: settings.flag("streaming")?,
            other_client: settings.flag("other_client")?,
        };
        if stored == Stored::default() {
            return Err(settings.refuse(
                "expected one of `dialect`, `rate`, `config`, `streaming`, `other_client`: without any nothing would happen",
            ));
        }
        Ok(PartFault::Device(DeviceFault::Stored(stored)))
    },
};
