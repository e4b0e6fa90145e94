//! Process data, parameter group 0xCB00: a command, an element of a device, a data dictionary identifier (DDI) and a value, in eight bytes.
//!
//! Layout: AgIsoStack++, `isobus_task_controller_client.cpp`, `send_value_command`. Priorities: `isobus_task_controller_server.cpp`,
//! `send_generic_process_data_default_payload`.

use crate::frame::{CanFrame, J1939Id};
use crate::pgn::isobus::PROCESS_DATA;

/// What a message of process data does: the low four bits of its first byte.
pub mod command {
    /// Versions and abilities.
    pub const TECHNICAL: u8 = 0x0;
    /// Object pools and their labels.
    pub const DESCRIPTOR: u8 = 0x1;
    /// Asks for a value.
    pub const REQUEST: u8 = 0x2;
    /// Tells or sets a value.
    pub const VALUE: u8 = 0x3;
    /// A value shall come so often, ms.
    pub const TIME_INTERVAL: u8 = 0x4;
    /// A value shall come every so many millimetres.
    pub const DISTANCE_INTERVAL: u8 = 0x5;
    /// A value shall come when it falls below.
    pub const MINIMUM: u8 = 0x6;
    /// A value shall come when it rises above.
    pub const MAXIMUM: u8 = 0x7;
    /// A value shall come when it has changed by so much.
    pub const ON_CHANGE: u8 = 0x8;
    /// Whose setpoints an element takes.
    pub const PEER: u8 = 0x9;
    /// Sets a value that is to be acknowledged.
    pub const SET_AND_ACKNOWLEDGE: u8 = 0xA;
    /// The acknowledgement.
    pub const ACKNOWLEDGE: u8 = 0xD;
    /// The task controller is there.
    pub const SERVER_STATUS: u8 = 0xE;
    /// A client is there.
    pub const CLIENT_STATUS: u8 = 0xF;
}

/// What a message about device descriptors is about: the high four bits of its first byte (AgIsoStack++, `isobus_task_controller_server.hpp`,
/// `DeviceDescriptorCommandParameters`).
pub mod descriptor {
    /// Is there a pool of this structure?
    pub const REQUEST_STRUCTURE: u8 = 0x0;
    /// The structure that is there; FF where there is none.
    pub const STRUCTURE: u8 = 0x1;
    /// Is there a pool in this language?
    pub const REQUEST_LOCALIZATION: u8 = 0x2;
    /// The language that is there; FF where there is none.
    pub const LOCALIZATION: u8 = 0x3;
    /// May a pool of so many bytes come?
    pub const REQUEST_TRANSFER: u8 = 0x4;
    /// 0: it may.
    pub const TRANSFER_ANSWER: u8 = 0x5;
    /// The pool.
    pub const TRANSFER: u8 = 0x6;
    /// 0: it came.
    pub const TRANSFERRED: u8 = 0x7;
    /// FF: use the pool; 0: no more.
    pub const ACTIVATE: u8 = 0x8;
    /// 0: it is in use; else what is wrong with it.
    pub const ACTIVATED: u8 = 0x9;
    /// Forget the pool.
    pub const DELETE: u8 = 0xA;
    /// 0: it is forgotten.
    pub const DELETED: u8 = 0xB;
    /// Another name for an object.
    pub const CHANGE_DESIGNATOR: u8 = 0xC;
    /// 0: it has it.
    pub const DESIGNATOR_CHANGED: u8 = 0xD;
}

/// Why a value was not taken: bits of an acknowledgement (AgIsoStack++, `isobus_task_controller_server.hpp`, `ProcessDataAcknowledgeErrorCodes`).
pub mod refusal {
    /// The command is not supported.
    pub const COMMAND: u8 = 0x01;
    /// There is no such element.
    pub const ELEMENT: u8 = 0x02;
    /// The element has no such DDI.
    pub const DDI: u8 = 0x04;
    /// It does not come by this trigger.
    pub const TRIGGER: u8 = 0x08;
    /// It cannot be set.
    pub const NOT_SETTABLE: u8 = 0x10;
    /// The interval or threshold is none.
    pub const INTERVAL: u8 = 0x20;
    /// The value is none of this DDI.
    pub const VALUE: u8 = 0x40;
    /// The device cannot do that; of a value that was asked for: it is not known at present (assumed).
    pub const RANGE: u8 = 0x80;

    /// What the bits say.
    pub fn words(bits: u8) -> String {
        let known = [
            (COMMAND, "the command is not supported"),
            (ELEMENT, "there is no such element"),
            (DDI, "the element has no such DDI"),
            (TRIGGER, "it does not come by this trigger"),
            (NOT_SETTABLE, "it cannot be set"),
            (INTERVAL, "the interval or threshold is none"),
            (VALUE, "the value is none of this DDI"),
            (RANGE, "the device cannot do that"),
        ];
        let said = known.iter().filter(|(bit, _)| bits & bit != 0).map(|(_, words)| *words);
        said.collect::<Vec<_>>().join("; ")
    }
}

/// One value of one element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessData {
    /// What is done with it: a [`command`].
    pub command: u8,
    /// The element, 0 to 4095.
    pub element: u16,
    /// Data dictionary identifier.
    pub ddi: u16,
    /// The value, in the DDI's unit.
    pub value: i32,
}

impl ProcessData {
    /// Reads eight bytes.
    pub fn read(data: &[u8]) -> Option<Self> {
        let &[b0, b1, b2, b3, b4, b5, b6, b7] = data else { return None };
        Some(Self {
            command: b0 & 0xF,
            element: u16::from(b0 >> 4) | u16::from(b1) << 4,
            ddi: u16::from_le_bytes([b2, b3]),
            value: i32::from_le_bytes([b4, b5, b6, b7]),
        })
    }

    /// Its eight bytes; an element above 4095 loses its upper bits.
    pub fn bytes(self) -> [u8; 8] {
        let [low, high] = (self.element << 4).to_le_bytes();
        let [d0, d1] = self.ddi.to_le_bytes();
        let [v0, v1, v2, v3] = self.value.to_le_bytes();
        [low | self.command & 0xF, high, d0, d1, v0, v1, v2, v3]
    }

    /// The acknowledgement of this message: 0, or why not.
    pub fn acknowledged(self, refusals: u8) -> [u8; 8] {
        let head = Self { command: command::ACKNOWLEDGE, value: 0, ..self }.bytes();
        let [b0, b1, b2, b3, ..] = head;
        // AgIsoStack++, `isobus_task_controller_server.cpp`, `send_process_data_acknowledge`.
        [b0, b1, b2, b3, refusals, 0xF0 | self.command & 0xF, 0xFF, 0xFF]
    }
}

/// A message about device descriptors, filled with FF.
pub fn descriptor_message(subcommand: u8, rest: &[u8]) -> [u8; 8] {
    multiplexed(command::DESCRIPTOR | subcommand << 4, rest)
}

/// Eight bytes that begin with these, filled with FF.
pub(super) fn multiplexed(first: u8, rest: &[u8]) -> [u8; 8] {
    let mut bytes = [0xFF; 8];
    bytes[0] = first;
    for (place, byte) in bytes.iter_mut().skip(1).zip(rest) {
        *place = *byte;
    }
    bytes
}

/// A frame of process data.
pub fn frame((source, destination): (u8, u8), bytes: [u8; 8]) -> Option<CanFrame> {
    let priority = match bytes[0] & 0xF {
        command::VALUE | command::SET_AND_ACKNOWLEDGE | command::SERVER_STATUS | command::CLIENT_STATUS => 3,
        command::ACKNOWLEDGE => 4,
        _ => 5,
    };
    CanFrame::new(J1939Id { priority, pgn: PROCESS_DATA.pgn, source, destination }.id(), &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_where_other_stacks_have_them() {
        // Element 2 is told by DDI 290: sections 1 and 3 on, 2 and 4 off, the rest stay as they are.
        let told =
            ProcessData { command: command::VALUE, element: 2, ddi: 290, value: 0xFFFF_FF11_u32 as i32 };
        assert_eq!(told.bytes(), [0x23, 0x00, 0x22, 0x01, 0x11, 0xFF, 0xFF, 0xFF]);
        let frame = frame((0xF7, 0x80), told.bytes()).unwrap();
        assert_eq!(frame.id.bits(), 0x0CCB_80F7);
        let told = ProcessData { command: command::VALUE, element: 18, ddi: 161, value: 0 };
        assert_eq!(told.bytes()[..4], [0x23, 0x01, 0xA1, 0x00]);
    }

    #[test]
    fn every_value_comes_back_as_it_went() {
        for command in 0..16 {
            for (element, ddi, value) in [(0, 0, 0), (4095, 0xDFFF, i32::MIN), (17, 161, i32::MAX)] {
                let told = ProcessData { command, element, ddi, value };
                assert_eq!(ProcessData::read(&told.bytes()), Some(told));
            }
        }
        assert_eq!(ProcessData::read(&[0; 7]), None);
    }

    #[test]
    fn acknowledgements_name_what_they_are_about() {
        let told = ProcessData { command: command::SET_AND_ACKNOWLEDGE, element: 18, ddi: 290, value: 5 };
        let bytes = told.acknowledged(refusal::DDI);
        assert_eq!(bytes, [0x2D, 0x01, 0x22, 0x01, 0x04, 0xFA, 0xFF, 0xFF]);
        assert_eq!(
            descriptor_message(descriptor::REQUEST_TRANSFER, &[1, 2, 3, 4]),
            [0x41, 1, 2, 3, 4, 255, 255, 255]
        );
    }
}
