//! What CAN controllers tell their host, as Linux has it (`linux/can/error.h`).

use std::fmt::Write as _;

use rowscan_protocol::can::hex;

/// What says in an identifier that it is none.
const FLAG: u32 = 0x2000_0000;
const CONTROLLER: u32 = 0x004;
const PROTOCOL: u32 = 0x008;
const NOT_ACKNOWLEDGED: u32 = 0x020;
const BUS_OFF: u32 = 0x040;
const BUS_ERROR: u32 = 0x080;
const RESTARTED: u32 = 0x100;
const COUNTERS: u32 = 0x200;
/// Error counters from which a controller warns, and from which it is passive.
const WARNS: u8 = 96;
const PASSIVE: u8 = 128;

/// What a controller's error counters make of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControllerState {
    /// Many errors.
    pub warns: bool,
    /// So many that it may not destroy others' frames any more.
    pub is_passive: bool,
}

/// An error frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorFrame {
    /// What it is about: bits of the classes.
    pub class: u32,
    /// Details.
    pub data: [u8; 8],
}

impl ErrorFrame {
    /// Too many errors: off the bus.
    pub fn bus_off() -> Self {
        Self { class: BUS_OFF, data: [0; 8] }
    }

    /// Back on the bus.
    pub fn restarted() -> Self {
        Self { class: RESTARTED, data: [0; 8] }
    }

    /// The error counters, and what they make of the controller.
    pub fn counters(tx: u8, rx: u8) -> Self {
        let state = |count: u8, warning: u8, passive: u8| match count {
            PASSIVE.. => passive,
            WARNS.. => warning,
            _ => 0,
        };
        let state = state(rx, 0x04, 0x10) | state(tx, 0x08, 0x20);
        Self { class: CONTROLLER | COUNTERS, data: [0, state, 0, 0, 0, 0, tx, rx] }
    }

    /// Few errors again.
    pub fn active() -> Self {
        Self { class: CONTROLLER, data: [0, 0x40, 0, 0, 0, 0, 0, 0] }
    }

    /// A rule of the wire was broken.
    pub fn protocol(code: u8) -> Self {
        Self { class: PROTOCOL | BUS_ERROR, data: [0, 0, code, 0, 0, 0, 0, 0] }
    }

    /// Nobody acknowledged.
    pub fn not_acknowledged() -> Self {
        Self { class: NOT_ACKNOWLEDGED | BUS_ERROR, data: [0; 8] }
    }

    /// Whether the controller is off the bus from here on; none if this says nothing of it.
    pub fn is_off(&self) -> Option<bool> {
        match self.class {
            class if class & BUS_OFF != 0 => Some(true),
            class if class & RESTARTED != 0 => Some(false),
            _ => None,
        }
    }

    /// What the counters make of the controller; none if this says nothing of it.
    pub fn state(&self) -> Option<ControllerState> {
        let [_, state, ..] = self.data;
        (self.class & CONTROLLER != 0)
            .then_some(ControllerState { warns: state & 0x3C != 0, is_passive: state & 0x30 != 0 })
    }

    /// Reads what [`to_text`](Self::to_text) writes; `None` for anything else, the frames of a bus among it.
    pub fn from_text(text: &str) -> Option<Self> {
        let (id, data) = text.split_once('#')?;
        let bits = u32::from_str_radix(id, 16).ok().filter(|_| id.len() == 8)?;
        let class = bits.checked_sub(FLAG).filter(|class| *class < FLAG)?;
        Some(Self { class, data: hex(data)?.try_into().ok()? })
    }

    /// What it is about, in words; the details of counters and of broken rules.
    pub fn told(&self) -> String {
        let [_, state, rule, _, _, _, tx, rx] = self.data;
        let known = |bit: u32, words: &str| (self.class & bit != 0).then(|| words.to_owned());
        let state = self.state().map(|controller| match controller {
            ControllerState { is_passive: true, .. } => "error passive".to_owned(),
            ControllerState { warns: true, .. } => "error warning".to_owned(),
            _ if state & 0x40 != 0 => "error active".to_owned(),
            _ => format!("controller state {state:02X}"),
        });
        let counters =
            (self.class & COUNTERS != 0).then(|| format!("{tx} transmit errors, {rx} receive errors"));
        let rule = (self.class & PROTOCOL != 0).then(|| format!("protocol violation {rule:02X}"));
        let told = [
            known(BUS_OFF, "bus off"),
            known(RESTARTED, "restarted"),
            state,
            counters,
            rule,
            known(NOT_ACKNOWLEDGED, "not acknowledged"),
            known(BUS_ERROR, "bus error"),
        ];
        let told: Vec<String> = told.into_iter().flatten().collect();
        if told.is_empty() { format!("class {:08X}", self.class) } else { told.join(", ") }
    }

    /// As candump writes it.
    pub fn to_text(&self) -> String {
        let mut text = format!("{:08X}#", FLAG | self.class);
        for byte in self.data {
            // Writing to memory cannot fail.
            let _ = write!(text, "{byte:02X}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_written_as_linux_numbers_them() {
        assert_eq!(ErrorFrame::bus_off().to_text(), "20000040#0000000000000000");
        assert_eq!(ErrorFrame::counters(128, 100).to_text(), "20000204#0024000000008064");
        assert_eq!(ErrorFrame::protocol(4).to_text(), "20000088#0000040000000000");
    }

    #[test]
    fn they_come_back_as_they_were_written_and_frames_are_none() {
        let told = [
            (ErrorFrame::bus_off(), "bus off"),
            (ErrorFrame::restarted(), "restarted"),
            (ErrorFrame::counters(128, 100), "error passive, 128 transmit errors, 100 receive errors"),
            (ErrorFrame::active(), "error active"),
            (ErrorFrame::protocol(4), "protocol violation 04, bus error"),
            (ErrorFrame::not_acknowledged(), "not acknowledged, bus error"),
        ];
        for (frame, words) in told {
            assert_eq!(ErrorFrame::from_text(&frame.to_text()), Some(frame));
            assert_eq!(frame.told(), words);
        }
        for other in ["18FE4980#0011223344556677", "123#", "20000040#00", "40000040#0000000000000000", "x#"] {
            assert_eq!(ErrorFrame::from_text(other), None, "{other}");
        }
    }
}
