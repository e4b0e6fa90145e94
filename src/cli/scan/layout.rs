//! The flags that lay a scan out, shared by `scan` and the studies.

use rowscan_scenes::scan::{Mesh, Sampling, ScanSettings, WoodTest};

/// How a scan is laid out; what is left out is the command's own.
#[derive(Clone, Debug, clap::Args)]
pub(in crate::cli) struct ScanArgs {
    /// Advance from line to line, Δy
    #[arg(long, value_name = "METRES", value_parser = finite)]
    dy: Option<f64>,
    /// Angle between the beams of an angular scan, Δθ
    #[arg(long, value_name = "DEGREES", value_parser = finite)]
    dtheta: Option<f64>,
    /// Distance between the beams of an orthogonal scan, Δz or Δx
    #[arg(long, value_name = "METRES", value_parser = finite)]
    pitch: Option<f64>,
    /// Where in its cell a sample is taken: start (as the paper does) or centre
    #[arg(long, value_name = "WHERE", value_parser = sampling)]
    sampling: Option<Sampling>,
    /// Distance of a lateral sensor from the row's axis, D
    #[arg(long, value_name = "METRES", value_parser = finite)]
    distance: Option<f64>,
    /// Height of a lateral angular sensor, z0
    #[arg(long, value_name = "METRES", value_parser = finite)]
    height: Option<f64>,
    /// Height of a zenith sensor, Zs; 2 m above the canopy where left out
    #[arg(long, value_name = "METRES", value_parser = finite)]
    overhead: Option<f64>,
    /// How wood is found: exact, or mesh as the paper does (half width 1 mm, 3 points an edge, step 1 mm), or mesh:HALF,POINTS,STEP
    #[arg(long, value_name = "TEST", value_parser = wood)]
    wood: Option<WoodTest>,
}

/// A number, also where the kind of scan does not use it. Its bounds are the scan's.
fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("expected a number, found `{text}`"))
}

fn wood(text: &str) -> Result<WoodTest, String> {
    let (name, numbers) = text.split_once(':').map_or((text, None), |(name, rest)| (name, Some(rest)));
    let mesh = match (name, numbers) {
        ("exact", None) => return Ok(WoodTest::Exact),
        ("mesh", None) => Some(Mesh::default()),
        ("mesh", Some(numbers)) => mesh(numbers),
        _ => None,
    };
    let mesh =
        mesh.ok_or("expected exact, mesh or mesh:HALF,POINTS,STEP in metres, such as mesh:0.001,3,0.001")?;
    mesh.validate().map(WoodTest::Mesh).map_err(|error| error.to_string())
}

fn mesh(numbers: &str) -> Option<Mesh> {
    let mut numbers = numbers.split(',');
    let half_width_m = numbers.next()?.parse().ok()?;
    let (points, step_m) = (numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?);
    numbers.next().is_none().then_some(Mesh { half_width_m, points, step_m })
}

fn sampling(text: &str) -> Result<Sampling, String> {
    let known = Sampling::ALL.iter().zip(Sampling::NAMES).find(|(_, name)| **name == text);
    known.map(|(sampling, _)| *sampling).ok_or_else(|| format!("expected {}", Sampling::NAMES.join(" or ")))
}

impl ScanArgs {
    /// `base` with everything replaced that was asked for.
    pub(in crate::cli) fn over(&self, base: ScanSettings) -> ScanSettings {
        ScanSettings {
            dy_m: self.dy.unwrap_or(base.dy_m),
            dtheta_deg: self.dtheta.unwrap_or(base.dtheta_deg),
            pitch_m: self.pitch.unwrap_or(base.pitch_m),
            sampling: self.sampling.unwrap_or(base.sampling),
            distance_m: self.distance.unwrap_or(base.distance_m),
            height_m: self.height.unwrap_or(base.height_m),
            overhead_m: self.overhead.or(base.overhead_m),
            wood: self.wood.unwrap_or(base.wood),
            ..base
        }
    }
}
