//! Calibrations: fits on exact data, leave-one-out by brute force, files, and how estimates use them.

use crate::common::*;
use crate::rows_law::contact_of;
use rowscan_canopy::calibration::{
    CalibrationError, ClumpingBy, ContactScale, FitQuality, FittedRange, RegressionKind,
};
use rowscan_canopy::{
    Calibration, EdgeBy, Estimate, FitError, Parameters, Pipeline, Sample, Warning, Withheld, fit, shipped,
};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Orientation, Rig};
use rowscan_protocol::scan::NO_ECHO;

/// Rows of several lengths with a leaf area that is a function of the impacted area a metre.
pub(crate) fn rows(leaf_per_m: impl Fn(f64) -> f64) -> Vec<Sample> {
    [0.4, 0.7, 0.9, 1.3, 1.6, 2.2]
        .iter()
        .enumerate()
        .map(|(i, &impacted)| {
            let length_m = 10.0 + i as f64;
            Sample {
                length_m,
                impacted_total_area_m2: impacted * length_m,
                contact_leaf_area_m2: 1.25 * leaf_per_m(impacted) * length_m,
                leaf_area_m2: leaf_per_m(impacted) * length_m,
                ..Sample::default()
            }
        })
        .collect()
}

/// The same with a scatter that no curve follows.
pub(crate) fn scattered() -> Vec<Sample> {
    let mut samples = rows(|i| 3.0 * i.powf(1.4));
    for (sample, off) in samples.iter_mut().zip([1.2, 0.8, 1.1, 0.95, 1.07, 0.9]) {
        sample.leaf_area_m2 *= off;
    }
    samples
}

pub(crate) fn line_on(samples: &[Sample]) -> Calibration {
    fit(samples, class(), provenance()).unwrap()
}

#[test]
fn exact_data_give_their_coefficients_back() {
    let linear = line_on(&rows(|i| -1.5 + 6.0 * i + 2.0)).linear;
    assert!((linear.a_m2_per_m - 0.5).abs() < 1e-12 && (linear.b - 6.0).abs() < 1e-12, "{linear:?}");
    assert!(linear.quality.r2 > 1.0 - 1e-12 && linear.quality.loo_rmse_relative < 1e-12);

    let calibration = line_on(&rows(|i| 3.7 * i.powf(1.5)));
    let power = calibration.power;
    assert!((power.c - 3.7).abs() < 1e-12 && (power.p - 1.5).abs() < 1e-12, "{power:?}");
    assert!(power.quality.loo_rmse_relative < 1e-12);
    assert_eq!(calibration.best_regression(), RegressionKind::Power);
    assert!((calibration.contact.k - 0.8).abs() < 1e-12);
    assert_eq!((power.quality.n, power.quality.low_m2_per_m, power.quality.high_m2_per_m), (6, 0.4, 2.2));
    // A power law of exponent 1.5 is convex: a straight line through it has a negative intercept.
    assert!(calibration.linear.a_m2_per_m < 0.0);
}

#[test]
fn contact_bends_where_that_predicts_rows_left_out_better_and_not_for_scatter() {
    let of = |leaf_m2: &dyn Fn(usize, f64) -> f64| contact_of(leaf_m2, 0.0);
    let bent = of(&|_, x| 0.6 * x.powf(1.3));
    assert!((bent.k - 0.6).abs() < 1e-9 && (bent.p - 1.3).abs() < 1e-9, "{bent:?}");
    // Beyond the fitted range, 4 to 8.5 m²/m, the factor stays that of its end.
    assert!((bent.factor(6.0) - 0.6 * 6f64.powf(0.3)).abs() < 1e-9);
    assert_eq!((bent.factor(1.0), bent.factor(20.0)), (bent.factor(4.0), bent.factor(8.5)));
    assert!((bent.amplification(6.0) - 1.3).abs() < 1e-9);
    assert_eq!((bent.amplification(3.9), bent.amplification(8.6)), (1.0, 1.0));
    // An even scatter about a proportion is no bend, nor are rows that saturate the other way.
    let even = of(&|i, x| x * if i % 2 == 0 { 1.05 } else { 0.95 });
    assert_eq!((even.p, even.amplification(6.0)), (1.0, 1.0), "{even:?}");
    assert!((even.k - 1.0).abs() < 0.02, "{even:?}");
    assert_eq!(of(&|_, x| 2.0 * x.powf(0.7)).p, 1.0);
}

#[test]
fn a_bent_calibration_widens_the_sampling_error_and_old_files_are_proportions() {
    let (impacted, contact) = hedge_per_metre();
    let mut calibration = around(impacted, contact);
    assert_eq!(calibration.contact.p, 1.0);
    let text = toml::to_string(&calibration).unwrap();
    assert!(text.contains("\np = 1.0\n"), "{text}");
    assert_eq!(toml::from_str::<Calibration>(&text.replace("\np = 1.0\n", "\n")).unwrap(), calibration);

    // Long enough for blocks.
    let passed = |calibration: &Calibration| {
        let mut pipeline = Pipeline::new(Some(&orchard_rig()), 0, Some(calibration.clone())).unwrap();
        hedge(600).iter().for_each(|scan| pipeline.push(scan));
        pipeline.finish()
    };
    let sampling = |calibration: &Calibration| {
        let found = passed(calibration);
        (found.leaf.areas.best_m2().ok().unwrap(), found.leaf.uncertainty.unwrap().sampling.unwrap())
    };
    let found = passed(&calibration);
    let x = found.leaf.areas.contact_raw_m2().ok().unwrap() / found.canopy_m.unwrap();
    // The fitted range is about the hedge.
    let (low, high) = (0.5 * x, 2.0 * x);
    (calibration.contact.quality.low_m2_per_m, calibration.contact.quality.high_m2_per_m) = (low, high);
    let (_, straight) = sampling(&calibration);
    // Of other rows than its own.
    (calibration.contact.p, calibration.contact.fitted) = (1.5, None);
    let (bent_m2, bent) = sampling(&calibration);
    assert!(relative(bent, 1.5 * straight) < 1e-12, "{bent} {straight}");
    let raw_m2 = found.leaf.areas.contact_raw_m2().ok().unwrap();
    assert!(relative(bent_m2, calibration.contact.k * x.powf(0.5) * raw_m2) < 1e-12);
    // Trees have the row's factor: they add up to it.
    let trees_m2: f64 =
        passed(&calibration).trees.iter().filter_map(|tree| tree.leaf.areas.best_m2().ok()).sum();
    assert!(relative(trees_m2, bent_m2) < 1e-9, "{trees_m2} {bent_m2}");
    calibration.contact.quality.low_m2_per_m = 0.0;
    let refusal = Pipeline::new(None, 0, Some(calibration)).unwrap_err().to_string();
    assert!(refusal.contains("contact.quality.low_m2_per_m"), "{refusal}");
}

#[test]
fn r2_is_centred_and_uncentred() {
    let samples = scattered();
    let calibration = line_on(&samples);
    let y: Vec<f64> = samples.iter().map(|s| s.leaf_area_m2 / s.length_m).collect();
    let mean = y.iter().sum::<f64>() / 6.0;
    let sse: f64 = samples
        .iter()
        .zip(&y)
        .map(|(s, y)| (y - calibration.contact.k * s.contact_leaf_area_m2 / s.length_m).powi(2))
        .sum();
    let quality = calibration.contact.quality;
    assert!((quality.r2 - (1.0 - sse / y.iter().map(|y| (y - mean).powi(2)).sum::<f64>())).abs() < 1e-12);
    assert!((quality.r2_uncentred - (1.0 - sse / y.iter().map(|y| y * y).sum::<f64>())).abs() < 1e-12);
    assert!(quality.r2 < quality.r2_uncentred);
    assert!((calibration.training.mean_leaf_area_m2_per_m - mean).abs() < 1e-12);
}

#[test]
fn leave_one_out_is_what_refitting_gives() {
    let samples = scattered();
    let calibration = line_on(&samples);
    let mut squares = [0.0; 3];
    for i in 0..samples.len() {
        let mut others = samples.clone();
        let left = others.remove(i);
        let without = line_on(&others);
        let truth = left.leaf_area_m2 / left.length_m;
        let said = [
            without.linear.a_m2_per_m + without.linear.b * left.impacted_total_area_m2 / left.length_m,
            without.power.c * (left.impacted_total_area_m2 / left.length_m).powf(without.power.p),
            without.contact.k * left.contact_leaf_area_m2 / left.length_m,
        ];
        for (sum, said) in squares.iter_mut().zip(said) {
            *sum += (said - truth).powi(2);
        }
    }
    let mean = calibration.training.mean_leaf_area_m2_per_m;
    let found = [calibration.linear.quality, calibration.power.quality, calibration.contact.quality];
    for (square, quality) in squares.iter().zip(found) {
        let expected = (square / samples.len() as f64).sqrt() / mean;
        assert!(relative(quality.loo_rmse_relative, expected) < 1e-9, "{quality:?} {expected}");
    }
}

#[test]
fn a_sample_is_the_estimate_of_a_row_beside_its_truth() {
    let found = estimate(&orchard_rig(), &hedge(225));
    let sample = Sample::of(&found, 12.5, ClumpingBy::Constant).unwrap();
    // Tree 1 is missing: 3 m of 4.5 m hold trees.
    assert!((sample.length_m - 3.0).abs() < 1e-6, "{sample:?}");
    assert_eq!(Some(sample.impacted_total_area_m2), found.impacted_total_area_m2);
    assert_eq!(Some(sample.contact_leaf_area_m2), found.leaf.areas.contact_raw_m2().ok());
    assert_eq!(Sample::of(&Estimate::default(), 1.0, ClumpingBy::Scans), None);
}

#[test]
fn samples_that_fit_no_line_are_refused() {
    let samples = rows(|i| 3.0 * i);
    let refusal = |samples: &[Sample]| fit(samples, class(), provenance()).unwrap_err();
    assert_eq!(refusal(&samples[..2]), FitError::TooFew { expected: 3, found: 2 });
    let mut bad = samples.clone();
    bad[4].leaf_area_m2 = f64::NAN;
    assert!(matches!(refusal(&bad), FitError::BadSample { index: 4, key: "leaf_area_m2", .. }));
    let same: Vec<Sample> = vec![samples[0]; 5];
    assert!(matches!(refusal(&same), FitError::NoSpread { .. }));
    // One row alone decides the line.
    let mut lever = same;
    lever.push(samples[3]);
    assert_eq!(refusal(&lever), FitError::NoSpread { key: "impacted_total_area_m2" });
}

#[test]
fn a_file_without_units_or_class_is_refused_by_key() {
    let calibration = line_on(&scattered());
    let text = toml::to_string(&calibration).unwrap();
    assert_eq!(toml::from_str::<Calibration>(&text).unwrap(), calibration);
    let refusal = |text: String| toml::from_str::<Calibration>(&text).unwrap_err().to_string();
    assert!(refusal(text.replace("units = \"m2\"\n", "")).contains("units"));
    assert!(refusal(text.replace("\"m2\"", "\"dm2\"")).contains("dm2"));
    let classless = text.split("[class]").next().unwrap().to_owned()
        + "[provenance]"
        + text.split("[provenance]").nth(1).unwrap();
    assert!(refusal(classless).contains("class"));
    assert!(refusal(text.replace("scanner_model", "scaner_model")).contains("scaner_model"));

    let endless = Calibration { contact: ContactScale { k: f64::NAN, ..calibration.contact }, ..calibration };
    let message = Pipeline::new(None, 0, Some(endless)).unwrap_err().to_string();
    assert!(message.contains("contact.k"), "{message}");
}

fn calibrated(calibration: Calibration, rig: &Rig) -> Estimate {
    let mut pipeline = Pipeline::new(Some(rig), 0, Some(calibration)).unwrap();
    hedge(225).iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

/// No calibration makes a row known that no beam met: it is told where it is told without.
#[test]
fn a_calibration_tells_no_more_of_a_row_of_which_nothing_is_seen() {
    let (impacted, contact) = hedge_per_metre();
    let mut reasons = Vec::new();
    for tenths in 4..36 {
        let mount =
            Mount { orientation: Orientation::Up, height_m: f64::from(tenths) / 10.0, ..Mount::default() };
        let rig = Rig { scanners: vec![mount], ..orchard_rig() };
        for grid in [BeamGrid::spanning(0, 1_800_000, 5000), lms511(), lms111()] {
            let scans = drive(&rig, grid, 50, 151, |_, _| NO_ECHO);
            let told = |calibration: Option<Calibration>| {
                let mut pipeline = Pipeline::new(Some(&rig), 0, calibration).unwrap();
                scans.iter().for_each(|scan| pipeline.push(scan));
                pipeline.finish().leaf.areas.best_m2()
            };
            let raw = told(None);
            assert_eq!(told(Some(around(impacted, contact))), raw, "{tenths} {grid:?}");
            reasons.extend(raw.err());
        }
    }
    assert!(
        reasons.contains(&Withheld::MostlyUnseen) && reasons.contains(&Withheld::OutOfSight),
        "{reasons:?}"
    );
}

/// A calibration whose fitted ranges hold `impacted` and `contact` m² a metre times 0.8 to 1.2.
pub(crate) fn around(impacted: f64, contact: f64) -> Calibration {
    let samples: Vec<Sample> = [0.8, 0.95, 1.1, 1.2]
        .iter()
        .map(|f| Sample {
            length_m: 1.0,
            impacted_total_area_m2: f * impacted,
            contact_leaf_area_m2: f * contact,
            leaf_area_m2: 1.0 + 2.0 * f * impacted,
            ..Sample::default()
        })
        .collect();
    line_on(&samples)
}

#[test]
fn a_calibration_scales_the_contact_and_gives_no_leaves_to_a_gap() {
    let (impacted, contact) = hedge_per_metre();
    let calibration = around(impacted, contact);
    let k = calibration.contact.k;
    let found = calibrated(calibration, &orchard_rig());
    assert_eq!(found.leaf.regression, Some(RegressionKind::Linear));
    assert!(
        relative(
            found.leaf.areas.best_m2().ok().unwrap(),
            k * found.leaf.areas.contact_raw_m2().ok().unwrap()
        ) < 1e-12
    );
    assert_eq!(found.leaf.areas.best_m2().ok(), found.leaf.areas.contact_m2().ok());
    // `a` = 1 m²/m must not reach the gap.
    let gap = &found.trees[1];
    assert_eq!(
        (gap.leaf.areas.regression_m2().ok(), gap.leaf.areas.contact_m2().ok()),
        (Some(0.0), Some(0.0))
    );
    for tree in [&found.trees[0], &found.trees[2]] {
        let expected = tree.scanned_m + 2.0 * tree.impacted_total_area_m2;
        assert!(relative(tree.leaf.areas.regression_m2().ok().unwrap(), expected) < 1e-9);
    }
    // Metre 1 (y = 1..2) is half gap; metre 2 is all gap: the row's `a` counts the 3 m of 4.5 m that trees stand on.
    assert_eq!(found.slices[2].leaf.areas.regression_m2().ok(), Some(0.0));
    let canopy_m = found.trees[0].scanned_m + found.trees[2].scanned_m;
    let expected = canopy_m + 2.0 * found.impacted_total_area_m2.unwrap();
    assert!(relative(found.leaf.areas.regression_m2().ok().unwrap(), expected) < 1e-9);
    let codes: Vec<_> = found.warnings.iter().map(|w| w.code()).collect();
    assert!(!codes.contains(&"optics_unknown") && !codes.contains(&"uncalibrated"), "{codes:?}");
    assert_eq!(found.calibration.unwrap().preset, "spindle");
}

#[test]
fn without_the_width_of_the_beams_no_leaf_area_is_told_by_any_way() {
    let (impacted, contact) = hedge_per_metre();
    let rig = Rig { optics: None, ..orchard_rig() };
    for found in [calibrated(around(impacted, contact), &rig), estimate(&rig, &hedge(75))] {
        let areas = &found.leaf.areas;
        for known in
            [areas.best_m2(), areas.contact_m2(), areas.contact_raw_m2(), areas.regression_m2(), areas.lai()]
        {
            assert_eq!(known, Err(Withheld::OpticsUnknown));
        }
        assert!(found.trees.iter().all(|tree| tree.leaf.areas.best_m2().is_err()) && found.is_withheld());
        assert!(found.impacted_total_area_m2.is_some(), "what was hit is known");
        let told: Vec<_> = found.warnings.iter().filter(|w| w.code() == "optics_unknown").collect();
        assert!(
            told.len() == 1 && told[0].to_string().contains("optics = \"device\" below [rig]"),
            "{told:?}"
        );
    }
}

#[test]
fn a_regression_that_tells_less_than_half_of_what_rows_differ_by_is_withheld() {
    let (impacted, contact) = hedge_per_metre();
    let with = |scatter: f64| {
        let samples: Vec<Sample> = (0..12)
            .map(|row| (0.8 + 0.04 * f64::from(row), if row % 2 == 0 { scatter } else { -scatter }))
            .map(|(f, off)| Sample {
                length_m: 1.0,
                impacted_total_area_m2: f * impacted,
                contact_leaf_area_m2: f * contact,
                leaf_area_m2: 1.0 + 2.0 * f * impacted + off,
                ..Sample::default()
            })
            .collect();
        line_on(&samples)
    };
    let strong = calibrated(with(0.05 * impacted), &orchard_rig());
    assert!(strong.leaf.areas.regression_m2().is_ok(), "{:?}", strong.warnings);
    let weak = with(0.6 * impacted);
    let quality = weak.quality(weak.best_regression());
    assert!(quality.r2_left_out() < quality.r2 && quality.r2 < 0.5, "{quality:?}");
    let found = calibrated(weak, &orchard_rig());
    assert_eq!(found.leaf.areas.regression_m2(), Err(Withheld::WeakRegression));
    assert!(found.leaf.areas.best_m2().is_ok(), "contact is no regression on I_T");
    assert!(found.warnings.iter().any(|warning| warning.code() == "weak_regression"), "{:?}", found.warnings);
}

#[test]
fn the_left_out_share_of_scatter_follows_from_what_a_calibration_file_holds() {
    let (impacted, contact) = hedge_per_metre();
    let quality = around(impacted, contact).linear.quality;
    assert!((quality.r2_left_out() - 1.0).abs() < 1e-9, "a line without error");
    // Σ(L − mean)² is 4 % of ΣL²: so the scatter is 0.2041 of the mean, and errors of half of it leave three quarters.
    let scatter = (0.04_f64 / 0.96).sqrt();
    let half =
        FitQuality { r2: 0.8, r2_uncentred: 1.0 - 0.2 * 0.04, loo_rmse_relative: 0.5 * scatter, ..quality };
    assert!((half.r2_left_out() - 0.75).abs() < 1e-9, "{}", half.r2_left_out());
}

#[test]
fn a_gap_of_any_length_has_no_leaves_by_either_regression() {
    let calibration = around(1.0, 1.0);
    for kind in [RegressionKind::Linear, RegressionKind::Power] {
        assert_eq!(calibration.regression_m2(kind, 3.0, 0.0), 0.0);
        assert_eq!(calibration.regression_m2(kind, 0.0, 1.0), 0.0);
        assert!(calibration.regression_m2(kind, 3.0, 3.0) > 8.0);
    }
}

/// Smallest and largest impacted area a metre that the best regression was fitted on.
fn fitted_range(calibration: &Calibration) -> (f64, f64) {
    let quality = calibration.quality(calibration.best_regression());
    (quality.low_m2_per_m, quality.high_m2_per_m)
}

#[test]
fn outside_the_fitted_range_is_said_and_far_outside_withheld() {
    let (impacted, contact) = hedge_per_metre();
    let warnings = |found: &Estimate| found.warnings.iter().map(|w| w.code()).collect::<Vec<_>>();

    let inside = calibrated(around(impacted * 0.9, contact * 0.9), &orchard_rig());
    assert!(!warnings(&inside).contains(&"refused") && !warnings(&inside).contains(&"outside_fitted_range"));

    // The fitted range ends between the row's value and half of it: outside, and still told.
    let (_, high) = fitted_range(&around(impacted / 2.0, contact));
    assert!(high < impacted && impacted < 2.0 * high, "{high} {impacted}");
    let outside = calibrated(around(impacted / 2.0, contact), &orchard_rig());
    assert!(warnings(&outside).contains(&"outside_fitted_range"), "{:?}", warnings(&outside));
    assert!(!warnings(&outside).contains(&"refused"));
    assert!(outside.leaf.areas.regression_m2().ok().unwrap() > 0.0);

    let far = calibrated(around(impacted / 10.0, contact / 10.0), &orchard_rig());
    assert_eq!(
        (far.leaf.areas.regression_m2().ok(), far.leaf.areas.best_m2().ok(), far.leaf.areas.lai().ok()),
        (None, None, None)
    );
    assert_eq!(far.trees[0].leaf.areas.best_m2().ok(), None);
    assert!(far.leaf.areas.contact_raw_m2().ok().unwrap() > 0.0);
    assert!(warnings(&far).contains(&"refused") && warnings(&far).contains(&"trees_refused"));
    let null = far.slices.iter().filter(|slice| slice.leaf.areas.best_m2().is_err()).count();
    let told = far.warnings.iter().find_map(|warning| match warning {
        Warning::MetresRefused { metres, of, .. } => Some((*metres as usize, *of as usize)),
        _ => None,
    });
    assert_eq!(told, Some((null, far.slices.len())), "{:?}", far.warnings);
    assert!(null > 0 && !warnings(&outside).contains(&"metres_refused"), "{null}");

    // Thin rows: the line is withheld, the proportion is not.
    let thin = calibrated(around(impacted * 10.0, contact * 10.0), &orchard_rig());
    assert_eq!(thin.leaf.areas.regression_m2().ok(), None);
    assert!(thin.leaf.areas.best_m2().ok().unwrap() > 0.0);
}

#[test]
fn a_regressor_is_inside_outside_or_far_outside_the_fitted_range() {
    let calibration = line_on(&rows(|i| 3.7 * i.powf(1.5)));
    assert_eq!(fitted_range(&calibration), (0.4, 2.2));
    let places = [
        (0.19, FittedRange::FarOutside),
        (0.2, FittedRange::Outside),
        (0.39, FittedRange::Outside),
        (0.4, FittedRange::Inside),
        (2.2, FittedRange::Inside),
        (2.3, FittedRange::Outside),
        (4.4, FittedRange::Outside),
        (4.5, FittedRange::FarOutside),
    ];
    for (value, expected) in places {
        assert_eq!(calibration.power.quality.range(value), expected, "{value}");
    }
}

#[test]
fn regressions_are_evaluated_per_metre_of_row() {
    let mut calibration = line_on(&rows(|i| 3.7 * i.powf(1.5)));
    (calibration.power.c, calibration.power.p) = (3.0, 2.0);
    (calibration.linear.a_m2_per_m, calibration.linear.b) = (-1.0, 2.0);
    // 12 m² on 4 m of row: 3 m²/m; the power law gives 4 · 3 · 3², the line -4 + 24.
    assert!((calibration.regression_m2(RegressionKind::Power, 4.0, 12.0) - 108.0).abs() < 1e-12);
    assert!((calibration.regression_m2(RegressionKind::Linear, 4.0, 12.0) - 20.0).abs() < 1e-12);
    assert_eq!(calibration.regression_m2(RegressionKind::Linear, 4.0, 1.0), 0.0, "never negative");
}

#[test]
fn coefficients_that_are_no_positive_numbers_are_refused() {
    let sound = line_on(&rows(|i| 3.7 * i.powf(1.5)));
    for value in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let mut unsound = sound.clone();
        unsound.power.c = value;
        let error = unsound.validate().unwrap_err();
        assert!(matches!(error, CalibrationError::NotPositive { key: "power.c", .. }), "{error}");
    }
    let mut unsound = sound;
    unsound.linear.b = f64::NAN;
    let error = unsound.validate().unwrap_err();
    assert!(matches!(error, CalibrationError::NotFinite { key: "linear.b", .. }), "{error}");
}

/// No fit puts these values there: somebody changed the file. Each is named, and none is used.
#[test]
fn values_that_no_fit_gives_are_refused_in_every_shipped_calibration() {
    type Change = fn(&mut Calibration);
    let changes: [(&str, Change); 14] = [
        ("contact.k", |c| c.contact.k *= 10.0),
        ("contact.k", |c| c.contact.k /= 3.0),
        ("contact.k", |c| c.contact.fitted.iter_mut().for_each(|rows| rows.mean_m2_per_m *= 10.0)),
        ("contact.quality.n", |c| c.contact.quality.n = 0),
        ("contact.quality.r2", |c| c.contact.quality.r2 = 5.99),
        ("contact.quality.r2_uncentred", |c| c.contact.quality.r2_uncentred = f64::NAN),
        ("contact.quality.loo_rmse_relative", |c| c.contact.quality.loo_rmse_relative = -0.03),
        ("contact.quality.high_m2_per_m", |c| {
            let quality = &mut c.contact.quality;
            std::mem::swap(&mut quality.low_m2_per_m, &mut quality.high_m2_per_m);
        }),
        ("power.quality.high_m2_per_m", |c| c.power.quality.low_m2_per_m = 99.0),
        ("linear.quality.r2", |c| c.linear.quality.r2 = 1.2),
        ("class.canopy.wood_share", |c| c.class.canopy.wood_share = Some(11.05)),
        ("class.canopy.leaf_angle_deg", |c| c.class.canopy.leaf_angle_deg = Some(-3.0)),
        ("class.canopy.leaf_area_cm2", |c| c.class.canopy.leaf_area_cm2 = Some(-24.0)),
        ("class.crown_depth_m", |c| c.class.crown_depth_m = Some(0.0)),
    ];
    for name in shipped::names() {
        let sound: Calibration = toml::from_str(shipped::text(name).expect(name)).expect(name);
        assert_eq!(sound.validate(), Ok(()), "{name}");
        for (key, change) in changes {
            let mut changed = sound.clone();
            change(&mut changed);
            let why = changed.validate().expect_err(key).to_string();
            assert!(why.starts_with(&format!("calibration: {key} ")), "{name}: {why}");
        }
    }
}

#[test]
fn another_class_is_named() {
    let (impacted, contact) = hedge_per_metre();
    let rig = Rig { tree_spacing_m: Some(1.2), ..orchard_rig() };
    let found = calibrated(around(impacted, contact), &rig);
    let said: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
    assert!(said.iter().any(|w| w.contains("tree_spacing_m is 1.5, this is 1.2")), "{said:?}");
    assert!(!said.iter().any(|w| w.contains("scanner_model")), "{said:?}");
}

/// Contact goes by the edge of its voxels: a calibration says its own, another one widens the interval, and quite another tells nothing but what was met.
#[test]
fn voxels_of_another_edge_than_the_calibrations_are_told() {
    let (impacted, contact) = hedge_per_metre();
    let told = |edge_m: f64, calibrated_m: Option<f64>| {
        let mut calibration = around(impacted, contact);
        calibration.class.voxel_m = calibrated_m;
        let parameters = Parameters::default().with_voxel_edge(edge_m, EdgeBy::Given);
        let mut pipeline =
            Pipeline::with_parameters(Some(&orchard_rig()), 0, Some(calibration), parameters).unwrap();
        hedge(225).iter().for_each(|scan| pipeline.push(scan));
        let found = pipeline.finish();
        let words =
            found.warnings.iter().find(|warning| warning.code() == "voxel_edge").map(ToString::to_string);
        (words, found.leaf)
    };
    // In larger ones the hedge, which no beam passes, holds more leaves than any orchard.
    for edge_m in [0.1, 0.2, 0.25] {
        for calibrated_m in [None, Some(0.1), Some(0.2), Some(0.25), Some(0.3), Some(0.5)] {
            let (words, leaf) = told(edge_m, calibrated_m);
            let times = calibrated_m.map_or(1.0, |of: f64| (edge_m / of).max(of / edge_m));
            assert_eq!(words.is_some(), times > 1.0, "{edge_m} {calibrated_m:?}: {words:?}");
            assert!(words.iter().all(|text| text.contains("`voxel_edge_m`")), "{words:?}");
            let withheld = leaf.areas.best_m2().err() == Some(Withheld::VoxelEdge);
            assert_eq!(withheld, times > 1.6, "{edge_m} {calibrated_m:?}");
            assert!(!withheld || leaf.areas.contact_raw_m2().is_ok());
            let sd = leaf.uncertainty.and_then(|parts| parts.voxels);
            assert_eq!(
                sd.is_some_and(|sd| sd > 0.05),
                times > 1.0 && !withheld,
                "{edge_m} {calibrated_m:?}: {sd:?}"
            );
        }
    }
}

/// I_T goes with where a row is seen from; the same row by contact does not.
#[test]
fn a_regression_of_rows_that_were_seen_from_elsewhere_is_withheld() {
    let (impacted, contact) = hedge_per_metre();
    let mount = orchard_rig().scanners[0].clone();
    let (distance_m, height_m) = (mount.distance_m, mount.height_m);
    for (fitted, yaw_deg, is_told) in [
        ((None, None), 0.0, true),
        ((Some(distance_m), Some(height_m)), 0.0, true),
        ((Some(1.1 * distance_m), Some(height_m / 1.1)), 0.0, true),
        ((Some(1.2 * distance_m), None), 0.0, false),
        ((None, Some(height_m / 1.2)), 0.0, false),
        ((Some(distance_m), Some(height_m)), 10.0, false),
    ] {
        let mut calibration = around(impacted, contact);
        (calibration.class.distance_m, calibration.class.height_m) = fitted;
        let mut rig = orchard_rig();
        rig.scanners[0].yaw_deg = yaw_deg;
        let found = calibrated(calibration, &rig);
        let told = found.leaf.areas.regression_m2();
        assert_eq!(told.err(), (!is_told).then_some(Withheld::OtherMount), "{fitted:?} {yaw_deg}");
        let warned = found.warnings.iter().any(|warning| warning.code() == "other_mount");
        assert_eq!(warned, !is_told, "{fitted:?} {yaw_deg}: {:?}", found.warnings);
        assert!(found.leaf.areas.best_m2().is_ok(), "{:?}", found.warnings);
    }
    // One that was fitted with a yaw is told with that, and not upright.
    for (yaw_deg, is_told) in [(10.0, true), (0.0, false), (-10.0, false)] {
        let mut calibration = around(impacted, contact);
        calibration.class.yaw_deg = Some(10.0);
        let mut rig = orchard_rig();
        rig.scanners[0].yaw_deg = yaw_deg;
        let told = calibrated(calibration, &rig).leaf.areas.regression_m2();
        assert_eq!(told.err(), (!is_told).then_some(Withheld::OtherMount), "{yaw_deg}");
    }
}
