//! Timing two ways of one job, turn by turn, and telling the result.

use std::time::Instant;

/// Prints one line a case: JSON, or a table row for people.
pub struct Report {
    json: bool,
    begun: bool,
}

/// What a case is called and counted in.
pub struct Case {
    /// What was done.
    pub name: String,
    /// Unit of both values; more is better.
    pub unit: &'static str,
    /// What stands beside ours, with its version.
    pub peer: &'static str,
    /// Threads that ours used.
    pub threads: usize,
    /// Units of work in one run of ours, and of the peer.
    pub work: [f64; 2],
}

impl Report {
    /// Lines of JSON if `json`, else a table.
    pub fn new(json: bool) -> Self {
        Self { json, begun: false }
    }

    /// Runs both `rounds` times in turn, after one turn that does not count, and prints the best of each: on a machine with other work
    /// that is what either can do. Gives the ratio: how many times faster ours is.
    pub fn compare(&mut self, case: &Case, rounds: usize, ours: impl FnMut(), peer: impl FnMut()) -> f64 {
        let [ours, peer] = best_rates(case.work, rounds, ours, peer);
        self.more_is_better(case, ours, peer);
        ours / peer
    }

    /// As [`Self::compare`], but prints what a unit of work costs, in nanoseconds.
    pub fn compare_costs(&mut self, case: &Case, rounds: usize, ours: impl FnMut(), peer: impl FnMut()) {
        let [ours, peer] = best_rates(case.work, rounds, ours, peer);
        self.less_is_better(case, 1e9 / ours, 1e9 / peer);
    }

    /// Prints two values of which the greater is the better.
    pub fn more_is_better(&mut self, case: &Case, ours: f64, peer: f64) {
        self.line(case, ours, peer, ours / peer);
    }

    /// Prints two values of which the smaller is the better.
    pub fn less_is_better(&mut self, case: &Case, ours: f64, peer: f64) {
        self.line(case, ours, peer, peer / ours);
    }

    fn line(&mut self, case: &Case, ours: f64, peer: f64, ratio: f64) {
        let Case { name, unit, peer: of, threads, .. } = case;
        if self.json {
            let line = serde_json::json!({
                "case": name, "ours": ours, "unit": unit, "peer": of, "peer_value": peer, "ratio": ratio, "threads": threads,
            });
            println!("{line}");
            return;
        }
        if !self.begun {
            println!("{:<52} {:>10} {:>10} {:>7}  thr  unit, peer", "case", "ours", "peer", "ratio");
            self.begun = true;
        }
        println!("{name:<52} {ours:>10.2} {peer:>10.2} {ratio:>7.1}  {threads:>3}  {unit}, {of}");
    }
}

/// Units of work a second, the best of `rounds` turns.
fn best_rates(work: [f64; 2], rounds: usize, mut ours: impl FnMut(), mut peer: impl FnMut()) -> [f64; 2] {
    let mut rates = [0.0_f64; 2];
    for round in 0..=rounds {
        for (side, rate) in rates.iter_mut().enumerate() {
            let start = Instant::now();
            if side == 0 {
                ours()
            } else {
                peer()
            }
            if round > 0 {
                *rate = rate.max(work[side] / start.elapsed().as_secs_f64());
            }
        }
    }
    rates
}
