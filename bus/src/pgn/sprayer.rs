//! What a spray controller tells the nozzles that ride with the tractor, in the range for proprietary broadcasts.

use super::SPRAYER_ADDRESS;
use crate::message::{Message, Signal};

/// How often a boom tells its states, milliseconds.
const STATES_MS: u32 = 100;

/// Nozzles that one frame is about.
pub const NOZZLES: usize = 7;
/// The last nozzle that a frame can be about.
pub const LAST_NOZZLE: usize = 250;

const DUTY: Signal = Signal::new("Duty", 8, 8, 0.4, "%");

/// Nozzle duties: obeyed by the nozzles of the scene, in their order over all scanners' plumes.
pub const NOZZLE_DUTY: Message = Message {
    name: "NozzleDuty",
    pgn: 65_299,
    priority: 3,
    period_ms: None,
    len: 8,
    source: 0xFE,
    about: "how far nozzles are open, seven from the first one named on; 255 leaves one as it is (proprietary B)",
    signals: &[
        Signal::new("FirstNozzle", 0, 8, 1.0, "").about("0 is the scene's first [[optics.air.plume]]"),
        Signal { name: "Duty0", ..DUTY },
        Signal { name: "Duty1", start: 16, ..DUTY },
        Signal { name: "Duty2", start: 24, ..DUTY },
        Signal { name: "Duty3", start: 32, ..DUTY },
        Signal { name: "Duty4", start: 40, ..DUTY },
        Signal { name: "Duty5", start: 48, ..DUTY },
        Signal { name: "Duty6", start: 56, ..DUTY },
    ],
};

/// Which nozzles a [`NOZZLE_DUTY`] sets, each with its duty, 0 to 1.
pub fn nozzle_duties(data: &[u8]) -> impl Iterator<Item = (u8, f64)> + use<> {
    let mut values = NOZZLE_DUTY.decode(data).into_iter();
    let first = values.next().flatten();
    let duties = values.enumerate().filter_map(|(place, percent)| Some((place as f64, percent?)));
    duties.filter_map(move |(place, percent)| {
        let number = first? + place;
        (number <= 250.0).then_some((number as u8, percent / 100.0))
    })
}

/// Sections that one frame is about.
pub const SECTIONS: usize = 8;

const SECTION: Signal = Signal::new("Section", 0, 8, 0.4, "%");

/// Section duties: what a whole section of a boom is told.
pub const SECTION_DUTY: Message = Message {
    name: "SectionDuty",
    pgn: 65_300,
    priority: 3,
    period_ms: None,
    len: 8,
    source: 0xFE,
    about: "how far the sections of a boom are open, sections 1 to 8; 255 leaves one as it is (proprietary B)",
    signals: &[
        Signal { name: "Section1", ..SECTION },
        Signal { name: "Section2", start: 8, ..SECTION },
        Signal { name: "Section3", start: 16, ..SECTION },
        Signal { name: "Section4", start: 24, ..SECTION },
        Signal { name: "Section5", start: 32, ..SECTION },
        Signal { name: "Section6", start: 40, ..SECTION },
        Signal { name: "Section7", start: 48, ..SECTION },
        Signal { name: "Section8", start: 56, ..SECTION },
    ],
};

/// The same of sections 9 to 16.
pub const MORE_SECTION_DUTY: Message = Message {
    name: "MoreSectionDuty",
    pgn: 65_307,
    about: "the same of sections 9 to 16 (proprietary B)",
    signals: &[
        Signal { name: "Section9", ..SECTION },
        Signal { name: "Section10", start: 8, ..SECTION },
        Signal { name: "Section11", start: 16, ..SECTION },
        Signal { name: "Section12", start: 24, ..SECTION },
        Signal { name: "Section13", start: 32, ..SECTION },
        Signal { name: "Section14", start: 40, ..SECTION },
        Signal { name: "Section15", start: 48, ..SECTION },
        Signal { name: "Section16", start: 56, ..SECTION },
    ],
    ..SECTION_DUTY
};

/// The messages that set sections, each with the number of the first one.
pub const SECTION_DUTIES: [(u16, &Message); 2] = [(1, &SECTION_DUTY), (9, &MORE_SECTION_DUTY)];

/// Which sections a message with this parameter group number sets, each with its duty, 0 to 1; none where it sets none.
pub fn section_duties(pgn: u32, data: &[u8]) -> impl Iterator<Item = (u16, f64)> + use<> {
    let setter = SECTION_DUTIES.iter().find(|(_, message)| message.pgn == pgn);
    let values = setter.map_or_else(Vec::new, |(_, message)| message.decode(data));
    let first = setter.map_or(1, |(first, _)| *first);
    (first..).zip(values).filter_map(|(number, percent)| Some((number, percent? / 100.0)))
}

/// What a controller tells beside duties: where the regulating valve shall go, and how much it believes it has sprayed.
pub const SPRAYER_CONTROL: Message = Message {
    name: "SprayerControl",
    pgn: 65_302,
    priority: 3,
    period_ms: None,
    len: 8,
    source: 0xFE,
    about: "where the regulating valve shall go, and the litres that the controller believes it has sprayed; all bits 1 say nothing (proprietary B)",
    signals: &[
        Signal::new("RegulatorOpening", 0, 8, 0.4, "%").about("0 is shut: all flow to the nozzles"),
        Signal::new("ReportedLitres", 32, 32, 0.001, "l").about("all since the controller was started"),
    ],
};

/// The opening of the regulating valve that a [`SPRAYER_CONTROL`] asks for, 0 to 1, and the litres that it reports.
pub fn sprayer_control(data: &[u8]) -> (Option<f64>, Option<f64>) {
    let mut values = SPRAYER_CONTROL.decode(data).into_iter();
    let percent = values.next().flatten();
    (percent.map(|percent| percent / 100.0), values.next().flatten())
}

const STATE: Signal = Signal::new("Section", 0, 8, 0.4, "%");

/// How far sections were open: feedback of their valves.
pub const SECTION_STATES: Message = Message {
    name: "SectionStates",
    pgn: 65_303,
    priority: 3,
    period_ms: Some(STATES_MS),
    len: 8,
    source: SPRAYER_ADDRESS,
    about: "what sections 1 to 8 let through at the nominal pressure, as a mean share of full flow since the last frame: drips and blocked nozzles show; 255 where the boom has no such section (proprietary B)",
    signals: &[
        Signal { name: "Section1", ..STATE },
        Signal { name: "Section2", start: 8, ..STATE },
        Signal { name: "Section3", start: 16, ..STATE },
        Signal { name: "Section4", start: 24, ..STATE },
        Signal { name: "Section5", start: 32, ..STATE },
        Signal { name: "Section6", start: 40, ..STATE },
        Signal { name: "Section7", start: 48, ..STATE },
        Signal { name: "Section8", start: 56, ..STATE },
    ],
};

/// The same of sections 9 to 16.
pub const MORE_SECTION_STATES: Message = Message {
    name: "MoreSectionStates",
    pgn: 65_304,
    about: "the same of sections 9 to 16 (proprietary B)",
    signals: &[
        Signal { name: "Section9", ..STATE },
        Signal { name: "Section10", start: 8, ..STATE },
        Signal { name: "Section11", start: 16, ..STATE },
        Signal { name: "Section12", start: 24, ..STATE },
        Signal { name: "Section13", start: 32, ..STATE },
        Signal { name: "Section14", start: 40, ..STATE },
        Signal { name: "Section15", start: 48, ..STATE },
        Signal { name: "Section16", start: 56, ..STATE },
    ],
    ..SECTION_STATES
};

/// What the sensors of the boom tell.
pub const SPRAYER_STATE: Message = Message {
    name: "SprayerState",
    pgn: 65_305,
    priority: 3,
    period_ms: Some(STATES_MS),
    len: 8,
    source: SPRAYER_ADDRESS,
    about: "pressure, flow, tank, regulating valve and the driver's switches; not available where the boom has no such sensor (proprietary B)",
    signals: &[
        Signal::new("Pressure", 0, 16, 0.01, "bar"),
        Signal::new("Flow", 16, 16, 0.01, "l/min")
            .about("through all nozzles, by the flow meter, as a mean since the last frame"),
        Signal::new("Tank", 32, 16, 0.1, "l").about("what is left in the tank"),
        Signal::new("RegulatorOpening", 48, 8, 0.4, "%").about("0 is shut: all flow to the nozzles"),
        Signal::choice("MasterSwitch", 56, 2, &[(0, "off"), (1, "on")]),
        Signal::choice("HeldShut", 58, 2, &[(0, "no"), (1, "yes")]),
        Signal::choice("TankEmpty", 60, 2, &[(0, "no"), (1, "yes")]),
    ],
};

/// What the flow meter counts.
pub const FLOW_METER: Message = Message {
    name: "FlowMeter",
    pgn: 65_306,
    priority: 3,
    period_ms: Some(STATES_MS),
    len: 8,
    source: SPRAYER_ADDRESS,
    about: "whole pulses of the flow meter (proprietary B)",
    signals: &[
        Signal::new("Pulses", 0, 32, 1.0, "").about("since the start"),
        Signal::new("PulseRate", 32, 16, 0.1, "Hz").about("as a mean since the last frame"),
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duties_count_from_the_first_nozzle_and_255_says_nothing() {
        let found: Vec<(u8, f64)> = nozzle_duties(&[3, 250, 255, 0, 125, 255, 255, 255]).collect();
        assert_eq!(found, [(3, 1.0), (5, 0.0), (6, 0.5)]);
        assert_eq!(nozzle_duties(&[0, 250]).collect::<Vec<_>>(), [(0, 1.0)]);
        assert_eq!(nozzle_duties(&[255, 250, 0, 0, 0, 0, 0, 0]).count(), 0);
        // What an encoder writes comes back.
        let duties = [Some(2.0), Some(40.0), None, Some(100.0)];
        let back: Vec<(u8, f64)> = nozzle_duties(NOZZLE_DUTY.encode(&duties).bytes()).collect();
        assert_eq!(back, [(2, 0.4), (4, 1.0)]);
    }

    #[test]
    fn sections_count_from_one_and_255_leaves_one_as_it_is() {
        let found = |pgn, data: &[u8]| section_duties(pgn, data).collect::<Vec<(u16, f64)>>();
        let data = [250, 0, 255, 125, 254, 255, 255, 25];
        assert_eq!(found(65_300, &data), [(1, 1.0), (2, 0.0), (4, 0.5), (8, 0.1)]);
        assert_eq!(found(65_307, &data), [(9, 1.0), (10, 0.0), (12, 0.5), (16, 0.1)]);
        assert_eq!(found(65_303, &data), [], "states are no commands");
        assert_eq!(found(65_300, &[250]), [(1, 1.0)]);
        // The bytes of a frame, as another controller would send them.
        let data = SECTION_DUTY.encode(&[Some(100.0), None, Some(62.0)]);
        assert_eq!(data.bytes(), [250, 255, 155, 255, 255, 255, 255, 255]);
        assert_eq!(SECTION_DUTY.id(0x27).id().bits(), 0x0CFF_1427);
    }

    #[test]
    fn a_controller_asks_for_an_opening_and_reports_its_litres() {
        let data = SPRAYER_CONTROL.encode(&[Some(25.2), Some(12.345)]);
        assert_eq!(data.bytes(), [63, 255, 255, 255, 0x39, 0x30, 0, 0]);
        let (opening, litres) = sprayer_control(data.bytes());
        assert!(
            (opening.expect("said") - 0.252).abs() < 1e-12 && (litres.expect("said") - 12.345).abs() < 1e-9
        );
        assert_eq!(sprayer_control(&[255; 8]), (None, None));
    }
}
