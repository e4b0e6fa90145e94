//! A value over time, with what happened meanwhile: what a failed verdict shows.

use super::axis::Axis;
use super::canvas::{Canvas, Ink};
use super::chart::Chart;
use super::style::{INKS, Mark};

/// Pixels.
const SIZE: (u32, u32) = (900, 360);
/// Events that are named; more would cover each other.
const NAMED: usize = 8;

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    /// What is above it.
    pub title: String,
    /// What the value is, with its unit.
    pub name: String,
    /// Values that have a name, which then stands at the axis in place of numbers.
    pub names: Vec<(f64, String)>,
    /// From when to when, seconds.
    pub from_to_s: (f64, f64),
    /// Seconds and values, in their order; none where there is no value. Each holds until the next one.
    pub samples: Vec<(f64, Option<f64>)>,
    /// Values that bound what is expected.
    pub bounds: Vec<f64>,
    /// When the verdict fell, seconds.
    pub decided_s: f64,
    /// Seconds and names of what happened.
    pub events: Vec<(f64, String)>,
}

/// The figure, as SVG.
pub fn course(course: &Course) -> String {
    let (from_s, to_s) = course.from_to_s;
    let values = course.samples.iter().filter_map(|(_, value)| *value).chain(course.bounds.iter().copied());
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
    let room = if high > low { 0.15 * (high - low) } else { 1.0 };
    let (bottom, top) = (low - room, high + 2.0 * room);
    let mut canvas = Canvas::paper(SIZE);
    let area = canvas.all();
    let axes = (Axis::linear(from_s, to_s), Axis::linear(bottom, top));
    let mut chart = Chart::with_names(&mut canvas, area, &course.title, axes, &course.names);
    match course.names.as_slice() {
        [] => chart.axes("time, s", &course.name),
        names => chart.axes_with_names("time, s", &course.name, names),
    }
    for bound in &course.bounds {
        chart.path(&[(from_s, *bound), (to_s, *bound)], INKS[1].thinned(0.6), 1.0);
    }
    let events: Vec<&(f64, String)> =
        course.events.iter().filter(|(at_s, _)| (from_s..=to_s).contains(at_s)).collect();
    for (number, (at_s, name)) in events.iter().take(NAMED).enumerate() {
        chart.path(&[(*at_s, bottom), (*at_s, top)], Ink::BLACK.thinned(0.35), 1.0);
        // One below the other, so that events of one instant can be read.
        chart.label((*at_s, top - (0.35 + 0.6 * (number % 4) as f64) * 0.5 * room), name);
    }
    chart.path(&[(course.decided_s, bottom), (course.decided_s, top)], INKS[1], 2.0);
    for stretch in stretches(&course.samples, to_s) {
        chart.path(&stretch, INKS[0], 2.0);
    }
    let heard: Vec<(f64, f64)> =
        course.samples.iter().filter_map(|(at_s, value)| Some((*at_s, (*value)?))).collect();
    chart.marks(&heard, Mark::Disc, INKS[0]);
    canvas.svg()
}

/// The steps of the value, a path for each time in which there is one.
fn stretches(samples: &[(f64, Option<f64>)], to_s: f64) -> Vec<Vec<(f64, f64)>> {
    let mut all: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for (number, (at_s, value)) in samples.iter().enumerate() {
        let until_s = samples.get(number + 1).map_or(to_s, |(next_s, _)| *next_s);
        match (value, all.last_mut()) {
            (Some(value), Some(path)) => path.extend([(*at_s, *value), (until_s, *value)]),
            _ => all.push(Vec::new()),
        }
    }
    all.retain(|path| !path.is_empty());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_holds_until_the_next_and_stops_where_there_is_none() {
        let samples = [(0.0, Some(1.0)), (1.0, Some(2.0)), (2.0, None), (3.0, Some(0.0))];
        let expected = [vec![(0.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 2.0)], vec![(3.0, 0.0), (4.0, 0.0)]];
        assert_eq!(stretches(&samples, 4.0), expected);
        assert!(stretches(&[], 4.0).is_empty());
    }

    #[test]
    fn words_stay_within_the_picture_and_values_have_their_names() {
        let name = "a rather long name of an event".to_owned();
        let drawn = Course {
            title: "x".repeat(200),
            names: vec![(0.0, "closed".to_owned()), (1.0, "open".to_owned()), (9.0, "never".to_owned())],
            from_to_s: (0.0, 1.0),
            samples: vec![(0.0, Some(0.0)), (0.5, Some(1.0))],
            events: vec![(0.1, name.clone()), (0.98, name.clone())],
            ..Course::default()
        };
        let svg = course(&drawn);
        let line_of = |words: &str| svg.lines().filter(|line| line.contains(words)).collect::<Vec<_>>();
        let anchors: Vec<bool> =
            line_of(&name).iter().map(|line| line.contains("text-anchor=\"end\"")).collect();
        assert_eq!(anchors, [false, true], "{svg}");
        // Names in place of numbers, and none of a value that is not shown.
        assert!(svg.contains(">closed<") && svg.contains(">open<"), "{svg}");
        assert!(!svg.contains(">never<") && !svg.contains(">-0.2<"), "{svg}");
        let title =
            line_of(&drawn.title).pop().and_then(|line| line.split("font-size=\"").nth(1)?.split('"').next());
        let size: f64 = title.and_then(|size| size.parse().ok()).expect("its size");
        assert!(200.0 * 0.5 * size <= 900.0, "{size}");
    }

    #[test]
    fn events_beside_the_window_are_left_out_and_their_names_are_no_mark_up() {
        let events = vec![(0.5, "a <b>".to_owned()), (9.0, "later".to_owned())];
        let svg = course(&Course { from_to_s: (0.0, 1.0), events, ..Course::default() });
        assert!(svg.contains("a &lt;b&gt;") && !svg.contains("later"), "{svg}");
    }
}
