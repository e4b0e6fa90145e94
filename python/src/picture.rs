//! Pictures of an orchard: a drawing as SVG, a shaded picture as PNG.

use pyo3::prelude::*;
use rowscan_emulator::stage::Stage;
use rowscan_render::{Look, Model, render};
use rowscan_scenes::drawing::{self, Drawing};

use crate::failure::{Failure, Refusal};

/// From where a picture is taken, by the command line's names.
#[derive(Clone, Copy, Default)]
pub(crate) struct View(rowscan_render::View);

const VIEWS: [(&str, rowscan_render::View); 4] = [
    ("three-quarter", rowscan_render::View::ThreeQuarter),
    ("side", rowscan_render::View::Side),
    ("alley", rowscan_render::View::Alley),
    ("top", rowscan_render::View::Top),
];

impl<'py> FromPyObject<'_, 'py> for View {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let name: String = given.extract()?;
        let named = VIEWS.iter().find(|(known, _)| *known == name);
        let names = VIEWS.map(|(known, _)| known).join(", ");
        let unknown = || Refusal::Usage(format!("view: expected one of {names}, found `{name}`"));
        Ok(Self(named.ok_or_else(unknown)?.1))
    }
}

/// Front, side and top view.
pub(crate) fn svg(stage: &Stage, trees: Option<usize>, outlines: bool) -> String {
    let settings = Drawing { trees: trees.unwrap_or(usize::MAX), outlines, ..Drawing::default() };
    drawing::draw(&stage.orchard, &[], &settings, None)
}

/// A shaded picture.
pub(crate) fn png(
    stage: &Stage,
    view: View,
    size: (u32, u32),
    trees: Option<usize>,
) -> Result<Vec<u8>, Failure> {
    let model = Model::of(&stage.orchard, trees.unwrap_or(usize::MAX))?;
    let camera = view.0.camera(&model, size)?;
    let look = Look { season: stage.scene.orchard.season, ..Look::default() };
    Ok(render(&model, &camera, &look).png(None)?)
}
