//! `Orchard`: what grows, with its truth.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use rowscan_emulator::stage::Stage;
use rowscan_scenes::files::{load_scene, scene_from_text};
use rowscan_scenes::{Cell, CellGrid, RowCells, Scene, Truth};
use rowscan_study::scene_with;

use crate::failure::{Failure, Refusal};
use crate::picture::{self, View};
use crate::seed::Seed;
use crate::{arrays, document, wait, warning};

/// A grown orchard, and what is really there. It never changes.
#[pyclass(frozen, module = "rowscan")]
pub(crate) struct Orchard {
    pub(crate) stage: Arc<Stage>,
    truth: OnceLock<Truth>,
}

/// Which orchard is meant: one that was grown, or the name of its scene.
#[derive(FromPyObject)]
pub(crate) enum SceneOf {
    /// One that was grown.
    Grown(Py<Orchard>),
    /// A built-in scene's name, or a scene file.
    Named(PathBuf),
}

impl SceneOf {
    /// The orchard, grown now where only its scene is named, with this seed and these optics instead of the scene's own.
    pub(crate) fn stage(
        self,
        py: Python<'_>,
        seed: Option<Seed>,
        optics: Option<&str>,
    ) -> PyResult<Arc<Stage>> {
        match self {
            Self::Named(name) => grown(py, scene(py, &name.to_string_lossy(), seed, optics)?),
            Self::Grown(_) if seed.is_some() || optics.is_some() => Err(Refusal::AlreadyGrown.into()),
            Self::Grown(orchard) => Ok(Arc::clone(&orchard.get().stage)),
        }
    }
}

/// The scene of this name with its seed and optics.
pub(crate) fn scene(py: Python<'_>, name: &str, seed: Option<Seed>, optics: Option<&str>) -> PyResult<Scene> {
    let mut scene = warning::of_file(py, |tell| load_scene(name, tell))?;
    scene.seed = seed.map_or(scene.seed, |seed| seed.0);
    if let Some(optics) = optics {
        scene.optics.stages = optics.parse().map_err(Failure::from)?;
    }
    Ok(scene)
}

/// Grows a scene.
pub(crate) fn grown(py: Python<'_>, scene: Scene) -> PyResult<Arc<Stage>> {
    wait::for_work(py, "grow the orchard", move || {
        Ok(Arc::new(Stage::grow(scene, &|_, _| {}).map_err(Refusal::Grow)?))
    })
}

/// The scene with keys set by name: `trees` is `orchard.trees`, and names with dots are what they say.
fn with_keys(scene: Scene, keys: &Bound<'_, PyDict>) -> PyResult<Scene> {
    if keys.is_empty() {
        return Ok(scene);
    }
    let mut settings = Vec::new();
    for (key, value) in keys {
        let key: String = key.extract()?;
        let key = if key.contains('.') { key } else { format!("orchard.{key}") };
        settings.push((key, document::value(&value)?));
    }
    Ok(scene_with(&scene, settings).map_err(Failure::from)?)
}

/// A column of cells, and its number for a cell.
type Column = (&'static str, fn(&Cell) -> f64);

/// An orchard from the text of its scene: what pickles hold.
#[pyfunction]
pub(crate) fn _orchard(py: Python<'_>, text: &str) -> PyResult<Orchard> {
    Orchard::of_scene(py, scene_from_text(text, |_| {}).map_err(Refusal::Usage)?)
}

impl Orchard {
    fn of_scene(py: Python<'_>, scene: Scene) -> PyResult<Self> {
        Ok(Self { stage: grown(py, scene)?, truth: OnceLock::new() })
    }

    fn truth(&self) -> &Truth {
        self.truth.get_or_init(|| self.stage.orchard.truth())
    }
}

#[pymethods]
impl Orchard {
    #[new]
    #[pyo3(signature = (scene = PathBuf::from("spindle"), *, seed = None, optics = None, **keys))]
    fn new(
        py: Python<'_>,
        scene: PathBuf,
        seed: Option<Seed>,
        optics: Option<&str>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let scene = self::scene(py, &scene.to_string_lossy(), seed, optics)?;
        let scene = keys.map_or(Ok(scene.clone()), |keys| with_keys(scene, keys))?;
        Self::of_scene(py, scene)
    }

    /// The same orchard, grown again where it is unpickled: its scene is all that it follows from.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let mut scene = self.stage.scene.clone();
        if let Some(file) = scene.files_mut().first() {
            let why = format!(
                "an orchard whose scene names a file ({}) cannot be pickled: pickle the scene's name",
                file.path()
            );
            return Err(Refusal::Usage(why).into());
        }
        let text = toml::to_string(&scene).map_err(Failure::from)?;
        Ok((py.import("rowscan._native")?.getattr("_orchard")?, (text,)))
    }

    /// Front, side and top view as SVG.
    #[pyo3(signature = (*, trees = None, outlines = false))]
    fn svg(&self, py: Python<'_>, trees: Option<usize>, outlines: bool) -> PyResult<String> {
        let stage = Arc::clone(&self.stage);
        wait::for_work(py, "draw the orchard", move || Ok(picture::svg(&stage, trees, outlines)))
    }

    /// A shaded picture as PNG.
    #[pyo3(signature = (view = View::default(), *, size = (1600, 900), trees = None))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        view: View,
        size: (u32, u32),
        trees: Option<usize>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let stage = Arc::clone(&self.stage);
        let drawn = wait::for_work(py, "draw the orchard", move || picture::png(&stage, view, size, trees))?;
        Ok(PyBytes::new(py, &drawn))
    }

    /// What a notebook shows of it.
    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        self.svg(py, None, false)
    }

    /// Name of the scene.
    #[getter]
    fn scene(&self) -> &str {
        &self.stage.scene.name
    }

    /// Seed of everything random.
    #[getter]
    fn seed(&self) -> u64 {
        self.stage.scene.seed
    }

    /// Number of rows.
    #[getter]
    fn rows(&self) -> usize {
        self.stage.orchard.rows()
    }

    /// Places of a row, gaps included.
    #[getter]
    fn trees_per_row(&self) -> usize {
        self.stage.orchard.trees_per_row()
    }

    /// Length of a row, metres.
    #[getter]
    fn length_m(&self) -> f64 {
        self.stage.orchard.length_m()
    }

    /// From row to row, metres; None where the scene does not say.
    #[getter]
    fn row_spacing_m(&self) -> Option<f64> {
        self.stage.orchard.row_spacing_m()
    }

    /// From tree to tree, metres; None where the scene does not say.
    #[getter]
    fn tree_spacing_m(&self) -> Option<f64> {
        self.stage.orchard.tree_spacing_m()
    }

    /// One-sided leaf area of the first row, m².
    #[getter]
    fn leaf_area_m2(&self) -> f64 {
        self.truth().leaf_area_m2
    }

    /// Lateral surface of the first row's wood, m².
    #[getter]
    fn wood_area_m2(&self) -> f64 {
        self.truth().wood_area_m2
    }

    /// Leaf area over ground of the first row; None where a spacing is unknown.
    #[getter]
    fn lai(&self) -> Option<f64> {
        self.truth().lai
    }

    /// What was done to the input that nobody asked for word by word.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.stage.orchard.remarks().iter().map(ToString::to_string).collect()
    }

    /// What `rowscan orchard truth --format json` writes of the first row.
    #[getter(truth)]
    fn truth_document(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        document::of(py, self.truth())
    }

    /// The trees of the first row, a dict each, in the order of their places.
    #[getter]
    fn trees(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        document::of(py, &self.truth().trees)
    }

    /// Areas by row, tree, cell along the row and height band: arrays of one length, by column.
    #[pyo3(signature = (cell_m = CellGrid::default().cell_m, band_m = CellGrid::default().band_m))]
    fn cells<'py>(&self, py: Python<'py>, cell_m: f64, band_m: f64) -> PyResult<Bound<'py, PyDict>> {
        for (name, found) in [("cell_m", cell_m), ("band_m", band_m)] {
            if !(found.is_finite() && found > 0.0) {
                return Err(Refusal::Usage(format!(
                    "{name}: expected a positive number of metres, found `{found}`"
                ))
                .into());
            }
        }
        let stage = Arc::clone(&self.stage);
        let cells = wait::for_work(py, "measure cells", move || {
            let rows = stage.orchard.cells(CellGrid { cell_m, band_m });
            Ok(rows.iter().flat_map(RowCells::cells).collect::<Vec<Cell>>())
        })?;
        let columns = PyDict::new(py);
        let whole = |of: fn(&Cell) -> u32| arrays::line(py, cells.iter().map(of).collect());
        columns.set_item("row", whole(|cell| cell.row as u32))?;
        columns.set_item("tree", whole(|cell| cell.tree))?;
        let numbers: [Column; 7] = [
            ("y_from_m", |cell| cell.y_from_m),
            ("y_to_m", |cell| cell.y_to_m),
            ("z_from_m", |cell| cell.z_from_m),
            ("z_to_m", |cell| cell.z_to_m),
            ("leaf_area_m2", |cell| cell.areas.leaf_area_m2),
            ("wood_area_m2", |cell| cell.areas.wood_area_m2),
            ("fruit_area_m2", |cell| cell.areas.fruit_area_m2),
        ];
        for (name, of) in numbers {
            columns.set_item(name, arrays::line(py, cells.iter().map(of).collect::<Vec<f64>>()))?;
        }
        Ok(columns)
    }

    /// Every leaf of every row.
    fn leaves(&self, py: Python<'_>) -> PyResult<Leaves> {
        let stage = Arc::clone(&self.stage);
        let found = wait::for_work(py, "gather the leaves", move || Ok(Found::of(&stage)))?;
        let Found { row, tree, area_m2, normal, centre_m, vertices_m, first } = found;
        Ok(Leaves {
            row: arrays::line(py, row),
            tree: arrays::line(py, tree),
            area_m2: arrays::line(py, area_m2),
            normal: arrays::points(py, normal)?,
            centre_m: arrays::points(py, centre_m)?,
            vertices_m: arrays::points(py, vertices_m)?,
            first: arrays::line(py, first),
        })
    }

    fn __repr__(&self) -> String {
        let Stage { scene, orchard, .. } = &*self.stage;
        let (rows, trees) = (orchard.rows(), orchard.trees_per_row());
        format!("<rowscan.Orchard {} seed {}: {rows} × {trees} places>", scene.name, scene.seed)
    }
}

/// Leaves as arrays, one entry a leaf.
#[pyclass(frozen, get_all, module = "rowscan")]
pub(crate) struct Leaves {
    /// The row, from 0: uint32, (leaves,).
    row: Py<PyArray1<u32>>,
    /// Place of the tree in its row, from 0: uint32, (leaves,).
    tree: Py<PyArray1<u32>>,
    /// One-sided area: m², (leaves,).
    area_m2: Py<PyArray1<f64>>,
    /// Unit normal: (leaves, 3).
    normal: Py<PyArray2<f64>>,
    /// Centroid: metres, (leaves, 3).
    centre_m: Py<PyArray2<f64>>,
    /// The outlines' vertices, leaf after leaf: metres, (vertices, 3).
    vertices_m: Py<PyArray2<f64>>,
    /// Where each leaf's outline begins in `vertices_m`, and where the last one ends: uint64, (leaves + 1,).
    first: Py<PyArray1<u64>>,
}

#[pymethods]
impl Leaves {
    #[new]
    /// The arrays, in their order: what pickles hold.
    fn new(
        row: Py<PyArray1<u32>>,
        tree: Py<PyArray1<u32>>,
        area_m2: Py<PyArray1<f64>>,
        normal: Py<PyArray2<f64>>,
        centre_m: Py<PyArray2<f64>>,
        vertices_m: Py<PyArray2<f64>>,
        first: Py<PyArray1<u64>>,
    ) -> Self {
        Self { row, tree, area_m2, normal, centre_m, vertices_m, first }
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let arrays = [
            self.row.bind(py).as_any(),
            self.tree.bind(py).as_any(),
            self.area_m2.bind(py).as_any(),
            self.normal.bind(py).as_any(),
            self.centre_m.bind(py).as_any(),
            self.vertices_m.bind(py).as_any(),
            self.first.bind(py).as_any(),
        ];
        Ok((py.get_type::<Self>().into_any(), PyTuple::new(py, arrays)?))
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.area_m2.bind(py).len()
    }
}

/// The same before Python has it.
#[derive(Default)]
struct Found {
    row: Vec<u32>,
    tree: Vec<u32>,
    area_m2: Vec<f64>,
    normal: Vec<[f64; 3]>,
    centre_m: Vec<[f64; 3]>,
    vertices_m: Vec<[f64; 3]>,
    first: Vec<u64>,
}

impl Found {
    fn of(stage: &Stage) -> Self {
        let mut found = Self { first: vec![0], ..Self::default() };
        for row in 0..stage.orchard.rows() {
            for (place, tree) in (0..).zip(stage.orchard.trees_of_row(row)) {
                for leaf in &tree.leaves {
                    found.row.push(row as u32);
                    found.tree.push(place);
                    found.area_m2.push(leaf.area_m2());
                    found.normal.push(leaf.normal());
                    found.centre_m.push(leaf.centroid());
                    found.vertices_m.extend_from_slice(leaf.outline());
                    found.first.push(found.vertices_m.len() as u64);
                }
            }
        }
        found
    }
}
