//! A boom while it runs: it is told commands as they come, and tells what its sensors see. What it tells is what [`crate::Pass`] finds afterwards.

use rowscan_fault_table::sprayer::SprayerFault;

use crate::boom::Boom;
use crate::commands::{Command, Target};
use crate::flow::Flow;
use crate::hydraulics::{Node, Signals};
use crate::sensors::Sensors;
use crate::span::{Span, Spans};
use crate::troubles::Troubles;
use crate::valve::Step;

mod valves;

pub use valves::Valves;

/// What the sensors see.
#[derive(Clone, Debug, PartialEq)]
pub struct States {
    /// By section's number: how far its valves were open, as a mean since the last look, 0 to 1.
    pub sections: Vec<(u16, f64)>,
    /// What the flow meter saw, as a mean since the last look, litres a second.
    pub flow_l_s: f64,
    /// Pulses of the flow meter since the start; the last one may not be whole.
    pub pulses: f64,
    /// Pulses a second, as a mean since the last look.
    pub pulse_hz: f64,
    /// What the pressure sensor tells, bar; none where the pressure is not modelled.
    pub pressure_bar: Option<f64>,
    /// Where the regulating valve is, 0 to 1; none where there is none.
    pub opening: Option<f64>,
    /// What is left in the tank, litres; none where nothing is known of it.
    pub tank_l: Option<f64>,
    /// The master switch is off.
    pub master_off: bool,
    /// The driver holds the valves shut.
    pub held_shut: bool,
    /// Nothing is left in the tank.
    pub tank_empty: bool,
}

/// A boom while it runs.
#[derive(Clone, Debug)]
pub struct Live {
    valves: Valves,
    sensors: Sensors,
    openings: Vec<Step>,
    node: Option<Node>,
    /// Of the last look.
    litres: f64,
    pulses: f64,
}

impl Live {
    /// `boom` with these sensors at time 0, all shut. Phases of valves that run free follow from `seed`, as in [`crate::Pass`].
    pub fn new(boom: Boom, sensors: Sensors, seed: u64) -> Self {
        Self {
            node: boom.hydraulics.map(|keys| Node::new(&boom, keys)),
            valves: Valves::new(boom, seed),
            openings: Vec::new(),
            sensors,
            litres: 0.0,
            pulses: 0.0,
        }
    }

    /// A command was heard, not before the last look.
    pub fn tell(&mut self, command: &Command) {
        if command.target == Target::Regulator {
            self.openings.push((command.at.as_secs_f64(), command.duty.clamp(0.0, 1.0)));
        }
        self.valves.tell(command);
    }

    /// Looks at the sensors at `at_s`, with what has gone wrong so far and the tractor's speed over time, m/s. Looks come in the order of time.
    pub fn look(&mut self, at_s: f64, troubles: &Troubles, speed_m_s: &dyn Fn(f64) -> f64) -> States {
        let (since, flows) = self.valves.look(at_s, troubles);
        let sections = self.sections(&flows, since);
        if let Some(node) = &mut self.node {
            let at_m_s = self.valves.boom().rate.map_or(1.0, |rate| rate.at_m_s);
            let rate = |at: f64| speed_m_s(at) / at_m_s;
            node.advance(
                &flows,
                Signals { opening: &self.openings, pump: &troubles.pump(), rate: &rate },
                at_s,
            );
        }
        let node = self.node.as_ref();
        let litres_in = |span: Span| match node {
            Some(node) => node.balance(span).nozzles_l,
            None => flows.iter().map(|flow| flow.litres_in(&Spans::of([span]))).sum(),
        };
        let metered: f64 = metering(troubles, since).map(|(span, ratio)| litres_in(span) * ratio).sum();
        self.litres += litres_in(since);
        self.pulses += metered * self.sensors.pulses_per_l;
        let is_now = |fault: SprayerFault| {
            troubles.0.iter().any(|trouble| {
                trouble.fault == fault && trouble.from <= at_s && trouble.to.is_none_or(|to| at_s < to)
            })
        };
        let flow_l_s = if since.length() > 0.0 { metered / since.length() } else { 0.0 };
        States {
            sections,
            flow_l_s,
            pulse_hz: flow_l_s * self.sensors.pulses_per_l,
            pulses: self.pulses,
            pressure_bar: node.map(|node| node.sensed_bar(at_s)),
            opening: node.map(Node::opening),
            tank_l: self.sensors.tank_l.map(|tank_l| (tank_l - self.litres).max(0.0)),
            master_off: is_now(SprayerFault::MasterOff),
            held_shut: is_now(SprayerFault::HeldShut),
            tank_empty: is_now(SprayerFault::TankEmpty),
        }
    }

    /// How far each section's valves were open.
    fn sections(&self, flows: &[Flow], since: Span) -> Vec<(u16, f64)> {
        let times = Spans::of([since]);
        let full_s = since.length();
        let of_section = |(place, number): (usize, u16)| {
            let own = self.valves.nozzles().iter().zip(flows).filter(|(nozzle, _)| nozzle.section == place);
            let (litres, full) = own.fold((0.0, 0.0), |(litres, full), (_, flow)| {
                (litres + flow.litres_in(&times), full + flow.full_l_s * full_s)
            });
            (number, if full > 0.0 { litres / full } else { 0.0 })
        };
        self.valves.boom().numbers().enumerate().map(of_section).collect()
    }
}

/// The parts of a time in which the flow meter tells one share of the flow, with the shares.
fn metering(troubles: &Troubles, time: Span) -> impl Iterator<Item = (Span, f64)> {
    let own: Vec<(Span, f64)> = troubles
        .0
        .iter()
        .filter_map(|trouble| match trouble.fault {
            SprayerFault::FlowMeterOff(ratio) => Some((trouble.span().common(time)?, ratio)),
            _ => None,
        })
        .collect();
    let mut ends: Vec<f64> = own.iter().flat_map(|(span, _)| [span.from, span.to]).collect();
    ends.extend([time.from, time.to]);
    ends.sort_by(f64::total_cmp);
    let parts: Vec<Span> = ends.windows(2).map(|pair| Span::new(pair[0], pair[1])).collect();
    parts.into_iter().map(move |part| {
        let at = part.from.midpoint(part.to);
        let now = own.iter().filter(|(span, _)| (span.from..span.to).contains(&at));
        (part, now.map(|(_, ratio)| ratio).product())
    })
}

#[cfg(test)]
mod tests;
