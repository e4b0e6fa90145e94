//! Which faults a scanner takes, by its model, and why it refuses the others.

use rowscan_faults::Fit;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{Model, SEGMENTED};
use rowscan_settings::fault_table::PartFault;
use rowscan_settings::fault_table::device::{Broken, DeviceFault, Dirt, Piece, Stored};

/// The scanner that faults act on.
#[derive(Clone, Copy, Debug)]
pub(super) enum FaultyScanner {
    /// One that speaks CoLa.
    Cola(&'static Model),
    Lms2xx,
}

impl FaultyScanner {
    /// Whether it sends scans as datagrams: then it has REST as well.
    pub(super) fn sends_datagrams(self) -> bool {
        matches!(self, Self::Cola(Model { compact: Some(_), .. }))
    }
}

/// The rate of an LMS2xx with so many bits a second, where it has one.
pub(super) fn lms2xx_rate(bits_s: u32) -> Option<lms2xx::Rate> {
    lms2xx::Rate::ALL.into_iter().find(|rate| rate.bits_per_second() == bits_s)
}

/// Whether the scanner takes such a fault.
pub(super) fn fits(scanner: FaultyScanner, fault: &PartFault) -> Fit {
    match (scanner, fault) {
        (_, PartFault::Datagrams(_)) if scanner.sends_datagrams() => Fit::Acts,
        (_, PartFault::Datagrams(fault)) => {
            let others = if fault.fate.needs_a_scanner() {
                ""
            } else {
                ", or GNSS sentences or CAN frames that go out over UDP"
            };
            Fit::Refuses(format!(
                "it sends no datagrams: expected one of the models that send scans over UDP ({}){others}; of a connection, use `drop`, `duplicate`, `delay` or `reorder`",
                over_udp()
            ))
        }
        (_, PartFault::Device(DeviceFault::Rest(_))) if !scanner.sends_datagrams() => Fit::Refuses(format!(
            "it has no REST interface: expected one of the models that have ({})",
            over_udp()
        )),
        (FaultyScanner::Cola(model), PartFault::Device(fault)) => fits_cola(model, fault),
        (FaultyScanner::Cola(_), PartFault::Clock(_)) => Fit::Acts,
        (FaultyScanner::Lms2xx, PartFault::Device(fault)) => fits_lms2xx(fault),
        (FaultyScanner::Lms2xx, PartFault::Clock(_)) => {
            Fit::Refuses("an LMS2xx's telegrams carry no time, so its clock cannot be wrong".to_owned())
        }
        _ => Fit::Foreign,
    }
}

/// The models that send scans over UDP, and have REST.
fn over_udp() -> String {
    SEGMENTED.iter().map(|model| model.name).collect::<Vec<_>>().join(", ")
}

/// Beams that see nothing look like beams that meet nothing, where scans do not say so: such a fault would change what is measured, and nobody could know.
fn blinds(fault: &DeviceFault) -> bool {
    matches!(fault, DeviceFault::Dirt(_) | DeviceFault::Broken(Broken { part: Piece::Laser, .. }))
}

/// Device angles of the model's first and last beam, degrees.
fn field_deg(model: &Model) -> (f64, f64) {
    (f64::from(model.start_angle) / 1e4, f64::from(model.stop_angle) / 1e4)
}

fn fits_cola(model: &Model, fault: &DeviceFault) -> Fit {
    match fault {
        fault if blinds(fault) && !model.scans_tell_status() => Fit::Refuses(format!(
            "what a {} tells of it is not emulated, and its Compact telegrams have no status: beams that see nothing would be taken for gaps; use `udp_loss`, `motor` or `power`, or a \
             model whose scans tell it, such as lms111",
            model.title
        )),
        DeviceFault::Dirt(Dirt { sector_deg: Some((from, to)), .. })
            if *to < field_deg(model).0 || *from > field_deg(model).1 =>
        {
            let (start, stop) = field_deg(model);
            Fit::Refuses(format!(
                "`sector` from {from}° to {to}° holds no beam of this {}: its beams lie between {start}° and {stop}°",
                model.title
            ))
        }
        DeviceFault::Stored(Stored { rate: Some(_), .. } | Stored { streaming: true, .. }) => Fit::Refuses(
            "`rate` and `streaming` are an LMS2xx's: a CoLa scanner has no rate, and streams to nobody who has not subscribed; use `dialect`, `config`, `other_client`".to_owned(),
        ),
        _ => Fit::Acts,
    }
}

fn fits_lms2xx(fault: &DeviceFault) -> Fit {
    let refuses = |why: &str| Fit::Refuses(why.to_owned());
    match fault {
        DeviceFault::Power(_) => Fit::Acts,
        DeviceFault::Dirt(Dirt { sector_deg: None, .. }) => Fit::Acts,
        DeviceFault::Dirt(_) => {
            refuses("an LMS2xx tells dirt by channels of its window, not by angle; leave `sector` out")
        }
        DeviceFault::Rest(_) => refuses("it has no REST interface"),
        DeviceFault::Broken(_) => refuses(
            "which error numbers an LMS2xx reports for a failing part is not emulated; use `contamination` or `power`",
        ),
        DeviceFault::Refusal(_) => refuses("an LMS2xx answers no sFA; use `drop`, direction = \"to_device\""),
        DeviceFault::Stored(stored) => match stored.rate {
            Some(rate) if lms2xx_rate(rate).is_none() => {
                Fit::Refuses(format!("expected a rate of 9600, 19200, 38400 or 500000, found {rate}"))
            }
            _ if stored.dialect.is_some() || stored.config || stored.other_client => refuses(
                "`dialect`, `config` and `other_client` are a CoLa scanner's; use `rate` and `streaming`",
            ),
            _ => Fit::Acts,
        },
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use rowscan_protocol::device::{Device, Identity, MeasuredEcho, MeasuredLine};
    use rowscan_protocol::model;
    use rowscan_protocol::scan::Scan;
    use rowscan_protocol::time::SimTime;
    use rowscan_protocol::validity::DeviceStatus;
    use rowscan_settings::fault_table::datagrams::{DatagramFault, Fate};
    use rowscan_settings::fault_table::device::RestFault;
    use tokio::sync::Notify;

    use super::*;
    use crate::faulted::DeviceFaults;

    fn blinding() -> Vec<DeviceFault> {
        let dirt = |sector_deg| Dirt { level: 2, sector_deg, ramp: Duration::ZERO };
        vec![
            DeviceFault::Dirt(dirt(None)),
            DeviceFault::Dirt(dirt(Some((0.0, 90.0)))),
            DeviceFault::Broken(Broken { part: Piece::Laser, until_reboot: false }),
        ]
    }

    /// The scan of a wall while a fault lasts.
    fn scan(model: &'static Model, fault: &DeviceFault) -> Scan {
        let faults = DeviceFaults::cola(&std::sync::Arc::new(Notify::new()), model);
        let mut device = Device::new(model, Identity::default());
        let fault = PartFault::Device(fault.clone());
        let order = rowscan_faults::Order { key: 1, at: Duration::ZERO, fault: &fault, seed: 0, p: 1.0 };
        rowscan_faults::Part::begin(&*faults, &order);
        faults.act_on(&mut device, SimTime::ZERO);
        let grid = device.mirror().beams;
        let echoes = [MeasuredEcho { range_mm: vec![2000; grid.len()], remission: vec![0x4000; grid.len()] }];
        let mut scan = Scan::default();
        let telegram =
            device.measure(SimTime::ZERO, &MeasuredLine { grid, echoes: &echoes }).expect("a scan");
        telegram.to_scan_into(&mut scan).expect("it is one");
        scan
    }

    #[test]
    fn no_fault_takes_beams_without_a_word_of_the_scanner() {
        for model in model::all() {
            for fault in blinding() {
                match fits(FaultyScanner::Cola(model), &PartFault::Device(fault.clone())) {
                    Fit::Acts => {
                        let scan = scan(model, &fault);
                        assert_ne!(scan.status, DeviceStatus::Ok, "{}, {fault:?}", model.name);
                        assert!(model.compact.is_none(), "{}, {fault:?}: Compact has no status", model.name);
                    }
                    Fit::Refuses(why) => {
                        assert!(!model.scans_tell_status(), "{}, {fault:?}: {why}", model.name);
                        assert!(why.contains(model.title) && why.contains("such as lms111"), "{why}");
                    }
                    Fit::Foreign => panic!("{}, {fault:?}", model.name),
                }
            }
        }
    }

    /// The same for a window that is dirty from the start, by rig or flag.
    #[test]
    fn no_dirt_is_put_on_a_window_without_a_word_of_the_scanner() {
        for model in model::all() {
            let mut device = Device::new(model, Identity::default());
            crate::stage::contaminate(&mut device, model, 0).expect("a clean window");
            let put = crate::stage::contaminate(&mut device, model, 2);
            assert_eq!(put.is_ok(), model.scans_tell_status(), "{}", model.name);
            let dirt = PartFault::Device(blinding().remove(0));
            assert_eq!(put.is_ok(), matches!(fits(FaultyScanner::Cola(model), &dirt), Fit::Acts));
        }
    }

    #[test]
    fn what_a_model_has_no_datagrams_or_rest_for_names_the_models_that_have() {
        let scanners = model::all().map(FaultyScanner::Cola).chain([FaultyScanner::Lms2xx]);
        let fates = [Fate::Lost, Fate::Doubled, Fate::Late(Duration::ZERO), Fate::Overtaken(1)];
        let of_datagrams = fates.map(|fate| PartFault::Datagrams(DatagramFault { fate, bursts: None }));
        let of_rest = [RestFault::StaleNonces, RestFault::TooMany]
            .map(|rest| PartFault::Device(DeviceFault::Rest(rest)));
        for scanner in scanners {
            for fault in of_datagrams.iter().chain(&of_rest) {
                match fits(scanner, fault) {
                    Fit::Acts => assert!(scanner.sends_datagrams(), "{scanner:?}, {fault:?}"),
                    Fit::Refuses(why) => {
                        assert!(!scanner.sends_datagrams(), "{scanner:?}, {fault:?}");
                        assert!(SEGMENTED.iter().all(|model| why.contains(model.name)), "{why}");
                        let is_anothers =
                            matches!(fault, PartFault::Datagrams(fault) if !fault.fate.needs_a_scanner());
                        assert_eq!(why.contains("CAN frames"), is_anothers, "{why}");
                    }
                    Fit::Foreign => panic!("{scanner:?}, {fault:?}"),
                }
            }
        }
    }
}
