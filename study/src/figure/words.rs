//! Keys and outputs as people say them: `speed_m_s` is `speed, m/s`.

/// Ends of names that are units, longer ones first.
const UNITS: &[(&str, &str)] = &[
    ("_m2_per_m", "m²/m"),
    ("_m3_ha", "m³/ha"),
    ("_m2_ha", "m²/ha"),
    ("_m_s", "m/s"),
    ("_percent", "%"),
    ("_cm2", "cm²"),
    ("_deg", "°"),
    ("_hz", "Hz"),
    ("_m2", "m²"),
    ("_m3", "m³"),
    ("_mm", "mm"),
    ("_ms", "ms"),
    ("_m", "m"),
    ("_s", "s"),
];

/// Words that are written otherwise than they are spelt in keys.
const SPELT: &[(&str, &str)] = &[("lai", "LAI"), ("trv", "TRV"), ("lwa", "LWA")];

/// An axis: its keys without their tables, with their units.
pub(super) fn of_axis(name: &str) -> String {
    name.split(" + ").map(|key| joined(split(key))).collect::<Vec<_>>().join(" + ")
}

/// An output: `error.voxel.leaf_area_m2` is `voxel: leaf area`. An error has no unit, it is a share.
pub(super) fn of_output(name: &str) -> String {
    let is_error = name.starts_with("error.");
    let name = name.strip_prefix("error.").unwrap_or(name);
    let (what, unit) = split(name.rsplit('.').next().unwrap_or(name));
    let what = joined((what, unit.filter(|_| !is_error)));
    match name.rsplit_once('.') {
        Some((of, _)) => format!("{}: {what}", spelt(&of.replace(['.', '_'], " "))),
        None => what,
    }
}

fn split(key: &str) -> (String, Option<&'static str>) {
    let found = UNITS.iter().find_map(|(end, unit)| Some((key.strip_suffix(end)?, *unit)));
    let (what, unit) = found.map_or((key, None), |(what, unit)| (what, Some(unit)));
    (spelt(&what.replace('_', " ")), unit)
}

fn joined((what, unit): (String, Option<&str>)) -> String {
    unit.map_or(what.clone(), |unit| format!("{what}, {unit}"))
}

fn spelt(words: &str) -> String {
    let word = |word: &str| {
        SPELT.iter().find(|(key, _)| *key == word).map_or(word.to_owned(), |(_, own)| (*own).to_owned())
    };
    words.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_outputs_are_words_with_units() {
        for (key, words) in [
            ("speed_m_s", "speed, m/s"),
            ("height_m", "height, m"),
            ("resolution_deg + frequency_hz", "resolution, ° + frequency, Hz"),
            ("trees", "trees"),
            ("target_lai", "target LAI"),
        ] {
            assert_eq!(of_axis(key), words);
        }
        for (name, words) in [
            ("error.voxel.leaf_area_m2", "voxel: leaf area"),
            ("error.contact_raw.leaf_area_m2", "contact raw: leaf area"),
            ("truth.leaf_area_m2", "truth: leaf area, m²"),
            ("estimate.lai", "estimate: LAI"),
            ("estimate.scans", "estimate: scans"),
        ] {
            assert_eq!(of_output(name), words);
        }
    }
}
