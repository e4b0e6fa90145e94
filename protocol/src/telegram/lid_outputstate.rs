//! `LIDoutputstate`: digital outputs. How many a model has is not on the wire; it follows from the length.

use alloc::vec::Vec;

use super::Variable;
use super::lmd_scandata::DateTime;
use super::wire::{Fields, Reader, WireError, Writer, fields};
use crate::frame::Dialect;
use crate::visit::{Group, Visitor};

/// State of the digital outputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutputStates {
    /// Telegram version.
    pub version: u16,
    /// µs since power-up.
    pub time_us: u32,
    /// Every output: 11 on an LMS111, 14 on an LMS511.
    pub outputs: Vec<OutputState>,
    /// Date and time.
    pub date_time: Option<DateTime>,
}

fields! {
    /// One output.
    pub struct OutputState {
        /// 0 off, 1 on, 2 unused.
        pub state: u8,
        /// Changes since power-up.
        pub changes: u32,
    }
}

impl Variable for OutputStates {
    const NAME: &'static str = "LIDoutputstate";
}

/// How many outputs stand before the time flag. With or without a time, the rest has another remainder.
fn outputs_ahead(reader: &Reader<'_>) -> usize {
    let rest = reader.rest();
    let (units, an_output, flag, flag_and_time) = match reader.dialect() {
        Dialect::B => (rest.len(), 5, 2, 13),
        Dialect::A => (rest.iter().filter(|&&b| b == b' ').count(), 2, 1, 8),
    };
    let tail = if units % an_output == flag_and_time % an_output { flag_and_time } else { flag };
    units.saturating_sub(tail) / an_output
}

impl Fields for OutputStates {
    const IS_STRUCT: bool = true;

    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        self.version.read(reader)?;
        self.time_us.read(reader)?;
        self.outputs.clear();
        for _ in 0..outputs_ahead(reader) {
            let mut output = OutputState::default();
            output.read(reader)?;
            self.outputs.push(output);
        }
        self.date_time.read(reader)
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.version.write(writer);
        self.time_us.write(writer);
        self.outputs.iter().for_each(|output| output.write(writer));
        self.date_time.write(writer);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        visitor.field("version", None);
        self.version.visit(visitor);
        visitor.field("time_us", Some("µs"));
        self.time_us.visit(visitor);
        visitor.field("outputs", None);
        self.outputs.visit(visitor);
        visitor.field("date_time", None);
        self.date_time.visit(visitor);
        visitor.end();
    }
}
