//! Rows beside one alley without end repeat; where a drive turns on headlands, nothing stands behind their ends.

use rowscan_protocol::scan::Pose;
use rowscan_scenes::caster::{BeamFan, Caster, Class, Return, Scratch, brute::Oracle};
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{CellGrid, Orchard, RowCells};
use rowscan_vehicle::trajectory::Drive;

/// Places, posts and wires, and copies of few trees.
fn orchards() -> Vec<Orchard> {
    let of = |preset, distinct| OrchardParameters {
        rows: Some(2),
        trees: Some(4),
        distinct_trees: Some(distinct),
        ..OrchardParameters::of(preset)
    };
    let all = [
        of(Preset::FruitingWall, 2),
        of(Preset::FruitingWall, 0),
        of(Preset::Spindle, 3),
        of(Preset::Spindle, 0),
    ];
    all.iter().map(|parameters| Orchard::grow(parameters, 5, &|_, _| {}).unwrap()).collect()
}

/// Where the scanners are beside a row.
fn from(y_m: f64) -> Pose {
    Pose { x_m: -1.75, y_m, z_m: 1.6 }
}

fn fan() -> BeamFan {
    BeamFan::from_degrees(-60.0, 0.5, 241)
}

fn seen(caster: &Caster, y_m: f64) -> Vec<Return> {
    let mut found = vec![Return::MISS; fan().len()];
    caster.cast(from(y_m), &fan(), &mut Scratch::default(), &mut found);
    found
}

fn stands(found: &[Return]) -> usize {
    found.iter().filter(|hit| !matches!(hit.class, Class::Ground | Class::None)).count()
}

fn leaf_m2(cells: &RowCells, y_m: f64) -> f64 {
    cells.column(y_m).bands.iter().map(|band| band.areas.leaf_area_m2).sum()
}

#[test]
fn rows_end_where_a_drive_has_headlands_and_repeat_where_it_has_none() {
    // Farther out than any crown reaches over the row's end.
    const REACH_M: f64 = 2.5;
    for orchard in orchards() {
        let (length_m, grown) = (orchard.length_m(), orchard.clone());
        let with = |alleys| orchard.clone().beside(&Drive { alleys, ..Drive::default() });
        for alleys in [None, Some(1)] {
            assert_eq!(with(alleys), grown, "{alleys:?} alleys: nothing changes");
        }
        for alleys in [Some(2), Some(1000)] {
            let ended = with(alleys);
            assert_eq!((ended.length_m(), ended.period_m()), (length_m, f64::INFINITY));
            assert_eq!(ended.clone().beside(&Drive::default()), grown, "no going back and forth changes it");
        }
        let ended = with(Some(3));
        assert_eq!(ended.truth(), grown.truth(), "the same trees");
        let [here, there] = [&ended, &grown].map(Caster::new);
        let [cells, repeated] =
            [&ended, &grown].map(|orchard| orchard.cells_of_row(0, CellGrid::default()).unwrap());
        let (mut behind, mut behind_m2) = (0, 0.0);
        for step in 0..40 {
            let out_m = REACH_M + 0.0137 + 0.3171 * f64::from(step);
            for y_m in [-out_m, length_m + out_m] {
                assert_eq!((stands(&seen(&here, y_m)), leaf_m2(&cells, y_m)), (0, 0.0), "at {y_m} m");
                behind += stands(&seen(&there, y_m));
                behind_m2 += leaf_m2(&repeated, y_m);
            }
        }
        assert!(behind > 1000 && behind_m2 > 1.0, "rows repeat otherwise: {behind} {behind_m2}");
        // The row itself is as it was, away from what its repetitions reach into.
        let middle_m = 0.5 * length_m + 0.0171;
        assert_eq!(seen(&here, middle_m), seen(&there, middle_m));
        // The oracle of the casters has the same ends.
        let oracle = Oracle::new(&ended);
        for y_m in [-0.3171, 0.2171, middle_m, length_m + 0.4173, length_m + 2.7171] {
            let classes = |found: Vec<Return>| found.iter().map(|hit| hit.class).collect::<Vec<_>>();
            assert_eq!(classes(seen(&here, y_m)), classes(oracle.cast(from(y_m), &fan())), "at {y_m} m");
        }
    }
}
