//! The models' periods and times of transmission beside those of real scanners.

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::by_name;
use rowscan_protocol::telegram::{LmdScandata, Telegram};

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation, and the correlations of each value with the one before it and the one before that.
fn sd_and_lags(values: &[f64]) -> (f64, [f64; 2]) {
    let mean = mean(values);
    let off: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let squares: f64 = off.iter().map(|off| off * off).sum();
    let lag = |lag: usize| off.iter().zip(&off[lag..]).map(|(a, b)| a * b).sum::<f64>() / squares;
    ((squares / (off.len() - 1) as f64).sqrt(), [lag(1), lag(2)])
}

/// Scans in their order, once each: one capture has some of them twice.
fn scans(recording: &crate::facts::Recording) -> Vec<LmdScandata> {
    let mut scans: Vec<LmdScandata> = recording
        .index
        .iter()
        .filter(|at| at.from_device && recording.payload(at).starts_with(b"sSN LMDscandata "))
        .map(|at| Telegram::parse(Dialect::B, recording.payload(at)).unwrap().args.decode().unwrap())
        .collect();
    scans.dedup_by_key(|scan| scan.scan_counter);
    scans
}

#[test]
fn periods_and_transmissions_of_the_models_are_the_recorded_ones() {
    for recording in crate::facts::recordings() {
        // The first period of the LMS111 belongs to its start.
        let (name, left_out) = match recording.name {
            "lms111_startup_first88" => ("lms111", 1),
            "lms511_20210302" => ("lms511", 0),
            "tim781s_20210125" => ("tim781s", 0),
            _ => continue,
        };
        let model = by_name(name).unwrap();
        let scans = scans(&recording);
        let periods: Vec<f64> = scans
            .iter()
            .zip(&scans[1..])
            .inspect(|(a, b)| assert_eq!(a.scan_counter + 1, b.scan_counter, "{name}"))
            .map(|(a, b)| f64::from(b.scan_time_us - a.scan_time_us))
            .skip(left_out)
            .collect();
        let nominal_us = 1e8 / f64::from(model.default_mode.frequency_centihz);
        let modelled_us = nominal_us * (1.0 + f64::from(model.period_ppm) * 1e-6);
        assert!((mean(&periods) - modelled_us).abs() < 1.0, "{name}: {} for {modelled_us}", mean(&periods));
        let (sd, lags) = sd_and_lags(&periods);
        let scatter = &model.scatter;
        assert!((sd - scatter.period_sd_us.value).abs() < 0.1, "{name}: {sd}");
        for (found, fact) in lags.iter().zip([scatter.lag_1, scatter.lag_2]) {
            assert!((found - fact.value).abs() < 0.01, "{name}: {found} for {fact}");
        }
        let within = scatter.period_within_us();
        assert!(periods.iter().all(|period| (period - modelled_us).abs() <= within), "{name}: {within}");

        let delays: Vec<f64> =
            scans.iter().map(|scan| f64::from(scan.transmit_time_us - scan.scan_time_us)).collect();
        let (found, (found_sd, _)) = (mean(&delays), sd_and_lags(&delays));
        let (delay, delay_sd) = scatter.delay_mean_sd_us();
        assert!((found - delay).abs() < 0.02 * found_sd, "{name}: {found} for {delay}");
        assert!((found_sd / delay_sd - 1.0).abs() < 0.05, "{name}: {found_sd} for {delay_sd}");
        let ends =
            [delays.iter().copied().fold(f64::MAX, f64::min), delays.iter().copied().fold(0.0, f64::max)];
        assert_eq!(ends, [scatter.delay_us[0], scatter.delay_us[20]].map(f64::from), "{name}");
    }
}
