//! Colours of returns, told apart by colour-blind readers as well.

use rowscan_scenes::Class;

/// Viridis (Smith and van der Walt, matplotlib) at nine places from its dark to its light end.
const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// The colour of a share from 0 (dark violet) to 1 (yellow): lighter with every step, also in grey.
pub fn of_share(share: f64) -> [u8; 3] {
    let last = VIRIDIS.len() - 1;
    let place = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 } * last as f64;
    let from = (place as usize).min(last - 1);
    let part = place - from as f64;
    std::array::from_fn(|c| {
        let [low, high] = [VIRIDIS[from][c], VIRIDIS[from + 1][c]].map(f64::from);
        (low + part * (high - low) + 0.5) as u8
    })
}

/// The colour of a class of returns (Okabe and Ito's palette).
pub fn of_class(class: Class) -> [u8; 3] {
    match class {
        Class::Leaf => [0, 158, 115],
        Class::Wood => [213, 94, 0],
        Class::Fruit => [204, 121, 167],
        Class::Post => [0, 114, 178],
        Class::Wire => [86, 180, 233],
        Class::Ground => [230, 159, 0],
        Class::Grass => [240, 228, 66],
        Class::None => [120, 120, 120],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_larger_share_is_always_lighter() {
        let grey = |k: u32| {
            let [r, g, b] = of_share(f64::from(k) / 64.0).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        assert!((0..64).all(|k| grey(k) < grey(k + 1)), "the order of the legend");
        assert_eq!((of_share(-1.0), of_share(f64::NAN), of_share(2.0)), (VIRIDIS[0], VIRIDIS[0], VIRIDIS[8]));
    }

    #[test]
    fn no_two_classes_have_one_colour() {
        let mut colours: Vec<[u8; 3]> = Class::ALL.iter().map(|class| of_class(*class)).collect();
        colours.sort_unstable();
        colours.dedup();
        assert_eq!(colours.len(), Class::ALL.len());
    }
}
