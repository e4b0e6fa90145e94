//! The fields of any telegram, one by one: name, value and unit.
//!
//! Order of calls: a value is one [`value`](Visitor::value), or a [`begin`](Visitor::begin), its parts, and an [`end`](Visitor::end). Parts of a
//! struct are a [`field`](Visitor::field) each, followed by that field's value; parts of a list are values.

/// One value without parts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Value<'a> {
    /// An optional block that is absent.
    Absent,
    /// A flag.
    Flag(bool),
    /// A whole number.
    Integer(i64),
    /// A whole number that is never negative and may be as large as this.
    Unsigned(u64),
    /// A real number.
    Real(f32),
    /// A text; bytes that are no printable ASCII are escaped where the text has a fixed length.
    Text(&'a str),
    /// Bytes that this crate does not take apart.
    Opaque(&'a [u8]),
}

/// A value with parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Parts with names.
    Struct,
    /// Parts without names.
    List,
}

/// Receives the fields of a telegram.
pub trait Visitor {
    /// A value without parts.
    fn value(&mut self, value: Value<'_>);
    /// A value with parts begins.
    fn begin(&mut self, group: Group);
    /// The next value is this field of the struct. The unit is that of the raw number: `1/100 Hz` means hundredths of a hertz.
    fn field(&mut self, name: &'static str, unit: Option<&'static str>);
    /// The value with parts ends.
    fn end(&mut self);
}

/// Ignores everything.
impl Visitor for () {
    fn value(&mut self, _: Value<'_>) {}
    fn begin(&mut self, _: Group) {}
    fn field(&mut self, _: &'static str, _: Option<&'static str>) {}
    fn end(&mut self) {}
}

/// Visits a struct of one field.
pub(crate) fn one_field(visitor: &mut dyn Visitor, name: &'static str, value: impl FnOnce(&mut dyn Visitor)) {
    visitor.begin(Group::Struct);
    visitor.field(name, None);
    value(visitor);
    visitor.end();
}
