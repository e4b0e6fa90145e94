//! Nozzles whose shares of height overlap: a boom may be built so, and a slip of the pen looks the same.

use crate::boom::Boom;

/// Heights that overlap by less touch each other, metres.
const TOUCHING_M: f64 = 1e-3;
/// Pairs that are told, at most.
const MOST: usize = 4;

/// What the reader of `boom` should know of nozzles of one side whose shares of height overlap; none where none do.
pub fn overlaps(boom: &Boom) -> Option<String> {
    let (nozzles, mut pairs) = (boom.nozzles(), Vec::new());
    let id = |section: usize| boom.sections.get(section).map_or("", |section| section.id.as_str());
    for (place, one) in nozzles.iter().enumerate() {
        for other in nozzles.iter().skip(place + 1).filter(|other| other.side == one.side) {
            if let Some(both) = one.height.common(other.height).filter(|both| both.length() > TOUCHING_M) {
                pairs.push(format!(
                    "{} of section {} and {} of section {} ({:.2} to {:.2} m)",
                    one.number,
                    id(one.section),
                    other.number,
                    id(other.section),
                    both.from,
                    both.to
                ));
            }
        }
    }
    let shown = pairs.iter().take(MOST).cloned().collect::<Vec<_>>().join(", ");
    let more = pairs.len().saturating_sub(MOST);
    let more = if more > 0 { format!(" and {more} pairs more") } else { String::new() };
    (!pairs.is_empty()).then(|| {
        format!(
            "boom: nozzles of one side overlap in height: {shown}{more}; leaves there are wanted of each of them and count for each"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(sections: &[(&str, &str, f64, f64)]) -> Option<String> {
        let text = sections.iter().map(|(id, side, from, to)| {
            format!("[[section]]\nid = \"{id}\"\nside = \"{side}\"\nz_from_m = {from}\nz_to_m = {to}\nnozzles = 2\n")
        });
        overlaps(&Boom::read(&format!("version = 1\n{}", text.collect::<String>())).expect("a boom"))
    }

    #[test]
    fn nozzles_of_one_side_that_share_a_height_are_named() {
        assert_eq!(told(&[("a", "left", 0.5, 1.5), ("b", "left", 1.5, 2.5), ("c", "right", 0.5, 2.5)]), None);
        let found = told(&[("a", "left", 0.5, 1.5), ("b", "left", 1.3, 2.5)]).expect("they overlap");
        assert!(found.contains("1 of section a and 2 of section b (1.30 to 1.50 m)"), "{found}");
        let same = told(&[("a", "left", 0.5, 1.5), ("b", "left", 0.5, 1.5)]).expect("they overlap");
        assert_eq!(same.matches(" of section a and ").count(), 2, "{same}");
        let many: Vec<_> = (0..4).map(|_| ("left", 0.0, 1.0)).collect();
        let ids = ["a", "b", "c", "d"];
        let many: Vec<_> = ids.iter().zip(many).map(|(id, (side, from, to))| (*id, side, from, to)).collect();
        assert!(told(&many).is_some_and(|found| found.contains("and 8 pairs more")));
    }
}
