//! The ground of an orchard that is not a plane: soil with roughness and slope, grass and weeds.
//!
//! The soil is a sum of waves whose lengths, bearings and phases follow from the scene's seed, on a slope across the rows; it repeats
//! with the row. It is cut into triangles, and grass into blades; both are surfaces of their own class and never count as leaf.

use std::f64::consts::TAU;

use crate::orchard::layout::Layout;
use crate::organ::{Facet, Leaf, Surface};
use crate::parameters::{ParameterError, parameters, require};
use crate::seed::{Purpose, Stream};

/// Waves that the roughness is made of.
const WAVES: u32 = 24;

/// Facets at which a ground counts as too fine.
const MOST_FACETS: f64 = 2e6;

parameters! {
    /// The ground: a level plane unless it is given roughness or slope, bare unless it is given grass.
    pub struct GroundParameters;
    /// A ground of which every value may be left out: the `[orchard.ground]` table of a scene file.
    pub overrides GroundOverrides;

    /// Standard deviation of the soil's height.
    roughness_m: f64 = 0.0, "m", "0: a plane; tilled strips 0.01 to 0.03";
    /// Length of the shortest wave of the soil; the longest is four times as long.
    wave_m: f64 = 0.4, "m", "assumed: clods and tracks";
    /// Slope across the rows, rising towards +X; rows stand on it.
    slope_deg: f64 = 0.0, "°", "0: level";
    /// Side of the soil's triangles.
    cell_m: f64 = 0.1, "m", "a quarter of the shortest wave";
    /// Width of the strip along the trees that is kept free of grass.
    strip_m: f64 = 1.0, "m", "herbicide or tilled strips of 0.8 to 1.2 m";
    /// Height of the grass between the strips; 0 for none.
    grass_height_m: f64 = 0.0, "m", "mown alleys 0.05 to 0.15";
    /// Blades of grass.
    grass_per_m2: f64 = 400.0, "1/m²", "assumed: a tenth of a lawn's, each some ten times as wide";
    /// Height of weeds within the strips, under the skirt; 0 for none.
    weed_height_m: f64 = 0.0, "m", "assumed: 0.1 to 0.4 before they are cut";
    /// Leaves of weeds.
    weeds_per_m2: f64 = 60.0, "1/m²", "assumed";
}

impl GroundParameters {
    /// True for the bare level plane that needs nothing built.
    pub(crate) fn is_plane(&self) -> bool {
        self.is_flat() && self.grass_height_m <= 0.0 && self.weed_height_m <= 0.0
    }

    fn is_flat(&self) -> bool {
        self.roughness_m <= 0.0 && self.slope_deg == 0.0
    }

    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self, layout: &Layout) -> Result<(), ParameterError> {
        let within = |name: &str, value: f64, low: f64, high: f64| {
            let expected = format!("a number from {low} to {high}");
            require((low..=high).contains(&value), &format!("orchard.ground.{name}"), &expected, value)
        };
        within("roughness_m", self.roughness_m, 0.0, 0.5)?;
        within("wave_m", self.wave_m, 0.01, 100.0)?;
        within("slope_deg", self.slope_deg, -45.0, 45.0)?;
        within("cell_m", self.cell_m, 0.005, 10.0)?;
        within("strip_m", self.strip_m, 0.0, 20.0)?;
        within("grass_height_m", self.grass_height_m, 0.0, 2.0)?;
        within("grass_per_m2", self.grass_per_m2, 0.0, 1e5)?;
        within("weed_height_m", self.weed_height_m, 0.0, 2.0)?;
        within("weeds_per_m2", self.weeds_per_m2, 0.0, 1e5)?;
        let facets = self.facets(layout);
        let expected = "a ground of at most 2000000 facets: larger cells, fewer blades or fewer places";
        require(facets <= MOST_FACETS, "orchard.ground", expected, format!("{facets:.0}"))
    }

    /// How many facets this makes, about.
    fn facets(&self, layout: &Layout) -> f64 {
        let area_m2 = {
            let (low, high) = extent_m(layout);
            (high - low) * length_m(layout)
        };
        let soil = if self.is_flat() { 0.0 } else { 2.0 / (self.cell_m * self.cell_m) };
        let grass = if self.grass_height_m > 0.0 { self.grass_per_m2 } else { 0.0 };
        let weeds = if self.weed_height_m > 0.0 { self.weeds_per_m2 } else { 0.0 };
        area_m2 * (soil + grass + weeds)
    }
}

/// What lies on the ground or is the ground.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ground {
    /// Soil and grass as polygons, in the scene frame; they repeat with the rows.
    pub facets: Vec<Facet>,
    /// Height of the level plane below them, metres; where nothing is built, it is the ground.
    pub plane_m: f64,
    /// How much the soil rises a metre along X, waves apart: the tangent of its slope.
    pub rise: f64,
}

impl Ground {
    /// One-sided area of grass and weeds whose foot lies nearer to a row than to the next, m².
    pub fn grass_area_m2(&self, row: usize, rows: usize, row_spacing_m: Option<f64>) -> f64 {
        let last = rows.saturating_sub(1) as f64;
        let is_own = |facet: &&Facet| {
            let x_m = facet.polygon.outline().first().map_or(0.0, |foot| foot[0]);
            let at = row_spacing_m.map_or(0.0, |spacing_m| (x_m / spacing_m).round());
            facet.surface == Surface::Grass && at.clamp(0.0, last) == row as f64
        };
        self.facets.iter().filter(is_own).fold(0.0, |sum, facet| sum + facet.polygon.area_m2())
    }
}

/// From which X to which the ground is built: three quarters of a spacing beyond the outer rows.
fn extent_m(layout: &Layout) -> (f64, f64) {
    let spacing_m = layout.row_spacing_m;
    (-0.75 * spacing_m, (f64::from(layout.rows) - 0.25) * spacing_m)
}

fn length_m(layout: &Layout) -> f64 {
    f64::from(layout.trees) * layout.tree_spacing_m
}

/// One wave of the soil.
#[derive(Clone, Copy, Debug)]
struct Wave {
    /// Radians a metre along X and Y.
    per_m: [f64; 2],
    phase: f64,
}

/// The height of the soil anywhere.
#[derive(Clone, Debug)]
pub(crate) struct Relief {
    slope: f64,
    amplitude_m: f64,
    waves: Vec<Wave>,
}

impl Relief {
    /// Of a seed: along the row every wave has a whole number of periods in the row's length.
    pub(crate) fn of(parameters: &GroundParameters, layout: &Layout, seed: u64) -> Self {
        let mut stream = Purpose::Ground.stream(seed, 0, 0);
        let period_m = length_m(layout);
        let wave = |stream: &mut Stream| {
            let wave_m = parameters.wave_m * (1.0 + 3.0 * stream.unit());
            let bearing = TAU * stream.unit();
            let along = (libm::sin(bearing) * period_m / wave_m).round() / period_m;
            Wave { per_m: [TAU * libm::cos(bearing) / wave_m, TAU * along], phase: TAU * stream.unit() }
        };
        let waves = if parameters.roughness_m > 0.0 { WAVES } else { 0 };
        Self {
            slope: libm::tan(parameters.slope_deg.to_radians()),
            // Each wave has half its squared amplitude of variance.
            amplitude_m: parameters.roughness_m * (2.0 / f64::from(WAVES)).sqrt(),
            waves: (0..waves).map(|_| wave(&mut stream)).collect(),
        }
    }

    /// Height of the slope alone, metres.
    pub(crate) fn slope_m(&self, x_m: f64) -> f64 {
        self.slope * x_m
    }

    /// Height of the soil, metres.
    pub(crate) fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let waves = self.waves.iter();
        let sum: f64 =
            waves.map(|wave| libm::cos(wave.per_m[0] * x_m + wave.per_m[1] * y_m + wave.phase)).sum();
        self.slope_m(x_m) + self.amplitude_m * sum
    }
}

/// Builds the ground of an orchard; nothing for a bare level plane.
pub(crate) fn build(parameters: &GroundParameters, layout: &Layout, seed: u64) -> Ground {
    if parameters.is_plane() {
        return Ground::default();
    }
    let relief = Relief::of(parameters, layout, seed);
    let mut facets = if parameters.is_flat() { Vec::new() } else { soil(parameters, layout, &relief) };
    let low = |facet: &Facet| facet.polygon.outline().iter().map(|vertex| vertex[2]).fold(0.0, f64::min);
    let plane_m = facets.iter().map(low).fold(0.0, f64::min);
    for row in 0..layout.rows {
        let mut stream = Purpose::Ground.stream(seed, 1 + row, 0);
        facets.extend(grass(parameters, layout, row, &relief, &mut stream));
    }
    Ground { facets, plane_m, rise: relief.slope }
}

fn soil(parameters: &GroundParameters, layout: &Layout, relief: &Relief) -> Vec<Facet> {
    let ((from_m, to_m), long_m) = (extent_m(layout), length_m(layout));
    let cells = |extent_m: f64| (extent_m / parameters.cell_m).round().clamp(1.0, 1e6) as u32;
    let (wide, long) = (cells(to_m - from_m), cells(long_m));
    let at = |i: u32, j: u32| {
        let x_m = from_m + (to_m - from_m) * f64::from(i) / f64::from(wide);
        let y_m = long_m * f64::from(j) / f64::from(long);
        [x_m, y_m, relief.height_m(x_m, y_m)]
    };
    let cell = |i: u32, j: u32| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        [[a, b, c], [a, c, d]].into_iter().filter_map(|corners| {
            let polygon = Leaf::new(corners).ok()?;
            Some(Facet { surface: Surface::Soil, polygon })
        })
    };
    (0..wide).flat_map(|i| (0..long).flat_map(move |j| cell(i, j))).collect()
}

/// Grass of the alley around a row, and weeds of its strip.
fn grass(
    parameters: &GroundParameters,
    layout: &Layout,
    row: u32,
    relief: &Relief,
    stream: &mut Stream,
) -> Vec<Facet> {
    let (axis_m, half_m) = (f64::from(row) * layout.row_spacing_m, 0.5 * layout.row_spacing_m);
    let (strip_m, long_m) = ((0.5 * parameters.strip_m).min(half_m), length_m(layout));
    let mut blades = Vec::new();
    let mut sow = |per_m2: f64, height_m: f64, width_m: f64, (near_m, far_m): (f64, f64)| {
        if height_m <= 0.0 {
            return;
        }
        let number = (2.0 * (far_m - near_m) * long_m * per_m2).round() as u64;
        for _ in 0..number {
            let out_m = near_m + (far_m - near_m) * stream.unit();
            let side = if stream.unit() < 0.5 { -1.0 } else { 1.0 };
            let foot = [axis_m + side * out_m, long_m * stream.unit()];
            blades.extend(blade(foot, height_m, width_m, relief, stream));
        }
    };
    // A blade is as wide as ten of grass, a weed's leaf some 25 mm.
    sow(parameters.grass_per_m2, parameters.grass_height_m, 0.012, (strip_m, half_m));
    sow(parameters.weeds_per_m2, parameters.weed_height_m, 0.025, (0.0, strip_m));
    blades
}

/// An upright triangle that leans a little.
fn blade(
    [x_m, y_m]: [f64; 2],
    height_m: f64,
    width_m: f64,
    relief: &Relief,
    stream: &mut Stream,
) -> Option<Facet> {
    let z_m = relief.height_m(x_m, y_m);
    let height_m = height_m * (0.4 + 0.6 * stream.unit());
    let (bearing, lean) = (TAU * stream.unit(), 0.5 * stream.unit() * height_m);
    let (cos, sin) = (libm::cos(bearing), libm::sin(bearing));
    let side = |sign: f64| [x_m + sign * 0.5 * width_m * cos, y_m + sign * 0.5 * width_m * sin, z_m];
    let tip = [x_m - lean * sin, y_m + lean * cos, z_m + height_m];
    let polygon = Leaf::new([side(-1.0), side(1.0), tip]).ok()?;
    Some(Facet { surface: Surface::Grass, polygon })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> Layout {
        Layout { trees: 12, tree_spacing_m: 1.5, row_spacing_m: 4.0, ..Layout::default() }
    }

    #[test]
    fn the_soil_has_the_deviation_and_the_slope_asked_for_and_repeats_with_the_row() {
        let parameters =
            GroundParameters { roughness_m: 0.02, slope_deg: 5.0, ..GroundParameters::default() };
        let mut square = 0.0;
        let mut count = 0.0;
        for seed in 1..=20 {
            let relief = Relief::of(&parameters, &layout(), seed);
            for k in 0..400 {
                let (x_m, y_m) = (f64::from(k % 20) * 0.37 - 3.0, f64::from(k / 20) * 0.83);
                let off_m = relief.height_m(x_m, y_m) - x_m * 5f64.to_radians().tan();
                square += off_m * off_m;
                count += 1.0;
                let beyond_m = relief.height_m(x_m, y_m + 18.0);
                assert!((relief.height_m(x_m, y_m) - beyond_m).abs() < 1e-9, "the row repeats");
            }
        }
        let deviation_m = f64::sqrt(square / count);
        assert!((deviation_m / 0.02 - 1.0).abs() < 0.1, "{deviation_m}");
    }

    #[test]
    fn a_bare_plane_needs_nothing_and_grass_stands_where_it_should() {
        assert_eq!(build(&GroundParameters::default(), &layout(), 1), Ground::default());
        let parameters =
            GroundParameters { grass_height_m: 0.1, weed_height_m: 0.3, ..GroundParameters::default() };
        parameters.validate(&layout()).unwrap();
        let ground = build(&parameters, &layout(), 1);
        // 18 m of row: alley of 3 m at 400, strip of 1 m at 60.
        assert_eq!(ground.facets.len(), (18.0 * (3.0 * 400.0 + 60.0)) as usize);
        assert!(ground.facets.iter().all(|facet| facet.surface == Surface::Grass));
        for facet in &ground.facets {
            let tip = facet.polygon.outline()[2];
            let foot = facet.polygon.outline()[0];
            assert!(tip[2] <= if foot[0].abs() < 0.49 { 0.3 } else { 0.1 } + 1e-12 || foot[0].abs() < 0.52);
        }
        let area_m2 = ground.grass_area_m2(0, 1, Some(4.0));
        let whole: f64 = ground.facets.iter().map(|facet| facet.polygon.area_m2()).sum();
        assert!((area_m2 - whole).abs() < 1e-9 && ground.grass_area_m2(1, 1, Some(4.0)) == 0.0);
    }

    #[test]
    fn too_fine_a_ground_is_refused() {
        let fine = GroundParameters { roughness_m: 0.02, cell_m: 0.005, ..GroundParameters::default() };
        let error = fine.validate(&layout()).unwrap_err().to_string();
        assert!(error.starts_with("orchard.ground must be") && error.contains("larger cells"), "{error}");
    }
}
