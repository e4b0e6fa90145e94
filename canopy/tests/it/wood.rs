//! Wood that a calibration takes out of what beams meet.

use rowscan_canopy::calibration::{CalibrationError, CanopyClass, ContactScale, Wood};
use rowscan_canopy::{Calibration, FitError, Pipeline, RowClass, Sample, Withheld, fit};

use crate::common::*;

/// Wood of the rows below, half of its surface a metre, m²/m.
const WOOD_M2_PER_M: f64 = 0.8;

/// Rows of these leaf areas a metre: what is met is their leaves and half of their wood's surface, times `met`.
fn rows(leaf_m2_per_m: &[f64], met: f64) -> Vec<Sample> {
    let row = |(i, leaf): (usize, &f64)| {
        let length_m = 10.0 + i as f64;
        Sample {
            length_m,
            impacted_total_area_m2: 0.3 * leaf * length_m,
            contact_leaf_area_m2: met * (leaf + WOOD_M2_PER_M) * length_m,
            leaf_area_m2: leaf * length_m,
            wood_area_m2: Some(2.0 * WOOD_M2_PER_M * length_m),
            ..Sample::default()
        }
    };
    leaf_m2_per_m.iter().enumerate().map(row).collect()
}

fn without_wood(rows: &[Sample]) -> Vec<Sample> {
    rows.iter().map(|row| Sample { wood_area_m2: None, ..*row }).collect()
}

fn contact_of(rows: &[Sample]) -> ContactScale {
    fit(rows, class(), provenance()).unwrap().contact
}

#[test]
fn rows_of_any_density_have_their_leaves_where_their_wood_is_taken_out() {
    let fitted = [2.0, 4.0, 6.0, 8.0];
    let told = contact_of(&rows(&fitted, 1.0));
    assert!((told.k - 1.0).abs() < 1e-9 && told.p == 1.0, "{told:?}");
    let wood = told.wood.unwrap();
    assert!((wood.m2_per_m - WOOD_M2_PER_M).abs() < 1e-9 && wood.sd_m2_per_m < 1e-9, "{wood:?}");
    let untold = contact_of(&without_wood(&rows(&fitted, 1.0)));
    assert_eq!(untold.wood, None);
    // Denser and thinner than what was fitted, too.
    for leaf in [1.0, 2.0, 5.0, 8.0, 12.0] {
        let raw = leaf + WOOD_M2_PER_M;
        assert!(relative(told.factor(raw) * raw, leaf) < 1e-9, "{leaf}");
    }
    // The wrong twin, wood as a part of the law: what is thinner than the fitted rows has leaves for its wood.
    let thin = 1.0 + WOOD_M2_PER_M;
    assert!(relative(untold.factor(thin) * thin, 1.0) > 0.2, "{untold:?}");
}

#[test]
fn an_error_of_what_was_met_is_a_larger_one_of_the_leaves_and_wood_has_one_of_its_own() {
    let scale = contact_of(&rows(&[1.0, 2.0, 3.0], 1.0));
    let leaf = |raw: f64| scale.factor(raw) * raw;
    for raw in [1.8, 2.5, 3.8] {
        let step = 1e-6;
        let slope = (leaf(raw * (1.0 + step)) / leaf(raw)).ln() / step;
        assert!((scale.amplification(raw) - slope).abs() < 1e-3, "{raw}: {slope}");
        assert!((scale.leafy_share(raw) - (raw - WOOD_M2_PER_M) / raw).abs() < 1e-9);
    }
    let uneven = ContactScale { wood: Some(Wood { m2_per_m: 0.8, sd_m2_per_m: 0.1 }), ..scale };
    // A tenth of a square metre of wood, of two of leaves.
    assert!((uneven.wood_sd(2.8).unwrap() - 0.05).abs() < 1e-9);
    assert_eq!(ContactScale { wood: None, ..scale }.wood_sd(2.8), None);
    // Less than the wood is no leaf, and never less than none.
    assert_eq!((scale.factor(0.5), scale.leafy_share(0.5), scale.leafy_share(0.0)), (0.0, 0.0, 1.0));
}

#[test]
fn wood_that_rows_do_not_have_or_do_not_all_tell_is_refused() {
    let good = rows(&[1.0, 2.0, 3.0], 1.0);
    let refused = |change: &dyn Fn(&mut Sample)| {
        let mut rows = good.clone();
        change(&mut rows[1]);
        fit(&rows, class(), provenance()).unwrap_err()
    };
    assert_eq!(refused(&|row| row.wood_area_m2 = None), FitError::WoodOfSome { index: 1 });
    for bad in [0.0, -1.0, f64::NAN] {
        let told = refused(&|row| row.wood_area_m2 = Some(bad));
        assert!(matches!(told, FitError::BadSample { index: 1, key: "wood_area_m2", .. }), "{told}");
    }
    let bare = refused(&|row| row.contact_leaf_area_m2 = 0.5 * row.length_m);
    assert!(matches!(bare, FitError::AllWood { index: 1, .. }), "{bare}");
    assert!(bare.to_string().contains("0.80 m²/m") && bare.to_string().contains("0.50 m²/m"), "{bare}");
}

/// A calibration around the hedge, of whose contact this share is wood.
fn hedge_calibration(wood_share: f64) -> Calibration {
    let (impacted, contact) = hedge_per_metre();
    let row = |f: f64| Sample {
        length_m: 1.0,
        impacted_total_area_m2: f * impacted,
        contact_leaf_area_m2: f * contact,
        leaf_area_m2: (f - wood_share) * contact,
        wood_area_m2: Some(2.0 * wood_share * contact),
        ..Sample::default()
    };
    fit(&[0.9, 1.0, 1.1].map(row), class(), provenance()).unwrap()
}

#[test]
fn a_row_that_is_mostly_wood_has_no_leaf_area_and_pieces_add_up_to_a_row_that_is_not() {
    let told = |calibration: &Calibration| {
        let mut pipeline = Pipeline::new(Some(&orchard_rig()), 0, Some(calibration.clone())).unwrap();
        hedge(225).iter().for_each(|scan| pipeline.push(scan));
        (pipeline.window(), pipeline.finish())
    };
    let (window, found) = told(&hedge_calibration(0.3));
    let (leaf, raw) = (found.leaf.areas.best_m2().unwrap(), found.leaf.areas.contact_raw_m2().unwrap());
    assert!(relative(leaf, 0.7 * raw) < 0.02, "{leaf} of {raw}");
    let pieces: f64 = found.slices.iter().map(|slice| slice.leaf.areas.best_m2().unwrap()).sum();
    assert!(relative(pieces, leaf) < 1e-9, "{pieces} for {leaf}");
    assert!(window.unwrap().leaf.is_ok());
    // The same row by a calibration whose wood is nearly all of it: null, with a word, on the bus too.
    let leafless = hedge_calibration(0.65);
    let (window, found) = told(&leafless);
    assert_eq!(found.leaf.areas.best_m2(), Err(Withheld::MostlyWood));
    assert_eq!(window.unwrap().leaf.unwrap_err(), Withheld::MostlyWood);
    assert!(found.warnings.iter().any(|warning| warning.code() == "mostly_wood"), "{:?}", found.warnings);
    assert!(found.leaf.areas.contact_m2().is_err() && found.impacted_total_area_m2 > Some(0.0));
    // What was met is the wood, for who wants to know how much there is.
    assert_eq!(found.leaf.areas.contact_raw_m2(), Ok(raw));
}

/// Without a calibration wood counts as leaf: of a row whose class is bare nothing is told, in a window neither.
#[test]
fn a_row_of_a_bare_class_has_no_leaf_area_without_a_calibration() {
    let told = |wood_share: f64| {
        let canopy = CanopyClass { wood_share: Some(wood_share), ..CanopyClass::default() };
        let pipeline = Pipeline::new(Some(&orchard_rig()), 0, None).unwrap();
        let mut pipeline = pipeline.of_class(RowClass { preset: None, canopy });
        hedge(225).iter().for_each(|scan| pipeline.push(scan));
        let window = pipeline.window().unwrap().leaf.map(|_| ());
        (window, pipeline.finish())
    };
    let (window, leafy) = told(0.59);
    assert!(window.is_ok() && leafy.leaf.areas.best_m2().is_ok());
    for wood_share in [0.61, 1.0] {
        let (window, bare) = told(wood_share);
        assert_eq!(window, Err(Withheld::MostlyWood));
        assert_eq!(bare.leaf.areas.best_m2(), Err(Withheld::MostlyWood));
        assert_eq!(bare.leaf.areas.contact_raw_m2(), leafy.leaf.areas.contact_raw_m2());
        let said = bare.warnings.iter().find(|warning| warning.code() == "mostly_wood").expect("a warning");
        assert!(said.to_string().contains("by its class"), "{said}");
    }
}

/// A class with more wood than the calibration's rows had is believed; one with as much is what the calibration was fitted on.
#[test]
fn a_row_of_a_bare_class_has_no_leaf_area_by_a_calibration_of_leafy_rows() {
    let told = |fitted: Option<f64>, wood_share: f64| {
        let mut calibration = hedge_calibration(0.3);
        calibration.class.canopy.wood_share = fitted;
        let canopy = CanopyClass { wood_share: Some(wood_share), ..CanopyClass::default() };
        let pipeline = Pipeline::new(Some(&orchard_rig()), 0, Some(calibration)).unwrap();
        let mut pipeline = pipeline.of_class(RowClass { preset: None, canopy });
        hedge(225).iter().for_each(|scan| pipeline.push(scan));
        let window = pipeline.window().unwrap().leaf.map(|_| ());
        let found = pipeline.finish();
        let said = found.warnings.iter().find(|warning| warning.code() == "mostly_wood");
        let by_class = said.map(|said| said.to_string().contains("by its class"));
        assert_eq!(window.err(), found.leaf.areas.best_m2().err(), "the bus tells what the file tells");
        (window, by_class)
    };
    let withheld = (Err(Withheld::MostlyWood), Some(true));
    for fitted in [None, Some(0.0), Some(0.12), Some(0.55)] {
        assert_eq!(told(fitted, 0.61), withheld, "{fitted:?}");
        assert_eq!(told(fitted, 1.0), withheld, "{fitted:?}");
        assert_eq!(told(fitted, 0.59), (Ok(()), None), "{fitted:?}");
    }
    assert_eq!(told(Some(0.62), 0.63), (Ok(()), None), "rows like those that were fitted");
}

/// A calibration that takes no wood out knows of its rows' class how much there was.
#[test]
fn a_row_without_leaves_is_told_from_a_thin_one_by_the_wood_of_the_class() {
    let (impacted, contact) = hedge_per_metre();
    let told = |wood_share: Option<f64>, leaf: f64| {
        let row = |f: f64| Sample {
            length_m: 1.0,
            impacted_total_area_m2: f * impacted,
            contact_leaf_area_m2: f * contact,
            leaf_area_m2: f * leaf * contact,
            ..Sample::default()
        };
        let mut class = class();
        class.canopy.wood_share = wood_share;
        let calibration = fit(&[0.9, 1.0, 1.1].map(row), class, provenance()).unwrap();
        let mut pipeline = Pipeline::new(Some(&orchard_rig()), 0, Some(calibration)).unwrap();
        hedge(225).iter().for_each(|scan| pipeline.push(scan));
        (pipeline.window().unwrap().leaf.is_ok(), pipeline.finish())
    };
    // Half of the wood's surface beside 0.35 of leaves: 0.65 of what was met, and 0.35.
    for (share, leaf, is_told) in
        [(Some(0.65), 0.35, false), (Some(0.5), 0.35, true), (Some(0.3), 0.7, true), (None, 0.35, true)]
    {
        let (on_the_bus, found) = told(share, leaf);
        assert_eq!(found.leaf.areas.best_m2().is_ok(), is_told, "{share:?}: {:?}", found.warnings);
        assert_eq!(on_the_bus, is_told, "{share:?}");
        assert_eq!(found.warnings.iter().any(|warning| warning.code() == "mostly_wood"), !is_told);
        assert!(found.leaf.areas.contact_raw_m2().is_ok());
    }
}

#[test]
fn a_file_keeps_its_wood_and_one_with_more_wood_than_rows_is_refused() {
    let calibration = hedge_calibration(0.3);
    let text = toml::to_string(&calibration).unwrap();
    assert!(text.contains("[contact.wood]"), "{text}");
    assert_eq!(toml::from_str::<Calibration>(&text).unwrap(), calibration);
    let wood = |m2_per_m| Some(Wood { m2_per_m, sd_m2_per_m: 0.0 });
    for (wood, key) in [
        (wood(calibration.contact.quality.low_m2_per_m), "contact.wood.m2_per_m"),
        (wood(-0.1), "contact.wood.m2_per_m"),
        (wood(f64::NAN), "contact.wood.m2_per_m"),
        (Some(Wood { m2_per_m: 0.1, sd_m2_per_m: -1.0 }), "contact.wood.sd_m2_per_m"),
    ] {
        let wrong =
            Calibration { contact: ContactScale { wood, ..calibration.contact }, ..calibration.clone() };
        let told = Pipeline::new(None, 0, Some(wrong)).unwrap_err().to_string();
        assert!(told.contains(key), "{told}");
    }
    let mostly = CalibrationError::MostlyWood { key: "contact.wood.m2_per_m", wood: 2.0, low: 1.5 };
    assert!(mostly.to_string().contains("begins at 1.5"), "{mostly}");
}
