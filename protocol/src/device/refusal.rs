//! What a device refuses, with which code, and how we know: one line a fault. The effects refuse by these faults, the tests send every
//! example, and `docs/refusals.md` is this table in print.

use crate::telegram::SopasError;
use crate::telegram::wire::{Found, WireError};

/// What is wrong with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// No CoLa command begins with these letters.
    NoCommand,
    /// No such variable.
    NoVariable,
    /// No such method.
    NoMethod,
    /// No such event.
    NoEvent,
    /// The variable can only be read.
    ReadOnly,
    /// Writing needs the user level of an authorised client.
    WriteWithoutLogin,
    /// The method needs the user level of an authorised client.
    CallWithoutLogin,
    /// Arguments are missing.
    TooFewArguments,
    /// More arguments than the command takes.
    TooManyArguments,
    /// A number that its field cannot hold.
    NumberTooLarge,
    /// A text argument that is no number.
    NoNumber,
    /// Neither 0 nor 1 where a flag stands.
    NoFlag,
    /// A date that does not exist.
    NoDate,
    /// A text longer than the variable holds.
    TextTooLong,
    /// No scan has been made yet.
    NoScanYet,
    /// Not one sector, angles outside the model's range, or none of its beams between them.
    OutsideOutputRange,
    /// Contents of the scan telegram the model does not have.
    ImpossibleContents,
    /// A code the variable does not have.
    NoSuchCode,
    /// Not as many layers as the scanner has, or none of them.
    NoSuchLayers,
    /// Numbers a filter does not take.
    ImpossibleFilter,
    /// An application the device does not have.
    NoSuchApplication,
    /// The scans come from a recording, which does not have what the setting asks for.
    FixedByRecording,
    /// The scans come from a recording, and nothing in it tells which echo they hold.
    EchoNotRecorded,
    /// The variable exists, but this virtual device cannot change it.
    FixedHere,
}

/// How a line of the table is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// A real device answered so in a recording.
    Recorded(&'static str),
    /// SICK's documents, or a thread about a real device, say so.
    Documented(&'static str),
    /// The meaning of the code fits; no device was seen to answer so.
    Assumed,
}

/// One line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Refusal {
    /// Which requests.
    pub command: &'static str,
    /// What is wrong with them.
    pub fault: Fault,
    /// The same in words.
    pub what: &'static str,
    /// What is answered.
    pub error: SopasError,
    /// How it is known.
    pub evidence: Evidence,
    /// A request that is refused so, in CoLa A. It is sent logged in, unless the fault is not to be.
    pub example: &'static str,
    /// The model that gets the example.
    pub model: &'static str,
}

use Evidence::{Assumed, Documented, Recorded};

const fn line(
    command: &'static str,
    fault: Fault,
    what: &'static str,
    error: SopasError,
    evidence: Evidence,
    example: &'static str,
) -> Refusal {
    Refusal { command, fault, what, error, evidence, example, model: "lms111" }
}

/// One line a fault and command.
#[rustfmt::skip]
pub static REFUSALS: &[Refusal] = &[
    line("any", Fault::NoCommand, "an unknown kind of command", SopasError::UnknownColaCommand, Assumed, "sRIO"),
    line("sRN, sWN", Fault::NoVariable, "no such variable", SopasError::UnknownVariable, Recorded("LMS511, fields 12 to 29"), "sRN NoSuchVariable"),
    line("sRI", Fault::NoVariable, "any index but 0", SopasError::UnknownVariable, Assumed, "sRI 7"),
    line("sRN fieldNNN", Fault::NoVariable, "a slot beyond the model's", SopasError::UnknownVariable, Recorded("LMS511, fields 12 to 29"), "sRN field030"),
    Refusal { model: "tim571", ..line("sWN FREchoFilter, MSsuppmode, LIC…, DO3And4Fnc", Fault::NoVariable, "a variable the model does not have", SopasError::UnknownVariable, Assumed, "sWN FREchoFilter 1") },
    line("sMN", Fault::NoMethod, "no such method", SopasError::UnknownMethod, Documented("telegram listing, error codes"), "sMN NoSuchMethod"),
    line("sEN", Fault::NoEvent, "no such event", SopasError::UnknownEvent, Recorded("MRS1104, InertialMeasurementUnit"), "sEN InertialMeasurementUnit 1"),
    line("sWN", Fault::ReadOnly, "a variable that can only be read", SopasError::WriteAccessDenied, Documented("telegram listing, error codes"), "sWN SerialNumber 1 5"),
    line("sWN", Fault::WriteWithoutLogin, "user level below authorised client", SopasError::WriteAccessDenied, Documented("picoScan thread"), "sWN LocationName 5 north"),
    line("sMN", Fault::CallWithoutLogin, "user level below authorised client", SopasError::MethodAccessDenied, Documented("telegram listing, error codes"), "sMN LMCstopmeas"),
    line("any", Fault::TooFewArguments, "arguments missing", SopasError::BufferUnderflow, Documented("LMS1xx thread, short mLMPsetscancfg"), "sMN mLMPsetscancfg 1388"),
    line("any", Fault::TooManyArguments, "too many arguments", SopasError::BufferOverflow, Assumed, "sWN FREchoFilter 1 1"),
    line("any, CoLa A", Fault::NumberTooLarge, "a number its field cannot hold", SopasError::ValueOverflow, Documented("telegram listing, error codes"), "sMN SetAccessMode 3 F47247440"),
    line("any, CoLa A", Fault::NoNumber, "text that is no number", SopasError::InvalidCharacter, Documented("telegram listing, error codes"), "sMN mLMPsetscancfg \\x00\\x00\\x13\\x88"),
    line("any", Fault::NoFlag, "neither 0 nor 1 for a flag", SopasError::InvalidData, Assumed, "sEN LMDscandata 2"),
    line("sMN LSPsetdatetime", Fault::NoDate, "a date that does not exist", SopasError::InvalidData, Assumed, "sMN LSPsetdatetime +2023 +2 +29 0 0 0 0"),
    line("sWN LocationName", Fault::TextTooLong, "more than 16 characters", SopasError::FlexOutOfBounds, Assumed, "sWN LocationName 11 seventeen letters"),
    line("sRN LMDscandata", Fault::NoScanYet, "no scan has been made since power-up (a TiM answers with a scan of zeros)", SopasError::LocalConditionFailed, Assumed, "sRN LMDscandata"),
    line("sWN LMPoutputRange", Fault::OutsideOutputRange, "not one sector, or angles beyond the model's", SopasError::LocalConditionFailed, Recorded("MRS1104"), "sWN LMPoutputRange 1 1388 -500000 +2250000"),
    line("sWN LMPoutputRange", Fault::OutsideOutputRange, "a range without a beam: it lies between two", SopasError::LocalConditionFailed, Assumed, "sWN LMPoutputRange 1 1388 +12345 +13000"),
    line("sWN LMDscandatacfg", Fault::ImpossibleContents, "echoes or encoders the model does not have, no echo at all (LMS5xx takes that), unit not 0, rate not 1 to 50000", SopasError::LocalConditionFailed, Assumed, "sWN LMDscandatacfg 04 00 0 0 0 00 00 0 0 0 0 +1"),
    line("sWN EIHstCola, FREchoFilter, MSsuppmode, LICsrc, LICencset", Fault::NoSuchCode, "a code the variable does not have", SopasError::LocalConditionFailed, Assumed, "sWN EIHstCola 2"),
    line("sWN LICencres", Fault::NoSuchCode, "not between 0.001 and 2000", SopasError::LocalConditionFailed, Assumed, "sWN LICencres 00000000"),
    Refusal { model: "mrs1000", ..line("sWN ScanLayerFilter", Fault::NoSuchLayers, "not as many layers as the scanner has, or all of them off", SopasError::LocalConditionFailed, Assumed, "sWN ScanLayerFilter 4 0 0 0 0") },
    line("sWN LFPmeanfilter, LFPmedianfilter, LFPparticle", Fault::ImpossibleFilter, "a mean of other than 2 to 100 scans, a median of other than 3 beams", SopasError::LocalConditionFailed, Assumed, "sWN LFPmeanfilter 1 +101 0"),
    line("sWN SetActiveApplications", Fault::NoSuchApplication, "neither RANG nor FEVL", SopasError::LocalConditionFailed, Assumed, "sWN SetActiveApplications 1 NONE 1"),
    line("sWN LMDscandatacfg, LMPoutputRange, FREchoFilter, MSsuppmode, LFP…, LIC…", Fault::FixedByRecording, "`rowscan replay` only: the recorded scans do not have what is asked for", SopasError::LocalConditionFailed, Assumed, "sWN LMDscandatacfg 01 00 1 0 0 00 00 0 0 0 0 +1"),
    Refusal { model: "lms511", ..line("sRN FREchoFilter", Fault::EchoNotRecorded, "`rowscan replay` only: nothing in the recording tells which echo its scans hold", SopasError::LocalConditionFailed, Assumed, "sRN FREchoFilter") },
    line("sWN TSC…, EIIpAddr, EImask, EIgate, LMPautostartmeas", Fault::FixedHere, "another value than the one in force: not emulated", SopasError::LocalConditionFailed, Assumed, "sWN TSCRole 1"),
];

impl From<Fault> for SopasError {
    fn from(fault: Fault) -> Self {
        let line = REFUSALS.iter().find(|line| line.fault == fault);
        line.map_or(Self::UnknownError, |line| line.error)
    }
}

impl From<WireError> for Fault {
    fn from(error: WireError) -> Self {
        match error.found {
            Found::End => Self::TooFewArguments,
            Found::Text(_) => Self::NoNumber,
            Found::TooLarge(_) => Self::NumberTooLarge,
            Found::Value(_) => Self::NoFlag,
            Found::Extra(_) => Self::TooManyArguments,
        }
    }
}

/// The code a device refuses arguments with that it cannot read.
impl From<WireError> for SopasError {
    fn from(error: WireError) -> Self {
        Fault::from(error).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_fault_has_one_code() {
        for line in REFUSALS {
            assert_eq!(SopasError::from(line.fault), line.error, "{}", line.command);
        }
    }
}
