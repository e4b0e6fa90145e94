//! When sections opened and closed, beside when they should have.

use serde::{Deserialize, Serialize};

use crate::flow::Flow;
use crate::pass::Pass;
use crate::span::{Span, Spans};

/// Edges farther apart than this are not one, metres driven.
pub const MATCH_M: f64 = 0.5;

/// What rounding leaves of an edge that came when it should have, seconds.
const ON_TIME_S: f64 = 1e-9;

/// From shut to open, or the other way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Edge {
    /// A section opens.
    Open,
    /// A section shuts.
    Close,
}

impl Edge {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Open, Self::Close];

    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Close => "close",
        }
    }
}

/// Why an edge says nothing of who commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Undecided {
    /// It should have been before any command could have opened the section.
    Unmeetable,
    /// It is alone, and its counterpart, wanted or delivered, may lie beyond the run: it ended too soon behind it, or began before leaves.
    CutOff,
}

/// An edge that was wanted, or delivered, or both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EdgePair {
    /// The section's place in the boom, from 0.
    pub section: usize,
    /// Which way.
    pub edge: Edge,
    /// When it should have been, seconds; none where it is spurious, or cut off.
    pub wanted_s: Option<f64>,
    /// When it was, seconds; none where it was missed, or cut off.
    pub delivered_s: Option<f64>,
    /// How much too late, seconds; negative too soon.
    pub late_s: Option<f64>,
    /// How far the tractor drove in that time, metres; negative too soon.
    pub late_m: Option<f64>,
    /// Speed ahead when it should have been, or was, m/s.
    pub speed_m_s: f64,
    /// Why it is neither missed, nor spurious, nor late; none where it is decided.
    pub undecided: Option<Undecided>,
}

impl EdgePair {
    /// It should have been, could have been, and was not.
    pub fn is_missed(&self) -> bool {
        self.delivered_s.is_none() && self.undecided.is_none()
    }

    /// It was, and should not have been.
    pub fn is_spurious(&self) -> bool {
        self.wanted_s.is_none() && self.undecided.is_none()
    }

    /// How much too late it was, seconds and metres; none where that says nothing of who commanded.
    fn late(&self) -> Option<(f64, f64)> {
        self.late_s.zip(self.late_m).filter(|_| self.undecided.is_none())
    }
}

/// All edges of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Edges(Vec<EdgePair>);

/// Edges in numbers. What no edge tells is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EdgeSummary {
    /// Edges that should have been.
    pub wanted: usize,
    /// Those of them that could have been and were not.
    pub missed: usize,
    /// Those of them that were wanted at the start, before any command could have opened the section: neither missed nor late.
    pub unmeetable: usize,
    /// Edges, wanted or delivered, whose counterpart the run's end or beginning may have cut off: neither missed nor spurious.
    pub cut_off: usize,
    /// Edges that should not have been.
    pub spurious: usize,
    /// Median of how much too late, s; negative too soon.
    pub p50_s: Option<f64>,
    /// 95th percentile of how much too late or too soon, without its sign, s: a missed edge is later than any number, and is none.
    pub p95_s: Option<f64>,
    /// The most, without its sign, s; none where an edge was missed.
    pub worst_s: Option<f64>,
    /// Median of how far too late, metres; negative too soon.
    pub p50_m: Option<f64>,
    /// 95th percentile of how far too late or too soon, without its sign, metres: a missed edge is farther than any number, and is none.
    pub p95_m: Option<f64>,
    /// The most, without its sign, metres; none where an edge was missed.
    pub worst_m: Option<f64>,
    /// The edges that came too soon: by how much, above 0.
    pub lead: Off,
    /// Those that came too late: by how much, above 0.
    pub lag: Off,
}

/// How far off the edges of one sign were; all are above 0. What no edge tells is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Off {
    /// How many edges.
    pub edges: usize,
    /// Median, s.
    pub p50_s: Option<f64>,
    /// 95th percentile, s.
    pub p95_s: Option<f64>,
    /// The most, s.
    pub worst_s: Option<f64>,
    /// Median, metres.
    pub p50_m: Option<f64>,
    /// 95th percentile, metres.
    pub p95_m: Option<f64>,
    /// The most, metres.
    pub worst_m: Option<f64>,
}

impl Off {
    /// Of edges that came too late; with `sign` −1 of those that came too soon. Seconds and metres may differ in sign in reverse: time decides.
    fn of<'a>(pairs: impl Iterator<Item = &'a EdgePair>, sign: f64) -> Self {
        let late = pairs.filter_map(EdgePair::late);
        let (s, m): (Vec<f64>, Vec<f64>) =
            late.filter(|(s, _)| s * sign > ON_TIME_S).map(|(s, m)| (s.abs(), m.abs())).unzip();
        Self {
            edges: s.len(),
            p50_s: quantile(s.clone(), 0.5),
            p95_s: quantile(s.clone(), 0.95),
            worst_s: quantile(s, 1.0),
            p50_m: quantile(m.clone(), 0.5),
            p95_m: quantile(m.clone(), 0.95),
            worst_m: quantile(m, 1.0),
        }
    }
}

impl Edges {
    /// Of what `flows`, one a nozzle, did on a pass. Edges that the run's beginning or end cuts are none. One that is alone within [`MATCH_M`] before the end is
    /// undecided, unless so much time was left that a tractor that goes would have driven as far; so is an opening as near behind the beginning of a run that
    /// begins before leaves.
    pub fn of(pass: &Pass, flows: &[Flow]) -> Self {
        let open = pass.section_open(flows);
        let (run, longest_s) = (pass.time(), MATCH_M / pass.boom().standstill_m_s);
        let is_near =
            |a: f64, b: f64| (pass.way_m(a) - pass.way_m(b)).abs() <= MATCH_M && (a - b).abs() <= longest_s;
        let mut all = Vec::new();
        for (section, (wanted, open)) in pass.section_wanted().iter().zip(&open).enumerate() {
            let could_open_s = pass.could_open_s(section);
            let begins_wanted = wanted.has(run.from);
            for edge in Edge::ALL {
                let (wanted, delivered) = (times(wanted, edge, pass.time()), times(open, edge, pass.time()));
                let way = |times: &[f64]| times.iter().map(|at| pass.way_m(*at)).collect::<Vec<_>>();
                // If a run begins before leaves, their opening was wanted before it. A late opening is matched with that one, not with that of the next leaves.
                let before = usize::from(edge == Edge::Open && begins_wanted);
                let from_beginning = [&vec![pass.way_m(run.from); before][..], &way(&wanted)].concat();
                for (a, b) in pairs(&from_beginning, &way(&delivered)) {
                    let is_before = a.is_some_and(|a| a < before);
                    if is_before && b.is_none() {
                        continue;
                    }
                    let a = a.and_then(|a| a.checked_sub(before));
                    let at = |times: &[f64], number: Option<usize>| {
                        number.and_then(|number| times.get(number).copied())
                    };
                    let (wanted_s, delivered_s) = (at(&wanted, a), at(&delivered, b));
                    let late = wanted_s.zip(delivered_s);
                    let speed_m_s = pass.drive().speed_m_s(wanted_s.or(delivered_s).unwrap_or_default());
                    let is_unmeetable = wanted_s.is_some_and(|wanted_s| wanted_s < could_open_s - ON_TIME_S);
                    let is_cut_off = wanted_s.xor(delivered_s).is_some_and(|alone_s| {
                        is_near(alone_s, run.to) || (is_before && is_near(alone_s, run.from))
                    });
                    let undecided = match (is_unmeetable, is_cut_off) {
                        (true, _) => Some(Undecided::Unmeetable),
                        (false, true) => Some(Undecided::CutOff),
                        (false, false) => None,
                    };
                    all.push(EdgePair {
                        section,
                        edge,
                        wanted_s,
                        delivered_s,
                        late_s: late.map(|(wanted, delivered)| delivered - wanted),
                        late_m: late.map(|(wanted, delivered)| pass.way_m(delivered) - pass.way_m(wanted)),
                        speed_m_s,
                        undecided,
                    });
                }
            }
        }
        Self(all)
    }

    /// All of them, by section, openings first, in the order of time.
    pub fn all(&self) -> &[EdgePair] {
        &self.0
    }

    /// Those that `which` holds for, in numbers.
    pub fn summary(&self, which: impl Fn(&EdgePair) -> bool) -> EdgeSummary {
        let chosen = || self.0.iter().filter(|pair| which(pair));
        let (late_s, late_m): (Vec<f64>, Vec<f64>) = chosen().filter_map(EdgePair::late).unzip();
        let away = |late: fn(&EdgePair) -> Option<f64>, share: f64| {
            quantile(off_with_missed(chosen(), late), share).filter(|off| off.is_finite())
        };
        EdgeSummary {
            wanted: chosen().filter(|pair| pair.wanted_s.is_some()).count(),
            missed: chosen().filter(|pair| pair.is_missed()).count(),
            unmeetable: chosen().filter(|pair| pair.undecided == Some(Undecided::Unmeetable)).count(),
            cut_off: chosen().filter(|pair| pair.undecided == Some(Undecided::CutOff)).count(),
            spurious: chosen().filter(|pair| pair.is_spurious()).count(),
            p50_s: quantile(late_s, 0.5),
            p95_s: away(|pair| pair.late_s, 0.95),
            worst_s: away(|pair| pair.late_s, 1.0),
            p50_m: quantile(late_m, 0.5),
            p95_m: away(|pair| pair.late_m, 0.95),
            worst_m: away(|pair| pair.late_m, 1.0),
            lead: Off::of(chosen(), -1.0),
            lag: Off::of(chosen(), 1.0),
        }
    }

    /// 95th percentile of how far wanted edges were off, metres: one that was missed is farther than any number. None where none was wanted that is decided.
    pub fn p95_with_missed_m(&self, edge: Option<Edge>) -> Option<f64> {
        let of_edge = |pair: &&EdgePair| edge.is_none_or(|edge| edge == pair.edge);
        quantile(off_with_missed(self.0.iter().filter(of_edge), |pair| pair.late_m), 0.95)
    }
}

/// How far off the wanted and decided ones of these edges were, without sign: a missed one is farther than any number.
fn off_with_missed<'a>(
    pairs: impl Iterator<Item = &'a EdgePair>,
    late: impl Fn(&EdgePair) -> Option<f64>,
) -> Vec<f64> {
    let decided = pairs.filter(|pair| pair.wanted_s.is_some() && pair.undecided.is_none());
    decided.map(|pair| late(pair).map_or(f64::INFINITY, f64::abs)).collect()
}

/// The nearest-rank quantile.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil().max(1.0) as usize;
    values.get(rank - 1).copied()
}

fn times(spans: &Spans, edge: Edge, run: Span) -> Vec<f64> {
    let at = spans.iter().map(|span| if edge == Edge::Open { span.from } else { span.to });
    at.filter(|at| *at > run.from + 1e-9 && *at < run.to - 1e-9).collect()
}

/// Which of `a` and `b`, both growing, belong together: each to one other at most, in their order, nearer than [`MATCH_M`], with the least sum of distances and of half that
/// for each that stays alone.
fn pairs(a: &[f64], b: &[f64]) -> Vec<(Option<usize>, Option<usize>)> {
    let mut all = Vec::new();
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        // A cluster: nothing in it is near anything outside it.
        let (from, mut last) = ((i, j), f64::NEG_INFINITY);
        loop {
            let next = match (a.get(i), b.get(j)) {
                (Some(one), Some(other)) => one.min(*other),
                (Some(one), None) | (None, Some(one)) => *one,
                (None, None) => break,
            };
            if last > f64::NEG_INFINITY && next - last > MATCH_M {
                break;
            }
            last = next;
            if a.get(i) == Some(&next) { i += 1 } else { j += 1 }
        }
        let (own, others) = (a.get(from.0..i).unwrap_or_default(), b.get(from.1..j).unwrap_or_default());
        let found = cluster(own, others).into_iter();
        all.extend(
            found.map(|(one, other)| (one.map(|one| one + from.0), other.map(|other| other + from.1))),
        );
    }
    all
}

/// The same of one cluster, by dynamic programming.
fn cluster(a: &[f64], b: &[f64]) -> Vec<(Option<usize>, Option<usize>)> {
    const ALONE: f64 = MATCH_M / 2.0;
    let width = b.len() + 1;
    // Least cost of what remains from each place on.
    let mut costs = vec![0.0; (a.len() + 1) * width];
    let cost = |costs: &[f64], i: usize, j: usize| costs.get(i * width + j).copied().unwrap_or(f64::INFINITY);
    for i in (0..=a.len()).rev() {
        for j in (0..=b.len()).rev() {
            let both = a.get(i).zip(b.get(j)).map(|(a, b)| (a - b).abs() + cost(&costs, i + 1, j + 1));
            let one = a.get(i).map(|_| ALONE + cost(&costs, i + 1, j));
            let other = b.get(j).map(|_| ALONE + cost(&costs, i, j + 1));
            let least = [both, one, other].into_iter().flatten().fold(f64::INFINITY, f64::min);
            if let Some(place) = costs.get_mut(i * width + j) {
                *place = if least.is_finite() { least } else { 0.0 };
            }
        }
    }
    let (mut i, mut j, mut found) = (0, 0, Vec::new());
    while i < a.len() || j < b.len() {
        let here = cost(&costs, i, j);
        let both = a.get(i).zip(b.get(j)).map(|(a, b)| (a - b).abs() + cost(&costs, i + 1, j + 1));
        if both.is_some_and(|both| both <= here) {
            found.push((Some(i), Some(j)));
            (i, j) = (i + 1, j + 1);
        } else if i < a.len() && ALONE + cost(&costs, i + 1, j) <= here {
            found.push((Some(i), None));
            i += 1;
        } else {
            found.push((None, Some(j)));
            j += 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_edge_is_matched_once_and_what_is_too_much_is_told() {
        let found = pairs(&[1.0, 2.0, 5.0], &[1.2, 2.2, 3.0, 9.0]);
        let wanted =
            [(Some(0), Some(0)), (Some(1), Some(1)), (None, Some(2)), (Some(2), None), (None, Some(3))];
        assert_eq!(found, wanted);
        // All late by the same: not the next one's.
        let edges: Vec<f64> = (0..40).map(|n| f64::from(n) * 0.4).collect();
        let late: Vec<f64> = edges.iter().map(|at| at + 0.15).collect();
        assert!(pairs(&edges, &late).iter().all(|(a, b)| a == b));
        assert_eq!(pairs(&[], &[]), []);
    }

    #[test]
    fn lead_and_lag_are_told_apart_and_have_all_edges_that_were_not_on_time() {
        // 100 ms too soon, 1 to 19 times 10 ms too late, one on time, one missed, one spurious; 2 m/s.
        let late = [-0.1, 0.0].into_iter().chain((1..20).map(|n| f64::from(n) * 0.01));
        let pair = |late_s: Option<f64>| EdgePair {
            section: 0,
            edge: Edge::Open,
            wanted_s: Some(1.0),
            delivered_s: late_s.map(|late_s| 1.0 + late_s),
            late_s,
            late_m: late_s.map(|late_s| late_s * 2.0),
            speed_m_s: 2.0,
            undecided: None,
        };
        let spurious = EdgePair { wanted_s: None, delivered_s: Some(3.0), ..pair(None) };
        let all = Edges(late.map(Some).chain([None]).map(pair).chain([spurious]).collect());
        let EdgeSummary { lead, lag, wanted, missed, spurious: alone, p95_s, worst_s, .. } =
            all.summary(|_| true);
        assert_eq!((wanted, missed, alone, lead.edges, lag.edges), (22, 1, 1, 1, 19));
        let about = |found: Option<f64>, expected: f64| (found.expect("known") - expected).abs() < 1e-12;
        assert!(about(lead.p50_s, 0.1) && about(lead.worst_s, 0.1) && about(lead.p95_m, 0.2), "{lead:?}");
        assert!(about(lag.p50_s, 0.10) && about(lag.p95_s, 0.19) && about(lag.worst_m, 0.38), "{lag:?}");
        assert_eq!(
            (p95_s.map(|s| (s * 1e3).round()), worst_s),
            (Some(190.0), None),
            "the worst is the missed one"
        );
        let heard = Edges(all.0.iter().copied().filter(|pair| !pair.is_missed()).collect());
        assert!(about(heard.summary(|_| true).worst_s, 0.19), "the worst of either");
        let half = Edges(vec![pair(Some(0.1)), pair(None)]).summary(|_| true);
        assert_eq!(
            (half.p50_s, half.p95_s, half.p95_m),
            (Some(0.1), None, None),
            "a missed edge is the later one"
        );
        // All the other way round: lead and lag change places.
        let turned = |pair: &EdgePair| EdgePair {
            late_s: pair.late_s.map(|s| -s),
            late_m: pair.late_m.map(|m| -m),
            ..*pair
        };
        let other = Edges(all.0.iter().map(turned).collect()).summary(|_| true);
        assert_eq!((other.lead, other.lag), (lag, lead));
        // What nobody could have met is told, and is nothing else.
        let at_start = |delivered_s| EdgePair { undecided: Some(Undecided::Unmeetable), ..pair(delivered_s) };
        let with: Vec<EdgePair> =
            all.0.iter().copied().chain([at_start(None), at_start(Some(0.4))]).collect();
        let with = Edges(with);
        let expected = EdgeSummary { wanted: 24, unmeetable: 2, ..all.summary(|_| true) };
        assert_eq!(with.summary(|_| true), expected);
        assert_eq!(with.p95_with_missed_m(None), all.p95_with_missed_m(None));
        assert_eq!(Edges(vec![at_start(None)]).p95_with_missed_m(None), None);
        // So is what the end cut off, wanted or delivered.
        let at_end = |pair| EdgePair { undecided: Some(Undecided::CutOff), ..pair };
        let cut = [at_end(pair(None)), at_end(spurious)];
        let expected = EdgeSummary { wanted: 23, cut_off: 2, ..all.summary(|_| true) };
        let with = Edges(all.0.iter().copied().chain(cut).collect());
        assert_eq!(with.summary(|_| true), expected);
        assert_eq!(with.p95_with_missed_m(None), all.p95_with_missed_m(None));
        assert_eq!(Edges::default().summary(|_| true).lag, Off::default(), "no edge, no number");
    }

    #[test]
    fn quantiles_are_of_what_is_there() {
        assert_eq!(quantile((1..=100).map(f64::from).collect(), 0.95), Some(95.0));
        assert_eq!((quantile(vec![3.0], 0.5), quantile(Vec::new(), 0.5)), (Some(3.0), None));
    }
}
