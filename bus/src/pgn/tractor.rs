//! Speed and distance of the tractor, and the command that drives it (ISO 11783-7 and -9).
//!
//! Layouts as AgIsoStack++ sends and reads them; the bits of the facilities after another public implementation, not verified against
//! the standard's text.

use rowscan_vehicle::trajectory::Motion;

use super::TRACTOR_ADDRESS;
use crate::message::{Message, Payload, Signal};

const DIRECTION: &[(u64, &str)] = &[(0, "Reverse"), (1, "Forward"), (2, "Error"), (3, "NotAvailable")];
const SPEED: Signal = Signal::new("Speed", 0, 16, 0.001, "m/s");
const DISTANCE: Signal = Signal::new("Distance", 16, 32, 0.001, "m");

/// Wheel-based speed and distance: slip included.
pub const WHEEL_SPEED: Message = Message {
    name: "WheelBasedSpeed",
    pgn: 65_096,
    priority: 3,
    period_ms: Some(100),
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "wheel-based speed and distance (ISO 11783-7)",
    signals: &[
        Signal { name: "WheelSpeed", about: "magnitude", ..SPEED },
        Signal { name: "WheelDistance", about: "way of the wheels, either direction counted up", ..DISTANCE },
        Signal::new("MaximumPowerTime", 48, 8, 1.0, "min"),
        Signal::choice("WheelDirection", 56, 2, DIRECTION),
        Signal::choice("KeySwitch", 58, 2, &[(0, "Off"), (1, "On"), (3, "NotAvailable")]),
        Signal::choice("StartStop", 60, 2, &[(0, "Stop"), (1, "Start"), (3, "NotAvailable")]),
        Signal::choice(
            "OperatorDirection",
            62,
            2,
            &[(0, "NotReversed"), (1, "Reversed"), (3, "NotAvailable")],
        ),
    ],
};

/// Ground-based speed and distance.
pub const GROUND_SPEED: Message = Message {
    name: "GroundBasedSpeed",
    pgn: 65_097,
    priority: 3,
    period_ms: Some(100),
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "ground-based speed and distance, as a radar has it (ISO 11783-7)",
    signals: &[
        Signal { name: "GroundSpeed", about: "magnitude", ..SPEED },
        Signal { name: "GroundDistance", about: "way over ground, either direction counted up", ..DISTANCE },
        Signal::choice("GroundDirection", 56, 2, DIRECTION),
    ],
};

/// Machine selected speed: the one that implements shall use.
pub const SELECTED_SPEED: Message = Message {
    name: "MachineSelectedSpeed",
    pgn: 61_474,
    priority: 3,
    period_ms: Some(100),
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "the speed the tractor selects for its implements; here the ground-based one (ISO 11783-7)",
    signals: &[
        Signal { name: "SelectedSpeed", about: "magnitude", ..SPEED },
        Signal {
            name: "SelectedDistance",
            about: "way over ground, either direction counted up",
            ..DISTANCE
        },
        Signal::new("ExitReasonCode", 48, 8, 1.0, ""),
        Signal::choice("SelectedDirection", 56, 2, DIRECTION),
        Signal::choice(
            "SelectedSource",
            58,
            3,
            &[
                (0, "Wheel"),
                (1, "Ground"),
                (2, "Navigation"),
                (3, "Blended"),
                (4, "Simulated"),
                (7, "NotAvailable"),
            ],
        ),
        Signal::choice(
            "LimitStatus",
            61,
            3,
            &[(0, "NotLimited"), (1, "OperatorLimited"), (7, "NotAvailable")],
        ),
    ],
};

/// Machine selected speed command: obeyed.
pub const SPEED_COMMAND: Message = Message {
    name: "MachineSelectedSpeedCommand",
    pgn: 64_835,
    priority: 3,
    period_ms: None,
    len: 8,
    source: super::CANOPY_ADDRESS,
    about: "sets the tractor's speed; it is made for with the scene's drive.acceleration_m_s2 (ISO 11783-7)",
    signals: &[
        Signal { name: "CommandedSpeed", about: "magnitude", ..SPEED },
        Signal { name: "SpeedLimit", start: 16, about: "no faster than this", ..SPEED },
        Signal::choice("CommandedDirection", 56, 2, DIRECTION),
    ],
};

/// Tractor facilities: what this tractor tells and obeys.
pub const FACILITIES: Message = Message {
    name: "TractorFacilities",
    pgn: 65_033,
    priority: 6,
    period_ms: None,
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "what this tractor tells and obeys, once after its address claim and on request (ISO 11783-7 B.24.3, bits as AgOpenGPS's task controller has them)",
    signals: &[
        Signal::new("HasEngineSpeed", 0, 1, 1.0, ""),
        Signal::new("HasGroundSpeed", 1, 1, 1.0, ""),
        Signal::new("HasWheelSpeed", 2, 1, 1.0, ""),
        Signal::new("MaintainsPower", 3, 2, 1.0, ""),
        Signal::new("HasKeySwitch", 5, 1, 1.0, ""),
        Signal::choice(
            "TractorClass",
            6,
            2,
            &[(0, "Class1"), (1, "Class2"), (2, "Class3"), (3, "NotAvailable")],
        ),
        Signal::new("RearHitchPtoAndLights", 8, 8, 1.0, ""),
        Signal::new("ValvesLightsAndDraft", 16, 3, 1.0, ""),
        Signal::new("HasWheelDirection", 19, 1, 1.0, ""),
        Signal::new("HasWheelDistance", 20, 1, 1.0, ""),
        Signal::new("HasGroundDirection", 21, 1, 1.0, ""),
        Signal::new("HasGroundDistance", 22, 1, 1.0, ""),
        Signal::new("HasTimeAndDate", 23, 1, 1.0, ""),
        Signal::new("RearAndValveCommands", 24, 8, 1.0, ""),
        Signal::new("ObeysDirection", 32, 1, 1.0, ""),
        Signal::new("ObeysSpeedCommand", 33, 1, 1.0, ""),
        Signal::new("HasSelectedSpeed", 34, 1, 1.0, ""),
        Signal::new("LightsAndNoiseStatistics", 35, 3, 1.0, ""),
        Signal::new("HasPosition", 38, 1, 1.0, "").about("129029"),
        Signal::new("HasRapidPosition", 39, 1, 1.0, "").about("129025, 129026"),
        Signal::new("FrontHitchAndPto", 40, 8, 1.0, ""),
        Signal::new("FacilitiesReserved", 48, 16, 1.0, ""),
    ],
};

/// The direction of a speed. Standing counts as the direction it will most likely take.
fn direction(speed_m_s: f64) -> Option<f64> {
    Some(if speed_m_s < 0.0 { 0.0 } else { 1.0 })
}

/// [`WHEEL_SPEED`] of a tractor in `motion`.
pub fn wheel_speed(motion: &Motion) -> Payload {
    let speed_m_s = motion.wheel_speed_m_s;
    let (speed, distance) = (Some(speed_m_s.abs()), Some(motion.rolled_m));
    WHEEL_SPEED.encode(&[speed, distance, None, direction(speed_m_s), Some(1.0), Some(1.0), Some(0.0)])
}

/// [`GROUND_SPEED`] of a tractor in `motion`.
pub fn ground_speed(motion: &Motion) -> Payload {
    let speed_m_s = motion.speed_m_s;
    GROUND_SPEED.encode(&[Some(speed_m_s.abs()), Some(motion.driven_m), direction(speed_m_s)])
}

/// [`SELECTED_SPEED`] of a tractor in `motion`.
pub fn selected_speed(motion: &Motion) -> Payload {
    let speed_m_s = motion.speed_m_s;
    let (speed, distance) = (Some(speed_m_s.abs()), Some(motion.driven_m));
    SELECTED_SPEED.encode(&[speed, distance, None, direction(speed_m_s), Some(1.0), Some(0.0)])
}

/// [`FACILITIES`] of the virtual tractor.
pub fn facilities() -> Payload {
    let has = [
        "HasGroundSpeed",
        "HasWheelSpeed",
        "HasKeySwitch",
        "HasWheelDirection",
        "HasWheelDistance",
        "HasGroundDirection",
        "HasGroundDistance",
        "ObeysDirection",
        "ObeysSpeedCommand",
        "HasSelectedSpeed",
        "HasPosition",
        "HasRapidPosition",
    ];
    let values =
        FACILITIES.signals.iter().map(|signal| Some(f64::from(u8::from(has.contains(&signal.name)))));
    FACILITIES.encode(&values.collect::<Vec<_>>())
}

/// The signed speed that a [`GROUND_SPEED`] tells, m/s; `None` where it is not available.
pub fn ground_speed_m_s(data: &[u8]) -> Option<f64> {
    let [speed, _, direction] = GROUND_SPEED.decode(data).try_into().ok()?;
    let speed_m_s: f64 = speed?;
    match direction.map(|direction| direction as u8) {
        Some(0) => Some(-speed_m_s),
        Some(2) => None,
        _ => Some(speed_m_s),
    }
}

/// The signed speed that a [`SPEED_COMMAND`] asks for, m/s; `None` where it asks for nothing that can be driven.
pub fn commanded_m_s(data: &[u8]) -> Option<f64> {
    data.get(7)?;
    let [speed, limit, direction] = SPEED_COMMAND.decode(data).try_into().ok()?;
    let speed_m_s = limit.map_or(speed?, |limit: f64| speed.unwrap_or(0.0).min(limit));
    match direction.map(|direction| direction as u8) {
        Some(0) => Some(-speed_m_s),
        Some(2) => None,
        _ => Some(speed_m_s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_vehicle::trajectory::Trajectory;

    #[test]
    fn speed_and_distance_stand_where_agisostack_reads_them() {
        let motion = Trajectory::straight(0.0, 1.234).at(100.0);
        let bytes = wheel_speed(&motion);
        assert_eq!(bytes.bytes(), [0xD2, 0x04, 0x08, 0xE2, 0x01, 0x00, 0xFF, 0b0001_0101]);
        assert_eq!(ground_speed(&motion).bytes()[6..], [0xFF, 0xFD]);
        let back = Trajectory::straight(0.0, -0.5).at(10.0);
        assert_eq!(ground_speed(&back).bytes(), [0xF4, 0x01, 0x88, 0x13, 0x00, 0x00, 0xFF, 0xFC]);
        assert_eq!(selected_speed(&back).bytes()[7], 0b0000_0100);
    }

    #[test]
    fn distances_count_up_in_reverse() {
        let mut trajectory = Trajectory::straight(0.0, 1.0);
        trajectory.command(4.0, -1.0);
        let told = |t_s: f64| {
            let motion = trajectory.at(t_s);
            let second = |message: &Message, payload: Payload| message.decode(payload.bytes())[1].unwrap();
            [
                second(&WHEEL_SPEED, wheel_speed(&motion)),
                second(&GROUND_SPEED, ground_speed(&motion)),
                second(&SELECTED_SPEED, selected_speed(&motion)),
            ]
        };
        // Two seconds and a metre until it stands, as much until it is at speed again.
        assert_eq!([told(4.0), told(6.0), told(8.0), told(13.0)], [[4.0; 3], [5.0; 3], [6.0; 3], [11.0; 3]]);
    }

    /// AgOpenGPS's task controller, which tells both speeds with distance and direction and nothing else, sends 06 00 78
    /// (AgOpenGPS-Official/AOG-TaskController#82); ours adds key switch, position and selected speed.
    #[test]
    fn facilities_stand_where_a_task_controller_reads_them() {
        assert_eq!(facilities().bytes(), [0x26, 0x00, 0x78, 0x00, 0xC7, 0x00, 0x00, 0x00]);
    }

    #[test]
    fn commands_are_read_with_limit_and_direction() {
        let command = |speed: u16, limit: u16, direction: u8| {
            let ([a, b], [c, d]) = (speed.to_le_bytes(), limit.to_le_bytes());
            commanded_m_s(&[a, b, c, d, 0xFF, 0xFF, 0xFF, 0xFC | direction])
        };
        assert_eq!(command(1500, 0xFFFF, 1), Some(1.5));
        assert_eq!(command(1500, 1000, 0), Some(-1.0));
        assert_eq!(command(1500, 0xFFFF, 3), Some(1.5));
        assert_eq!(command(0xFFFF, 0xFFFF, 1), None);
        assert_eq!(command(1500, 0xFFFF, 2), None);
        assert_eq!(commanded_m_s(&[1, 2]), None);
    }
}
