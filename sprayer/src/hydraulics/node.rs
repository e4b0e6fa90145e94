//! The node: its pressure from event to event.

use serde::{Deserialize, Serialize};

use super::plateau::{Plateau, plateaus};
use super::{Hydraulics, Regulator};
use crate::boom::Boom;
use crate::flow::{Course, Flow, Piece};
use crate::span::{Span, Spans};
use crate::valve::{OPEN_SHARE, Step};

/// Notches of the regulating valve from shut to open.
const NOTCHES: f64 = 100.0;
/// Shut, it lets through so much of what it does wide open.
const LEAK: f64 = 1e-3;
/// Below this the loop's aim does not go, as a share of the nominal pressure.
const LEAST_AIM: f64 = 0.01;

/// What acts on the node beside its nozzles.
#[derive(Clone, Copy)]
pub struct Signals<'a> {
    /// Openings of the regulating valve that are commanded, 0 to 1.
    pub opening: &'a [Step],
    /// Share of the pump's flow that it gives; all before the first step.
    pub pump: &'a [Step],
    /// The rate that is wanted at an instant, as a share of the nominal flow.
    pub rate: &'a dyn Fn(f64) -> f64,
}

/// A time between two events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// When, seconds.
    pub span: Span,
    /// Root of the pressure at its beginning, √bar.
    pub from: f64,
    /// Where it goes to.
    pub towards: f64,
    /// Time constant, seconds.
    pub tau_s: f64,
    /// What the pump gives, l/s.
    pub pump_l_s: f64,
    /// What nozzles take, l/s for 1 √bar.
    pub nozzles: f64,
    /// What the regulating valve takes, l/s for 1 √bar.
    pub returned: f64,
    /// Opening of the regulating valve.
    pub opening: f64,
    /// The relief valve is open and holds the pressure.
    pub relief: bool,
    /// What the sensor tells at its beginning, bar.
    pub sensed_bar: f64,
}

impl Segment {
    /// Root of the pressure at `at`, √bar.
    pub fn root(&self, at: f64) -> f64 {
        self.towards + (self.from - self.towards) * libm::exp(-(at - self.span.from) / self.tau_s)
    }

    /// Pressure at `at`, bar.
    pub fn pressure_bar(&self, at: f64) -> f64 {
        let root = self.root(at);
        root * root
    }

    /// What a sensor with this time constant tells at `at`, bar.
    pub fn sensed_bar(&self, at: f64, sensor_s: f64) -> f64 {
        if sensor_s <= 0.0 {
            return self.pressure_bar(at);
        }
        // The square of a + b e^(−t/τ) has the rates 1/τ and 2/τ; where the sensor's is one of them, it is shifted slightly.
        let ratio = [1.0, 2.0].into_iter().fold(sensor_s / self.tau_s, |ratio, rate| {
            if (1.0 - rate * ratio).abs() < 1e-6 { ratio * (1.0 + 2e-6) } else { ratio }
        });
        let (a, b) = (self.towards, self.from - self.towards);
        let (once, twice) = (2.0 * a * b / (1.0 - ratio), b * b / (1.0 - 2.0 * ratio));
        let t = at - self.span.from;
        let decay = |tau_s: f64| libm::exp(-t / tau_s);
        a * a
            + once * decay(self.tau_s)
            + twice * decay(self.tau_s / 2.0)
            + (self.sensed_bar - a * a - once - twice) * decay(ratio * self.tau_s)
    }

    /// Integral of the root over a part of it, √bar s.
    fn integral(&self, part: Span) -> f64 {
        self.towards * part.length()
            - (self.root(part.from) - self.towards) * self.tau_s * libm::expm1(-part.length() / self.tau_s)
    }
}

/// Where the litres of a stretch of time have come from and gone to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Balance {
    /// From the pump.
    pub pump_l: f64,
    /// Through nozzles.
    pub nozzles_l: f64,
    /// Back to the tank.
    pub returned_l: f64,
    /// Into hoses; negative where they gave.
    pub hoses_l: f64,
}

/// The node of a boom, from the beginning of time on as far as it has come.
#[derive(Clone, Debug)]
pub struct Node {
    keys: Hydraulics,
    /// Root of the boom's nominal pressure, √bar.
    nominal: f64,
    /// What each nozzle takes, l/s for 1 √bar.
    nozzles: Vec<f64>,
    pump_l_s: f64,
    /// Of the regulating valve wide open, l/s for 1 √bar.
    wide: f64,
    /// Of the hoses, litres for 1 √bar.
    hose: f64,
    at: f64,
    root: f64,
    sensed_bar: f64,
    opening: f64,
    /// Where its own loop sends the regulating valve: −1, 0 or 1.
    moving: f64,
    /// When it takes its next notch.
    notch_s: f64,
    /// Number of the next look of its loop.
    look: u64,
    segments: Vec<Segment>,
    pieces: Vec<Vec<Piece>>,
}

impl Node {
    /// The node of `boom` at time 0: all nozzles are shut and the pressure is steady.
    pub fn new(boom: &Boom, keys: Hydraulics) -> Self {
        let nominal = boom.pressure_bar.sqrt();
        let nozzles: Vec<f64> = boom.nozzles().iter().map(|nozzle| nozzle.flow_l_s / nominal).collect();
        let pump_l_s = keys.pump_l_min / 60.0 * keys.pto_rpm / keys.pump_rpm;
        let wide = keys.return_l_min.unwrap_or(keys.pump_l_min) / 60.0 / nominal;
        let all: f64 = nozzles.iter().sum();
        let opening = keys.opening.unwrap_or(((pump_l_s / nominal - all) / wide).clamp(0.0, 1.0));
        let root = (pump_l_s / (wide * opening.max(LEAK))).min(keys.relief_bar.sqrt());
        let count = nozzles.len();
        Self {
            keys,
            nominal,
            nozzles,
            pump_l_s,
            wide,
            hose: keys.hose_l / nominal,
            at: 0.0,
            root,
            sensed_bar: root * root,
            opening,
            moving: 0.0,
            notch_s: f64::INFINITY,
            look: 1,
            segments: Vec::new(),
            pieces: vec![Vec::new(); count],
        }
    }

    /// Goes on to `until_s`. `flows` are the nozzles' at the nominal pressure, complete as far as that.
    pub fn advance(&mut self, flows: &[Flow], signals: Signals<'_>, until_s: f64) {
        let plateaus: Vec<Vec<Plateau>> = flows.iter().map(|flow| plateaus(&flow.pieces, self.at)).collect();
        let mut next: Vec<usize> = vec![0; plateaus.len()];
        while self.at < until_s {
            // Which plateau each nozzle is on, and the first event of any.
            let mut end = until_s;
            let mut shares = vec![0.0; plateaus.len()];
            for ((all, next), share) in plateaus.iter().zip(&mut next).zip(&mut shares) {
                while all.get(*next).is_some_and(|plateau| plateau.span.to <= self.at) {
                    *next += 1;
                }
                match all.get(*next) {
                    Some(plateau) if plateau.span.from <= self.at => {
                        (*share, end) = (plateau.share, end.min(plateau.span.to));
                    }
                    Some(plateau) => end = end.min(plateau.span.from),
                    None => {}
                }
            }
            let pump = held(signals.pump, self.at).unwrap_or(1.0);
            end = end.min(later(signals.pump, self.at)).min(later(signals.opening, self.at));
            self.aim(held(signals.opening, self.at));
            let look_s = match self.keys.regulator {
                Regulator::Pressure | Regulator::Rate => self.look as f64 * self.keys.loop_s,
                Regulator::Fixed | Regulator::Commanded => f64::INFINITY,
            };
            end = end.min(self.notch_s).min(look_s);
            self.go(&shares, self.pump_l_s * pump, end);
            if self.at >= self.notch_s {
                self.take_notch(held(signals.opening, self.at));
            }
            if self.at >= look_s {
                self.look += 1;
                self.decide(signals);
            }
        }
    }

    /// Plans the next notch where the regulating valve is commanded to another opening.
    fn aim(&mut self, commanded: Option<f64>) {
        let notch_s = self.at + self.keys.travel_s / NOTCHES;
        match (self.keys.regulator, commanded) {
            (Regulator::Commanded, Some(aim)) if (aim - self.opening).abs() > 1e-9 => {
                self.notch_s = if self.notch_s.is_finite() { self.notch_s } else { notch_s };
            }
            (Regulator::Pressure | Regulator::Rate, _) if self.moving != 0.0 => {
                self.notch_s = if self.notch_s.is_finite() { self.notch_s } else { notch_s };
            }
            _ => self.notch_s = f64::INFINITY,
        }
    }

    fn take_notch(&mut self, commanded: Option<f64>) {
        self.notch_s = f64::INFINITY;
        let way = match (self.keys.regulator, commanded) {
            (Regulator::Commanded, Some(aim)) => aim - self.opening,
            _ => self.moving,
        };
        let opening = self.opening + way.clamp(-1.0 / NOTCHES, 1.0 / NOTCHES);
        self.opening = opening.clamp(0.0, 1.0);
    }

    /// Its own loop looks at the sensor.
    fn decide(&mut self, signals: Signals<'_>) {
        let share = match self.keys.regulator {
            Regulator::Rate => (signals.rate)(self.at),
            _ => 1.0,
        };
        // Where nothing is wanted, as at standstill, the valve stays where it is.
        let aim_bar = self.nominal * self.nominal * (share * share).max(LEAST_AIM);
        let off = self.sensed_bar / aim_bar - 1.0;
        self.moving = if off.abs() <= self.keys.dead || share <= 0.0 { 0.0 } else { off.signum() };
    }

    /// Goes on to `to`, with nothing that changes between.
    fn go(&mut self, shares: &[f64], pump_l_s: f64, to: f64) {
        let nozzles: f64 = self.nozzles.iter().zip(shares).map(|(nozzle, share)| nozzle * share).sum();
        let returned = self.wide * self.opening.max(LEAK);
        let (towards, tau_s) = (pump_l_s / (nozzles + returned), self.hose / (nozzles + returned));
        let most = self.keys.relief_bar.sqrt();
        let segment = |node: &Self, span, from, towards, relief| Segment {
            span,
            from,
            towards,
            tau_s,
            pump_l_s,
            nozzles,
            returned,
            opening: node.opening,
            relief,
            sensed_bar: node.sensed_bar,
        };
        // When the relief valve opens, if it does.
        let opens = if towards <= most {
            to
        } else if self.root >= most {
            self.at
        } else {
            (self.at + tau_s * libm::log((towards - self.root) / (towards - most))).min(to)
        };
        if opens > self.at {
            self.push(segment(self, Span::new(self.at, opens), self.root, towards, false), shares);
        }
        if opens < to {
            self.push(segment(self, Span::new(opens, to), most, most, true), shares);
        }
    }

    fn push(&mut self, segment: Segment, shares: &[f64]) {
        let to = segment.span.to;
        self.sensed_bar = segment.sensed_bar(to, self.keys.sensor_s);
        (self.at, self.root) = (to, segment.root(to));
        let (from, towards) = (segment.from / self.nominal, segment.towards / self.nominal);
        for (pieces, share) in self.pieces.iter_mut().zip(shares).filter(|(_, share)| **share > 0.0) {
            let course =
                Course::Settling { from: share * from, towards: share * towards, tau_s: segment.tau_s };
            pieces.push(Piece { span: segment.span, course });
        }
        self.segments.push(segment);
    }

    /// What has come out of each nozzle so far, where `flows` is what would have at the nominal pressure.
    pub fn flows(&self, flows: Vec<Flow>) -> Vec<Flow> {
        flows
            .into_iter()
            .zip(&self.pieces)
            .map(|(flow, pieces)| Flow { pieces: pieces.clone(), ..flow })
            .collect()
    }

    /// Its time so far, from event to event.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The segment at `at`; the last one after them all.
    pub fn segment(&self, at: f64) -> Option<&Segment> {
        let next = self.segments.partition_point(|segment| segment.span.from <= at);
        self.segments.get(next.saturating_sub(1))
    }

    /// When nothing worth the name leaves an open nozzle: while the pump gives nothing, whatever hoses still hold, and while the pressure gives it less than a
    /// twentieth of its nominal flow.
    pub fn starved(&self) -> Spans {
        let least = OPEN_SHARE * self.nominal;
        let of = |segment: &Segment| -> Option<Span> {
            let Segment { span, from, towards, tau_s, pump_l_s, .. } = *segment;
            // When the pressure goes through the least one, if it does.
            let crosses = span.from + tau_s * libm::log((from - towards) / (least - towards));
            match (from < least, towards < least) {
                _ if pump_l_s <= 0.0 => Some(span),
                (true, true) => Some(span),
                (true, false) => Some(Span::new(span.from, crosses.min(span.to))),
                (false, true) => Span::new(crosses, span.to).common(span),
                (false, false) => None,
            }
        };
        Spans::of(self.segments.iter().filter_map(of))
    }

    /// What its pressure sensor tells at `at`, bar.
    pub fn sensed_bar(&self, at: f64) -> f64 {
        self.segment(at).map_or(self.sensed_bar, |segment| segment.sensed_bar(at, self.keys.sensor_s))
    }

    /// Opening of its regulating valve now.
    pub fn opening(&self) -> f64 {
        self.opening
    }

    /// Time constant of its pressure sensor, seconds.
    pub fn sensor_s(&self) -> f64 {
        self.keys.sensor_s
    }

    /// What the pump gives with all its share, l/s.
    pub(crate) fn pump_l_s(&self) -> f64 {
        self.pump_l_s
    }

    /// Where the litres of `times` came from and went to.
    pub fn balance(&self, times: Span) -> Balance {
        let mut all = Balance::default();
        let first = self.segments.partition_point(|segment| segment.span.to <= times.from);
        let own = self.segments.iter().skip(first).take_while(|segment| segment.span.from < times.to);
        for segment in own {
            let Some(part) = segment.span.common(times) else { continue };
            let root_s = segment.integral(part);
            let pump_l = segment.pump_l_s * part.length();
            let (nozzles_l, regulated_l) = (segment.nozzles * root_s, segment.returned * root_s);
            all.pump_l += pump_l;
            all.nozzles_l += nozzles_l;
            // What the relief valve lets through is the rest.
            all.returned_l += if segment.relief { pump_l - nozzles_l } else { regulated_l };
            all.hoses_l += self.hose * (segment.root(part.to) - segment.root(part.from));
        }
        all
    }
}

/// What holds at `at`.
fn held(steps: &[Step], at: f64) -> Option<f64> {
    let next = steps.partition_point(|(from, _)| *from <= at);
    steps.get(next.wrapping_sub(1)).map(|(_, value)| *value)
}

/// The first step after `at`.
fn later(steps: &[Step], at: f64) -> f64 {
    steps.get(steps.partition_point(|(from, _)| *from <= at)).map_or(f64::INFINITY, |(from, _)| *from)
}
