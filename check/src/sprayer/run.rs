//! What a sprayer did in a run, beside what it should have done.

use std::sync::{Arc, OnceLock};

use rowscan_bus::isobus::role::SectionLog;
use rowscan_bus::transport::Assembly;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::{Orchard, Scene};
use rowscan_sprayer::interception::{Settings, intercept};
use rowscan_sprayer::safety::Forbidden;
use rowscan_sprayer::{
    Command, CommandLog, Delivery, Drive, Edges, Flow, Interception, Node, Pass, Rate, Score, Span, Spans,
    Target, Troubles, oracle,
};
use rowscan_vehicle::Tractor;
use serde::{Deserialize, Serialize};

use super::client;
use super::spec::SprayerSpec;
use crate::frames::BusRecord;

/// A controller that has reported nothing for more than so many of its longest pauses has stopped to.
const MOST_PAUSES: f64 = 2.0;

/// A nozzle that was wanted, and not forbidden, for longer could have been opened, seconds.
const LEAST_FREE_S: f64 = 1.0;

/// Parts that a message names, at most.
const MOST_NAMED: usize = 8;

/// A sprayer's run: all that can be said of it follows from these.
#[derive(Clone, Debug)]
pub struct SprayerRun {
    /// What was wanted.
    pub pass: Pass,
    /// What the controller said.
    pub log: CommandLog,
    /// What left the nozzles, by nozzle.
    pub flows: Vec<Flow>,
    /// Its scores.
    pub score: Score,
    /// Those of the best that this boom and these valves, sound ones, can do.
    pub oracle: Score,
    /// Its edges.
    pub edges: Edges,
    /// Its pressure; none where that is constant.
    pub node: Option<Node>,
    /// When its tank ran dry, seconds; none where it did not, or where nothing is known of it.
    pub dry_s: Option<f64>,
    /// How it kept its rate; none where the boom has no `[rate]`.
    pub rate: Option<Rate>,
    /// When the controller told how many litres it believes it has sprayed, seconds, and how many.
    pub reports: Vec<(f64, f64)>,
    /// Why it ended before its end, in words; none where it did not.
    pub cut_off: Option<String>,
    /// The scene, where it is a run that was kept.
    pub(super) scene: Option<Scene>,
    oracle_flows: Vec<Flow>,
    orchard: Arc<Orchard>,
    /// Found when it is asked for: it takes a second and more.
    interception: OnceLock<Intercepted>,
}

/// What the liquid of a run has met, beside that of others on the same drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Intercepted {
    /// The run's own.
    #[serde(flatten)]
    pub run: Interception,
    /// That of the best that this boom and these valves can do.
    pub oracle: Interception,
    /// That of all nozzles at full flow while the tractor goes ahead in its alleys.
    pub constant: Interception,
}

/// A run's scores as shares of the oracle's. None where either is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Relative {
    /// Of the recall.
    pub recall: Option<f64>,
    /// Of the litres.
    pub litres: Option<f64>,
    /// Of the score.
    pub score: Option<f64>,
}

/// The litres that a controller reported beside the true ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reported {
    /// The share by which they are off.
    pub error: f64,
    /// It had stopped to report so long before the run's end, seconds, and what was sprayed since counts; none where it had not.
    pub silent_s: Option<f64>,
}

impl SprayerRun {
    /// Of a run that ended at `ended`: who drove, what went wrong with the sprayer, what its bus carried, and what the sections of a task
    /// controller's client were told.
    pub(crate) fn of(
        spec: &SprayerSpec,
        (scene, orchard): (&Scene, &Orchard),
        ((tractor, ended), troubles): ((&Tractor, SimTime), Troubles),
        (bus, sections): (&BusRecord, &SectionLog),
    ) -> Result<Self, String> {
        if bus.lost > 0 {
            return Err(format!(
                "{} carried {} frames more than are kept; shorten the run",
                spec.bus, bus.lost
            ));
        }
        let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, ended);
        let pass = Pass::new(spec.boom.clone(), orchard, drive, scene.seed).with_troubles(troubles);
        let mut assembly = Assembly::default();
        let heard = bus.all.iter().filter_map(|carried| Some((carried.at, assembly.take(&carried.frame)?)));
        let (mut commands, mut reports) = (Vec::new(), Vec::new());
        for (at, (id, bytes)) in heard {
            let said = spec.commands(id, &bytes).into_iter();
            commands.extend(said.map(|(target, duty)| Command { at, target, duty }));
            reports.extend(spec.reported_litres(id, &bytes).map(|litres| (at.as_secs_f64(), litres)));
        }
        if spec.client.is_some() {
            commands.extend(client::commands(sections));
            commands.sort_by_key(|command| command.at);
        }
        let log = commands.into_iter().collect();
        Ok(Self { reports, ..Self::judged(pass, log, orchard.clone().into()) })
    }

    /// Of these commands on this pass of an orchard.
    pub fn judged(pass: Pass, log: CommandLog, orchard: Arc<Orchard>) -> Self {
        let Delivery { flows, node, dry_s } = pass.deliver(&log);
        let rate = pass.boom().rate.map(|keys| Rate::of(&pass, &keys, &flows, 0.0));
        let commanded = pass.deliver_sound(&log).flows;
        let score = Score::of(&pass, &flows).beside_sound(&commanded);
        let edges = Edges::of(&pass, &flows);
        // Valves that nobody has told anything say nothing of a controller.
        let score = if log.reaches(pass.boom()) { score } else { score.unheard() };
        let oracle_flows = pass.deliver_sound(&oracle::commands(&pass)).flows;
        let best = Score::of(&pass, &oracle_flows);
        let (reports, interception) = (Vec::new(), OnceLock::new());
        Self {
            pass,
            log,
            flows,
            score,
            oracle: best,
            oracle_flows,
            edges,
            node,
            dry_s,
            rate,
            reports,
            cut_off: None,
            scene: None,
            orchard,
            interception,
        }
    }

    /// How far the litres that the controller reported are off the true ones, from its first report after `from_s` on; none where that is unknown.
    pub fn reported(&self, from_s: f64) -> Option<Reported> {
        let reports: Vec<(f64, f64)> = self.reports.iter().filter(|(at, _)| *at >= from_s).copied().collect();
        let ([first, .., last], end_s) = (reports.as_slice(), self.pass.time().to) else { return None };
        let pause_s = reports.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max);
        let silent_s = Some(end_s - last.0).filter(|silent_s| *silent_s > MOST_PAUSES * pause_s);
        let times = Spans::of([Span::new(first.0, if silent_s.is_some() { end_s } else { last.0 })]);
        let litres: f64 = self.flows.iter().map(|flow| flow.litres_in(&times)).sum();
        (litres > 0.0).then(|| Reported { error: (last.1 - first.1) / litres - 1.0, silent_s })
    }

    /// Why nothing is known of what the controller spared, in words; none where it told a valve to open, or was never free to. Who opens nothing spares everything.
    pub fn idle(&self) -> Option<&'static str> {
        let commanded = self.pass.deliver_sound(&self.log).flows;
        let forbidden = self.forbidden(0.0);
        let mut free = self.oracle_flows.iter().enumerate().map(|(nozzle, flow)| {
            let times = forbidden.times(nozzle);
            flow.valve.iter().map(|span| times.gaps(*span).length()).sum::<f64>()
        });
        let is_idle = commanded.iter().all(|flow| flow.valve.is_empty());
        (is_idle && free.any(|free_s| free_s > LEAST_FREE_S)).then_some(
            "no valve was told to open in the whole run, though leaves were wanted: a controller that opens nothing spares everything",
        )
    }

    /// Litres against every rule, those of switches and tank by the faults of the run and by a tank that ran dry, from `grace_s` after a rule begins.
    pub fn forbidden(&self, grace_s: f64) -> Forbidden<'_> {
        Forbidden::new(&self.pass, &self.flows, &self.pass.switches(self.dry_s), grace_s)
    }

    /// On what its liquid would have fallen if it flew straight. Nothing is known of it where [`Self::unheard`] says why.
    pub fn interception(&self) -> &Intercepted {
        self.interception.get_or_init(|| {
            let constant = self.pass.constant_flows();
            let settings = Settings::new(self.pass.seed());
            let runs: [&[Flow]; 3] = [&self.flows, &self.oracle_flows, &constant];
            let mut found = intercept(&self.pass, &self.orchard, &runs, &settings).into_iter();
            let mut next = || found.next().unwrap_or_default();
            Intercepted { run: next(), oracle: next(), constant: next() }
        })
    }

    /// Why nothing is known of the controller, in words; none where a command was heard that names a part of the boom.
    pub fn unheard(&self) -> Option<String> {
        let (boom, count) = (self.pass.boom(), self.log.all().len());
        (!self.log.reaches(boom)).then(|| match count {
            0 => "no command was heard in the whole run".to_owned(),
            _ => format!(
                "{count} commands were heard, and none names a nozzle (0 to {}) or a section ({}) of the boom",
                boom.nozzles().len().saturating_sub(1),
                boom.numbers().map(|number| number.to_string()).collect::<Vec<_>>().join(", ")
            ),
        })
    }

    /// What commands opened that the boom lacks, in words; none where every part is there.
    pub fn unheeded(&self) -> Option<String> {
        let of = self.log.unheeded(self.pass.boom());
        let count: usize = of.iter().map(|unheeded| unheeded.commands).sum();
        let parts = of.iter().map(|unheeded| match unheeded.target {
            Target::Section(number) => format!("section {number}"),
            Target::Nozzle(number) => format!("nozzle {number}"),
            Target::Regulator => "the regulating valve (it takes `regulator = \"commanded\"`)".to_owned(),
            Target::All => "all".to_owned(),
        });
        let parts: Vec<String> = parts.collect();
        (count > 0).then(|| {
            let (shown, more) = parts.split_at(parts.len().min(MOST_NAMED));
            let more = if more.is_empty() { String::new() } else { format!(" and {} more", more.len()) };
            format!("{count} commands opened parts that the boom does not have: {}{more}", shown.join(", "))
        })
    }

    /// Duties between shut and open that on/off valves were told, in words; none where there was none.
    pub fn in_part(&self) -> Option<String> {
        let (count, least) = self.log.in_part(self.pass.boom())?;
        Some(format!(
            "{count} commands told on/off valves a duty between 0 and 100 % (the least {:.1} %), and such valves open for any above 0: a whole duty is 100 %, 250 in SectionDuties and NozzleDuty",
            100.0 * least
        ))
    }

    /// Its scores as shares of the oracle's.
    pub fn relative(&self) -> Relative {
        let share = |own: Option<f64>, best: Option<f64>| match (own, best) {
            (Some(own), Some(best)) if best > 0.0 => Some(own / best),
            _ => None,
        };
        let (own, best) = (&self.score, &self.oracle);
        Relative {
            recall: share(own.recall, best.recall),
            litres: share(Some(own.litres), Some(best.litres)),
            score: share(own.score, best.score),
        }
    }

    /// In a few words.
    pub(crate) fn words(&self) -> String {
        let told = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.3}"));
        let of = |score: &Score| {
            format!("recall {}, waste {}, {:.3} l", told(score.recall), told(score.waste), score.litres)
        };
        format!("{}; the oracle: {}", of(&self.score), of(&self.oracle))
    }
}
