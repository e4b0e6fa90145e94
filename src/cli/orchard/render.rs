//! `rowscan orchard render`

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use rowscan_render::{Camera, Figure, Look, Model, View, render};
use rowscan_scenes::season::Season;

use super::export::season;
use crate::cli::blocking::off_runtime;
use crate::cli::output::{self, say};
use crate::cli::scene::{SceneArgs, grow};
use crate::cli::{Failure, Outcome};
use rowscan_emulator::stage::Stage;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Write the picture to this PNG file; `-` for standard output
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Season, instead of the scene's own: dormant, bud_burst, unfolding, bloom, fruit_set, full_leaf, leaf_fall
    #[arg(long, value_name = "NAME", value_parser = season)]
    season: Option<Season>,
    /// Where to look from, with the whole row in the picture
    #[arg(long, value_enum, default_value_t, conflicts_with = "from")]
    view: ViewArg,
    /// Stand there instead: metres across the row from its axis (the scanner is at a negative X), along it, and up
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    from: Option<[f64; 3]>,
    /// Look at this point; the middle of the row where it is left out
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "from")]
    look: Option<[f64; 3]>,
    /// Angle of view from left to right, degrees; the view's own where it is left out, 40 with --from
    #[arg(long, value_name = "DEGREES")]
    fov: Option<f64>,
    /// Size of the picture, pixels
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1600x900")]
    size: (u32, u32),
    /// What stands beside the first tree, for the size
    #[arg(long, value_enum, default_value_t)]
    figure: FigureArg,
    /// Draw only that many trees, from the first place
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    trees: Option<u32>,
    /// Use at most that many colours, 2 to 256: a file of about half the size
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=256))]
    colours: Option<u16>,
}

/// [`View`] on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum ViewArg {
    /// From beside and above the row's begin
    #[default]
    ThreeQuarter,
    /// From the scanner's side, square to the row
    Side,
    /// Along the row, from the alley, at the height of the eyes
    Alley,
    /// From above
    Top,
}

/// [`Figure`] on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum FigureArg {
    /// A person of 1.75 m
    #[default]
    Person,
    /// A pole of 2 m with bands of half a metre
    Pole,
    /// Nothing
    None,
}

impl From<ViewArg> for View {
    fn from(view: ViewArg) -> Self {
        match view {
            ViewArg::ThreeQuarter => Self::ThreeQuarter,
            ViewArg::Side => Self::Side,
            ViewArg::Alley => Self::Alley,
            ViewArg::Top => Self::Top,
        }
    }
}

impl From<FigureArg> for Figure {
    fn from(figure: FigureArg) -> Self {
        match figure {
            FigureArg::Person => Self::Person,
            FigureArg::Pole => Self::Pole,
            FigureArg::None => Self::None,
        }
    }
}

fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    let point: Option<[f64; 3]> = numbers.and_then(|numbers| numbers.try_into().ok());
    let finite = point.filter(|point| point.iter().all(|number| number.is_finite()));
    finite
        .ok_or_else(|| format!("expected three numbers of metres as X,Y,Z, such as -6,2,1.7, found `{text}`"))
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let both = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    both.ok_or_else(|| {
        format!("expected a width and a height in pixels as WxH, such as 1600x900, found `{text}`")
    })
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    check(&args)?;
    let mut scene = args.scene.scene()?;
    scene.orchard.season = args.season.unwrap_or(scene.orchard.season);
    output::can_be_written(&args.output)?;
    let stage = grow(scene).await?;
    off_runtime("draw the orchard", move || draw(&args, &stage)).await
}

/// Tells of a camera that cannot be, and of a file that is no PNG, before an orchard has been grown.
fn check(args: &Args) -> Result<(), Failure> {
    let (from, look) = (args.from.unwrap_or([-1.0, 0.0, 0.0]), args.look.unwrap_or([f64::MIN_POSITIVE; 3]));
    Camera::at(from, look, args.fov.unwrap_or(40.0), args.size)?;
    png_name(&args.output)
}

/// Refuses a name that says another format.
pub(crate) fn png_name(path: &Path) -> Result<(), Failure> {
    let is_png = path.extension().is_none_or(|extension| extension.eq_ignore_ascii_case("png"));
    if is_png {
        return Ok(());
    }
    let found = path.display();
    Err(Failure::Usage(format!(
        "expected a picture's name to end in .png, found `{found}`; drawings as SVG: rowscan orchard export --svg"
    )))
}

fn draw(args: &Args, stage: &Stage) -> Result<Outcome, Failure> {
    let trees = args.trees.map_or(usize::MAX, |trees| trees as usize);
    let model = Model::of(&stage.orchard, trees)?.with_figure(args.figure.into());
    let camera = camera(args, &model)?;
    let look = Look { season: stage.scene.orchard.season, ..Look::default() };
    let file = render(&model, &camera, &look).png(args.colours)?;
    output::write_file(&args.output, &file)?;
    if args.output.as_os_str() != "-" {
        say(format_args!("wrote {}", args.output.display()));
    }
    Ok(Outcome::Done)
}

fn camera(args: &Args, model: &Model) -> Result<Camera, Failure> {
    let view = View::from(args.view);
    let Some(from) = args.from else {
        return Ok(match args.fov {
            Some(fov_deg) => view.camera_with(model, fov_deg, args.size)?,
            None => view.camera(model, args.size)?,
        });
    };
    let [low, high] = model.extent();
    let middle = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    Ok(Camera::at(from, args.look.unwrap_or(middle), args.fov.unwrap_or(40.0), args.size)?)
}
