//! Requests and scans of the LMS2xx, visited field by field.

use super::telegram::{Mode, Request};
use super::values::{Output, Unit, Values};
use crate::visit::{Group, Value, Visitor};

impl Request<'_> {
    /// What it asks, in a word.
    fn name(&self) -> &'static str {
        match self {
            Self::Reset => "reset",
            Self::Mode(_) => "mode",
            Self::Values(_) => "values",
            Self::Status => "status",
            Self::Errors => "errors",
            Self::Counters => "counters",
            Self::Type => "type",
            Self::Variant(_) => "variant",
            Self::FieldSet(_) => "field_set",
            Self::SetField(_) => "set_field",
            Self::ReadField(..) => "read_field",
            Self::Teach(_) => "teach",
            Self::Positioning(..) => "positioning",
            Self::Password(..) => "password",
            Self::Outputs => "outputs",
            Self::Permanent(_) => "permanent",
            Self::ReadPart2 => "read_part_2",
            Self::WritePart2(_) => "write_part_2",
            Self::ReadConfiguration => "read_configuration",
            Self::WriteConfiguration(_) => "write_configuration",
            Self::Unknown(_) => "unknown",
        }
    }

    /// Visits the request's fields.
    pub fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        text(visitor, "request", self.name());
        match self {
            Self::Mode(mode) => visit_mode(*mode, visitor),
            Self::Values(output) => visit_output(*output, visitor),
            Self::Variant(variant) => {
                integer(visitor, "angle_deg", Some("°"), variant.angle_deg.into());
                integer(visitor, "step_centideg", Some("1/100°"), variant.step_centideg.into());
            }
            Self::FieldSet(set) => integer(visitor, "set", None, (*set).into()),
            Self::Permanent(what) => integer(visitor, "what", None, (*what).into()),
            Self::Password(step, level, _) => {
                integer(visitor, "step", None, (*step).into());
                integer(visitor, "level", None, (*level).into());
            }
            Self::ReadField(set, field) => {
                integer(visitor, "set", None, (*set).into());
                integer(visitor, "field", None, (*field).into());
            }
            Self::SetField(bytes) | Self::Teach(bytes) => {
                visitor.field("data", None);
                list(visitor, bytes.iter().map(|byte| (*byte).into()));
            }
            Self::Positioning(step, span) => {
                integer(visitor, "step_centideg", Some("1/100°"), (*step).into());
                integer(visitor, "start_deg", Some("°"), span.first.into());
                integer(visitor, "stop_deg", Some("°"), span.last.into());
            }
            Self::WriteConfiguration(bytes) | Self::WritePart2(bytes) => {
                visitor.field("configuration", None);
                list(visitor, bytes.iter().map(|byte| (*byte).into()));
            }
            Self::Unknown(command) => integer(visitor, "command", None, (*command).into()),
            Self::Reset
            | Self::Status
            | Self::Errors
            | Self::Counters
            | Self::Type
            | Self::Outputs
            | Self::ReadPart2
            | Self::ReadConfiguration => {}
        }
        visitor.end();
    }
}

impl Values {
    /// Visits the scan's fields. Values are as sent, with the flag bits of the measuring mode, which is not in the telegram.
    pub fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        visit_output(self.output, visitor);
        visitor.field("unit", None);
        visitor.value(match self.word.unit {
            Some(Unit::Cm) => Value::Text("cm"),
            Some(Unit::Mm) => Value::Text("mm"),
            None => Value::Absent,
        });
        if let Some(partial) = self.word.partial {
            integer(visitor, "partial", Some("1/4°"), partial.into());
        }
        visitor.field("values", None);
        list(visitor, self.values.iter().map(|value| (*value).into()));
        if !self.reflectivity.is_empty() {
            visitor.field("reflectivity", None);
            list(visitor, self.reflectivity.iter().map(|value| (*value).into()));
        }
        if !self.part_reflectivity.is_empty() {
            visitor.field("reflectivity", None);
            list(visitor, self.part_reflectivity.iter().map(|value| (*value).into()));
        }
        if let Some(index) = self.real_time_index {
            integer(visitor, "real_time_index", None, index.into());
        }
        if let Some(index) = self.telegram_index {
            integer(visitor, "telegram_index", None, index.into());
        }
        integer(visitor, "status", None, self.status.into());
        visitor.end();
    }
}

fn visit_mode(mode: Mode, visitor: &mut dyn Visitor) {
    match mode {
        Mode::Installation(_) => text(visitor, "mode", "installation"),
        Mode::PasswordTest(_) => text(visitor, "mode", "password_test"),
        Mode::Diagnostic => text(visitor, "mode", "diagnostic"),
        Mode::Stream(output) => {
            text(visitor, "mode", "stream");
            visit_output(output, visitor);
        }
        Mode::OnRequest => text(visitor, "mode", "on_request"),
        Mode::Rate(rate) => {
            text(visitor, "mode", "rate");
            integer(visitor, "rate", Some("bit/s"), rate.bits_per_second().into());
        }
        Mode::Other(number) => integer(visitor, "mode", None, number.into()),
    }
}

fn visit_output(output: Output, visitor: &mut dyn Visitor) {
    let name = match output {
        Output::All => "all",
        Output::Partial => "partial",
        Output::Mean { .. } => "mean",
        Output::Range(_) => "range",
        Output::MeanRange { .. } => "mean_range",
        Output::Reflectivity(_) => "reflectivity",
        Output::Every(_) => "every",
        Output::Parts(_) => "parts",
        Output::Direct(_) => "direct",
        Output::Segments { .. } => "segments",
        Output::Fields(_) => "fields",
        Output::Cartesian(_) => "cartesian",
        Output::Minima(_) => "minima",
        Output::Perpendicular(_) => "perpendicular",
        Output::Taught => "taught",
    };
    text(visitor, "output", name);
    if let Output::Mean { scans } | Output::MeanRange { scans, .. } = output {
        integer(visitor, "scans", None, scans.into());
    }
    if let Output::Segments { segments, .. } = output {
        integer(visitor, "segments", None, segments.into());
    }
    if let Some(span) = output.span() {
        integer(visitor, "first", None, span.first.into());
        integer(visitor, "last", None, span.last.into());
    }
    if let Output::Every(step) = output {
        integer(visitor, "every", None, step.into());
    }
    if let Output::Parts(parts) = output {
        visitor.field("parts", None);
        list(visitor, parts.spans().iter().flat_map(|span| [span.first.into(), span.last.into()]));
    }
}

fn text(visitor: &mut dyn Visitor, name: &'static str, text: &str) {
    visitor.field(name, None);
    visitor.value(Value::Text(text));
}

fn integer(visitor: &mut dyn Visitor, name: &'static str, unit: Option<&'static str>, value: i64) {
    visitor.field(name, unit);
    visitor.value(Value::Integer(value));
}

fn list(visitor: &mut dyn Visitor, values: impl Iterator<Item = i64>) {
    visitor.begin(Group::List);
    values.for_each(|value| visitor.value(Value::Integer(value)));
    visitor.end();
}
