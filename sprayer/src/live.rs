//! A boom while it runs: it is told commands as they come, and tells what its sensors see. What it tells is what [`crate::Pass`] finds afterwards.

use rowscan_settings::fault_table::sprayer::SprayerFault;

use crate::boom::Boom;
use crate::commands::{Command, Target};
use crate::flow::Flow;
use crate::hydraulics::{Node, Signals};
use crate::span::Span;
use crate::tank;
use crate::troubles::Troubles;
use crate::valve::Step;

mod unseen;
mod valves;

use unseen::Unseen;
use valves::Valves;

/// What a reader sees. Shares are of the full flow at the nominal pressure, as a mean since its last look.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct States {
    /// By section's number: how far its valves were open, 0 to 1.
    pub sections: Vec<(u16, f64)>,
    /// By nozzle: how far its valve was open while there was something to spray, 0 to 1.
    pub nozzles: Vec<f64>,
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
    /// The driver's override asks for all valves shut.
    pub held_shut: bool,
    /// Nothing is left in the tank.
    pub tank_empty: bool,
}

/// Who looks at a boom. Each sees what was since its own last look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reader(usize);

/// A boom while it runs.
#[derive(Clone, Debug)]
pub struct Live {
    valves: Valves,
    pulses_per_l: f64,
    openings: Vec<Step>,
    node: Option<Node>,
    /// What leaves the tank at most, litres a second.
    most_l_s: f64,
    /// As far as it has come, seconds.
    at_s: f64,
    /// What has left the tank so far, litres.
    drawn_l: f64,
    pulses: f64,
    /// When the tank ran dry.
    dry_s: Option<f64>,
    /// By reader.
    unseen: Vec<Unseen>,
}

impl Live {
    /// `boom` at time 0, all shut. Phases of valves that run free follow from `seed`, as in [`crate::Pass`].
    pub fn new(boom: Boom, seed: u64) -> Self {
        let node = boom.hydraulics.map(|keys| Node::new(&boom, keys));
        let full_l_s: f64 = boom.nozzles().iter().map(|nozzle| nozzle.flow_l_s).sum();
        Self {
            most_l_s: node.as_ref().map_or(full_l_s, Node::pump_l_s),
            pulses_per_l: boom.sensors.unwrap_or_default().pulses_per_l,
            valves: Valves::new(boom, seed),
            openings: Vec::new(),
            node,
            at_s: 0.0,
            drawn_l: 0.0,
            pulses: 0.0,
            dry_s: None,
            unseen: Vec::new(),
        }
    }

    /// Someone who looks from now on.
    pub fn reader(&mut self) -> Reader {
        self.unseen.push(Unseen::new(self.at_s, self.valves.nozzles().len()));
        Reader(self.unseen.len() - 1)
    }

    /// A command was heard, not before the last look.
    pub fn tell(&mut self, command: &Command) {
        if command.target == Target::Regulator {
            self.openings.push((command.at.as_secs_f64(), command.duty.clamp(0.0, 1.0)));
        }
        self.valves.tell(command);
    }

    /// Looks at the sensors at `at_s`, with what has gone wrong so far and the tractor's speed over time, m/s. Looks come in the order of time.
    pub fn look(
        &mut self,
        reader: Reader,
        at_s: f64,
        troubles: &Troubles,
        speed_m_s: &dyn Fn(f64) -> f64,
    ) -> States {
        if at_s > self.at_s {
            self.go(at_s, troubles, speed_m_s);
        }
        let seen = self.unseen.get_mut(reader.0).map(|unseen| unseen.take(self.at_s)).unwrap_or_default();
        let is_now = |fault: SprayerFault| {
            troubles.0.iter().any(|trouble| {
                trouble.fault == fault && trouble.from <= at_s && trouble.to.is_none_or(|to| at_s < to)
            })
        };
        let flow_l_s = if seen.long_s > 0.0 { seen.metered_l / seen.long_s } else { 0.0 };
        let node = self.node.as_ref();
        States {
            sections: self.sections(&seen),
            nozzles: self.nozzles(&seen),
            flow_l_s,
            pulse_hz: flow_l_s * self.pulses_per_l,
            pulses: self.pulses,
            pressure_bar: node.map(|node| node.sensed_bar(at_s)),
            opening: node.map(Node::opening),
            // Once dry it stays dry, whatever hoses give back.
            tank_l: self.left_l().map(|left_l| if self.dry_s.is_some() { 0.0 } else { left_l.max(0.0) }),
            master_off: is_now(SprayerFault::MasterOff),
            held_shut: is_now(SprayerFault::HeldShut),
            tank_empty: self.dry_s.is_some() || is_now(SprayerFault::TankEmpty),
        }
    }

    /// Goes on to `at_s`.
    fn go(&mut self, at_s: f64, troubles: &Troubles, speed_m_s: &dyn Fn(f64) -> f64) {
        let since = Span::new(self.at_s, at_s);
        let open = self.valves.look(at_s, troubles);
        let at_m_s = self.valves.boom().rate.map_or(1.0, |rate| rate.at_m_s);
        let rate = |at: f64| speed_m_s(at) / at_m_s;
        // It may run dry now: then the pressure has fallen from that instant on.
        let most_l = self.most_l_s * since.length();
        let left_l = self.left_l().filter(|left_l| self.dry_s.is_none() && *left_l <= most_l);
        let before = left_l.and_then(|_| self.node.clone());
        self.press(&open, troubles, (&rate, at_s));
        if let Some(left_l) = left_l {
            let drawn_l = |span| tank::drawn_l(&open, self.node.as_ref(), span);
            self.dry_s = tank::runs_dry_s(left_l, since, drawn_l);
            if self.dry_s.is_some() && before.is_some() {
                self.node = before;
                self.press(&open, troubles, (&rate, at_s));
            }
        }
        let mut flows = open.clone();
        if let Some(dry_s) = self.dry_s {
            flows.iter_mut().for_each(|flow| flow.end(dry_s));
        }
        let litres_in = |span: Span| tank::litres_in(&flows, self.node.as_ref(), span);
        let metered_l: f64 = metering(troubles, since).map(|(span, ratio)| litres_in(span) * ratio).sum();
        self.drawn_l += tank::drawn_l(&flows, self.node.as_ref(), since);
        self.pulses += metered_l * self.pulses_per_l;
        self.unseen.iter_mut().for_each(|unseen| unseen.add(since, (&open, &flows), metered_l));
        self.at_s = at_s;
    }

    /// The pressure goes on to `at_s`.
    fn press(&mut self, open: &[Flow], troubles: &Troubles, (rate, at_s): (&dyn Fn(f64) -> f64, f64)) {
        if let Some(node) = &mut self.node {
            let pump = tank::pump(troubles.pump(), self.dry_s);
            node.advance(open, Signals { opening: &self.openings, pump: &pump, rate }, at_s);
        }
    }

    /// What is left in the tank.
    fn left_l(&self) -> Option<f64> {
        self.valves.boom().tank_l.map(|tank_l| tank_l - self.drawn_l)
    }

    /// How far each section's valves were open.
    fn sections(&self, seen: &unseen::Seen) -> Vec<(u16, f64)> {
        let of_section = |(place, number): (usize, u16)| {
            let own = self.valves.nozzles().iter().zip(&seen.open_l);
            let own = own.filter(|(nozzle, _)| nozzle.section == place);
            let (litres, full) = own.fold((0.0, 0.0), |(litres, full), (nozzle, open_l)| {
                (litres + open_l, full + nozzle.flow_l_s * seen.long_s)
            });
            (number, if full > 0.0 { litres / full } else { 0.0 })
        };
        self.valves.boom().numbers().enumerate().map(of_section).collect()
    }

    /// How far each nozzle's valve was open while there was something to spray.
    fn nozzles(&self, seen: &unseen::Seen) -> Vec<f64> {
        let own = self.valves.nozzles().iter().zip(&seen.sprayed_l);
        own.map(|(nozzle, sprayed_l)| {
            let full_l = nozzle.flow_l_s * seen.long_s;
            if full_l > 0.0 { sprayed_l / full_l } else { 0.0 }
        })
        .collect()
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
