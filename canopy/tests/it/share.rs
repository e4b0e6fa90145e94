//! Leaf area by the shares of spots, on slabs with a closed form whose beams are made of rays; and what becomes of remission that is not there.

use crate::common::slab::*;
use crate::common::*;
use rowscan_canopy::calibration::{self, CalibrationClass, CanopyClass, EchoRule, Provenance};
use rowscan_canopy::estimate::LeafAreaEstimator;
use rowscan_canopy::{
    Calibration, Estimate, Footprint, FrontWindow, LeafShape, Parameters, Pipeline, PipelineError,
    RemissionScale, Sample, Warning, Withheld, fit,
};
use rowscan_protocol::optics::{
    DAZZLED, Fact, FactoryEcho, FogFilter, Noise, NoiseShape, Optics, Pulse, RemissionCurve, Spot,
};
use rowscan_protocol::rig::{CardReading, EchoChoice, RemissionReading, Rig};
use rowscan_protocol::scan::{Echo, NO_ECHO, Scan};

/// Rays of a beam.
const RAYS: u32 = 12;
/// Returns of a beam closer than this are one echo, metres.
const MERGED_M: f64 = 1.0;

/// A scanner like an LMS1xx, with remission by this curve.
fn optics(remission: RemissionCurve) -> Optics {
    let fact = Fact::assumed;
    Optics {
        wavelength_nm: fact(905.0),
        spot: no_rims().spot,
        bend_deg: fact(0.0),
        pulse: Pulse { merged_m: fact(MERGED_M), apart_m: fact(2.0) },
        factory_echo: FactoryEcho::First,
        fog_filter: FogFilter::None,
        range_at_10_percent_m: fact(18.0),
        noise: Noise {
            sigma_mm: fact(8.0),
            weak_sigma_mm: fact(18.0),
            near_sigma_mm: fact(6.0),
            sheet_sigma_mm: fact(12.0),
            shape: NoiseShape::Normal,
            pattern_mm: fact(1.0),
            systematic_mm: fact(30.0),
            slant_mrad: fact(0.0),
        },
        near_field_m: fact(1.5),
        remission,
    }
}

fn logarithmic() -> Optics {
    optics(RemissionCurve::Logarithmic {
        digits_a_decade: Fact::assumed(60.0),
        sigma_digits: Fact::assumed(2.6),
    })
}

/// As a TiM's.
fn compressed() -> Optics {
    let fact = Fact::assumed;
    optics(RemissionCurve::Compressed { at_half: fact(13_000.0), exponent: fact(0.11), sigma: fact(0.01) })
}

fn model_scale() -> RemissionScale {
    RemissionScale::of(&logarithmic(), LeafShape::default(), FrontWindow::default()).unwrap()
}

/// What leaves send back that take this share of a spot, by the model's curve; digits.
fn digits(scale: &RemissionScale, range_m: f64, share: f64) -> f64 {
    scale.full_digits(range_m) + scale.digits_a_decade * share.log10()
}

/// Beams of rays through a turbid slab: the range is the mean of the first echo by power, and remission tells its power.
fn beams_of_rays(thick_m: f64, density: f64, lines: u32, seed: u64) -> Vec<Scan> {
    let mut random = Random(seed);
    let scale = model_scale();
    let mut told = Vec::new();
    let mut scans = drive(&rig(), lms111(), 50, lines, |_, theta| {
        let mut hits: Vec<f64> = (0..RAYS)
            .filter_map(|_| {
                let path_m = -(1.0 - random.unit()).ln() / (0.5 * density);
                chord(thick_m, theta)
                    .filter(|(near, far)| near + path_m < *far)
                    .map(|(near, _)| near + path_m)
            })
            .collect();
        hits.sort_by(f64::total_cmp);
        let (mut power, mut first, mut last) = (0.0, 0.0, f64::INFINITY);
        for range_m in hits {
            if range_m - last > MERGED_M {
                break;
            }
            let weight = 1.0 / (range_m * range_m);
            power += weight;
            first += weight * range_m;
            last = first / power;
        }
        if power > 0.0 {
            // 8 bits, rounded to a digit.
            let share = power * last * last / f64::from(RAYS);
            told.push(digits(&scale, last, share).round().clamp(1.0, 254.0) as u16);
            last
        } else {
            told.push(0);
            NO_ECHO
        }
    });
    let mut told = told.into_iter();
    for scan in &mut scans {
        let Echo { range_m, remission } = &mut scan.echoes[0];
        // Beams that look away from the row have no remission here.
        *remission = (0..range_m.len())
            .map(|beam| {
                let (_, ahead) = theta(&rig().scanners[0], lms111(), beam);
                if ahead { told.next().unwrap() } else { 0 }
            })
            .collect();
    }
    scans
}

/// A spot so small that leaves have no rims.
fn no_rims() -> Footprint {
    Footprint {
        spot: Spot {
            exit_mm: Fact::assumed(1e-3),
            divergence_mrad: Fact::assumed(0.0),
            sweep_mrad: Fact::assumed(0.0),
            effective: Fact::assumed(0.9),
        },
        least_power: 0.0,
        least_share: 0.0,
        least_share_sd: 0.0,
        leaf: LeafShape::default(),
        echo: Some(EchoChoice::First),
        merged_m: MERGED_M,
        clumping: 1.0,
        clump_m: f64::INFINITY,
        law: None,
    }
}

fn reading() -> Parameters {
    Parameters { footprint: Some(no_rims()), remission: Some(model_scale()), ..parameters() }
}

fn estimated(parameters: Parameters, calibration: Option<Calibration>, scans: &[Scan]) -> Estimate {
    let mut pipeline = Pipeline::with_parameters(Some(&rig()), 0, calibration, parameters).unwrap();
    scans.iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

#[test]
fn shares_see_what_rays_see_whatever_a_beam_holds() {
    for (thick_m, density) in [(0.5, 1.0), (1.0, 0.5), (1.0, 1.0), (0.5, 2.0)] {
        let scans = beams_of_rays(thick_m, density, 300, 7);
        let found = estimated(reading(), None, &scans);
        let truth = density * thick_m * HIGH_M * found.scanned_m.unwrap();
        let (share, contact) = (
            found.leaf.areas.share_raw_m2().ok().unwrap() / truth,
            found.leaf.areas.contact_raw_m2().ok().unwrap() / truth,
        );
        assert!((share - 1.0).abs() < 0.1, "{thick_m} m of {density}: {share}");
        assert!(contact > 2.0, "any of {RAYS} rays is a hit: {contact}");
    }
}

#[test]
fn a_beam_that_is_all_rays_or_none_is_a_ray() {
    // Whole leaves at the power of their mean: shares are 1, and the estimate that of contact frequency.
    let mut scans = turbid(1.0, 1.0, 200, 3);
    let scale = model_scale();
    for scan in &mut scans {
        let Echo { range_m, remission } = &mut scan.echoes[0];
        let of = |range_m: &f64| {
            if range_m.is_finite() { (257.0 * digits(&scale, *range_m, 1.0)).round() as u16 } else { 0 }
        };
        *remission = range_m.iter().map(of).collect();
    }
    let found = estimated(reading(), None, &scans);
    let (share, contact) =
        (found.leaf.areas.share_raw_m2().ok().unwrap(), found.leaf.areas.contact_raw_m2().ok().unwrap());
    // Ranges are told apart by 0.1 m; the contact frequency takes the bias of few beams off.
    assert!(relative(share, contact) < 0.03, "{share} {contact}");
}

#[test]
fn a_card_that_was_measured_is_as_good_as_the_curve_it_was_measured_on() {
    let scale = model_scale();
    let leaf = LeafShape::default();
    // A card of half the light is brighter than leaves.
    let brighter = (0.5 / (leaf.reflectance * leaf.cosine)).log10() * scale.digits_a_decade;
    let card = RemissionReading::Card {
        reflectance: 0.5,
        digits_a_decade: scale.digits_a_decade,
        readings: [0.5, 1.5, 3.0, 6.0].map(|r| [r, scale.full_digits(r) + brighter]).to_vec(),
        power_sd: 0.1,
        others: Vec::new(),
    };
    let measured = RemissionScale::read(&card, &logarithmic(), leaf, FrontWindow::default()).unwrap();
    for range_m in [0.4, 1.0, 1.7, 2.5, 5.0] {
        assert!((measured.full_digits(range_m) - scale.full_digits(range_m)).abs() < 1e-9, "{range_m}");
    }
    let scans = beams_of_rays(1.0, 1.0, 100, 5);
    let by_card = estimated(Parameters { remission: Some(measured), ..reading() }, None, &scans);
    let by_model = estimated(reading(), None, &scans);
    assert!(
        relative(
            by_card.leaf.areas.share_raw_m2().ok().unwrap(),
            by_model.leaf.areas.share_raw_m2().ok().unwrap()
        ) < 1e-3
    );
    let assumed = |found: &Estimate| found.warnings.contains(&Warning::RemissionAssumed);
    assert!(assumed(&by_model) && !assumed(&by_card));
}

#[test]
fn cards_and_models_that_tell_no_power_are_refused() {
    let leaf = LeafShape::default();
    let tim = &compressed();
    let of = |reading: RemissionReading, optics: &Optics| {
        RemissionScale::read(&reading, optics, leaf, FrontWindow::default()).unwrap_err()
    };
    assert_eq!(of(RemissionReading::Model, tim), PipelineError::RemissionTellsNoPower);
    let lms1xx = logarithmic();
    let read = |reading| of(reading, &lms1xx);
    let card = |reflectance, readings: Vec<[f64; 2]>| RemissionReading::Card {
        reflectance,
        digits_a_decade: 60.0,
        readings,
        power_sd: 0.1,
        others: Vec::new(),
    };
    assert!(matches!(read(card(0.5, Vec::new())), PipelineError::CardReadings { found: 0, .. }));
    assert!(matches!(
        read(card(0.5, vec![[1.0, 9.0]; 33])),
        PipelineError::CardReadings { found: 33, most: 32 }
    ));
    assert!(matches!(read(card(0.5, vec![[2.0, 9.0], [1.0, 9.0]])), PipelineError::CardOrder { .. }));
    assert!(matches!(read(card(50.0, vec![[2.0, 9.0]])), PipelineError::OutOfRange { .. }));
    let good = card(0.5, vec![[2.0, 190.0]]);
    assert!(RemissionScale::read(&good, &logarithmic(), leaf, FrontWindow::default()).is_ok());
    assert_eq!(of(good, tim), PipelineError::RemissionTellsNoPower, "its digits are no logarithm");
}

/// A calibration on rows like the slab, `share` by a factor of 1.1.
fn fitted(found: &Estimate) -> Calibration {
    let length_m = found.canopy_m.unwrap();
    let samples: Vec<Sample> = (0..10)
        .map(|row| 0.8 + 0.05 * f64::from(row))
        .map(|f| Sample {
            length_m,
            impacted_total_area_m2: f * found.impacted_total_area_m2.unwrap(),
            contact_leaf_area_m2: f * found.leaf.areas.contact_raw_m2().ok().unwrap(),
            leaf_area_m2: 1.1 * f * found.leaf.areas.share_raw_m2().ok().unwrap(),
            share_leaf_area_m2: found.leaf.areas.share_raw_m2().ok().map(|share_m2| f * share_m2),
            ..Sample::default()
        })
        .collect();
    let class = CalibrationClass {
        preset: "slab".into(),
        shady_threshold_percent: 101.0,
        growth_stage: "grown".into(),
        tree_spacing_m: 1.5,
        scanner_model: "lms111".into(),
        resolution_deg: 0.5,
        echo_rule: EchoRule::First,
        optics: calibration::Optics::Footprint,
        distance_m: Some(DISTANCE_M),
        height_m: None,
        yaw_deg: None,
        pitch_deg: None,
        line_spacing_m: None,
        crown_depth_m: None,
        voxel_m: None,
        canopy: CanopyClass::default(),
    };
    fit(&samples, class, Provenance { command: "a test".into(), seeds: vec![1] }).unwrap()
}

#[test]
fn with_remission_and_a_scale_the_leaf_area_is_by_shares_and_without_by_contact() {
    use rowscan_canopy::estimate::LeafAreaEstimator::{ContactCalibratedSpotCorrected, ShareCalibrated};
    let scans = beams_of_rays(1.0, 1.0, 150, 11);
    let raw = estimated(reading(), None, &scans);
    assert_ne!(raw.leaf.estimator, Some(ShareCalibrated), "no scale, no leaf area by shares");
    let calibration = fitted(&raw);
    let scale = calibration.share.unwrap();
    assert!((scale.k - 1.1).abs() < 1e-9 && scale.p == 1.0, "{scale:?}");
    let with = estimated(reading(), Some(calibration.clone()), &scans);
    assert_eq!(with.leaf.estimator, Some(ShareCalibrated));
    assert_eq!(with.leaf.areas.best_m2().ok(), with.leaf.areas.share_m2().ok());
    assert!(
        relative(with.leaf.areas.best_m2().ok().unwrap(), 1.1 * raw.leaf.areas.share_raw_m2().ok().unwrap())
            < 1e-9
    );
    let of_trees: f64 = with.trees.iter().filter_map(|tree| tree.leaf.areas.best_m2().ok()).sum();
    assert!(relative(of_trees, with.leaf.areas.best_m2().ok().unwrap()) < 1e-9, "trees add up to the row");

    // One beam in ten lost its remission: too many to go by the rest.
    let mut silent = scans.clone();
    for scan in &mut silent {
        scan.echoes[0].remission.iter_mut().step_by(10).for_each(|remission| *remission = 0);
    }
    let without = estimated(reading(), Some(calibration.clone()), &silent);
    assert_eq!(without.leaf.estimator, Some(ContactCalibratedSpotCorrected));
    assert_eq!((without.leaf.areas.share_m2().ok(), without.leaf.areas.share_raw_m2().ok()), (None, None));
    let missing =
        |warning: &Warning| matches!(warning, Warning::RemissionMissing { hits, read } if read < hits);
    assert!(without.warnings.iter().any(missing), "{:?}", without.warnings);

    // A rig that does not read remission takes no notice of it.
    let unread = estimated(Parameters { remission: None, ..reading() }, Some(calibration), &scans);
    assert_eq!(unread.leaf.areas.best_m2().ok(), without.leaf.areas.best_m2().ok());
    assert_eq!(unread.leaf.areas.share_m2().ok(), None);
}

/// What an estimate of these scans through this scale says: its estimator, its leaf area over that of the fitted row, and its warnings' codes.
fn read_as(
    scale: RemissionScale,
    calibration: &Calibration,
    scans: &[Scan],
) -> (Option<LeafAreaEstimator>, Estimate, Vec<&'static str>) {
    let parameters = Parameters { remission: Some(scale), ..reading() };
    let found = estimated(parameters, Some(calibration.clone()), scans);
    let codes = found.warnings.iter().map(Warning::code).collect();
    (found.leaf.estimator, found, codes)
}

/// The scans as they come through a window that lets so much light pass, one way.
fn behind_window(scans: &[Scan], transmission: f64) -> Vec<Scan> {
    let lost = 2.0 * transmission.log10() * model_scale().digits_a_decade;
    let mut scans = scans.to_vec();
    for remission in scans.iter_mut().flat_map(|scan| &mut scan.echoes[0].remission) {
        if *remission > 0 {
            *remission = (f64::from(*remission) + lost).round().clamp(1.0, 254.0) as u16;
        }
    }
    scans
}

#[test]
fn shares_that_contact_does_not_bear_out_are_withheld_whatever_changed_the_power() {
    use rowscan_canopy::estimate::LeafAreaEstimator::{ContactCalibratedSpotCorrected, ShareCalibrated};
    let scans = beams_of_rays(1.0, 1.0, 150, 11);
    let calibration = fitted(&estimated(reading(), None, &scans));
    let (by, clean, codes) = read_as(model_scale(), &calibration, &scans);
    assert!(by == Some(ShareCalibrated) && !codes.contains(&"shares_disagree"), "{codes:?}");

    // Eight digits of sixty a decade: 0.858.
    let transmission = 10_f64.powf(-8.0 / 120.0);
    let dirty = behind_window(&scans, transmission);
    let (by, found, codes) = read_as(model_scale(), &calibration, &dirty);
    assert_eq!(by, Some(ContactCalibratedSpotCorrected));
    assert!(codes.contains(&"shares_disagree"), "{codes:?}");
    assert_eq!(found.leaf.areas.share_m2(), Err(Withheld::SharesDisagree));
    assert_eq!(found.leaf.areas.best_m2(), clean.leaf.areas.contact_m2(), "contact does not hang on power");
    // By shares it would have been 28 % too little.
    let raw = |found: &Estimate| found.leaf.areas.share_raw_m2().unwrap();
    assert!(raw(&found) < 0.8 * raw(&clean), "{} {}", raw(&found), raw(&clean));

    // Who knows the window says so, and gets shares again; how well it is known widens the interval.
    let window = FrontWindow { transmission, sd: 0.02 };
    let told = RemissionScale::of(&logarithmic(), LeafShape::default(), window).unwrap();
    let (by, found, codes) = read_as(told, &calibration, &dirty);
    assert!(by == Some(ShareCalibrated) && !codes.contains(&"shares_disagree"), "{codes:?}");
    assert!(relative(found.leaf.areas.best_m2().unwrap(), clean.leaf.areas.best_m2().unwrap()) < 0.01);
    let part = |found: &Estimate| found.leaf.uncertainty.unwrap().remission.unwrap();
    assert!(part(&found) > part(&clean), "{} {}", part(&found), part(&clean));

    // Brighter leaves than the rig says are found as well.
    let darker = LeafShape { reflectance: 0.35, ..LeafShape::default() };
    let misread = RemissionScale::of(&logarithmic(), darker, FrontWindow::default()).unwrap();
    assert!(read_as(misread, &calibration, &scans).2.contains(&"shares_disagree"));

    // A calibration that says nothing of it bears no witness.
    let (by, _, codes) = read_as(model_scale(), &Calibration { witness: None, ..calibration }, &scans);
    assert!(by == Some(ContactCalibratedSpotCorrected) && codes.contains(&"no_witness"), "{codes:?}");
}

#[test]
fn a_card_of_few_readings_gives_no_shares() {
    use rowscan_canopy::estimate::LeafAreaEstimator::{ContactCalibratedSpotCorrected, ShareCalibrated};
    let scans = beams_of_rays(1.0, 1.0, 150, 11);
    let calibration = fitted(&estimated(reading(), None, &scans));
    let leaf = LeafShape::default();
    let brighter = (0.5 / (leaf.reflectance * leaf.cosine)).log10() * model_scale().digits_a_decade;
    let card = |ranges_m: &[f64]| {
        let reading = RemissionReading::Card {
            reflectance: 0.5,
            digits_a_decade: model_scale().digits_a_decade,
            readings: ranges_m.iter().map(|r| [*r, model_scale().full_digits(*r) + brighter]).collect(),
            power_sd: 0.1,
            others: Vec::new(),
        };
        RemissionScale::read(&reading, &logarithmic(), leaf, FrontWindow::default()).unwrap()
    };
    let enough = [0.7, 0.9, 1.2, 1.5, 1.9, 2.5, 3.3, 4.5];
    assert_eq!(read_as(card(&enough), &calibration, &scans).0, Some(ShareCalibrated));
    let cards: [(&str, &[f64]); 4] = [
        ("three", &[1.0, 2.0, 4.0]),
        ("one less", &enough[1..]),
        ("two before the knee", &[1.0, 1.3, 1.7, 2.0, 2.5, 3.0, 3.5, 4.5]),
        ("far apart", &[0.7, 0.9, 1.2, 1.9, 2.5, 3.3, 4.0, 6.1]),
    ];
    for (name, ranges_m) in cards {
        let (by, _, codes) = read_as(card(ranges_m), &calibration, &scans);
        assert!(
            by == Some(ContactCalibratedSpotCorrected) && codes.contains(&"card_too_short"),
            "{name}: {codes:?}"
        );
    }
}

/// Cards of other reflectances, read by a scanner whose digits go by a logarithm and by one whose digits go by the square root of power.
#[test]
fn other_cards_bear_the_logarithm_out_or_the_row_goes_by_contact() {
    use rowscan_canopy::estimate::LeafAreaEstimator::{ContactCalibratedSpotCorrected, ShareCalibrated};
    let scans = beams_of_rays(1.0, 1.0, 150, 11);
    let calibration = fitted(&estimated(reading(), None, &scans));
    let (scale, leaf) = (model_scale(), LeafShape::default());
    let of_card = |range_m: f64, reflectance: f64| {
        let brighter = (reflectance / (leaf.reflectance * leaf.cosine)).log10() * scale.digits_a_decade;
        scale.full_digits(range_m) + brighter
    };
    let read_with = |others: Vec<CardReading>| {
        let reading = RemissionReading::Card {
            reflectance: 0.5,
            digits_a_decade: scale.digits_a_decade,
            readings: [0.7, 0.9, 1.2, 1.5, 1.9, 2.5, 3.3, 4.5].map(|r| [r, of_card(r, 0.5)]).to_vec(),
            power_sd: 0.1,
            others,
        };
        RemissionScale::read(&reading, &logarithmic(), leaf, FrontWindow::default())
    };
    let others = |digits: &dyn Fn(f64, f64) -> f64| {
        let all =
            [0.1, 0.25, 0.9].into_iter().flat_map(|reflectance| [1.0, 2.0, 4.0].map(|r| (reflectance, r)));
        all.map(|(reflectance, range_m)| CardReading {
            reflectance,
            range_m,
            remission: digits(range_m, reflectance),
        })
        .collect()
    };
    let by = |others| read_as(read_with(others).unwrap(), &calibration, &scans);
    let (estimator, _, codes) = by(others(&of_card));
    assert!(estimator == Some(ShareCalibrated) && !codes.contains(&"card_law"), "{codes:?}");
    let (estimator, found, codes) =
        by(others(&|range_m, reflectance| of_card(range_m, 0.5) * (reflectance / 0.5).sqrt()));
    assert!(estimator == Some(ContactCalibratedSpotCorrected) && codes.contains(&"card_law"), "{codes:?}");
    assert_eq!(found.leaf.areas.share_m2(), Err(Withheld::CardLaw));

    // Cards that test nothing are refused: too few reflectances, a range that the first was not read at.
    let card = |reflectance, range_m| CardReading { reflectance, range_m, remission: 150.0 };
    assert_eq!(
        read_with(vec![card(0.1, 2.0), card(0.5, 2.0)]).unwrap_err(),
        PipelineError::Cards { found: 2 }
    );
    let far = read_with(vec![card(0.1, 2.0), card(0.9, 9.0)]).unwrap_err();
    assert!(matches!(far, PipelineError::OutOfRange { .. }), "{far}");
}

#[test]
fn a_dazzled_beam_is_unknown_and_neither_hit_nor_gap() {
    let scans = turbid(1.0, 1.0, 150, 9);
    let whole = estimated(parameters(), None, &scans);
    // Every third beam looks into the sun.
    let mut dazzled = scans;
    for scan in &mut dazzled {
        let Echo { range_m, remission } = &mut scan.echoes[0];
        *remission = vec![0; range_m.len()];
        for (range_m, remission) in range_m.iter_mut().zip(remission).step_by(3) {
            (*range_m, *remission) = (rowscan_protocol::scan::DAZZLED, DAZZLED);
        }
    }
    let any = Rig { max_excluded: 1.0, ..rig() };
    let mut pipeline = Pipeline::with_parameters(Some(&any), 0, None, parameters()).unwrap();
    dazzled.iter().for_each(|scan| pipeline.push(scan));
    let found = pipeline.finish();
    let of = |found: &Estimate| found.leaf.areas.contact_raw_m2().ok().unwrap() / found.scanned_m.unwrap();
    assert!(relative(of(&found), of(&whole)) < 0.02, "{} {}", of(&found), of(&whole));
    assert!(found.ranges.invalid > 0 && found.ranges.misses < whole.ranges.misses);
}
