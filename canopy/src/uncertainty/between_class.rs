//! How far apart classes are: the transfer study's table.

use std::sync::LazyLock;

use crate::class::ClassKey;

/// The error that a calibration of one class makes on another, root mean square over all ordered pairs of the study's classes that differ in one
/// property. Lines of `property,estimator,relative sd`; the first ones say by which command, and when.
static TABLE: &str = include_str!("../../between-class.csv");

/// One line of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BetweenClass {
    /// The property in which classes differ.
    pub key: ClassKey,
    /// The estimator: `contact` or `contact_raw`.
    pub estimator: &'static str,
    /// Relative standard deviation.
    pub relative_sd: f64,
}

impl BetweenClass {
    /// The whole table.
    pub fn table() -> &'static [Self] {
        static LINES: LazyLock<Vec<BetweenClass>> =
            LazyLock::new(|| TABLE.lines().filter_map(read).collect());
        &LINES
    }
}

fn read(line: &'static str) -> Option<BetweenClass> {
    let mut fields = line.split(',');
    let (key, estimator, sd) = (fields.next()?, fields.next()?, fields.next()?);
    Some(BetweenClass { key: ClassKey::by_name(key)?, estimator, relative_sd: sd.parse().ok()? })
}

/// The relative standard deviation between classes that differ in this property; `None` where the study did not measure it.
pub fn between_class(key: ClassKey, estimator: &str) -> Option<f64> {
    let found = BetweenClass::table().iter().find(|line| line.key == key && line.estimator == estimator)?;
    Some(found.relative_sd)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_table_is_read_and_the_first_say_where_it_comes_from() {
        let lines = || TABLE.lines().filter(|line| !line.starts_with('#') && !line.starts_with("property"));
        assert!(lines().count() > 0 && lines().all(|line| read(line).is_some_and(|l| l.relative_sd >= 0.0)));
        assert!(TABLE.lines().any(|line| line.starts_with("# rowscan study transfer")));
    }
}
