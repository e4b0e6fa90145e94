//! What a sprayer did in a run, beside what it should have done.

use rowscan_bus::transport::Assembly;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::{Orchard, Scene};
use rowscan_sprayer::{Command, CommandLog, Drive, Edges, Flow, Pass, Score, oracle};
use rowscan_vehicle::Tractor;
use serde::{Deserialize, Serialize};

use super::spec::SprayerSpec;
use crate::frames::BusRecord;

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
    /// Those of the best that this boom and these valves can do.
    pub oracle: Score,
    /// Its edges.
    pub edges: Edges,
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

impl SprayerRun {
    /// Of a run that ended at `ended`: who drove, and what its bus carried.
    pub(crate) fn of(
        spec: &SprayerSpec,
        (scene, orchard): (&Scene, &Orchard),
        (tractor, ended): (&Tractor, SimTime),
        bus: &BusRecord,
    ) -> Result<Self, String> {
        if bus.lost > 0 {
            return Err(format!(
                "{} carried {} frames more than are kept; shorten the run",
                spec.bus, bus.lost
            ));
        }
        let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, ended);
        let mut assembly = Assembly::default();
        let heard = bus.all.iter().filter_map(|carried| Some((carried.at, assembly.take(&carried.frame)?)));
        let log = heard
            .flat_map(|(at, (id, bytes))| {
                let said = spec.commands(id, &bytes).into_iter();
                said.map(move |(target, duty)| Command { at, target, duty }).collect::<Vec<_>>()
            })
            .collect();
        Ok(Self::judged(Pass::new(spec.boom.clone(), orchard, drive, scene.seed), log))
    }

    /// Of these commands on this pass.
    pub fn judged(pass: Pass, log: CommandLog) -> Self {
        let flows = pass.flows(&log);
        let (score, edges) = (Score::of(&pass, &flows), Edges::of(&pass, &flows));
        // Valves that nobody has told anything say nothing of a controller.
        let score = if log.reaches(pass.boom()) { score } else { score.unheard() };
        let best = Score::of(&pass, &pass.flows(&oracle::commands(&pass)));
        Self { pass, log, flows, score, oracle: best, edges }
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
