//! The best that a boom and its valves can do: commands of one who knows every leaf.
//!
//! Of all commands to sections that leave no wanted time uncovered, those with the least litres at full duty: opened a dead time before, closed a dead time and the tail of
//! the flow before, and kept open where the valve could not close and open again in time. Of a proportional valve what is left of the flow before counts, too.

use rowscan_protocol::time::SimTime;

use crate::boom::Nozzle;
use crate::commands::{Command, CommandLog, Target};
use crate::pass::Pass;
use crate::span::{Span, Spans};
use crate::valve::{Kind, OPEN_SHARE, Phase, Valve};

/// The shortest pulse of current, seconds.
const SHORTEST_S: f64 = 1e-9;

/// The commands that cover all that is wanted with the least litres. They are said again as often as the boom's watchdog asks.
pub fn commands(pass: &Pass) -> CommandLog {
    let mut all = Vec::new();
    for ((place, number), wanted) in pass.boom().numbers().enumerate().zip(pass.section_wanted()) {
        let nozzles: Vec<&Nozzle> = pass.nozzles().iter().filter(|nozzle| nozzle.section == place).collect();
        let Some(valve) = nozzles.first().map(|nozzle| nozzle.valve) else { continue };
        let phases: Vec<f64> =
            nozzles.iter().map(|nozzle| valve.phase_s(nozzle.number, pass.seed())).collect();
        let pulses: Spans = match valve.kind {
            Kind::Proportional => settling(&valve, wanted),
            _ => wanted.iter().map(|span| pulse(&valve, &phases, *span)).collect(),
        };
        for span in pulses.iter() {
            let command = |at: u64, duty| Command { at: SimTime(at), target: Target::Section(number), duty };
            // To the nanosecond: sooner rather than too late, later rather than too soon.
            all.extend([
                command((span.from * 1e9).floor() as u64, 1.0),
                command((span.to * 1e9).ceil() as u64, 0.0),
            ]);
        }
    }
    let once: CommandLog = all.into_iter().collect();
    match pass.boom().watchdog_s {
        Some(watchdog_s) => said_again(&once, watchdog_s / 2.0),
        None => once,
    }
}

/// The same, said again every `every_s` while a section is open: a watchdog closes what it has not heard of for too long.
fn said_again(once: &CommandLog, every_s: f64) -> CommandLog {
    let (mut told, mut open) = (Vec::new(), 0_usize);
    for (n, command) in once.all().iter().enumerate() {
        told.push(*command);
        // Those of one section are on and off by turns.
        open = if command.duty > 0.0 { open + 1 } else { open.saturating_sub(1) };
        let Some(next) = once.all().get(n + 1).filter(|_| open > 0) else { continue };
        let (from_s, to_s) = (command.at.as_secs_f64(), next.at.as_secs_f64());
        let repeats = (1..).map(|n| from_s + f64::from(n) * every_s).take_while(|at| *at < to_s);
        told.extend(repeats.map(|at| Command { at: SimTime((at * 1e9) as u64), ..*command }));
    }
    told.into_iter().collect()
}

/// When current must flow for every nozzle to be open in all of `open`.
fn pulse(valve: &Valve, phases: &[f64], open: Span) -> Span {
    let (on_s, _) = valve.dead_s();
    let long_s = acting_s(valve, open.length());
    // Before the beginning of time nobody can say anything: what passes then is missed by everybody.
    let from = open.from - on_s;
    let (from, to) = (from.max(0.0), from + long_s);
    if valve.kind != Kind::Pwm || valve.phase != Phase::Free {
        return Span::new(from, to);
    }
    // A command acts at the next beginning of a period: of each nozzle, the last that is early enough, and the first that is late enough.
    let period_s = 1.0 / valve.hz;
    let starts = phases.iter().map(|phase| {
        let next = valve.next_period(from, *phase);
        if next > from + 1e-9 { next - period_s } else { next }
    });
    let from = starts.fold(from, f64::min).max(0.0);
    let ends = phases.iter().map(|phase| valve.next_period(to, *phase) - period_s + 2e-9);
    Span::new(from, ends.fold(from, f64::max))
}

/// How long current must flow for a nozzle to be open for `open_s`.
fn acting_s(valve: &Valve, open_s: f64) -> f64 {
    let (on_s, off_s) = valve.dead_s();
    let (rise_s, fall_s) = (valve.rise_ms / 1e3, valve.fall_ms / 1e3);
    let flowing_s = match valve.kind {
        _ if open_s - fall_s >= rise_s => open_s - fall_s,
        // It is closed before it is quite open: the tail is shorter.
        _ => open_s * rise_s / (rise_s + fall_s),
    };
    (flowing_s + on_s - off_s).max(valve.min_pulse_ms / 1e3).max(SHORTEST_S)
}

/// When current must flow for a proportional valve to be open in all of `wanted`.
fn settling(valve: &Valve, wanted: &Spans) -> Spans {
    let (on_s, off_s) = valve.dead_s();
    // Each with the time for which it is open, and what came before that.
    let mut pulses: Vec<(Span, Span, f64)> = Vec::new();
    for open in wanted.iter() {
        let (mut open, mut gap_s) =
            (*open, pulses.last().map_or(f64::INFINITY, |(_, last, _)| open.from - last.to));
        loop {
            let from = open.from - lead_s(valve, gap_s) - on_s;
            let to = open.to - tail_s(valve, open.length()) - off_s;
            match pulses.last() {
                // It cannot close and open again in time: both are one.
                Some((before, last, gap)) if from <= before.to => {
                    (open.from, gap_s) = (last.from, *gap);
                    pulses.pop();
                }
                _ => {
                    pulses.push((
                        Span::new(
                            from.max(0.0),
                            to.max(from + valve.min_pulse_ms.max(SHORTEST_S * 1e3) / 1e3),
                        ),
                        open,
                        gap_s,
                    ));
                    break;
                }
            }
        }
    }
    pulses.into_iter().map(|(pulse, ..)| pulse).collect()
}

/// From the first current, without the dead time, until a proportional valve counts as open, which it last did so long ago: it is not quite shut yet.
fn lead_s(valve: &Valve, gap_s: f64) -> f64 {
    -valve.tau_s * libm::log(1.0 - OPEN_SHARE + OPEN_SHARE * libm::exp(-gap_s / valve.tau_s))
}

/// How long a proportional valve still counts as open after it is told to close.
fn tail_s(valve: &Valve, open_s: f64) -> f64 {
    // Told to close p seconds after it was open it has come to 1 - 0.95 exp(-p/tau), and needs tau log of that over 0.05 more: halves until both are `open_s`.
    let (mut low, mut high) = (0.0, open_s);
    let tail = |p: f64| {
        let share = 1.0 - (1.0 - OPEN_SHARE) * libm::exp(-p / valve.tau_s);
        (valve.tau_s * libm::log(share / OPEN_SHARE)).max(0.0)
    };
    for _ in 0..60 {
        let p = f64::midpoint(low, high);
        if p + tail(p) < open_s { low = p } else { high = p }
    }
    tail(high)
}
