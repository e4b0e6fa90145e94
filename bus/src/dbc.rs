//! The message table as a DBC file, and as a page for people.

use std::fmt::Write;

use super::frame::J1939Id;
use super::message::{Message, Signal};
use super::pgn::MESSAGES;

/// Who sends what, by the address in the table.
fn sender(message: &Message) -> &'static str {
    match message.source {
        super::pgn::TRACTOR_ADDRESS => "Tractor",
        super::pgn::CANOPY_ADDRESS => "CanopySensor",
        super::pgn::SPRAYER_ADDRESS => "Sprayer",
        _ => "Vector__XXX",
    }
}

/// The identifier in the file: 29 bits are marked by bit 31. A message of more than eight bytes stands there as one frame of its
/// packet.
fn dbc_id(message: &Message) -> u32 {
    J1939Id { ..message.id(message.source) }.id().bits() | 1 << 31
}

/// The frames of a fast packet, which a DBC file cannot put together.
const PACKET: [Signal; 3] = [
    Signal::new("FrameNumber", 0, 5, 1.0, "").about("0 first: then byte 1 is the packet's length"),
    Signal::new("PacketSequence", 5, 3, 1.0, ""),
    Signal::new("PacketBytes", 8, 56, 1.0, "").about("the packet's bytes, in order"),
];

/// The DBC file of all messages.
pub fn dbc() -> String {
    let mut text = String::from("VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Tractor CanopySensor Sprayer\n");
    let signals = |message: &Message| -> Vec<Signal> {
        if message.len > 8 { PACKET.to_vec() } else { message.signals.to_vec() }
    };
    for message in MESSAGES {
        let _ = write!(
            text,
            "\nBO_ {} {}: {} {}\n",
            dbc_id(message),
            message.name,
            message.len.min(8),
            sender(message)
        );
        for signal in signals(message) {
            let sign = if signal.signed { '-' } else { '+' };
            let limit = |raw: i128| raw as f64 * signal.scale + signal.offset;
            let _ = writeln!(
                text,
                " SG_ {} : {}|{}@1{sign} ({},{}) [{}|{}] \"{}\" Vector__XXX",
                signal.name,
                signal.start,
                signal.bits,
                signal.scale,
                signal.offset,
                limit(signal.raw_min()),
                limit(signal.raw_max()),
                signal.unit
            );
        }
    }
    text.push('\n');
    for message in MESSAGES {
        let _ = writeln!(text, "CM_ BO_ {} \"PGN {}: {}\";", dbc_id(message), message.pgn, message.about);
        for signal in signals(message).iter().filter(|signal| !signal.about.is_empty()) {
            let _ = writeln!(text, "CM_ SG_ {} {} \"{}\";", dbc_id(message), signal.name, signal.about);
        }
    }
    text.push_str(
        "\nBA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\n\
         BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"J1939PG\";\n\
         BA_DEF_ \"ProtocolType\" STRING ;\n\
         BA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n\
         BA_DEF_DEF_ \"VFrameFormat\" \"J1939PG\";\n\
         BA_DEF_DEF_ \"ProtocolType\" \"J1939\";\n\
         BA_ \"ProtocolType\" \"J1939\";\n",
    );
    for message in MESSAGES {
        let _ = writeln!(text, "BA_ \"VFrameFormat\" BO_ {} 3;", dbc_id(message));
        if let Some(period_ms) = message.period_ms {
            let _ = writeln!(text, "BA_ \"GenMsgCycleTime\" BO_ {} {period_ms};", dbc_id(message));
        }
    }
    text.push('\n');
    for message in MESSAGES {
        for signal in signals(message).iter().filter(|signal| !signal.names.is_empty()) {
            let _ = write!(text, "VAL_ {} {}", dbc_id(message), signal.name);
            for (raw, name) in signal.names {
                let _ = write!(text, " {raw} \"{name}\"");
            }
            text.push_str(" ;\n");
        }
    }
    text
}

/// Share of a 250 kbit/s bus that the periodic messages of `messages` take, at most (every stuff bit that can be).
pub fn load(messages: &[&Message]) -> f64 {
    let bits_per_s = |message: &&Message| {
        let frames = if message.len <= 8 { 1 } else { 1 + (message.len - 6).div_ceil(7) };
        let bytes = message.len.min(8) as f64;
        let most = (54.0 + 8.0 * bytes) + ((54.0 + 8.0 * bytes - 1.0) / 4.0).floor() + 13.0;
        message.period_ms.map_or(0.0, |period| frames as f64 * most * 1000.0 / f64::from(period))
    };
    messages.iter().map(bits_per_s).sum::<f64>() / 250_000.0
}

/// The table for people: what `docs/can.md` holds.
pub fn markdown() -> String {
    let mut text = String::from("| PGN | hex | message | from | every | what |\n|---|---|---|---|---|---|\n");
    for message in MESSAGES {
        let every = message.period_ms.map_or_else(|| "–".to_owned(), |period| format!("{period} ms"));
        let from = match sender(message) {
            "Vector__XXX" => "anyone",
            sender => sender,
        };
        let _ = writeln!(
            text,
            "| {} | {:X} | {} | {from} | {every} | {} |",
            message.pgn, message.pgn, message.name, message.about
        );
    }
    text.push_str(
        "\n| message | signal | bits | unit | step | largest | what |\n|---|---|---|---|---|---|---|\n",
    );
    for message in MESSAGES {
        for signal in message.signals {
            let about = if signal.names.is_empty() {
                signal.about.to_owned()
            } else {
                signal.names.iter().map(|(raw, name)| format!("{raw} {name}")).collect::<Vec<_>>().join(", ")
            };
            let largest = signal.largest();
            let largest =
                if signal.bits > 32 { String::new() } else { format!("{}", (largest * 1e6).round() / 1e6) };
            let last = signal.start + signal.bits - 1;
            let _ = writeln!(
                text,
                "| {} | {} | {}–{last} | {} | {} | {largest} | {about} |",
                message.name, signal.name, signal.start, signal.unit, signal.scale
            );
        }
    }
    let percent = |messages: &[&Message]| 100.0 * load(messages);
    let of = |sender_name: &str| -> Vec<&Message> {
        MESSAGES.iter().copied().filter(|message| sender(message) == sender_name).collect()
    };
    let _ = write!(
        text,
        "\nBus load at 250 kbit/s, every stuff bit counted that can be: tractor {:.1} %, canopy sensor {:.1} %, together {:.1} %.\n",
        percent(&of("Tractor")),
        percent(&of("CanopySensor")),
        percent(MESSAGES)
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bus_has_room_for_others() {
        let load = load(MESSAGES);
        assert!(load < 0.30, "{load}");
        assert!(load > 0.03, "{load}");
    }

    #[test]
    fn names_are_unique_as_dbc_wants_them() {
        let mut names: Vec<&str> = MESSAGES.iter().map(|message| message.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), MESSAGES.len());
        let word =
            |name: &str| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && name.len() <= 32;
        assert!(MESSAGES.iter().flat_map(|m| m.signals).all(|signal| word(signal.name)));
    }
}
