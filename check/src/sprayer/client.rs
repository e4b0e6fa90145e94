//! The sprayer as client of a task controller: what it tells of its boom, and what its sections were told.

use std::time::Duration;

use rowscan_bus::isobus::client::{
    IdleReason, IdleSetpoint, Machine as ClientMachine, OnLoss, SectionOrder, Seen, TaskClient,
};
use rowscan_bus::isobus::implement::{Implement, ImplementSection};
use rowscan_bus::isobus::process_data::refusal;
use rowscan_bus::isobus::role::{IdleSetpoints, Role, SectionLog};
use rowscan_bus::isobus::trouble::TroubleDesk;
use rowscan_protocol::time::SimTime;
use rowscan_sprayer::live::Reader;
use rowscan_sprayer::{Boom, Command, Side, Target};
use serde::Deserialize;

use super::machine::Machine;

/// A client looks at its machine so often: what valves do is told so much later at most.
const LOOK: Duration = Duration::from_millis(10);
/// A section works while it gives more than this share of its flow.
const WORKS: f64 = 0.5;

/// What sections do without their task controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum OnLossValue {
    /// They close.
    #[default]
    Close,
    /// They stay as they are.
    Hold,
}

/// Section control at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum SectionControlValue {
    /// The task controller's setpoints of sections have no effect before it sets DDI 160 to 1.
    #[default]
    Manual,
    /// They have.
    Automatic,
}

/// The sprayer as client of a task controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClientSpec {
    on_loss: OnLoss,
    section_control: SectionControlValue,
}

impl ClientSpec {
    /// Of these keys.
    pub(super) fn new(on_loss: Option<OnLossValue>, section_control: Option<SectionControlValue>) -> Self {
        let on_loss = match on_loss.unwrap_or_default() {
            OnLossValue::Close => OnLoss::Close,
            OnLossValue::Hold => OnLoss::Hold,
        };
        Self { on_loss, section_control: section_control.unwrap_or_default() }
    }

    /// The control function of this machine, between rows so far apart.
    pub(crate) fn role(
        &self,
        (boom, machine): (&Boom, Machine),
        row_spacing_m: Option<f64>,
        (log, troubles): (SectionLog, TroubleDesk),
    ) -> Role {
        let client = TaskClient::new(implement(boom, row_spacing_m), self.on_loss);
        let client = client.with_machine(Box::new(SeenMachine::new(machine)));
        let client = Box::new(match self.section_control {
            SectionControlValue::Manual => client,
            SectionControlValue::Automatic => client.in_automatic(),
        });
        Role::Client { client, log, troubles }
    }
}

/// The machine as its client sees it, by sensors of its own.
#[derive(Debug)]
struct SeenMachine {
    machine: Machine,
    reader: Reader,
    /// The last look, and when it was.
    seen: Option<(SimTime, Seen)>,
}

impl SeenMachine {
    fn new(machine: Machine) -> Self {
        Self { reader: machine.reader(), machine, seen: None }
    }
}

impl ClientMachine for SeenMachine {
    fn tell(&mut self, order: &SectionOrder) {
        self.machine.tell(&command(order));
    }

    fn look(&mut self, at: SimTime) -> Seen {
        if let Some((_, seen)) = self.seen.as_ref().filter(|_| self.next().is_some_and(|next| at < next)) {
            return seen.clone();
        }
        let mut states = self.machine.look(self.reader, at);
        states.sections.sort_by_key(|(number, _)| *number);
        let seen = Seen {
            open: states.sections.iter().map(|(_, share)| *share > WORKS).collect(),
            flow_l_min: states.flow_l_s * 60.0,
            tank_ml: states.tank_l.map(|tank_l| (tank_l * 1000.0).round() as i32),
        };
        self.seen = Some((at, seen.clone()));
        seen
    }

    fn next(&self) -> Option<SimTime> {
        self.seen.as_ref().map(|(at, _)| *at + LOOK)
    }
}

/// What a boom's client tells of it. Its sections stand in the order of their numbers: in condensed work states as well.
fn implement(boom: &Boom, row_spacing_m: Option<f64>) -> Implement {
    let mm = |m: f64| (m * 1000.0).round() as i32;
    let nozzles = boom.nozzles();
    let mut sections: Vec<ImplementSection> = boom
        .numbers()
        .zip(&boom.sections)
        .enumerate()
        .map(|(place, (number, section))| {
            let own = nozzles.iter().filter(|nozzle| nozzle.section == place);
            let (count, flow_l_s) =
                own.fold((0, 0.0), |(count, flow), nozzle| (count + 1, flow + nozzle.flow_l_s));
            ImplementSection {
                number,
                is_left: section.side == Side::Left,
                height_mm: (mm(section.z_from_m), mm(section.z_to_m)),
                nozzles: count,
                flow_l_min: flow_l_s * 60.0,
            }
        })
        .collect();
    sections.sort_by_key(|section| section.number);
    let slowest =
        |of: fn(&rowscan_sprayer::boom::Nozzle) -> f64| nozzles.iter().map(of).fold(0.0, f64::max).round();
    Implement {
        name: Implement::name(),
        width_mm: row_spacing_m.map_or(0, |spacing_m| mm(boom.swath_m(spacing_m))),
        behind_mm: mm(boom.offset_y_m),
        on_ms: slowest(|nozzle| nozzle.valve.on_ms) as i32,
        off_ms: slowest(|nozzle| nozzle.valve.off_ms) as i32,
        tank_ml: boom.tank_l.map(mm),
        sections,
    }
}

/// Setpoints that commanded nothing, in words.
pub(crate) fn idle_setpoints(log: &SectionLog) -> Vec<String> {
    log.idle().iter().map(idle_words).collect()
}

fn idle_words(IdleSetpoints { first, count }: &IdleSetpoints) -> String {
    let IdleSetpoint { at, element, ddi, why } = first;
    let why = match why {
        IdleReason::Reserved => {
            "to a reserved state (error or undefined): it commanded nothing, and was refused (0x40)".to_owned()
        }
        IdleReason::InManual => "while section control (DDI 160) was manual: it commanded nothing; set 160 to 1 first, or start with `section_control = \"automatic\"`".to_owned(),
        IdleReason::NoSuchSection => "and opened sections that the boom does not have".to_owned(),
        IdleReason::NotConnected => "while the client had no task controller (its pool not active, or no status for 6 s): it commanded nothing".to_owned(),
        IdleReason::OtherSender => "by another sender than the connected task controller: it commanded nothing".to_owned(),
        IdleReason::Refused(bits) => format!("and refused (0x{bits:02X}: {})", refusal::words(*bits)),
        other => format!("in vain ({other:?})"),
    };
    format!(
        "`sprayer.isobus`: DDI {ddi} of element {element} was set {count} times, first at {:.3} s, {why}",
        at.as_secs_f64()
    )
}

/// What sections were told, as commands.
pub(super) fn commands(log: &SectionLog) -> impl Iterator<Item = Command> + use<> {
    log.orders().into_iter().map(|order| command(&order))
}

fn command(order: &SectionOrder) -> Command {
    let duty = if order.is_open { 1.0 } else { 0.0 };
    Command { at: order.at, target: Target::Section(order.number), duty }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use std::sync::Arc;

    use rowscan_faults::{Order, Part};
    use rowscan_settings::fault_table::PartFault;
    use rowscan_settings::fault_table::sprayer::{SprayerFault, Valves};
    use rowscan_vehicle::Tractor;
    use rowscan_vehicle::trajectory::Trajectory;

    use super::super::part::SprayerPart;
    use super::*;

    #[test]
    fn a_boom_is_told_as_it_is() {
        let section = |id: &str, side: &str, number: u16, z_m: f64| {
            format!(
                "[[section]]\nid = \"{id}\"\nside = \"{side}\"\nnumber = {number}\nz_from_m = {z_m}\nz_to_m = {}\nnozzles = 2\n",
                z_m + 0.5
            )
        };
        let boom = format!(
            "version = 1\noffset_y_m = 1.5\ntank_l = 400\n[valve]\non_ms = 150\noff_ms = 100\n{}{}",
            section("high", "right", 4, 1.0),
            section("low", "left", 1, 0.5)
        );
        let told = implement(&Boom::read(&boom).expect("a boom"), Some(4.0));
        assert_eq!((told.width_mm, told.behind_mm, told.on_ms, told.off_ms), (4000, 1500, 150, 100));
        assert_eq!(told.tank_ml, Some(400_000));
        let one_sided = boom.replace("\"left\"", "\"right\"");
        let half = implement(&Boom::read(&one_sided).expect("a boom"), Some(4.0));
        assert_eq!(half.width_mm, 2000, "half an alley");
        let sections: Vec<_> = told
            .sections
            .iter()
            .map(|section| (section.number, section.is_left, section.height_mm, section.nozzles))
            .collect();
        assert_eq!(sections, [(1, true, (500, 1000), 2), (4, false, (1000, 1500), 2)]);
        assert!((told.sections[0].flow_l_min - 2.0).abs() < 1e-9);
        told.pool().check().expect("a sound pool");
    }

    /// What the client sees is what the boom's sensors see, of a sound machine and of one with faults.
    #[test]
    fn the_client_sees_the_machine_that_sensors_see() {
        let text = "version = 1\ntank_l = 0.05\n[valve]\non_ms = 150\noff_ms = 100\n[[section]]\nid = \"b\"\nnumber = 7\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\n\
                    [[section]]\nid = \"a\"\nnumber = 3\nside = \"left\"\nz_from_m = 0\nz_to_m = 1\n";
        let boom = Boom::read(text).expect("a boom");
        for fault in [None, Some(SprayerFault::CoilOpen(Valves::Section(3)))] {
            let part = Arc::new(SprayerPart::new(boom.clone(), None));
            let fault = fault.map(PartFault::Sprayer);
            if let Some(fault) = &fault {
                part.begin(&Order { key: 1, at: Duration::ZERO, fault, seed: 0, p: 1.0 });
            }
            let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
            let machine = Machine::new(boom.clone(), 1, part, tractor);
            let (reader, mut client) = (machine.reader(), SeenMachine::new(machine.clone()));
            let ms = |ms: u64| SimTime(ms * 1_000_000);
            client.look(SimTime::ZERO);
            for number in [3, 7] {
                client.tell(&SectionOrder { at: ms(200), number, is_open: true });
            }
            let mut told = Vec::new();
            for tick in 1..=400 {
                let (seen, states) = (client.look(ms(10 * tick)), machine.look(reader, ms(10 * tick)));
                let share = |number| {
                    states.sections.iter().find(|(own, _)| *own == number).map_or(0.0, |(_, share)| *share)
                };
                assert_eq!(seen.open, [share(3) > 0.5, share(7) > 0.5]);
                assert!((seen.flow_l_min - 60.0 * states.flow_l_s).abs() < 1e-9);
                assert_eq!(seen.tank_ml, states.tank_l.map(|l| (1000.0 * l).round() as i32));
                told.push(seen);
            }
            let opens =
                |place: usize| told.iter().position(|seen| seen.open[place]).map(|tick| 10 * (tick + 1));
            assert!(opens(1).is_some_and(|ms| (350..=370).contains(&ms)), "{:?}", opens(1));
            assert_eq!(opens(0), opens(1).filter(|_| fault.is_none()), "without current it stays shut");
            // Two litres a minute, or one: 50 ml are gone after 1.5 or 3 s.
            let dry = told.iter().position(|seen| seen.tank_ml == Some(0)).map(|tick| 10 * (tick + 1));
            let expected = if fault.is_none() { 1830..=1870 } else { 3330..=3370 };
            assert!(dry.is_some_and(|ms| expected.contains(&ms)), "{dry:?}");
        }
    }
}
