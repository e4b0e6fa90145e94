//! The estimators in use: one set for the row, one for the tree being passed.

use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Slice, Stretch};
use super::measure::Measure;
use crate::profile::Section;

/// The requested estimators. Empty by default: nothing is kept then.
#[derive(Clone, Debug, Default)]
pub(crate) struct Estimators {
    row: Vec<Box<dyn Estimator>>,
    tree: Vec<Box<dyn Estimator>>,
    /// The tree whose sums `tree` holds.
    open_tree: Option<i64>,
    closed: Vec<(i64, Vec<Measure>)>,
    max_trees: usize,
}

impl Estimators {
    pub(crate) fn new(asked: &[&'static EstimatorInfo], setting: &Setting) -> Self {
        let make = || asked.iter().map(|info| (info.make)(setting)).collect();
        Self {
            row: make(),
            tree: make(),
            open_tree: None,
            closed: Vec::new(),
            max_trees: setting.parameters.max_cells,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.row.is_empty()
    }

    fn each(&mut self) -> impl Iterator<Item = &mut Box<dyn Estimator>> {
        let tree = self.open_tree.map(|_| self.tree.iter_mut());
        self.row.iter_mut().chain(tree.into_iter().flatten())
    }

    /// The next lines belong to this tree, or to none. Sums of another tree are dropped: ask for them before.
    pub(crate) fn enter_tree(&mut self, tree: Option<i64>) {
        if self.open_tree != tree {
            self.tree.iter_mut().for_each(|estimator| estimator.clear());
            self.open_tree = tree;
        }
    }

    pub(crate) fn line(&mut self, line: &SightedLine<'_>) {
        self.each().for_each(|estimator| estimator.line(line));
    }

    pub(crate) fn section(&mut self, section: &Section<'_>) {
        self.each().for_each(|estimator| estimator.section(section));
    }

    pub(crate) fn slice(&mut self, slice: &Slice<'_>) {
        self.each().for_each(|estimator| estimator.slice(slice));
    }

    /// Keeps the numbers of the open tree, in place of what was kept of it before.
    pub(crate) fn close_tree(&mut self, stretch: &Stretch) {
        let Some(tree) = self.open_tree.filter(|_| !self.tree.is_empty()) else { return };
        let mut measures = Vec::new();
        self.tree.iter().for_each(|estimator| estimator.measures(stretch, &mut measures));
        let room = self.closed.len() < self.max_trees;
        match self.closed.last_mut() {
            Some((last, kept)) if *last == tree => *kept = measures,
            _ if room => self.closed.push((tree, measures)),
            _ => {}
        }
    }

    /// The row's numbers.
    pub(crate) fn of_row(&self, stretch: &Stretch) -> Vec<Measure> {
        let mut measures = Vec::new();
        self.row.iter().for_each(|estimator| estimator.measures(stretch, &mut measures));
        measures
    }

    /// A tree's numbers.
    pub(crate) fn of_tree(&self, tree: i64) -> &[Measure] {
        let found = self.closed.binary_search_by_key(&tree, |(index, _)| *index);
        found.ok().and_then(|at| self.closed.get(at)).map_or(&[], |(_, measures)| measures)
    }
}
