//! Faults of a sprayer: its valves and wires, its liquid, and the driver's switches.

/// Whose valves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Valves {
    /// All of them.
    All,
    /// Those of the section with this number, from 1.
    Section(u16),
    /// That of the nozzle with this number, from 0.
    Nozzle(u16),
}

/// Where a valve is stuck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StuckAt {
    /// Where it was commanded to when it got stuck.
    AsItIs,
    /// Open.
    Open,
    /// Shut.
    Shut,
}

/// A fault of a sprayer, or a switch that is thrown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SprayerFault {
    /// Valves stay where they are.
    ValveStuck(Valves, StuckAt),
    /// Valves do what they are told so many seconds later.
    ValveSlow(Valves, f64),
    /// Coils get no current: valves shut.
    CoilOpen(Valves),
    /// The supply's voltage is too low to hold any valve open.
    Undervoltage,
    /// The wires of two sections are swapped.
    SwappedWires(u16, u16),
    /// Nozzles give less, by this share.
    BlockedNozzle(Valves, f64),
    /// Nozzles drip while they are shut: this share of full flow.
    Drip(Valves, f64),
    /// The pump gives this share of its flow.
    PumpLow(f64),
    /// The flow meter tells so many times the flow.
    FlowMeterOff(f64),
    /// The master switch is off.
    MasterOff,
    /// The driver's override asks for all valves shut.
    HeldShut,
    /// Nothing is left in the tank.
    TankEmpty,
}
