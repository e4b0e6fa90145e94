//! Faults of a tractor: what its encoder counts, what its receiver reports, where it sways. Functions of the instant, like all of it, once
//! their begins and ends are known; those come in the order of time.

mod counting;
mod reporting;
mod spans;
mod swaying;

pub(crate) use counting::Counting;
pub use reporting::Report;
pub(crate) use reporting::Reporting;
use rowscan_settings::fault_table::vehicle::{DriveFault, EncoderFault, GnssFault};
pub(crate) use swaying::Swaying;

/// A fault that a tractor takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VehicleFault {
    /// Of its wheel encoder.
    Encoder(EncoderFault),
    /// Of its GNSS receiver.
    Gnss(GnssFault),
    /// Of its drive.
    Drive(DriveFault),
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::time::SimTime;

    use crate::gnss::{FixQuality, Gnss, Receiver};
    use crate::trajectory::Trajectory;
    use crate::{Encoder, Tractor};

    const SECOND: u64 = 1_000_000_000;

    fn at(s: u64) -> SimTime {
        SimTime(s * SECOND)
    }

    /// At a metre a second since 0, with a fault from 10 s to 20 s.
    fn with(fault: VehicleFault) -> Tractor {
        let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
        tractor.begin(SimTime::ZERO);
        tractor.begin_fault(1, fault, at(10));
        tractor.end_fault(1, at(20));
        tractor
    }

    fn counted(fault: EncoderFault) -> [i64; 4] {
        let tractor = with(VehicleFault::Encoder(fault));
        assert_eq!(tractor.motion(at(30)).way_m, 30.0, "the tractor itself goes on");
        [5, 15, 20, 30].map(|s| tractor.encoder_ticks(&Encoder::default(), at(s)).round() as i64)
    }

    #[test]
    fn the_encoder_counts_otherwise_while_it_has_a_fault_and_goes_on_from_there() {
        let fault = EncoderFault::default();
        assert_eq!(counted(fault), [5_000, 15_000, 20_000, 30_000]);
        assert_eq!(counted(EncoderFault { slip: 0.2, ..fault }), [5_000, 16_250, 22_500, 32_500]);
        assert_eq!(counted(EncoderFault { missed: 0.1, ..fault }), [5_000, 14_500, 19_000, 29_000]);
        assert_eq!(counted(EncoderFault { extra: 0.1, ..fault }), [5_000, 15_500, 21_000, 31_000]);
        assert_eq!(counted(EncoderFault { stuck: true, ..fault }), [5_000, 10_000, 10_000, 20_000]);
        assert_eq!(counted(EncoderFault { cable_out: true, ..fault }), [5_000, 10_000, 10_000, 20_000]);
        assert_eq!(counted(EncoderFault { reversed: true, ..fault }), [5_000, 5_000, 0, 10_000]);
        let wrapped = counted(EncoderFault { wrap: true, ..fault }).map(|ticks| ticks as u32);
        assert_eq!(wrapped, [5_000, 4_990, 9_990, 19_990], "ten short of the wrap when it began");
    }

    /// Metres north and east of where the tractor is, 15 s on.
    fn reported(fault: GnssFault) -> (f64, f64, Report) {
        let receiver = Receiver::new(Gnss::default(), 1);
        let tractor = with(VehicleFault::Gnss(fault));
        let (report, true_fix) =
            (tractor.report(&receiver, at(15)), receiver.fix(at(15), &tractor.motion(at(15))));
        for sound in [5, 25] {
            let told = tractor.report(&receiver, at(sound));
            assert_eq!(
                told.fix,
                receiver.fix(at(sound), &tractor.motion(at(sound))),
                "{fault:?} at {sound} s"
            );
        }
        let north = (report.fix.latitude_deg - true_fix.latitude_deg) * 111_080.0;
        let east = (report.fix.longitude_deg - true_fix.longitude_deg) * 83_360.0;
        (north, east, report)
    }

    #[test]
    fn the_receiver_reports_otherwise_while_it_has_a_fault() {
        let fault = GnssFault::default();
        let near = |(north, east, _): (f64, f64, Report), (n, e): (f64, f64)| {
            assert!((north - n).abs() < 0.01 && (east - e).abs() < 0.01, "{north} {east}, not {n} {e}");
        };
        near(reported(GnssFault { jump_m: 5.0, jump_deg: 90.0, ..fault }), (0.0, 5.0));
        near(reported(GnssFault { lever_arm_m: (2.0, -1.0), ..fault }), (2.0, -1.0));
        near(reported(GnssFault { stale: true, ..fault }), (-5.0, 0.0));
        let (north, east, report) = reported(GnssFault { float: true, ..fault });
        assert_eq!(report.fix.quality, FixQuality::RtkFloat);
        assert!(north.hypot(east) > 0.01 && north.hypot(east) < 2.0, "{north} {east}");
        let (_, _, report) = reported(GnssFault { lost: true, ..fault });
        assert_eq!((report.fix.quality, report.fix.satellites), (FixQuality::None, 0));
        let (_, _, report) = reported(GnssFault { time_s: 18.0, ..fault });
        assert_eq!(
            report.fix.unix_s
                - Receiver::new(Gnss::default(), 1)
                    .fix(at(0), &Trajectory::straight(0.0, 0.0).at(0.0))
                    .unix_s,
            33.0
        );
        assert!(reported(GnssFault { bad_checksum: true, ..fault }).2.bad_checksum);
        assert!(!reported(fault).2.bad_checksum);
    }

    #[test]
    fn the_tractor_drives_beside_its_way_and_comes_back() {
        let lateral = DriveFault::Lateral { m: 0.5, over: std::time::Duration::from_secs(2) };
        let tractor = with(VehicleFault::Drive(lateral));
        let x_m = |s: u64| tractor.motion(at(s)).place.x_m - tractor.motion(at(0)).place.x_m;
        let shifts = [9, 11, 12, 20, 21, 22].map(|s| (x_m(s) * 1000.0).round());
        assert_eq!(shifts, [0.0, 250.0, 500.0, 500.0, 250.0, 0.0]);
        assert_eq!(tractor.motion(at(15)).place.y_m, 15.0);
    }

    #[test]
    fn the_tractor_goes_up_and_down_and_rolls() {
        let tractor = with(VehicleFault::Drive(DriveFault::Bounce { m: 0.1, hz: 0.25, roll_rad: 0.02 }));
        let sway = |s: u64| {
            let motion = tractor.motion(at(s));
            ((motion.up_m * 1000.0).round(), (motion.roll_rad * 1000.0).round())
        };
        assert_eq!([9, 11, 13, 25].map(sway), [(0.0, 0.0), (100.0, 20.0), (-100.0, -20.0), (0.0, 0.0)]);
    }

    #[test]
    fn a_stop_that_is_there_before_the_drive_keeps_it_from_starting() {
        let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
        tractor.begin_fault(1, VehicleFault::Drive(DriveFault::Speed { m_s: 0.0, change_m_s2: 0.5 }), at(0));
        tractor.begin(at(1));
        assert_eq!(tractor.motion(at(5)).place.y_m, 0.0);
        tractor.end_fault(1, at(5));
        // Two seconds to its speed, in which it goes a metre.
        assert!((tractor.motion(at(10)).place.y_m - 4.0).abs() < 1e-9);
    }
}
