use rowscan_canopy::calibration::{CanopyClass, EchoRule, Optics};

use super::*;

fn class() -> CalibrationClass {
    CalibrationClass {
        preset: "field".to_owned(),
        shady_threshold_percent: 101.0,
        growth_stage: "full leaf".to_owned(),
        tree_spacing_m: 1.5,
        scanner_model: "lms111".to_owned(),
        resolution_deg: 0.5,
        echo_rule: EchoRule::First,
        optics: Optics::Measured,
        distance_m: Some(2.0),
        height_m: None,
        yaw_deg: None,
        pitch_deg: None,
        line_spacing_m: None,
        crown_depth_m: None,
        voxel_m: None,
        canopy: CanopyClass::default(),
    }
}

/// Metres of a recording: raw contact, and the leaf area that is measured where leaves are `factor` times that.
fn pieces(recording: &str, raw_m2: &[f64], factor: f64) -> Vec<ScannedPiece> {
    let piece = |(place, raw_m2): (usize, &f64)| ScannedPiece {
        measured: MeasuredPiece {
            line: place as u64 + 2,
            recording: recording.to_owned(),
            from_m: place as f64,
            to_m: place as f64 + 1.0,
            leaf_area_m2: raw_m2 * factor,
        },
        sample: Sample {
            length_m: 1.0,
            impacted_total_area_m2: 1.0 + raw_m2 / 10.0,
            contact_leaf_area_m2: *raw_m2,
            leaf_area_m2: raw_m2 * factor,
            ..Sample::default()
        },
        before_m2: Some(raw_m2 * 0.9),
        row_raw_m2_per_m: 5.0,
    };
    raw_m2.iter().enumerate().map(piece).collect()
}

#[test]
fn a_row_whose_leaves_are_a_multiple_of_contact_gives_that_factor_and_no_error() {
    let found = calibrate(&pieces("a", &[4.0, 5.0, 6.0, 5.5], 1.25), &class(), Provenance::default());
    let found = found.expect("a calibration");
    assert_eq!(found.left_out, "piece");
    assert!((found.factor - 1.25).abs() < 1e-12 && found.after.rmse < 1e-12, "{found:?}");
    let before = found.before.expect("the rig had one");
    assert!((before.bias - (0.9 / 1.25 - 1.0)).abs() < 1e-12, "{before:?}");
    assert!((found.calibration.contact.k - 1.25).abs() < 1e-12);
    assert!(found.calibration.contact.k_sd.is_some_and(|sd| sd < 1e-12));
    assert_eq!((found.pieces_for_ten_percent, found.recordings_for_ten_percent), (Some(2), None));
}

/// Pieces of one row agree with each other and tell nothing of the next row: a fit that has seen the row looks better than it is.
#[test]
fn rows_with_factors_of_their_own_are_left_out_whole() {
    let mut all = Vec::new();
    for (name, factor) in [("a", 1.0), ("b", 1.2), ("c", 1.1)] {
        all.extend(pieces(name, &[4.0, 5.0, 6.0, 5.5], factor));
    }
    let found = calibrate(&all, &class(), Provenance::default()).expect("a calibration");
    assert_eq!(found.left_out, "recording");
    assert!((found.factor - 1.1).abs() < 1e-9, "{}", found.factor);
    // Without its own row, a is estimated with 1.15 and b with 1.05.
    assert!((found.pieces[0].left_out_m2 - 4.0 * 1.15).abs() < 1e-9, "{:?}", found.pieces[0]);
    assert!((found.pieces[4].left_out_m2 - 4.0 * 1.05).abs() < 1e-9, "{:?}", found.pieces[4]);
    // Three rows, not twelve pieces, say how well the factor is known: it may be off by as much as rows differ.
    let half = (found.factor_interval[1] / found.factor_interval[0] - 1.0) / 2.0;
    assert!(half > 0.25, "{:?}", found.factor_interval);
    // So it is rows that are planned for.
    assert_eq!(found.pieces_for_ten_percent, None, "more pieces of the same rows help little");
    let rows = found.recordings_for_ten_percent.expect("they scatter more");
    assert!(rows > 3 && rows < 20, "{rows}");
}

/// Areas in dm², or of other pieces.
#[test]
fn areas_of_another_unit_are_refused() {
    for factor in [100.0, 0.01] {
        let found = calibrate(&pieces("a", &[4.0, 5.0, 6.0, 5.5], factor), &class(), Provenance::default());
        let why = found.expect_err("refused").to_string();
        assert!(why.contains("expected 0.1 to 10 times"), "{why}");
    }
}

/// Pieces that are alike tell no law, and stand closer than their row: what lies beyond the row's own density is beyond what is known.
#[test]
fn a_row_denser_than_those_of_pieces_that_are_alike_is_not_well_known() {
    let mut alike = pieces("a", &[6.0, 6.4, 5.9, 6.2, 6.1, 6.3], 1.0);
    for (place, piece) in alike.iter_mut().enumerate() {
        let off = [0.1, -0.1][place % 2];
        piece.measured.leaf_area_m2 = 6.2 * (1.0 + off);
        piece.sample.leaf_area_m2 = piece.measured.leaf_area_m2;
        piece.sample.spot_relative_sd = 0.12;
    }
    let contact =
        calibrate(&alike, &class(), Provenance::default()).expect("a calibration").calibration.contact;
    assert!(contact.quality.r2 < 0.5, "{contact:?}");
    assert_eq!(contact.density_sd(5.0), 0.0, "the row's own");
    // The mean of the pieces is a fifth denser than their row.
    assert!(contact.density_sd(6.15) > 0.2, "{}", contact.density_sd(6.15));
    assert!(contact.own_law(6.15).is_some_and(|shift| shift > 0.2), "{:?}", contact.own_law(6.15));
}

#[test]
fn three_pieces_are_too_few_and_pieces_without_scatter_no_calibration() {
    let few = calibrate(&pieces("a", &[4.0, 5.0, 6.0], 1.0), &class(), Provenance::default());
    assert!(matches!(few, Err(FieldError::TooFew { expected: 4, found: 3 })), "{few:?}");
    let alike = calibrate(&pieces("a", &[4.0; 5], 1.0), &class(), Provenance::default());
    assert!(matches!(alike, Err(FieldError::Fit(FitError::NoSpread { .. }))), "{alike:?}");
}
