//! Faults of the nodes on a bus.

use crate::fault_table::bus::BusFault;
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::settings::Settings;

const ADDRESS: Form = Form::Whole(0, 253);

fn address(settings: &Settings<'_>) -> Result<Option<u8>, crate::TomlError> {
    Ok(settings.whole("sa")?.and_then(|address| u8::try_from(address).ok()))
}

/// An address is taken.
pub(super) const ADDRESS_STEAL: Row = Row {
    name: "address_steal",
    family: Family::Bus,
    parameters: &[Parameter::new("sa", ADDRESS, "the tractor's", "the address")],
    about: "A node with a better NAME claims an address. The tractor, which keeps to its own, goes silent; it claims again at the end.",
    reports: "cannot claim, or no speed",
    recovery: "moves or stops; falls back to another speed",
    make: |settings| Ok(PartFault::Bus(BusFault::AddressSteal { address: address(settings)? })),
};

/// No tractor.
pub(super) const NO_TECU: Row = Row {
    name: "no_tecu",
    family: Family::Bus,
    parameters: &[],
    about: "The tractor's control function is gone from the bus; it claims its address again at the end.",
    reports: "no speed",
    recovery: "falls back to another speed",
    make: |_| Ok(PartFault::Bus(BusFault::NoTecu)),
};

/// Two tractors.
pub(super) const TWO_TECU: Row = Row {
    name: "two_tecu",
    family: Family::Bus,
    parameters: &[
        Parameter::new("sa", ADDRESS, "241", "address of the second"),
        Parameter::new(
            "speed_ratio",
            Form::Number(0.0, 10.0),
            "1",
            "its speeds are so many times the true ones",
        ),
    ],
    about: "A second control function of a tractor is on the bus, and tells speeds of its own.",
    reports: "two sources of speed",
    recovery: "keeps to one",
    make: |settings| {
        let speed_ratio = settings.number("speed_ratio")?.unwrap_or(1.0);
        Ok(PartFault::Bus(BusFault::TwoTecu { address: address(settings)?.unwrap_or(241), speed_ratio }))
    },
};

/// A NAME twice.
pub(super) const NAME_CLASH: Row = Row {
    name: "name_clash",
    family: Family::Bus,
    parameters: &[Parameter::new("sa", ADDRESS, "241", "address of the second")],
    about: "Another node claims another address with the tractor's NAME.",
    reports: "two nodes of one NAME",
    recovery: "keeps to the first",
    make: |settings| Ok(PartFault::Bus(BusFault::NameClash { address: address(settings)?.unwrap_or(241) })),
};
