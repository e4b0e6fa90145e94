//! Requests and replies; measured values are in [`values`](super::values).

use alloc::vec::Vec;

use super::output::{Output, Parts, Span, When};
use super::words::{put_words, word};
use super::{Rate, Variant, frame};

/// The password of the installation mode.
pub const PASSWORD: [u8; 8] = *b"SICK_LMS";
/// Added to a request's command in its reply.
pub const REPLY: u8 = 0x80;
/// The reply to a reset, an exception to [`REPLY`].
pub const RESET_REPLY: u8 = 0x91;
/// Sent unasked at power-up.
pub const POWER_ON: u8 = 0x90;
/// Not acknowledged, or an unknown command.
pub const REFUSED: u8 = 0x92;
/// Status byte: an LMS, all well.
pub const STATUS_OK: u8 = 0x10;

/// Commands of a host.
pub mod command {
    #![allow(missing_docs, reason = "each is named as `Request` names it")]
    pub const RESET: u8 = 0x10;
    pub const MODE: u8 = 0x20;
    pub const VALUES: u8 = 0x30;
    pub const STATUS: u8 = 0x31;
    pub const ERRORS: u8 = 0x32;
    pub const MEAN: u8 = 0x36;
    pub const RANGE: u8 = 0x37;
    pub const COUNTERS: u8 = 0x35;
    pub const TYPE: u8 = 0x3A;
    pub const VARIANT: u8 = 0x3B;
    pub const MEAN_RANGE: u8 = 0x3F;
    pub const FIELDS: u8 = 0x3E;
    pub const SET_FIELD: u8 = 0x40;
    pub const READ_FIELD: u8 = 0x45;
    pub const TEACH: u8 = 0x46;
    pub const POSITIONING: u8 = 0x69;
    pub const CARTESIAN: u8 = 0x76;
    pub const FIELD_SET: u8 = 0x41;
    pub const PASSWORD: u8 = 0x42;
    pub const REFLECTIVITY: u8 = 0x44;
    pub const OUTPUTS: u8 = 0x4A;
    pub const PERMANENT: u8 = 0x66;
    pub const READ_CONFIGURATION: u8 = 0x74;
    pub const PARTS: u8 = 0x75;
    pub const WRITE_CONFIGURATION: u8 = 0x77;
    pub const READ_PART_2: u8 = 0x7B;
    pub const WRITE_PART_2: u8 = 0x7C;
}

/// An operating mode: what follows `20`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Mode {
    /// `00`: installation, with this password.
    Installation([u8; 8]),
    /// `10`: diagnostic.
    Diagnostic,
    /// `20` to `24`, `26` to `29`, `2A` to `2C`, `50`: the device streams values.
    Stream(Output),
    /// `25`: values on request; ends a stream, and the installation mode.
    OnRequest,
    /// `30`: whether this is the password of the installation mode; the mode stays.
    PasswordTest([u8; 8]),
    /// `40`, `41`, `42`, `48`: another rate.
    Rate(Rate),
    /// One that is not emulated, or none.
    Other(u8),
}

/// What a host asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Request<'a> {
    /// `10`: restart.
    Reset,
    /// `20`: change the operating mode.
    Mode(Mode),
    /// `30`, `36`, `37`, `3E`, `3F`, `44`, `75`, `76`: one scan in this form.
    Values(Output),
    /// `31`: status.
    Status,
    /// `32`: errors and their numbers.
    Errors,
    /// `35`: operating hours and power-ons.
    Counters,
    /// `3A`: type.
    Type,
    /// `3B`: angle and resolution.
    Variant(Variant),
    /// `40`: configure a field; its data.
    SetField(&'a [u8]),
    /// `45`: a field as it is configured: set from 1, field from 0.
    ReadField(u8, u8),
    /// `46`: teach a field in; its data.
    Teach(&'a [u8]),
    /// `69`: the positioning aid: resolution, then start and stop of its first range.
    Positioning(u8, Span),
    /// `41`: ask for the active field set (0), or switch to 1 or 2.
    FieldSet(u8),
    /// `42`: a new password: step (0 new, 1 confirm), level, the password.
    Password(u8, u8, [u8; 8]),
    /// `4A`: the switching outputs.
    Outputs,
    /// `66`: what is kept over power-on: 0 9600, 1 the present rate, 2 the configured type.
    Permanent(u8),
    /// `74`: read the configuration block.
    ReadConfiguration,
    /// `77`: write it, or its first bytes.
    WriteConfiguration(&'a [u8]),
    /// `7B`: read part 2 of the configuration.
    ReadPart2,
    /// `7C`: write it, or its first bytes.
    WritePart2(&'a [u8]),
    /// Unknown, or known with data that it does not take.
    Unknown(u8),
}

fn span(bytes: [u8; 4]) -> Span {
    Span::of_bytes(bytes)
}

/// Bit 15 of either word: each partial scan at once.
const DIRECT: u16 = 0x8000;

/// The sub-range of `27` and `37`.
fn sub_range(bytes: [u8; 4]) -> Output {
    let Span { first, last } = span(bytes);
    match (first | last) & DIRECT {
        0 => Output::Range(Span { first, last }),
        _ => Output::Direct(Span { first: first & !DIRECT, last: last & !DIRECT }),
    }
}

impl Mode {
    fn parse(data: &[u8]) -> Option<Self> {
        Some(match *data {
            [0x00, ref password @ ..] => Self::Installation(*password.first_chunk()?),
            [0x10, ..] => Self::Diagnostic,
            [0x24, ..] => Self::Stream(Output::All),
            [0x25, ..] => Self::OnRequest,
            [0x26, scans, ..] => Self::Stream(Output::Mean { scans }),
            [0x20, ..] => Self::Stream(Output::Minima(When::Always)),
            [0x21, ..] => Self::Stream(Output::Minima(When::Infringed)),
            [0x22, ..] => Self::Stream(Output::Perpendicular(When::Always)),
            [0x23, ..] => Self::Stream(Output::Perpendicular(When::Infringed)),
            [0x27, a, b, c, d, ..] => Self::Stream(sub_range([a, b, c, d])),
            // The listing's table has the number as a word, its text and public clients as a byte.
            [0x28, scans, 0, a, b, c, d] | [0x28, scans, a, b, c, d] => {
                Self::Stream(Output::MeanRange { scans, span: span([a, b, c, d]) })
            }
            [0x29, a, b, c, d, ..] => Self::Stream(Output::Fields(span([a, b, c, d]))),
            [0x2A, ..] => Self::Stream(Output::Partial),
            // Not the shape of 2B, which a public client sends.
            [0x2C, segments, a, b, c, d] => {
                Self::Stream(Output::Segments { segments, span: span([a, b, c, d]) })
            }
            [0x2B, ref parts @ ..] => Self::Stream(Output::Parts(Parts::parse(parts)?)),
            [0x30, ref password @ ..] => Self::PasswordTest(*password.first_chunk()?),
            [0x50, a, b, c, d, ..] => Self::Stream(Output::Reflectivity(span([a, b, c, d]))),
            [mode, ..] => Rate::of_mode(mode).map_or(Self::Other(mode), Self::Rate),
            [] => return None,
        })
    }

    /// Its number, as the status has it.
    pub fn number(self) -> u8 {
        match self {
            Self::Installation(_) => 0x00,
            Self::Diagnostic => 0x10,
            Self::OnRequest => 0x25,
            Self::Stream(Output::All) => 0x24,
            Self::Stream(Output::Mean { .. }) => 0x26,
            Self::Stream(Output::Range(_) | Output::Direct(_)) => 0x27,
            Self::Stream(Output::Minima(When::Always)) => 0x20,
            Self::Stream(Output::Minima(When::Infringed)) => 0x21,
            Self::Stream(Output::Perpendicular(When::Always)) => 0x22,
            Self::Stream(Output::Perpendicular(When::Infringed)) => 0x23,
            Self::Stream(Output::Fields(_)) => 0x29,
            Self::Stream(Output::Segments { .. }) => 0x2C,
            Self::Stream(Output::MeanRange { .. }) => 0x28,
            Self::Stream(Output::Partial) => 0x2A,
            Self::Stream(Output::Parts(_)) => 0x2B,
            Self::Stream(Output::Reflectivity(_)) => 0x50,
            // Never streamed: sent on request only.
            Self::Stream(Output::Every(_) | Output::Cartesian(_) | Output::Taught) => 0x24,
            Self::PasswordTest(_) => 0x30,
            Self::Rate(rate) => rate.mode(),
            Self::Other(number) => number,
        }
    }

    fn encode(self, out: &mut Vec<u8>) {
        out.push(self.number());
        match self {
            Self::Installation(password) | Self::PasswordTest(password) => out.extend_from_slice(&password),
            Self::Stream(output) => encode_output(output, out),
            Self::Diagnostic | Self::OnRequest | Self::Rate(_) | Self::Other(_) => {}
        }
    }
}

fn encode_output(output: Output, out: &mut Vec<u8>) {
    if let Output::Mean { scans }
    | Output::MeanRange { scans, .. }
    | Output::Segments { segments: scans, .. } = output
    {
        out.push(scans);
    }
    let direct = if matches!(output, Output::Direct(_)) { DIRECT } else { 0 };
    if let Some(span) = output.span() {
        put_words(&span.words().map(|word| word | direct), out);
    }
    if let Output::Parts(parts) = output {
        put_words(&[parts.spans().len() as u16], out);
        parts.spans().iter().for_each(|span| put_words(&span.words(), out));
    }
}

impl<'a> Request<'a> {
    /// Reads a frame's body.
    pub fn parse(body: &'a [u8]) -> Self {
        let (command, data) = match body.split_first() {
            Some((command, data)) => (*command, data),
            None => return Self::Unknown(0),
        };
        match (command, data) {
            (command::RESET, _) => Self::Reset,
            (command::MODE, data) => Mode::parse(data).map_or(Self::Unknown(command), Self::Mode),
            (command::VALUES, [0x01, ..]) => Self::Values(Output::All),
            (command::VALUES, [0x02, ..]) => Self::Values(Output::Perpendicular(When::Always)),
            (command::VALUES, [0x03, ..]) => Self::Values(Output::Taught),
            (command::VALUES, [0x06, ..]) => Self::Values(Output::Every(2)),
            (command::VALUES, [0x07, ..]) => Self::Values(Output::Every(20)),
            (command::VALUES, [0x08, ..]) => Self::Values(Output::Partial),
            (command::MEAN, &[scans, ..]) => Self::Values(Output::Mean { scans }),
            (command::RANGE, &[a, b, c, d, ..]) => Self::Values(sub_range([a, b, c, d])),
            (command::FIELDS, &[a, b, c, d, ..]) => Self::Values(Output::Fields(span([a, b, c, d]))),
            (command::CARTESIAN, &[a, b, c, d, ..]) => Self::Values(Output::Cartesian(span([a, b, c, d]))),
            (command::SET_FIELD, data) => Self::SetField(data),
            // The listing's own example has the set alone.
            (command::READ_FIELD, &[set]) => Self::ReadField(set, 0),
            (command::READ_FIELD, &[set, field, ..]) => Self::ReadField(set, field),
            (command::TEACH, data) => Self::Teach(data),
            (command::POSITIONING, &[step, 1..=3, a, b, c, d, ..]) => {
                Self::Positioning(step, span([a, b, c, d]))
            }
            (command::MEAN_RANGE, &[scans, a, b, c, d, ..]) => {
                Self::Values(Output::MeanRange { scans, span: span([a, b, c, d]) })
            }
            (command::REFLECTIVITY, &[a, b, c, d, ..]) => {
                Self::Values(Output::Reflectivity(span([a, b, c, d])))
            }
            (command::PARTS, data) => {
                Parts::parse(data).map_or(Self::Unknown(command), |parts| Self::Values(Output::Parts(parts)))
            }
            (command::STATUS, _) => Self::Status,
            (command::ERRORS, _) => Self::Errors,
            (command::COUNTERS, _) => Self::Counters,
            (command::TYPE, _) => Self::Type,
            (command::VARIANT, &[a, b, c, d, ..]) => {
                Self::Variant(Variant { angle_deg: word([a, b]), step_centideg: word([c, d]) })
            }
            (command::FIELD_SET, &[set, ..]) => Self::FieldSet(set),
            (command::PASSWORD, &[step, level, a, b, c, d, e, f, g, h, ..]) => {
                Self::Password(step, level, [a, b, c, d, e, f, g, h])
            }
            (command::OUTPUTS, _) => Self::Outputs,
            (command::PERMANENT, &[what, ..]) => Self::Permanent(what),
            (command::READ_CONFIGURATION, _) => Self::ReadConfiguration,
            (command::WRITE_CONFIGURATION, data) => Self::WriteConfiguration(data),
            (command::READ_PART_2, _) => Self::ReadPart2,
            (command::WRITE_PART_2, data) => Self::WritePart2(data),
            (command, _) => Self::Unknown(command),
        }
    }

    /// Its command.
    pub fn command(&self) -> u8 {
        match self {
            Self::Reset => command::RESET,
            Self::Mode(_) => command::MODE,
            Self::Values(Output::Parts(_)) => command::PARTS,
            Self::Values(output) => output.command() - REPLY,
            Self::Status => command::STATUS,
            Self::Errors => command::ERRORS,
            Self::Counters => command::COUNTERS,
            Self::Type => command::TYPE,
            Self::Variant(_) => command::VARIANT,
            Self::SetField(_) => command::SET_FIELD,
            Self::ReadField(..) => command::READ_FIELD,
            Self::Teach(_) => command::TEACH,
            Self::Positioning(..) => command::POSITIONING,
            Self::FieldSet(_) => command::FIELD_SET,
            Self::Password(..) => command::PASSWORD,
            Self::Outputs => command::OUTPUTS,
            Self::Permanent(_) => command::PERMANENT,
            Self::ReadPart2 => command::READ_PART_2,
            Self::WritePart2(_) => command::WRITE_PART_2,
            Self::ReadConfiguration => command::READ_CONFIGURATION,
            Self::WriteConfiguration(_) => command::WRITE_CONFIGURATION,
            Self::Unknown(command) => *command,
        }
    }

    /// The command of its reply.
    pub fn reply(&self) -> u8 {
        match self {
            Self::Reset => RESET_REPLY,
            other => other.command() | REPLY,
        }
    }

    /// As one frame to device 0.
    pub fn to_frame(&self) -> Vec<u8> {
        let mut out = Vec::new();
        frame::encode_with(0, &mut out, |out| {
            out.push(self.command());
            match self {
                Self::Mode(mode) => mode.encode(out),
                Self::Values(Output::All) => out.push(0x01),
                Self::Values(Output::Every(step)) => out.push(if *step == 2 { 0x06 } else { 0x07 }),
                Self::Values(Output::Partial) => out.push(0x08),
                Self::Values(Output::Perpendicular(_)) => out.push(0x02),
                Self::Values(Output::Taught) => out.push(0x03),
                Self::Values(output) => encode_output(*output, out),
                Self::Variant(variant) => {
                    put_words(&[variant.angle_deg, variant.step_centideg], out);
                }
                Self::FieldSet(set) | Self::Permanent(set) => out.push(*set),
                Self::Password(step, level, password) => {
                    out.extend_from_slice(&[*step, *level]);
                    out.extend_from_slice(password);
                }
                Self::ReadField(set, field) => out.extend_from_slice(&[*set, *field]),
                Self::Positioning(step, span) => {
                    out.extend_from_slice(&[*step, 1]);
                    put_words(&span.words(), out);
                }
                Self::WriteConfiguration(bytes)
                | Self::WritePart2(bytes)
                | Self::SetField(bytes)
                | Self::Teach(bytes) => out.extend_from_slice(bytes),
                _ => {}
            }
        });
        out
    }
}
