//! Network management: who is who (ISO 11783-5, SAE J1939-81), and asking (SAE J1939-21).

use super::TRACTOR_ADDRESS;
use crate::message::{Message, Signal};

/// "I am NAME, and this is my address."
pub const ADDRESS_CLAIMED: Message = Message {
    name: "AddressClaimed",
    pgn: 60_928,
    priority: 6,
    period_ms: None,
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "address claimed, or cannot claim from address 254 (ISO 11783-5)",
    signals: &[
        Signal::new("IdentityNumber", 0, 21, 1.0, ""),
        Signal::new("ManufacturerCode", 21, 11, 1.0, ""),
        Signal::new("EcuInstance", 32, 3, 1.0, ""),
        Signal::new("FunctionInstance", 35, 5, 1.0, ""),
        Signal::new("Function", 40, 8, 1.0, ""),
        Signal::new("DeviceClass", 49, 7, 1.0, ""),
        Signal::new("DeviceClassInstance", 56, 4, 1.0, ""),
        Signal::new("IndustryGroup", 60, 3, 1.0, ""),
        Signal::new("SelfConfigurable", 63, 1, 1.0, ""),
    ],
};

/// "Send me that."
pub const REQUEST: Message = Message {
    name: "Request",
    pgn: 59_904,
    priority: 6,
    period_ms: None,
    len: 3,
    source: 0xFE,
    about: "asks for a parameter group (SAE J1939-21)",
    signals: &[Signal::new("RequestedPgn", 0, 24, 1.0, "")],
};

/// "I do not have that."
pub const REQUEST_ACKNOWLEDGEMENT: Message = Message {
    name: "Acknowledgement",
    pgn: 59_392,
    priority: 6,
    period_ms: None,
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "refuses a request for a parameter group that is not there (SAE J1939-21)",
    signals: &[
        Signal::choice(
            "Control",
            0,
            8,
            &[(0, "Positive"), (1, "Negative"), (2, "AccessDenied"), (3, "Busy")],
        ),
        Signal::new("AcknowledgedAddress", 32, 8, 1.0, ""),
        Signal::new("AcknowledgedPgn", 40, 24, 1.0, ""),
    ],
};
