//! A picture of a run: by metre and height what was wanted, delivered, missed and wasted, and the valves over time.

use std::fmt::Write;

use crate::boom::Side;
use crate::flow::Flow;
use crate::pass::Pass;
use crate::span::{Span, Spans};

/// Wanted and delivered, wanted and not, not wanted and delivered.
const COLOURS: [(&str, &str); 3] =
    [("#2e7d32", "wanted and sprayed"), ("#c62828", "missed"), ("#f9a825", "wasted")];
const WIDTH: f64 = 960.0;
const LEFT: f64 = 70.0;
const PANEL: f64 = 150.0;
const VALVE: f64 = 12.0;

/// The picture as SVG.
pub fn svg(pass: &Pass, flows: &[Flow], title: &str) -> String {
    let sides: Vec<Side> = [Side::Left, Side::Right]
        .into_iter()
        .filter(|side| pass.boom().sections.iter().any(|section| section.side == *side))
        .collect();
    let valves = pass.boom().sections.len() as f64 * VALVE;
    let height = 50.0 + sides.len() as f64 * (PANEL + 40.0) + valves + 60.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n<text x=\"{LEFT}\" y=\"18\" font-size=\"14\">{}</text>\n",
        escaped(title)
    );
    for (place, (colour, name)) in (0..).zip(COLOURS) {
        let x = LEFT + f64::from(place) * 160.0;
        let _ = writeln!(
            svg,
            "<rect x=\"{x}\" y=\"26\" width=\"10\" height=\"10\" fill=\"{colour}\"/><text x=\"{}\" y=\"35\">{name}</text>",
            x + 14.0
        );
    }
    let mut top = 50.0;
    for side in sides {
        places(&mut svg, pass, flows, side, top);
        top += PANEL + 40.0;
    }
    times(&mut svg, pass, flows, top);
    svg + "</svg>\n"
}

/// What is drawn of one nozzle or section: the spans of each colour.
fn parts(wanted: &Spans, open: &Spans, run: Span) -> [Spans; 3] {
    [wanted.and(open), wanted.and(&open.gaps(run)), open.and(&wanted.gaps(run))]
}

fn places(svg: &mut String, pass: &Pass, flows: &[Flow], side: Side, top: f64) {
    let run = pass.time();
    let longest_m = pass.way_m(run.to).max(1e-9);
    let own = pass.nozzles().iter().filter(|nozzle| nozzle.side == side);
    let heights = own.clone().map(|nozzle| nozzle.height);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), span| {
        (low.min(span.from), high.max(span.to))
    });
    let x = |at: f64| LEFT + pass.way_m(at) / longest_m * (WIDTH - LEFT - 20.0);
    let y = |z: f64| top + (high - z) / (high - low) * PANEL;
    for nozzle in own {
        let (Some(flow), Some(wanted)) = (flows.get(nozzle.number), pass.wanted().get(nozzle.number)) else {
            continue;
        };
        for ((colour, _), spans) in COLOURS.iter().zip(parts(wanted, &flow.open, run)) {
            let boxes = spans.iter().map(|span| (x(span.from), x(span.to) - x(span.from)));
            rects(svg, colour, boxes, y(nozzle.height.to), y(nozzle.height.from) - y(nozzle.height.to));
        }
    }
    let name = if side == Side::Left { "left" } else { "right" };
    frame(svg, (top, PANEL), name);
    for z in [low, high] {
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{z} m</text>",
            LEFT - 4.0,
            y(z) + 4.0
        );
    }
    axis(svg, top + PANEL, longest_m, "m driven");
}

fn times(svg: &mut String, pass: &Pass, flows: &[Flow], top: f64) {
    let run = pass.time();
    let x = |at: f64| LEFT + (at - run.from) / run.length().max(1e-9) * (WIDTH - LEFT - 20.0);
    let open = pass.section_open(flows);
    let all = pass.boom().sections.iter().zip(pass.section_wanted()).zip(&open);
    for (place, ((section, wanted), open)) in (0..).zip(all) {
        let y = top + f64::from(place) * VALVE;
        for ((colour, _), spans) in COLOURS.iter().zip(parts(wanted, open, run)) {
            rects(
                svg,
                colour,
                spans.iter().map(|span| (x(span.from), x(span.to) - x(span.from))),
                y + 1.0,
                VALVE - 2.0,
            );
        }
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" font-size=\"9\">{}</text>",
            LEFT - 4.0,
            y + VALVE - 3.0,
            escaped(&section.id)
        );
    }
    let height = pass.boom().sections.len() as f64 * VALVE;
    frame(svg, (top, height), "");
    axis(svg, top + height, run.length(), "s, by section");
}

/// Boxes of one height as one path.
fn rects(svg: &mut String, colour: &str, boxes: impl Iterator<Item = (f64, f64)>, y: f64, height: f64) {
    let mut path = String::new();
    for (x, width) in boxes {
        let _ = write!(path, "M{x:.2} {y:.1}h{width:.2}v{height:.1}h-{width:.2}z");
    }
    if !path.is_empty() {
        let _ = writeln!(svg, "<path fill=\"{colour}\" d=\"{path}\"/>");
    }
}

fn frame(svg: &mut String, (top, height): (f64, f64), name: &str) {
    let _ = writeln!(
        svg,
        "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{}\" height=\"{height}\" fill=\"none\" stroke=\"#666\"/><text x=\"4\" y=\"{:.1}\">{name}</text>",
        WIDTH - LEFT - 20.0,
        top + height / 2.0
    );
}

fn axis(svg: &mut String, y: f64, longest: f64, unit: &str) {
    for share in 0..=4 {
        let share = f64::from(share) / 4.0;
        let x = LEFT + share * (WIDTH - LEFT - 20.0);
        let unit = if share == 1.0 { format!(" {unit}") } else { String::new() };
        let anchor = if share == 1.0 { "end" } else { "middle" };
        let _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{:.2}{unit}</text>",
            y + 14.0,
            share * longest
        );
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
