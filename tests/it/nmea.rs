//! What the `nmea` crate makes of every sentence is what the trajectory says.
#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used, reason = "a test fails by panicking")]

use nmea::ParseResult;
use nmea::sentences::rmc::RmcStatusOfFix;
use nmea::sentences::{FaaMode, FixType};
use rowscan_bus::nmea::{GnssEpochs, SENTENCES};
use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;
use rowscan_vehicle::gnss::{FixQuality, Gnss, GnssEvent, Receiver};
use rowscan_vehicle::trajectory::{Motion, Trajectory};

/// Knots a metre a second.
const KNOTS: f64 = 3600.0 / 1852.0;

fn near(what: &str, found: Option<f64>, expected: f64, tolerance: f64) {
    let found = found.unwrap_or_else(|| panic!("no {what}"));
    assert!((found - expected).abs() <= tolerance, "{what}: {found}, expected {expected}");
}

/// Where the antenna is: its place on the tractor's, northward by the rows' azimuth, in degrees of WGS 84.
fn antenna(gnss: &Gnss, motion: &Motion) -> (f64, f64) {
    let (x_m, y_m) = (motion.place.x_m + gnss.antenna_right_m, motion.place.y_m + gnss.antenna_forward_m);
    let (sin, cos) = gnss.azimuth_deg.to_radians().sin_cos();
    let (north_m, east_m) = (y_m * cos - x_m * sin, y_m * sin + x_m * cos);
    // Radii of curvature of the ellipsoid at that latitude.
    let (a, e2, latitude) = (6_378_137.0, 6.694_379_990_14e-3, gnss.latitude_deg.to_radians());
    let w2 = 1.0 - e2 * latitude.sin().powi(2);
    let (meridian_m, across_m) = (a * (1.0 - e2) / w2.powf(1.5), a / w2.sqrt() * latitude.cos());
    (
        gnss.latitude_deg + (north_m / meridian_m).to_degrees(),
        gnss.longitude_deg + (east_m / across_m).to_degrees(),
    )
}

/// Twelve seconds at 1.5 m/s from the first on, without a fix from the fourth to the sixth, by float from the eighth to the tenth.
#[test]
fn every_sentence_says_what_the_trajectory_does() {
    let event = |from_s, to_s, quality| GnssEvent { from_s, to_s, quality, noise_m: None };
    let gnss = Gnss {
        latitude_deg: -33.25,
        longitude_deg: -70.125,
        azimuth_deg: 12.0,
        antenna_forward_m: 0.4,
        antenna_right_m: -0.2,
        noise_m: 0.0,
        rate_hz: 5.0,
        quality: FixQuality::RtkFixed,
        events: vec![event(4.0, 6.0, FixQuality::None), event(8.0, 10.0, FixQuality::RtkFloat)],
        ..Gnss::default()
    };
    let tractor = Tractor::new(Trajectory::straight(2.0, 1.5));
    tractor.begin(SimTime(1_000_000_000));
    let mut voice = GnssEpochs::new(tractor.clone(), Receiver::new(gnss.clone(), 1));
    let mut parsed = 0;
    for _ in 0..60 {
        let at = voice.next();
        let (t_s, motion) = (at.as_secs_f64(), tractor.motion(at));
        let (latitude_deg, longitude_deg) = antenna(&gnss, &motion);
        let lost = (4.0..6.0).contains(&t_s);
        let float = (8.0..10.0).contains(&t_s);
        // Seven digits of a minute.
        let angle_deg = 1e-7 / 60.0;
        for sentence in voice.next_epoch().lines() {
            parsed += 1;
            match nmea::parse_str(sentence).unwrap_or_else(|error| panic!("{sentence}: {error}")) {
                ParseResult::GGA(gga) => {
                    let fix = match (lost, float) {
                        (true, _) => FixType::Invalid,
                        (_, true) => FixType::FloatRtk,
                        _ => FixType::Rtk,
                    };
                    assert_eq!(gga.fix_type, Some(fix));
                    if lost {
                        assert_eq!((gga.latitude, gga.altitude), (None, None));
                        continue;
                    }
                    near("latitude", gga.latitude, latitude_deg, angle_deg);
                    near("longitude", gga.longitude, longitude_deg, angle_deg);
                    let altitude_m = gnss.altitude_m + gnss.antenna_up_m;
                    near("altitude", gga.altitude.map(f64::from), altitude_m, 1e-3);
                    near("geoid", gga.geoid_separation.map(f64::from), gnss.geoid_m, 0.05);
                }
                ParseResult::RMC(rmc) => {
                    let valid = rmc.status_of_fix == RmcStatusOfFix::Autonomous;
                    assert_eq!(valid, !lost, "{sentence}");
                    if lost {
                        assert_eq!((rmc.lat, rmc.speed_over_ground), (None, None));
                        continue;
                    }
                    let mode = if float { FaaMode::FloatRtk } else { FaaMode::FixedRtk };
                    assert_eq!(rmc.faa_mode, Some(mode));
                    near("latitude", rmc.lat, latitude_deg, angle_deg);
                    near("speed", rmc.speed_over_ground.map(f64::from), motion.speed_m_s * KNOTS, 6e-4);
                    near("course", rmc.true_course.map(f64::from), 12.0, 0.006);
                }
                ParseResult::VTG(vtg) => {
                    assert_eq!(vtg.speed_over_ground.is_none(), lost);
                    if !lost {
                        near("speed", vtg.speed_over_ground.map(f64::from), motion.speed_m_s * KNOTS, 6e-4);
                        near("course", vtg.true_course.map(f64::from), 12.0, 0.006);
                    }
                }
                ParseResult::ZDA(zda) => {
                    let now = zda.utc_date_time().expect("a time").and_utc();
                    let since_start_s = now.timestamp_millis() as f64 / 1e3 - start_s(&gnss);
                    near("time", Some(since_start_s), t_s, 1e-6);
                }
                ParseResult::HDT(hdt) => {
                    if !lost {
                        near("heading", hdt.heading.map(f64::from), 12.0, 0.006);
                    }
                }
                ParseResult::GST(gst) => {
                    let expected = (!lost).then_some(if float { 0.2 } else { 0.01 });
                    let (latitude, height) = (gst.lat_sd.map(f64::from), gst.alt_sd);
                    assert_eq!(latitude.is_none(), lost);
                    if let Some(expected) = expected {
                        near("deviation", latitude, expected, 1e-6);
                        near("height deviation", height.map(f64::from), 2.0 * expected, 1e-6);
                    }
                }
                ParseResult::GSA(gsa) => {
                    assert_eq!(gsa.fix_sats_prn.len(), if lost { 0 } else { 12 });
                    near("hdop", gsa.hdop.map(f64::from), if lost { 99.9 } else { 0.7 }, 1e-5);
                }
                other => panic!("{other:?}"),
            }
        }
    }
    // Twelve seconds: what is sent once a second comes twelve times.
    let slow = SENTENCES.iter().filter(|sentence| sentence.once_a_second).count();
    assert_eq!(parsed, 60 * (SENTENCES.len() - slow) + 12 * slow);
}

/// The instant simulated time begins at, as the receiver has it.
fn start_s(gnss: &Gnss) -> f64 {
    Receiver::new(gnss.clone(), 1).fix(SimTime::ZERO, &Trajectory::straight(0.0, 0.0).at(0.0)).unix_s
}
