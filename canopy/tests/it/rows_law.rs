//! The law of a calibration's own rows: how it is fitted, and how intervals reach to it.

use crate::calibration::{around, line_on, rows, scattered};
use crate::common::*;
use rowscan_canopy::calibration::{ContactScale, FittedRows};
use rowscan_canopy::{Calibration, Pipeline, RowClass, Sample};

/// The contact's law on ten rows of 4 to 8.5 m²/m raw, whose spot correction is off by so much.
pub(crate) fn contact_of(leaf_m2: &dyn Fn(usize, f64) -> f64, spot_relative_sd: f64) -> ContactScale {
    let row = |i: usize| {
        let x = 4.0 + 0.5 * i as f64;
        Sample {
            length_m: 2.0,
            impacted_total_area_m2: 2.0 * (1.0 + 0.1 * i as f64),
            contact_leaf_area_m2: 2.0 * x,
            leaf_area_m2: 2.0 * leaf_m2(i, x),
            spot_relative_sd,
            ..Sample::default()
        }
    };
    line_on(&(0..10).map(row).collect::<Vec<_>>()).contact
}

#[test]
fn an_exponent_that_is_not_applied_widens_the_interval_of_rows_off_the_mean() {
    let law = |_, x: f64| 0.3 * x.powf(1.9);
    let (rays, wide) = (contact_of(&law, 0.0), contact_of(&law, 0.3));
    assert!((rays.p - 1.9).abs() < 1e-9 && wide.p == 1.0, "{rays:?} {wide:?}");
    let rows = wide.fitted.unwrap();
    assert!((rows.exponent - 1.9).abs() < 1e-9, "{rows:?}");
    assert!(rays.density_sd(4.0) < 1e-9 && rays.own_law(4.0).is_none_or(|off| off.abs() < 1e-9));
    // As far as the proportion is off the rows' own law; without canopy nothing is.
    for (x, least) in [(4.0, 0.3), (rows.mean_m2_per_m, 0.05), (8.5, 0.15)] {
        let off = (0.3 * x.powf(1.9) / (wide.k * x)).ln();
        let own_law = wide.own_law(x).unwrap();
        assert!((own_law - off).abs() < 1e-9 && off.abs() > least, "{x}: {off}");
        assert!((own_law > 0.0) == (x > rows.mean_m2_per_m * 1.01), "a dense row may hold more: {x} {off}");
    }
    assert_eq!([0.0, f64::NAN].map(|x| (wide.density_sd(x), wide.own_law(x))), [(0.0, None); 2]);
    // Scatter makes an exponent below 1 of rows that are alike, and files of older versions know of none.
    assert_eq!(contact_of(&|_, x| 2.0 * x.powf(0.7), 0.0).own_law(8.5), None);
    assert_eq!(ContactScale { fitted: None, ..wide }.own_law(8.5), None);
    // Beyond the fitted rows nobody knows the law, the less the farther; rows of one density tell none at all.
    let beyond = [2.0, 1.0, 17.0, 34.0].map(|x| rays.density_sd(x));
    let expected = [2.0_f64, 4.0, 2.0, 4.0].map(f64::ln);
    assert!(
        beyond.iter().zip(expected).all(|(found, least)| (found / least - 1.0).abs() < 0.6),
        "{beyond:?}"
    );
    assert!(beyond[0] < beyond[1] && beyond[2] < beyond[3]);
    let alike = contact_of(&|i, x| 5.0 + 0.01 * x + [0.3, -0.3][i % 2], 0.0);
    let mean = alike.fitted.unwrap().mean_m2_per_m;
    assert!(alike.quality.r2 < 0.5 && alike.density_sd(mean) < 1e-9, "{alike:?}");
    assert_eq!(alike.fitted.unwrap().exponent, 1.3, "what other rows have, by rays");
    let [thin, dense] = [0.8, 1.25].map(|off| alike.own_law(off * mean).unwrap());
    assert!((dense - thin - 0.3 * (1.25_f64 / 0.8).ln()).abs() < 1e-9, "{thin} {dense}");
    assert!([0.8, 1.25].iter().all(|off| (alike.density_sd(off * mean) - 1.25_f64.ln()).abs() < 1e-9));

    // In an estimate it stands beside the other parts.
    let (impacted, contact) = hedge_per_metre();
    let mut calibration = around(impacted, contact);
    let told = |calibration: &Calibration| {
        let pipeline = Pipeline::new(Some(&orchard_rig()), 0, Some(calibration.clone())).unwrap();
        let mut pipeline =
            pipeline.of_class(RowClass { preset: Some("hedge".into()), ..RowClass::default() });
        hedge(600).iter().for_each(|scan| pipeline.push(scan));
        let found = pipeline.finish();
        let [low, high] = found.leaf.interval_m2.unwrap();
        let leaf_m2 = found.leaf.areas.best_m2().ok();
        let sds = [leaf_m2.unwrap() / low, high / leaf_m2.unwrap()].map(|ratio| ratio.ln() / 1.96);
        (found.leaf.uncertainty.unwrap(), leaf_m2, sds)
    };
    calibration.contact.fitted = None;
    let (found, leaf_m2, narrow) = told(&calibration);
    assert_eq!((found.density, found.own_law), (Some(0.0), None));
    let mean_m2_per_m = 2.0 * contact;
    let mean_leaf_area_m2_per_m = calibration.contact.k * mean_m2_per_m;
    calibration.contact.fitted = Some(FittedRows {
        mean_m2_per_m,
        mean_leaf_area_m2_per_m,
        exponent: 1.9,
        scatter: None,
        row_m: None,
    });
    let (parts, same_m2, wide) = told(&calibration);
    let own_law = parts.own_law.unwrap();
    assert_eq!((same_m2, parts.density), (leaf_m2, Some(0.0)), "the estimate itself stays");
    // Thinner than the fitted rows: by their own law it holds less, and errors of the raw leaf area, of classes here, count by its exponent.
    assert!(own_law < -0.3, "{own_law}");
    let weighs = parts.own_law_weighs.unwrap();
    assert!((weighs - 1.9 / calibration.contact.p).abs() < 1e-9, "{weighs}");
    let (factor, of_raw) = (parts.calibration.unwrap(), parts.between_class.unwrap());
    let ends = |rows: f64| {
        let [told, own] = [1.0, weighs].map(|weighs| 1.96 * rows.hypot(factor).hypot(weighs * of_raw));
        [told.max(own - own_law), told.max(own + own_law)].map(|end| end / 1.96)
    };
    let are = |sds: [f64; 2], rows: f64| sds.iter().zip(ends(rows)).all(|(sd, end)| (sd - end).abs() < 1e-3);
    let sampling = parts.sampling.unwrap();
    assert!(sampling < 0.2 && are(wide, sampling), "{wide:?} {:?}", ends(sampling));
    assert!(wide[0] > 2.0 * narrow[0] && wide[1] > narrow[1], "{wide:?} {narrow:?}");
    // What the rows scatter stands for the sampling where it is larger.
    for (scatter, rows) in [(0.0, sampling), (sampling / 2.0, sampling), (0.2, 0.2)] {
        calibration.contact.fitted.as_mut().unwrap().scatter = Some(scatter);
        let (parts, same_m2, sd) = told(&calibration);
        assert_eq!((parts.rows, same_m2), (Some(scatter), leaf_m2));
        assert!(are(sd, rows), "{scatter}: {sd:?} {:?}", ends(rows));
    }
}

/// Rows about a power law by this much: a fit finds how much, and a file without it is read as before.
#[test]
fn a_fit_tells_what_its_rows_scatter_about_their_own_law() {
    let of = |calibration: &Calibration| calibration.contact.scatter_sd(1000.0);
    assert!(of(&line_on(&rows(|i| 3.7 * i.powf(1.5)))).is_some_and(|sd| sd < 1e-9));
    // Contact is of the unscattered law: ln of the factors about the line through them, by brute force.
    let found = of(&line_on(&scattered())).unwrap();
    let x: Vec<f64> =
        rows(|i| 3.0 * i.powf(1.4)).iter().map(|s| (s.contact_leaf_area_m2 / s.length_m).ln()).collect();
    let y: Vec<f64> = scattered().iter().map(|s| (s.leaf_area_m2 / s.length_m).ln()).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mx, my) = (mean(&x), mean(&y));
    let sxx: f64 = x.iter().map(|x| (x - mx).powi(2)).sum();
    let sxy: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
    let syy: f64 = y.iter().map(|y| (y - my).powi(2)).sum();
    // Leaf areas were chosen and raw ones scatter: the line of x on y, turned round.
    let exponent = syy / sxy;
    let fitted = line_on(&scattered()).contact.fitted.unwrap();
    assert!((fitted.exponent - exponent).abs() < 1e-9 && exponent > sxy / sxx);
    let expected = ((syy - 2.0 * exponent * sxy + exponent * exponent * sxx) / 4.0).sqrt();
    assert!((found - expected).abs() < 1e-9 && found > 0.05, "{found} {expected}");
    // A row of a quarter of their length scatters twice as much, a longer one not less.
    let row_m = fitted.row_m.unwrap();
    let of_length = |times: f64| line_on(&scattered()).contact.scatter_sd(times * row_m).unwrap();
    assert!((of_length(0.25) - 2.0 * found).abs() < 1e-9 && of_length(4.0) == found);
    type Spoil = fn(&mut FittedRows);
    let spoils: [(&str, Spoil); 2] =
        [("scatter", |rows| rows.scatter = Some(-0.1)), ("row_m", |rows| rows.row_m = Some(0.0))];
    for (key, spoil) in spoils {
        let mut bad = line_on(&scattered());
        spoil(bad.contact.fitted.as_mut().unwrap());
        assert!(bad.validate().is_err_and(|why| why.to_string().contains(&format!("contact.fitted.{key}"))));
    }
}
