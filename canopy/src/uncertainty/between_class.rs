//! How far apart classes are: the transfer study's table.

use std::sync::LazyLock;

use crate::class::ClassKey;

/// The error that a calibration of one class makes on another, root mean square over all ordered pairs of the study's classes that differ in one
/// property. Lines of `property,estimator,relative sd,apart`; the first ones say by which command, and when.
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
    /// How far apart the study's classes are in the property, root mean square by [`ClassKey::apart`]; `None` where its values are names.
    pub apart: Option<f64>,
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
    let (key, estimator, sd, apart) = (fields.next()?, fields.next()?, fields.next()?, fields.next()?);
    let key = ClassKey::by_name(key)?;
    let apart = if apart.is_empty() { None } else { Some(apart.parse().ok()?) };
    Some(BetweenClass { key, estimator, relative_sd: sd.parse().ok()?, apart })
}

/// The relative standard deviation between classes that differ in this property: in proportion to how far they are apart where that is known, else
/// that of the study's classes. `None` where the study did not measure it.
pub fn between_class(key: ClassKey, estimator: &str, apart: Option<f64>) -> Option<f64> {
    let found = BetweenClass::table().iter().find(|line| line.key == key && line.estimator == estimator)?;
    Some(found.relative_sd * apart.zip(found.apart).map_or(1.0, |(own, of_study)| own / of_study))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_table_is_read_and_the_first_say_where_it_comes_from() {
        let lines = || TABLE.lines().filter(|line| !line.starts_with('#') && !line.starts_with("property"));
        assert!(lines().count() > 0 && lines().all(|line| read(line).is_some_and(|l| l.relative_sd >= 0.0)));
        let by_number = |line: &BetweenClass| line.apart.is_some_and(|apart| apart > 0.0);
        for line in BetweenClass::table() {
            assert_eq!(by_number(line), line.key.is_number(), "{line:?}");
        }
        assert!(TABLE.lines().any(|line| line.starts_with("# rowscan study transfer")));
    }

    #[test]
    fn the_term_grows_with_the_difference_and_is_the_studys_own_where_that_is_unknown() {
        let line = BetweenClass::table().iter().find(|line| line.key == ClassKey::Distance).unwrap();
        let of_study = between_class(line.key, line.estimator, None);
        assert_eq!(of_study, Some(line.relative_sd));
        assert_eq!(between_class(line.key, line.estimator, line.apart), of_study);
        assert_eq!(between_class(line.key, line.estimator, Some(0.0)), Some(0.0));
        let twice = between_class(line.key, line.estimator, line.apart.map(|apart| 2.0 * apart));
        assert!((twice.unwrap() - 2.0 * line.relative_sd).abs() < 1e-12);
        assert_eq!(between_class(ClassKey::Season, "no such estimator", None), None);
    }
}
