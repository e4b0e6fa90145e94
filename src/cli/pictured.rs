//! Rows drawn as charts draw them, with returns over them.

use std::borrow::Cow;
use std::path::Path;

use rowscan_canopy::Estimate;
use rowscan_emulator::stage::Stage;
use rowscan_render::{Backdrop, Camera, Look, Mark, Model, Picture, render};
use rowscan_scenes::{Orchard, TruthGrid};
use rowscan_study::figure::{self, Metre, Metres, Sheet};

use super::Failure;
use super::output::{self, say};
use crate::export::{FigureFormat, SCALE, plate};

/// Colour of the returns in a demo's picture.
const RETURNS: [u8; 3] = [213, 94, 0];
/// Radius of a return, metres.
const RETURN_M: f64 = 0.011;
/// Of so many scans one is drawn: the trees are to be seen between them.
pub(super) const EVERY: u64 = 8;
/// Returns lower than this are those of the ground, metres.
const GROUND_M: f64 = 0.1;
/// Free room around the trees, metres.
pub(super) const ROOM_M: f64 = 0.3;

/// From which side a row is drawn. The row begins on the left, from every side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum From {
    /// The scanner's.
    Near,
    /// The other.
    Far,
    /// Above.
    Above,
}

/// What of a scene stands in a picture's window: along the row and upwards, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub(super) along_m: (f64, f64),
    pub(super) up_m: (f64, f64),
}

impl Extent {
    /// All that stands there, with some room.
    pub(super) fn of(model: &Model, from: From) -> Self {
        let [low, high] = model.extent();
        let up = if from == From::Above { 0 } else { 2 };
        let floor_m = if from == From::Above { low[up] - ROOM_M } else { low[up].min(0.0) };
        Self { along_m: (low[1] - ROOM_M, high[1] + ROOM_M), up_m: (floor_m, high[up] + ROOM_M) }
    }
}

/// Refuses a name that is no picture's, and a machine that cannot write it, before anything is grown.
pub(super) fn check(path: &Path) -> Result<(), Failure> {
    FigureFormat::of_picture(path)?.check()?;
    Ok(())
}

/// The picture for a sheet's window.
pub(super) fn window(
    model: &Model,
    sheet: &Sheet,
    extent: &Extent,
    from: From,
    pale: f64,
) -> Result<Picture, Failure> {
    let size = (sheet.window.width * SCALE, sheet.window.height * SCALE);
    let (begin, end) = extent.along_m;
    let high_m = (end - begin) * f64::from(size.1) / f64::from(size.0);
    let (along, up) = (0.5 * (begin + end), extent.up_m.0 + 0.5 * high_m);
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let (middle, axes) = match from {
        From::Near => ([0.0, along, up], [y, z, x]),
        From::Far => ([0.0, along, up], [y, z, [-1.0, 0.0, 0.0]]),
        From::Above => ([up, along, 0.0], [y, x, [0.0, 0.0, -1.0]]),
    };
    let camera = Camera::chart(middle, axes, end - begin, size)?;
    let backdrop = Backdrop::Paper { pale: pale as f32 };
    Ok(render(model, &camera, &Look { backdrop, returns_on_top: true, ..Look::default() }))
}

/// Writes a sheet with its picture.
pub(super) fn write(path: &Path, sheet: &Sheet, picture: &Picture) -> Result<(), Failure> {
    let file = plate(sheet, picture, FigureFormat::of_picture(path)?)?;
    output::write_file(path, &file)?;
    say(format_args!("wrote {}", path.display()));
    Ok(())
}

/// The picture of a demo: the row, what the scanner saw of it, and the estimate beside the truth by metre.
pub(super) fn demo(
    path: &Path,
    stage: &Stage,
    estimate: &Estimate,
    points: &[[f64; 3]],
) -> Result<(), Failure> {
    let half_m = 0.5 * stage.rig.row_spacing_m.unwrap_or(4.0);
    let seen = stage.row_seen(0);
    let axis_m = seen.row as f64 * stage.rig.row_spacing_m.unwrap_or(0.0);
    let shown = points.iter().filter(|[x, _, z]| *z > GROUND_M && (x - axis_m).abs() < half_m);
    let marks = shown.map(|at| Mark { at: *at, radius_m: RETURN_M, rgb: RETURNS }).collect();
    // Of several rows, the one that was passed.
    let alone = (stage.orchard.rows() > 1).then(|| {
        let trees = stage.orchard.trees_of_row(seen.row).map(Cow::into_owned).collect();
        let (tree_spacing_m, row_spacing_m) = (stage.orchard.tree_spacing_m(), stage.orchard.row_spacing_m());
        Orchard::from_trees(trees, stage.orchard.length_m(), tree_spacing_m, row_spacing_m)
    });
    let model = Model::of(alone.as_ref().unwrap_or(&stage.orchard), usize::MAX)?.with_marks(marks);
    let extent = Extent::of(&model, From::Near);
    let truth = stage.orchard.truth_of_row(seen.row, TruthGrid { slab_m: 1.0, ..TruthGrid::default() });
    let metres = truth.slabs.iter().map(|slab| {
        let y_m = 0.5 * (slab.y_from_m + slab.y_to_m);
        let slice = estimate.slices.iter().find(|slice| (slice.y_m - y_m).abs() < 0.25);
        Metre {
            y_m,
            truth_m2: slab.leaf_area_m2,
            estimate_m2: slice.and_then(|slice| slice.leaf.areas.best_m2().ok()),
        }
    });
    let total = |area_m2: Option<f64>| {
        area_m2.map_or_else(|| "unknown".to_owned(), |area_m2| format!("{area_m2:.1} m²"))
    };
    let sheet = figure::metres(&Metres {
        title: format!(
            "{}, seed {}: leaf area {} estimated, {} there",
            stage.scene.name,
            stage.scene.seed,
            total(estimate.leaf.areas.best_m2().ok()),
            total(Some(truth.leaf_area_m2))
        ),
        along_m: extent.along_m,
        up_m: extent.up_m.1 - extent.up_m.0,
        metres: metres.collect(),
        estimate: "leaf area estimated from the returns".to_owned(),
        returns: (format!("returns of one scan in {EVERY} received from the virtual scanner"), RETURNS),
    });
    let picture = window(&model, &sheet, &extent, From::Near, 0.15)?;
    write(path, &sheet, &picture)
}
