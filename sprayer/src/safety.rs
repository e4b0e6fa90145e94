//! Rules that a machine must keep: when it must not spray, what it sprayed all the same, and how soon it was safe.

use serde::{Deserialize, Serialize};

use crate::flow::Flow;
use crate::pass::Pass;
use crate::span::{Span, Spans, total};
pub use crate::switches::Switches;
use crate::zones;

/// What rounding leaves of a time that is none, seconds.
const ROUNDING_S: f64 = 1e-9;

/// Why spraying is forbidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// The master switch is off.
    Master,
    /// The driver's override asks for all valves shut.
    Override,
    /// Nothing is left in the tank.
    TankEmpty,
    /// The tractor turns.
    Headland,
    /// It drives backwards.
    Reverse,
    /// It stands.
    Standstill,
    /// The nozzle is in a stretch that must not be sprayed.
    NoSpray,
}

impl Rule {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Master,
        Self::Override,
        Self::TankEmpty,
        Self::Headland,
        Self::Reverse,
        Self::Standstill,
        Self::NoSpray,
    ];

    /// What expectations and files call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Master => "master",
            Self::Override => "override",
            Self::TankEmpty => "tank_empty",
            Self::Headland => "headland",
            Self::Reverse => "reverse",
            Self::Standstill => "standstill",
            Self::NoSpray => "no_spray",
        }
    }

    /// The rule of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rule| rule.name() == name)
    }
}

/// What was sprayed against a rule.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Breach {
    /// The rule.
    pub rule: Rule,
    /// How much, and for how long it forbade.
    #[serde(flatten)]
    pub spilt: Spilt,
}

/// What was sprayed while that was forbidden.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spilt {
    /// For how long spraying was forbidden, less the time that valves are given, seconds; of the nozzle that was forbidden longest. A tractor that has not moved yet counts as one that stands only if something was sprayed then.
    pub forbidden_s: f64,
    /// Litres in that time; against an empty tank those that open valves would let through at full flow.
    pub litres: f64,
}

impl Spilt {
    /// True where spraying was forbidden at all.
    pub fn is_known(self) -> bool {
        self.forbidden_s > 0.0 || self.litres > 0.0
    }
}

/// When every rule forbade each nozzle to spray, and what it sprayed all the same.
#[derive(Clone, Debug)]
pub struct Forbidden<'a> {
    flows: &'a [Flow],
    /// Times by nozzle.
    by_rule: Vec<(Rule, Vec<Spans>)>,
}

impl<'a> Forbidden<'a> {
    /// Valves that are told at the instant at which a rule begins need `grace_s` seconds.
    pub fn new(pass: &Pass, flows: &'a [Flow], switches: &Switches, grace_s: f64) -> Self {
        let (drive, boom) = (pass.drive(), pass.boom());
        let (going, reversing, turning) =
            (drive.going(boom.standstill_m_s), drive.reversing(boom.standstill_m_s), drive.turning());
        let moving = going.or(&reversing).or(&turning);
        let later = |times: &Spans| {
            let rest = times.iter().map(|span| Span::new(span.from + grace_s, span.to));
            rest.filter(|span| span.length() > ROUNDING_S).collect::<Spans>()
        };
        let moved_s = moving.iter().next().map_or(f64::INFINITY, |span| span.from);
        // Every drive begins from a stand: it is no stop, though what is sprayed then is sprayed against the rule.
        let stood = |times: Spans| {
            let before = times.within(Span::new(f64::NEG_INFINITY, moved_s));
            let is_clean = total(flows.iter().map(|flow| flow.litres_in(&before))) <= 0.0;
            if is_clean { times.within(Span::new(moved_s, f64::INFINITY)) } else { times }
        };
        let of_all = [
            (Rule::Master, later(&switches.master_off)),
            (Rule::Override, later(&switches.held_shut)),
            (Rule::TankEmpty, later(&switches.tank_empty)),
            (Rule::Headland, later(&turning)),
            (Rule::Reverse, later(&reversing)),
            (Rule::Standstill, stood(later(&moving.gaps(pass.time())))),
        ];
        let in_zones =
            pass.nozzles().iter().map(|nozzle| later(&zones::within(boom, drive, nozzle))).collect();
        let by_rule = of_all
            .into_iter()
            .map(|(rule, times)| (rule, vec![times; flows.len()]))
            .chain([(Rule::NoSpray, in_zones)])
            .collect();
        Self { flows, by_rule }
    }

    /// When any rule forbids this nozzle, by its number, to spray.
    pub fn times(&self, nozzle: usize) -> Spans {
        let own = self.by_rule.iter().filter_map(|(_, times)| times.get(nozzle));
        own.fold(Spans::default(), |all, times| all.or(times))
    }

    /// Against this rule; against any of them, each instant and litre counted once, where there is none.
    pub fn spilt(&self, rule: Option<Rule>) -> Spilt {
        let rules = || self.by_rule.iter().filter(|(own, _)| rule.is_none_or(|rule| rule == *own));
        let by_nozzle = self.flows.iter().enumerate().map(|(nozzle, flow)| {
            let of = |is_empty: bool| {
                let own = rules().filter(move |(rule, _)| (*rule == Rule::TankEmpty) == is_empty);
                let times = own.filter_map(|(_, times)| times.get(nozzle));
                times.fold(Spans::default(), |all, times| all.or(times))
            };
            // Out of an empty tank nothing comes, whatever the controller does: what it opens is what it does wrong.
            let (empty, others) = (of(true), of(false));
            let times = others.or(&empty);
            let full_l = flow.valve.and(&empty).length() * flow.full_l_s;
            let rest: Spans = others
                .iter()
                .flat_map(|span| empty.gaps(*span).iter().copied().collect::<Vec<_>>())
                .collect();
            (times.length(), full_l + flow.litres_in(&rest))
        });
        let (forbidden_s, litres) = by_nozzle
            .fold((0.0, 0.0), |(longest, all): (f64, f64), (s, litres)| (longest.max(s), all + litres));
        Spilt { forbidden_s, litres }
    }

    /// Against every rule by itself.
    pub fn breaches(&self) -> Vec<Breach> {
        Rule::ALL.map(|rule| Breach { rule, spilt: self.spilt(Some(rule)) }).to_vec()
    }
}

/// True if no valve was open from `from` until `to`: there was nothing to make safe.
pub fn is_already_safe(flows: &[Flow], from: f64, to: f64) -> bool {
    let within = Span::new(from, to);
    flows.iter().all(|flow| flow.valve.iter().all(|span| span.common(within).is_none()))
}

/// How long after `from` the last valve shut, to stay shut until `to`: 0 where [`is_already_safe`]. None where one is still open at `to`.
pub fn time_to_safe_s(flows: &[Flow], from: f64, to: f64) -> Option<f64> {
    let within = Span::new(from, to);
    let open = flows.iter().flat_map(|flow| flow.valve.iter().filter_map(|span| span.common(within)));
    let last = open.map(|span| span.to).fold(from, f64::max);
    (last < to).then_some(last - from)
}
