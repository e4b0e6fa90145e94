//! The picture of a signal around the moment at which a verdict on it fell.

use std::path::PathBuf;

use rowscan_files::OutputFile;
use rowscan_protocol::time::SimTime;
use rowscan_study::figure::{Course, course};

use crate::judged::Judged;
use crate::runner::RunRecord;
use crate::scenario::Expect;

/// Seconds that are shown before and after that moment.
const BEFORE_S: f64 = 2.0;
const AFTER_S: f64 = 1.0;
/// Samples that are drawn; where there are more, the last before the end of the picture.
const DRAWN: usize = 5000;

/// Draws the signal of expectation number `number` into the run's folder, as `NUMBER-signal.svg`; none where nothing can be shown.
pub(crate) fn picture(number: usize, expect: &Expect, judged: &Judged, run: &RunRecord) -> Option<PathBuf> {
    let (keys, source) = (expect.signal.as_ref()?, expect.source.as_ref()?);
    let decided_s = judged.at.unwrap_or(run.ended).as_secs_f64();
    let (from_s, to_s) =
        ((decided_s - BEFORE_S).max(0.0), (decided_s + AFTER_S).min(run.ended.as_secs_f64()));
    let samples = source.samples(number, run, SimTime::ZERO).ok()?;
    let until = samples.iter().take_while(|sample| sample.at.as_secs_f64() <= to_s).count();
    let from = samples.iter().take_while(|sample| sample.at.as_secs_f64() < from_s).count();
    // What was heard last before it still holds.
    let shown = samples.get(from.saturating_sub(1).max(until.saturating_sub(DRAWN))..until)?;
    let shown = shown.iter().map(|sample| (sample.at.as_secs_f64().max(from_s), sample.value));
    let bounds = expect.bounds;
    let (least, most) = bounds.between.unzip();
    let unit = source.unit();
    let drawn = Course {
        title: expect.title(),
        name: if unit.is_empty() { keys.name.clone() } else { format!("{}, {unit}", keys.name) },
        names: source.named_values(),
        from_to_s: (from_s, to_s.max(from_s + 0.1)),
        samples: shown.collect(),
        bounds: [bounds.equals, bounds.above, bounds.below, least, most].into_iter().flatten().collect(),
        decided_s,
        events: run.events.iter().map(|event| (event.t_s, event.event.clone())).collect(),
    };
    let path = run.folder.join(format!("{}-signal.svg", number + 1));
    let written = OutputFile::create(&path).and_then(|file| file.write_whole(course(&drawn).as_bytes()));
    // The verdict stands without it.
    written.ok().map(|()| path)
}
