//! A fault as a file keeps it: a name and numbers.

use rowscan_settings::fault_table::sprayer::{SprayerFault, StuckAt, Valves};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Of {
    All,
    Section(u16),
    Nozzle(u16),
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kept {
    ValveStuck(Of, Option<bool>),
    ValveSlow(Of, f64),
    CoilOpen(Of),
    Undervoltage,
    SwappedWires(u16, u16),
    BlockedNozzle(Of, f64),
    Drip(Of, f64),
    PumpLow(f64),
    FlowMeterOff(f64),
    MasterOff,
    HeldShut,
    TankEmpty,
}

fn of(valves: Valves) -> Of {
    match valves {
        Valves::All => Of::All,
        Valves::Section(number) => Of::Section(number),
        Valves::Nozzle(number) => Of::Nozzle(number),
    }
}

fn valves(of: Of) -> Valves {
    match of {
        Of::All => Valves::All,
        Of::Section(number) => Valves::Section(number),
        Of::Nozzle(number) => Valves::Nozzle(number),
    }
}

pub(super) fn serialize<S: Serializer>(fault: &SprayerFault, to: S) -> Result<S::Ok, S::Error> {
    let kept = match *fault {
        SprayerFault::ValveStuck(valves, at) => {
            let open = match at {
                StuckAt::Open => Some(true),
                StuckAt::Shut => Some(false),
                StuckAt::AsItIs => None,
            };
            Kept::ValveStuck(of(valves), open)
        }
        SprayerFault::ValveSlow(valves, late_s) => Kept::ValveSlow(of(valves), late_s),
        SprayerFault::CoilOpen(valves) => Kept::CoilOpen(of(valves)),
        SprayerFault::Undervoltage => Kept::Undervoltage,
        SprayerFault::SwappedWires(one, other) => Kept::SwappedWires(one, other),
        SprayerFault::BlockedNozzle(valves, share) => Kept::BlockedNozzle(of(valves), share),
        SprayerFault::Drip(valves, share) => Kept::Drip(of(valves), share),
        SprayerFault::PumpLow(share) => Kept::PumpLow(share),
        SprayerFault::FlowMeterOff(ratio) => Kept::FlowMeterOff(ratio),
        SprayerFault::MasterOff => Kept::MasterOff,
        SprayerFault::HeldShut => Kept::HeldShut,
        SprayerFault::TankEmpty => Kept::TankEmpty,
    };
    kept.serialize(to)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<SprayerFault, D::Error> {
    let share = |share: f64, most: f64| {
        let is_share = (0.0..=most).contains(&share);
        is_share.then_some(share).ok_or_else(|| D::Error::custom("expected a share in its range"))
    };
    Ok(match Kept::deserialize(from)? {
        Kept::ValveStuck(of, open) => {
            let at = match open {
                Some(true) => StuckAt::Open,
                Some(false) => StuckAt::Shut,
                None => StuckAt::AsItIs,
            };
            SprayerFault::ValveStuck(valves(of), at)
        }
        Kept::ValveSlow(of, late_s) => SprayerFault::ValveSlow(valves(of), share(late_s, 1e6)?),
        Kept::CoilOpen(of) => SprayerFault::CoilOpen(valves(of)),
        Kept::Undervoltage => SprayerFault::Undervoltage,
        Kept::SwappedWires(one, other) => SprayerFault::SwappedWires(one, other),
        Kept::BlockedNozzle(of, part) => SprayerFault::BlockedNozzle(valves(of), share(part, 1.0)?),
        Kept::Drip(of, part) => SprayerFault::Drip(valves(of), share(part, 1.0)?),
        Kept::PumpLow(part) => SprayerFault::PumpLow(share(part, 10.0)?),
        Kept::FlowMeterOff(ratio) => SprayerFault::FlowMeterOff(share(ratio, 10.0)?),
        Kept::MasterOff => SprayerFault::MasterOff,
        Kept::HeldShut => SprayerFault::HeldShut,
        Kept::TankEmpty => SprayerFault::TankEmpty,
    })
}
