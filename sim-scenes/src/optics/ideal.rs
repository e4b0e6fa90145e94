//! What an ideal scanner makes of the returns of one mirror turn: whole millimetres and a remission value.
//!
//! Ideal means: an infinitely thin beam, the first surface only, no noise, no mixed pixels, no loss by distance.

use crate::caster::{Class, Return};

/// The distances a scanner reports. What lies outside is a miss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeLimits {
    /// Nearest echo, metres.
    pub min_range_m: f64,
    /// Farthest echo, metres.
    pub max_range_m: f64,
}

/// Raw range of a beam without an echo.
pub const NO_ECHO_MM: u16 = 0;

/// Raw ranges and remissions of the first echo, one each a return. The vectors are emptied first and reused.
///
/// Range: metres to the nearest millimetre; [`NO_ECHO_MM`] for a miss, outside `limits`, or above the 65 535 mm that fit
/// the wire. Remission: [`remission`], 0 where there is no echo.
pub fn measure(
    returns: &[Return],
    limits: RangeLimits,
    range_mm: &mut Vec<u16>,
    remission_digits: &mut Vec<u16>,
) {
    range_mm.clear();
    range_mm.extend(returns.iter().map(|hit| millimetres(hit.range_m, limits)));
    remission_digits.clear();
    remission_digits.extend(
        returns.iter().zip(range_mm).map(|(hit, raw)| if *raw == NO_ECHO_MM { 0 } else { remission(hit) }),
    );
}

/// Remission on the 16-bit scale: 65535 · ρ · |cos incidence|, a Lambert surface without loss by distance.
///
/// ρ near 905 nm is taken as 0.50 for leaves (about half of near infrared passes or is absorbed), 0.35 for bark, 0.20 for soil and
/// litter, 0.60 for fruit, 0.45 for grass, 0.40 for dry timber, 0.30 for dull wire: round figures that tell the classes apart, not a radiometric model.
pub fn remission(hit: &Return) -> u16 {
    let reflectance = match hit.class {
        Class::Leaf => 0.50,
        Class::Wood => 0.35,
        Class::Fruit => 0.60,
        Class::Post => 0.40,
        Class::Wire => 0.30,
        Class::Grass => 0.45,
        Class::Ground => 0.20,
        Class::None => 0.0,
    };
    // A float to integer cast saturates, so no cosine can leave the scale.
    (f64::from(u16::MAX) * reflectance * f64::from(hit.cos_incidence) + 0.5) as u16
}

pub(super) fn millimetres(range_m: f64, limits: RangeLimits) -> u16 {
    if !(range_m >= limits.min_range_m && range_m <= limits.max_range_m) {
        return NO_ECHO_MM;
    }
    let mm = (range_m * 1000.0 + 0.5) as u32;
    u16::try_from(mm).unwrap_or(NO_ECHO_MM)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: RangeLimits = RangeLimits { min_range_m: 0.5, max_range_m: 80.0 };

    fn at(range_m: f64) -> Return {
        Return { range_m, class: Class::Leaf, tree: 0, organ: 0, cos_incidence: 1.0 }
    }

    #[test]
    fn ranges_round_to_the_nearest_millimetre_and_misses_are_zero() {
        let returns = [
            at(1.9004),
            at(1.9006),
            at(0.4999),
            at(0.5),
            at(65.5354),
            at(65.536),
            at(80.1),
            at(f64::INFINITY),
            at(f64::NAN),
        ];
        let (mut mm, mut remission) = (vec![9], vec![9]);
        measure(&returns, LIMITS, &mut mm, &mut remission);
        assert_eq!(mm, [1900, 1901, 0, 500, 65535, 0, 0, 0, 0]);
        assert!(mm.iter().zip(&remission).all(|(r, s)| (*r == 0) == (*s == 0)));
    }

    #[test]
    fn remission_falls_with_the_cosine_and_tells_the_classes_apart() {
        let class = |class, cos_incidence| remission(&Return { class, cos_incidence, ..at(1.0) });
        assert_eq!(class(Class::Leaf, 0.5) * 2, class(Class::Leaf, 1.0));
        assert!(class(Class::Leaf, 1.0) > class(Class::Wood, 1.0));
        assert!(class(Class::Wood, 1.0) > class(Class::Ground, 1.0));
    }
}
