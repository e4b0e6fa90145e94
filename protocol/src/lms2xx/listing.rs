//! What SICK's telegram listing (8007954/Q501, part C of the addenda) says of each command, and what the emulated device does: one line a
//! command. The tests send every example, and `docs/models.md` is this table in print.

/// Where an example is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SentIn {
    /// Monitoring, on request.
    Monitoring,
    /// Installation mode.
    Installation,
}

/// One command.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Its number, with the sub-command where that matters.
    pub command: &'static str,
    /// What the listing says.
    pub listed: &'static str,
    /// What we do.
    pub ours: &'static str,
    /// A model that gets the example.
    pub model: &'static str,
    /// The mode it is in.
    pub sent_in: SentIn,
    /// The request: command and data.
    pub example: &'static [u8],
    /// How the reply begins. Telegrams of values by their command.
    pub reply: &'static [u8],
}

use SentIn::{Installation, Monitoring};

const fn line(
    command: &'static str,
    listed: &'static str,
    ours: &'static str,
    (model, sent_in): (&'static str, SentIn),
    example: &'static [u8],
    reply: &'static [u8],
) -> Line {
    Line { command, listed, ours, model, sent_in, example, reply }
}

const INDOOR: (&str, SentIn) = ("lms200", Monitoring);
const OUTDOOR: (&str, SentIn) = ("lms291", Monitoring);
const FAST: (&str, SentIn) = ("lms291-s14", Monitoring);
const SET_UP: (&str, SentIn) = ("lms291", Installation);

const AS_LISTED: &str = "as listed";
const REFUSED: &str = "not emulated: 92";

/// The password of the installation mode, behind its sub-command.
const INSTALL: &[u8] = b"\x20\x00SICK_LMS";
/// Part 2 of the configuration out of the box, behind its command.
const PART_2: &[u8] = &{
    let mut frame = [0; 85];
    frame[0] = 0x7C;
    frame
};

/// One line a command.
#[rustfmt::skip]
pub static LISTING: &[Line] = &[
    line("10", "reset: 91, restart, 90 within 60 s", "as listed; 15 s in `field` (--boot-s), fields and part 2 stay", INDOOR, &[0x10], &[0x91]),
    line("20 00", "installation mode with a password; A0 01 if it is wrong", AS_LISTED, INDOOR, INSTALL, &[0xA0, 0]),
    line("20 00", "a wrong password: A0 01", AS_LISTED, INDOOR, b"\x20\x00SICK_PLS", &[0xA0, 1]),
    line("20 01, 02, 2D, 2F, 31", "reserved", "92, as an unknown mode", INDOOR, &[0x20, 0x01], &[0x92]),
    line("20 10", "diagnostic mode", "as listed; nothing to diagnose", INDOOR, &[0x20, 0x10], &[0xA0, 0]),
    line("20 20, 20 21", "smallest value of each segment: B0; 21 only while an object is in a field", "as listed; the segments of field A of the active set", INDOOR, &[0x20, 0x20], &[0xA0, 0]),
    line("20 22, 20 23", "smallest perpendicular distance: B0; 23 only while an object is in a field", "as listed; overflow where a field is free", INDOOR, &[0x20, 0x22], &[0xA0, 0]),
    line("20 24, 25", "stream of all values; values on request", AS_LISTED, INDOOR, &[0x20, 0x24], &[0xA0, 0]),
    line("20 26, 36", "mean of 2 to 250 scans: B6; other numbers are refused", "as listed; beams without an echo are left out of a mean", INDOOR, &[0x20, 0x26, 2], &[0xA0, 0]),
    line("20 26, 36", "fewer than 2 or more than 250 scans: 92", AS_LISTED, INDOOR, &[0x36, 1], &[0x92]),
    line("20 27, 37", "sub-range: B7; bit 15 of the words asks for partial scans", "as listed", INDOOR, &[0x20, 0x27, 1, 0, 0x69, 1], &[0xA0, 0]),
    line("20 28, 3F", "mean of a sub-range: BF", "as listed; the number as a byte and as a word", INDOOR, &[0x20, 0x28, 2, 1, 0, 0xB5, 0], &[0xA0, 0]),
    line("20 27, 37", "with bit 15: each partial scan at once, 1 to 4 telegrams a scan", AS_LISTED, INDOOR, &[0x37, 1, 0x80, 0x69, 0x81], &[0xB7, 1, 0, 0x69, 1]),
    line("20 29, 3E", "at most 100 values with their fields: BE; not S14", AS_LISTED, INDOOR, &[0x3E, 1, 0, 0x64, 0], &[0xBE, 1, 0, 0x64, 0, 0x90, 0x41]),
    line("20 2A, 30 08", "partial scans, 180° and 1° whatever the variant, four rasters in turn", "as listed; an S14 sends its own turns (not stated)", INDOOR, &[0x20, 0x2A], &[0xA0, 0]),
    line("20 2B, 75", "range and reflectivity of 1 to 5 parts: F5; not S14", "as listed; at most 401 values in all (assumed); reflectivity is the simulated remission on its scale", INDOOR, &[0x20, 0x2B, 1, 0, 1, 0, 0x69, 1], &[0xA0, 0]),
    line("20 2C", "smallest value of each of 1 to 201 segments of a sub-range: B7", "as listed; the shape of 2B, which a public client sends: 92", INDOOR, &[0x20, 0x2C, 2, 1, 0, 0x69, 1], &[0xA0, 0]),
    line("20 2E", "navigation: not described", REFUSED, INDOOR, &[0x20, 0x2E], &[0x92]),
    line("20 30", "tests the installation password", AS_LISTED, INDOOR, b"\x20\x30SICK_LMS", &[0xA0, 0]),
    line("20 40, 41, 42, 48", "38400, 19200, 9600, 500000 bits a second", AS_LISTED, INDOOR, &[0x20, 0x40], &[0xA0, 0]),
    line("20 50, 44", "ranges and reflectivities: C4; S14 only", AS_LISTED, FAST, &[0x20, 0x50, 1, 0, 0xB5, 0], &[0xA0, 0]),
    line("20 50, 44", "the other types: 92", AS_LISTED, INDOOR, &[0x44, 1, 0, 0xB5, 0], &[0x92]),
    line("30 01", "all values: B0", AS_LISTED, INDOOR, &[0x30, 1], &[0xB0]),
    line("30 02", "smallest perpendicular distance, one a field: B0", "as listed; overflow where a field is free", INDOOR, &[0x30, 2], &[0xB0, 3, 0x40, 0xFD, 0x1F]),
    line("30 03", "the taught-in data: B0", "field A of the active set; 92 if it was not taught in", INDOOR, &[0x30, 3], &[0x92]),
    line("30 05, 30 04", "reserved; a public client finds the rate by it", "92, which that client takes for an answer", INDOOR, &[0x30, 5, 0xB4], &[0x92]),
    line("30 06, 30 07", "every 2nd, every 20th value: B0", AS_LISTED, INDOOR, &[0x30, 6], &[0xB0]),
    line("30, 36, 37, 3F", "allowed in installation mode too", AS_LISTED, SET_UP, &[0x30, 1], &[0xB0]),
    line("31", "status: B1, 154 bytes", "as listed; pollution by --contamination, with a spread in `field`, as the motor has; dark signals and reference scales 0", INDOOR, &[0x31], &[0xB1]),
    line("32", "errors: B2 and pairs of weight and number", "18 and 19 by --contamination, never any other", INDOOR, &[0x32], &[0xB2, 0x10]),
    line("35", "operating hours and power-ons: B5; outdoor types", "as listed; hours constant, restarts count", OUTDOOR, &[0x35], &[0xB5]),
    line("35", "not on an LMS200 and LMS220: 92", AS_LISTED, INDOOR, &[0x35], &[0x92]),
    line("3A", "type: BA, 21 characters", "as listed; 18 on S05 and S14, whose type key is not known", INDOOR, &[0x3A], b"\xBALMS200;301063;V02.30 \x10"),
    line("3B", "angle and resolution: BB 01, or BB 00 and the variant in force", "as listed; an LMS211 has 100° only, an S14 refuses", INDOOR, &[0x3B, 0x64, 0, 0x19, 0], &[0xBB, 1, 0x64, 0, 0x19, 0]),
    line("3B", "180° and 0.25°: BB 00", AS_LISTED, INDOOR, &[0x3B, 0xB4, 0, 0x19, 0], &[0xBB, 0, 0xB4, 0, 0x32, 0]),
    line("40", "configures a field: C0, 00 if it is refused, and the data back; not S14", "as listed; 1 or 6 reserved bytes; kept until the program ends", SET_UP, &[0x40, 1, 0x41, 0xB4, 0, 50, 0, 1, 0, 0xE8, 3], &[0xC0, 1, 1, 0x41]),
    line("40", "an impossible field: C0 00", AS_LISTED, SET_UP, &[0x40, 3, 0x41, 0xB4, 0, 50, 0, 1, 0, 0xE8, 3], &[0xC0, 0, 3]),
    line("41", "asks for or switches the field set: C1; not S14", AS_LISTED, INDOOR, &[0x41, 0], &[0xC1, 1]),
    line("42", "a new password, twice: C2 02, then C2 01", "as listed; every level, not kept over a restart of the program", SET_UP, b"\x42\x00\x00SICK_LMS", &[0xC2, 2, 0]),
    line("45", "a field as configured: C5; not S14", AS_LISTED, INDOOR, &[0x45, 1, 0], &[0xC5, 1, 0x42, 0, 0xB4, 0, 50, 0, 0, 10, 50, 0]),
    line("46", "teaches a field: C6 03, C6 01 at its end; not S14", "as listed; one scan is learnt", SET_UP, &[0x46, 1, 0x40, 0xB4, 0, 50, 0, 0, 5, 0, 0, 0, 0, 0], &[0xC6, 3]),
    line("46", "an end without a start: 92", AS_LISTED, SET_UP, &[0x46, 1, 0x40, 0xB4, 0, 50, 0, 1, 5, 0, 0, 0, 0, 0], &[0x92]),
    line("4A", "outputs: CA and three bytes, 0 while a field is infringed", "as listed; on request one scan is evaluated; no restart interlock", INDOOR, &[0x4A], &[0xCA, 1, 1, 1]),
    line("66", "permanent rate (00, 01) or type (02): E6", "as listed; not kept over a restart of the program", SET_UP, &[0x66, 1], &[0xE6, 1, 1]),
    line("40, 46, 66, 42, 77, 7C", "installation mode only; in monitoring mode 92", AS_LISTED, INDOOR, &[0x66, 1], &[0x92]),
    line("69", "positioning aid: E9", "as listed, without effect; the first range is repeated", INDOOR, &[0x69, 0x32, 1, 0, 0, 0xB4, 0], &[0xE9, 1, 0x32, 0, 0, 0xB4, 0]),
    line("74", "configuration: F4 and 34 bytes, 32 in old firmware", AS_LISTED, INDOOR, &[0x74], &[0xF4, 0, 0, 0x46]),
    line("76", "at most 200 Cartesian values: F6; not S14", "as listed; X is one word with its sign in bit 15, as only so 200 fit a telegram", INDOOR, &[0x76, 1, 0, 0x64, 0], &[0xF6, 1, 0, 0x64, 0, 200, 0x40]),
    line("77", "writes it: F7, up to 7 s where the unit changes", "as listed; 0.4 s else (`field`, --save-s); kept with --state", SET_UP, &[0x77, 0, 0, 0x46], &[0xF7, 1, 0, 0, 0x46]),
    line("77", "a value outside its range: F7 00 and the block in force", AS_LISTED, SET_UP, &[0x77, 0, 0, 0x46, 0, 0, 0, 1, 3], &[0xF7, 0, 0, 0, 0x46]),
    line("7B", "configuration part 2: FB and 84 bytes", AS_LISTED, INDOOR, &[0x7B], &[0xFB, 0, 0]),
    line("7C", "writes it: FC", "as listed, without effect; kept until the program ends", SET_UP, PART_2, &[0xFC, 1, 0]),
    line("0B, 33, 6A and others", "reserved or unknown: 06, then 92", AS_LISTED, INDOOR, &[0x6A], &[0x92]),
];
