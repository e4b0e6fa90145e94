//! An edge in words: what the section did in the place of what was wanted, and where the tractor was.

use rowscan_sprayer::edges::EdgePair;
use rowscan_sprayer::{Edge, Spans};

use super::run::SprayerRun;

/// When it should have been; when it was where it should not.
pub(super) fn due_s(pair: &EdgePair) -> Option<f64> {
    pair.wanted_s.or(pair.delivered_s)
}

/// What this edge, due at `at_s`, was.
pub(super) fn words(sprayer: &SprayerRun, pair: &EdgePair, at_s: f64) -> String {
    let (verb, past, state) = match pair.edge {
        Edge::Open => ("open", "opened", "open"),
        Edge::Close => ("close", "closed", "shut"),
    };
    let of_section = |all: &[Spans]| State::of(all.get(pair.section), at_s);
    // The edge led to no other state: the section was so before.
    let is_old = |state: &State| state.is_on == (pair.edge == Edge::Open);
    let what = match (pair.wanted_s, pair.late_m) {
        (None, _) => {
            let wanted = of_section(sprayer.pass.section_wanted());
            let not = if wanted.is_on { "" } else { "not " };
            match is_old(&wanted) {
                true => format!("{past} at {at_s:.3} s, {not}wanted {} already", wanted.since()),
                false => format!("{past} for nothing at {at_s:.3} s"),
            }
        }
        (Some(_), None) => {
            let open = of_section(&sprayer.pass.section_open(&sprayer.flows));
            match is_old(&open) {
                true => {
                    format!("was {state} already, {}, when it was to {verb} at {at_s:.3} s", open.since())
                }
                false => format!("did not {verb} at {at_s:.3} s"),
            }
        }
        (Some(_), Some(late_m)) if late_m < 0.0 => {
            format!("{past} {:.3} m too soon, due at {at_s:.3} s", -late_m)
        }
        (Some(_), Some(late_m)) => format!("{past} {late_m:.3} m too late, due at {at_s:.3} s"),
    };
    let section = sprayer.pass.boom().sections.get(pair.section);
    format!(
        "section \"{}\" {what}, the tractor at {:.2} m",
        section.map_or("", |section| section.id.as_str()),
        sprayer.pass.drive().y_m(at_s),
    )
}

/// Whether something is on, and since when.
struct State {
    is_on: bool,
    /// None since the start.
    since_s: Option<f64>,
}

impl State {
    fn of(spans: Option<&Spans>, at_s: f64) -> Self {
        let last = spans.and_then(|spans| spans.iter().take_while(|span| span.from <= at_s).last());
        let is_on = last.is_some_and(|span| at_s < span.to);
        Self { is_on, since_s: last.map(|span| if is_on { span.from } else { span.to }) }
    }

    fn since(&self) -> String {
        self.since_s.map_or("since the start".to_owned(), |since_s| format!("since {since_s:.3} s"))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rowscan_protocol::time::SimTime;
    use rowscan_scenes::{Leaf, Orchard};
    use rowscan_sprayer::{Boom, Command, Drive, Pass, Target};
    use rowscan_vehicle::Tractor;
    use rowscan_vehicle::trajectory::Trajectory;

    use super::*;

    /// Commands: seconds and duty.
    type Told = &'static [(f64, f64)];

    /// Leaves from 3 to 5 m, one section beside the scanners, 1 m/s for 9 s; these commands.
    fn run(commands: &[(f64, f64)]) -> SprayerRun {
        let valve = "[valve]\non_ms = 100\noff_ms = 0\nrise_ms = 0\nfall_ms = 0";
        let text = format!(
            "version = 1\noffset_y_m = 0\nstrip_m = 0\njoin_m = 0\n{valve}\n[[section]]\nid = \"a\"\nside = \"right\"\nz_from_m = 0.5\nz_to_m = 1.5\nnozzles = 1\n"
        );
        let corners = [[0.0, 3.0, 0.5], [0.0, 5.0, 0.5], [0.0, 5.0, 1.5], [0.0, 3.0, 1.5]];
        let leaf = Leaf::new(corners).expect("a leaf");
        let orchard = Orchard::from_organs(vec![leaf], Vec::new(), f64::INFINITY);
        let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
        tractor.begin(SimTime::ZERO);
        let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime(9_000_000_000));
        let pass = Pass::new(Boom::read(&text).expect("a boom"), &orchard, drive, 1);
        let command = |(at, duty): &(f64, f64)| Command {
            at: SimTime((at * 1e9) as u64),
            target: Target::Section(1),
            duty: *duty,
        };
        SprayerRun::judged(pass, commands.iter().map(command).collect(), Arc::new(orchard))
    }

    #[test]
    fn what_was_so_before_is_told_with_since_when() {
        const ON: (f64, f64) = (0.1, 1.0);
        let cases: [(Told, &[&str]); 5] = [
            (
                &[ON],
                &[
                    "was open already, since 0.200 s, when it was to open at 3.000 s, the tractor at 3.00 m",
                    "did not close at 5.000 s, the tractor at 5.00 m",
                ],
            ),
            (&[ON, (7.0, 0.0)], &["closed at 7.000 s, not wanted since 5.000 s already"]),
            (
                &[],
                &[
                    "did not open at 3.000 s",
                    "was shut already, since the start, when it was to close at 5.000 s",
                ],
            ),
            (
                &[(3.9, 1.0), (5.2, 0.0)],
                &[
                    "opened at 4.000 s, wanted since 3.000 s already",
                    "closed 0.200 m too late, due at 5.000 s",
                ],
            ),
            (
                &[(0.9, 1.0), (2.0, 0.0), (2.7, 1.0), (4.0, 0.0)],
                &[
                    "opened for nothing at 1.000 s",
                    "opened 0.200 m too soon, due at 3.000 s",
                    "closed for nothing at 4.000 s",
                    "was shut already, since 4.000 s, when it was to close at 5.000 s",
                ],
            ),
        ];
        for (commands, expected) in cases {
            let run = run(commands);
            let told: Vec<String> =
                run.edges.all().iter().filter_map(|pair| Some(words(&run, pair, due_s(pair)?))).collect();
            for words in expected {
                let found = told.iter().any(|told| told.starts_with(&format!("section \"a\" {words}")));
                assert!(found, "{commands:?}: expected {words:?}, found {told:?}");
            }
        }
    }
}
