//! `what = "ddi"`: a value of an element of a task controller's client, as it was told on a bus.

use std::collections::BTreeSet;

use rowscan_bus::J1939Id;
use rowscan_bus::isobus::process_data::{ProcessData, command};
use rowscan_bus::isobus::role::IdleSetpoints;
use rowscan_bus::pgn::isobus::PROCESS_DATA;
use rowscan_protocol::time::SimTime;

use crate::judged::{Judged, Window};
use crate::runner::RunRecord;
use crate::scenario::{Expect, ProcessValue, merged};

/// A value that went over a bus.
struct Said {
    at: SimTime,
    /// Told by a client; else set by a task controller.
    is_told: bool,
    data: ProcessData,
}

/// All that was told of a value, and set of its setpoint, in the order of time.
fn said(wanted: ProcessValue, run: &RunRecord) -> Vec<Said> {
    let mut all = Vec::new();
    for bus in run.frames.values() {
        let data = bus.all.iter().filter_map(|carried| {
            let id = J1939Id::of(carried.frame.id).filter(|id| id.pgn == PROCESS_DATA.pgn)?;
            Some((carried.at, id.source, ProcessData::read(carried.frame.data())?))
        });
        // Task controllers are known by their status.
        let status = data.clone().filter(|(.., data)| data.command == command::SERVER_STATUS);
        let servers: BTreeSet<u8> = status.map(|(_, source, _)| source).collect();
        let values = data.filter(|(.., data)| {
            [command::VALUE, command::SET_AND_ACKNOWLEDGE].contains(&data.command)
                && data.element == wanted.element
        });
        all.extend(values.filter_map(|(at, source, data)| {
            let is_told = !servers.contains(&source);
            let ddi = if is_told { Some(wanted.ddi) } else { wanted.setpoint() };
            (ddi == Some(data.ddi)).then_some(Said { at, is_told, data })
        }));
    }
    all.sort_by_key(|said| said.at);
    all
}

/// Why the setpoint says nothing, in words, where each one that was set commanded the sprayer nothing: what it is then is so by chance.
fn without_effect(wanted: ProcessValue, said: &[Said], run: &RunRecord) -> Option<String> {
    let ddi = wanted.setpoint()?;
    let of = |idle: &&IdleSetpoints| (idle.first.ddi, idle.first.element) == (ddi, wanted.element);
    let idle = run.idle_setpoints.iter().filter(of);
    let set = said.iter().filter(|said| !said.is_told).count() as u64;
    (set > 0 && idle.map(|idle| idle.count).sum::<u64>() >= set).then(|| {
        format!("`ddi`: unknown: DDI {ddi} was set {set} times, and commanded nothing each time: it was never a setpoint")
    })
}

/// Judges it.
pub(crate) fn judge(expect: &Expect, run: &RunRecord) -> Result<Judged, String> {
    let wanted = expect.process.ok_or("`ddi` expects nothing yet; add `element`, `ddi` and `value`")?;
    let window = Window::of(expect.after.as_ref(), run)?;
    let (from, due) = (window.from, window.due(expect.within_s.unwrap_or_default()));
    let setpoint = wanted.setpoint();
    let said = said(wanted, run);
    let unknown = |what: String| format!("`ddi`: unknown: no {what} in the whole run");
    if !said.iter().any(|said| said.is_told) {
        return Err(unknown(format!("client told DDI {} of element {}", wanted.ddi, wanted.element)));
    }
    if wanted.number.is_none() && said.iter().all(|said| said.is_told) {
        return Err(unknown(format!("task controller set DDI {}", setpoint.unwrap_or_default())));
    }
    if wanted.number.is_none()
        && let Some(why) = without_effect(wanted, &said, run)
    {
        return Err(why);
    }
    let (mut told_last, mut set, mut first) = (None, None, None);
    // What was told over a connection that was given up since holds no more.
    let holds = |(told_at, _): &(SimTime, i32), at: SimTime| {
        !run.given_up.iter().any(|given_up| told_at <= given_up && *given_up <= at)
    };
    let mut rest = said.into_iter().peekable();
    while let Some(Said { at, is_told, data }) = rest.next_if(|said| said.at <= due) {
        if is_told {
            told_last = Some((at, data.value));
        } else {
            set = Some(merged(set, data.value, data.ddi));
        }
        // What is said up to the event, or at one instant after it, holds together.
        let is_last = rest.peek().is_none_or(|next| next.at > at.max(from));
        let told = told_last.filter(|told| holds(told, at.max(from))).map(|(_, value)| value);
        if is_last && wanted.is_so(told, set) {
            first = Some(at.max(from));
            break;
        }
    }
    let told = told_last.filter(|told| holds(told, due)).map(|(_, value)| value);
    let words =
        |value: Option<i32>| value.map_or("nothing".to_owned(), |value| format!("{value} ({value:#X})"));
    let s = |at: SimTime| at.as_secs_f64() - from.as_secs_f64();
    Ok(match first {
        Some(at) => {
            Judged::holds(true, format!("ddi{} after {:.3} s", wanted.title(), s(at))).at(at).due(due, at)
        }
        None if due > run.ended => {
            return Err(run.end().before("`within_s` was over"));
        }
        None => Judged::holds(
            false,
            format!(
                "expected ddi{} within {:.3} s, found {} told and {} set",
                wanted.title(),
                s(due),
                words(told),
                words(set)
            ),
        )
        .at(due),
    })
}
