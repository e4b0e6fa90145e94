//! One drive of one boom past one orchard: what each nozzle should do, and what it does for a log of commands.

use rowscan_scenes::Orchard;

use crate::boom::{Boom, Nozzle};
use crate::commands::CommandLog;
use crate::drive::Drive;
use crate::flow::Flow;
use crate::hydraulics::{Node, Signals};
use crate::leaves::Area;
use crate::span::{Span, Spans};
use crate::switches::Switches;
use crate::tank;
use crate::troubles::Troubles;
use crate::valve::Step;
use crate::wanted::Passing;

/// A drive of a boom past an orchard.
#[derive(Clone, Debug)]
pub struct Pass {
    boom: Boom,
    nozzles: Vec<Nozzle>,
    drive: Drive,
    passing: Passing,
    /// Of valves that run free.
    seed: u64,
    troubles: Troubles,
    /// By nozzle.
    wanted: Vec<Spans>,
    /// By section.
    section_wanted: Vec<Spans>,
    /// Beginnings of the parts of the drive in which Y grows or falls only, with the metres driven before.
    ways: Vec<(f64, f64)>,
}

/// What a boom did.
#[derive(Clone, Debug)]
pub struct Delivery {
    /// By nozzle.
    pub flows: Vec<Flow>,
    /// Its pressure; none where that is constant.
    pub node: Option<Node>,
    /// When the tank ran dry, seconds; none where it did not.
    pub dry_s: Option<f64>,
}

impl Pass {
    /// Finds out what is wanted of each nozzle. Phases of valves that run free follow from `seed`.
    pub fn new(boom: Boom, orchard: &Orchard, drive: Drive, seed: u64) -> Self {
        let passing = Passing::of(&boom, orchard, &drive);
        let nozzles = boom.nozzles();
        let wanted: Vec<Spans> =
            nozzles.iter().map(|nozzle| passing.wanted(&boom, &drive, nozzle.number)).collect();
        let of_section = |section: usize| {
            let own = nozzles.iter().zip(&wanted).filter(move |(nozzle, _)| nozzle.section == section);
            own.flat_map(|(_, wanted)| wanted.iter().copied()).collect()
        };
        let section_wanted = (0..boom.sections.len()).map(of_section).collect();
        let mut way_m = 0.0;
        let parts = drive.pieces().iter().flat_map(|piece| piece.monotone().map(move |part| (piece, part)));
        let ways = parts
            .map(|(piece, part)| {
                let before_m = way_m;
                way_m += (piece.y_m(part.to) - piece.y_m(part.from)).abs();
                (part.from, before_m)
            })
            .collect();
        Self {
            boom,
            nozzles,
            drive,
            passing,
            seed,
            troubles: Troubles::default(),
            wanted,
            section_wanted,
            ways,
        }
    }

    /// The boom.
    pub fn boom(&self) -> &Boom {
        &self.boom
    }

    /// Its nozzles.
    pub fn nozzles(&self) -> &[Nozzle] {
        &self.nozzles
    }

    /// The drive.
    pub fn drive(&self) -> &Drive {
        &self.drive
    }

    /// Seed of the valves that run free.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// From the beginning to the end of the run, seconds.
    pub fn time(&self) -> Span {
        self.drive.time()
    }

    /// When each nozzle is wanted.
    pub fn wanted(&self) -> &[Spans] {
        &self.wanted
    }

    /// When each section is wanted: while any of its nozzles is.
    pub fn section_wanted(&self) -> &[Spans] {
        &self.section_wanted
    }

    /// The same with what goes wrong on the way.
    #[must_use]
    pub fn with_troubles(self, troubles: Troubles) -> Self {
        Self { troubles, ..self }
    }

    /// What goes wrong on the way.
    pub fn troubles(&self) -> &Troubles {
        &self.troubles
    }

    /// What comes out of each nozzle for these commands.
    pub fn flows(&self, log: &CommandLog) -> Vec<Flow> {
        self.deliver(log).flows
    }

    /// What comes out of each nozzle for these commands, and what the pressure does.
    pub fn deliver(&self, log: &CommandLog) -> Delivery {
        self.delivered(log, &self.troubles, self.boom.tank_l)
    }

    /// The same of a sound machine, with a tank that never runs dry.
    pub fn deliver_sound(&self, log: &CommandLog) -> Delivery {
        self.delivered(log, &Troubles::default(), None)
    }

    fn delivered(&self, log: &CommandLog, troubles: &Troubles, tank_l: Option<f64>) -> Delivery {
        let until_s = self.time().to;
        let flows =
            valve_flows((&self.boom, &self.nozzles, self.seed), log.duties(&self.boom), troubles, until_s);
        let at_m_s = self.boom.rate.map_or(1.0, |rate| rate.at_m_s);
        let rate = |at: f64| self.drive.speed_m_s(at) / at_m_s;
        let openings = log.openings();
        let pressure = |dry_s: Option<f64>| {
            let mut node = Node::new(&self.boom, self.boom.hydraulics?);
            let pump = tank::pump(troubles.pump(), dry_s);
            node.advance(&flows, Signals { opening: &openings, pump: &pump, rate: &rate }, until_s);
            Some(node)
        };
        let node = pressure(None);
        let dry_s = tank_l.and_then(|tank_l| {
            tank::runs_dry_s(tank_l, self.time(), |span| tank::drawn_l(&flows, node.as_ref(), span))
        });
        let node = if dry_s.is_some() { pressure(dry_s) } else { node };
        let mut flows = match &node {
            Some(node) => node.flows(flows),
            None => flows,
        };
        if let (None, Some(dry_s)) = (&node, dry_s) {
            flows.iter_mut().for_each(|flow| flow.end(dry_s));
        }
        if let Some(node) = &node {
            let fed = node.starved().gaps(self.time());
            flows.iter_mut().for_each(|flow| flow.open = flow.open.and(&fed));
        }
        Delivery { flows, node, dry_s }
    }

    /// When switches and tank forbid spraying, by what goes wrong and by a tank that ran dry.
    pub fn switches(&self, dry_s: Option<f64>) -> Switches {
        self.forbidden(&self.troubles, dry_s)
    }

    fn forbidden(&self, troubles: &Troubles, dry_s: Option<f64>) -> Switches {
        let until_s = self.time().to;
        let switches = troubles.switches(until_s);
        let dry = Spans::of(dry_s.map(|dry_s| Span::new(dry_s, until_s)));
        Switches { tank_empty: switches.tank_empty.or(&dry), ..switches }
    }

    /// The same of all nozzles at full flow while the tractor goes ahead in its alleys.
    pub fn constant_flows(&self) -> Vec<Flow> {
        let open = self.drive.going(self.boom.standstill_m_s);
        self.nozzles.iter().map(|nozzle| Flow::full(nozzle.flow_l_s, open.clone())).collect()
    }

    /// The first instant at which a sound section can be open: told to at the start of time, seconds.
    pub fn could_open_s(&self, section: usize) -> f64 {
        let own = self.nozzles.iter().filter(|nozzle| nozzle.section == section);
        let first = own.filter_map(|Nozzle { valve, number, .. }| {
            let flow = valve.flow(&[(0.0, 1.0)], (*number, self.seed), 1.0, self.time().to);
            flow.open.iter().next().map(|span| span.from)
        });
        first.fold(f64::INFINITY, f64::min)
    }

    /// When each section has an open nozzle.
    pub fn section_open(&self, flows: &[Flow]) -> Vec<Spans> {
        self.by_section(flows.iter().map(|flow| &flow.open))
    }

    /// When each section has an open valve, whether or not there is liquid behind it.
    pub(crate) fn section_valves(&self, flows: &[Flow]) -> Vec<Spans> {
        self.by_section(flows.iter().map(|flow| &flow.valve))
    }

    /// What the nozzles of each section cover together.
    fn by_section<'a>(&self, of_nozzles: impl Iterator<Item = &'a Spans> + Clone) -> Vec<Spans> {
        let of_section = |section: usize| {
            let own = self.nozzles.iter().zip(of_nozzles.clone());
            own.filter(|(nozzle, _)| nozzle.section == section)
                .flat_map(|(_, times)| times.iter().copied())
                .collect()
        };
        (0..self.boom.sections.len()).map(of_section).collect()
    }

    /// Leaf area that passes before nozzle number `number` in these times.
    pub fn area(&self, number: usize, times: &Spans) -> Area {
        self.passing.area(&self.drive, number, times)
    }

    /// Metres driven along the rows by `at`, either direction counted up.
    pub fn way_m(&self, at: f64) -> f64 {
        let next = self.ways.partition_point(|(from, _)| *from <= at);
        let Some((from, before_m)) = self.ways.get(next.saturating_sub(1)) else { return 0.0 };
        before_m + (self.drive.y_m(at) - self.drive.y_m(*from)).abs()
    }
}

/// What leaves each nozzle at the nominal pressure for these duties.
pub(crate) fn valve_flows(
    (boom, nozzles, seed): (&Boom, &[Nozzle], u64),
    commanded: Vec<Vec<Step>>,
    troubles: &Troubles,
    until_s: f64,
) -> Vec<Flow> {
    let duties = troubles.duties(boom, commanded);
    let each = nozzles.iter().zip(duties);
    let flows = each
        .map(|(nozzle, steps)| nozzle.valve.flow(&steps, (nozzle.number, seed), nozzle.flow_l_s, until_s));
    troubles.flows(boom, flows.collect(), until_s)
}
