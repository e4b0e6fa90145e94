//! How a row's leaf area by wide beams hangs on how its leaves stand ([`Clumping`](crate::Clumping)).

use std::sync::LazyLock;

use crate::clumping::Clumping;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::optics::Optics;

/// Lines of `model,constant,cells,closed,relative sd` and the ranges of both measures; the first ones say by which command, and when.
static TABLE: &str = include_str!("../clumping.csv");

/// How the leaf area by wide beams hangs on the measures, by a scanner's optics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClumpingLaw {
    /// The model whose optics it was fitted for.
    pub model: &'static str,
    /// ln of the factor where both measures are 1.
    pub constant: f64,
    /// Its slope over ln `cells`.
    pub by_cells: f64,
    /// Its slope over ln `closed`.
    pub by_closed: f64,
    /// Relative standard deviation of what it leaves, of training systems it was not fitted on.
    pub relative_sd: f64,
    /// Smallest and largest `cells` of the fitted rows; beyond, the end's value holds.
    pub cells: [f64; 2],
    /// The same of `closed`.
    pub closed: [f64; 2],
}

impl ClumpingLaw {
    /// The law for a scanner of these optics, if one was fitted.
    pub fn of(optics: &Optics) -> Option<&'static Self> {
        static LAWS: LazyLock<Vec<ClumpingLaw>> = LazyLock::new(|| TABLE.lines().filter_map(read).collect());
        LAWS.iter().find(|law| AnyModel::by_name(law.model).is_some_and(|model| model.optics() == optics))
    }

    /// What raw leaf areas of a row are multiplied by whose leaves stand like this.
    pub fn factor(&self, cells: f64, closed: f64) -> f64 {
        let within = |value: f64, [low, high]: [f64; 2]| value.clamp(low, high).ln();
        let by_cells = self.by_cells * within(cells, self.cells);
        (self.constant + by_cells + self.by_closed * within(closed, self.closed)).exp()
    }

    /// Whether rows were fitted whose leaves stand like this.
    pub fn holds(&self, clumping: &Clumping) -> bool {
        let within = |value: f64, [low, high]: [f64; 2]| (low..=high).contains(&value);
        within(clumping.cells, self.cells) && within(clumping.closed, self.closed)
    }
}

fn read(line: &'static str) -> Option<ClumpingLaw> {
    let mut fields = line.split(',');
    let model = fields.next()?;
    let mut number = || fields.next()?.parse::<f64>().ok();
    Some(ClumpingLaw {
        model,
        constant: number()?,
        by_cells: number()?,
        by_closed: number()?,
        relative_sd: number()?,
        cells: [number()?, number()?],
        closed: [number()?, number()?],
    })
}
