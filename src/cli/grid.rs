//! Tables for people, as wide as the terminal. A table that does not fit folds its words; where that leaves columns too narrow to read, each row
//! becomes a block of lines, one a column.
//!
//! On a pipe, or where nobody knows the width, a table is as wide as it needs to be. `COLUMNS` in the environment says the width in every case.

use std::fmt;
use std::ops::{Deref, DerefMut};

use comfy_table::presets::NOTHING;
use comfy_table::{ColumnConstraint, ContentArrangement, Table, TableComponent, Width};

/// Most lines that a folded row may take.
const MOST_LINES: usize = 6;
/// A blank at which no line ends: between a number and its unit.
pub(super) const TIED: char = '\u{a0}';
/// Blanks between a folded table's columns.
const GAP: usize = 1;

/// A table in the house style that fits its width when it is shown.
#[derive(Debug)]
pub(super) struct Grid {
    table: Table,
    columns: Option<usize>,
}

impl Grid {
    /// An empty one, as wide as the place that it will be shown in.
    pub(super) fn new() -> Self {
        Self::within(columns())
    }

    /// An empty one, at most this wide.
    fn within(columns: Option<usize>) -> Self {
        let mut table = Table::new();
        table
            .load_preset(NOTHING)
            .set_style(TableComponent::HeaderLines, '─')
            .set_style(TableComponent::MiddleHeaderIntersections, '─');
        Self { table, columns }
    }

    /// The table with its words folded; none where a column would be narrower than its longest word, or a row too tall.
    fn folded(&self, columns: usize) -> Option<String> {
        let least: Vec<usize> = (0..self.table.column_max_content_widths().len())
            .map(|column| {
                let cells = self.table.column_cells_with_header_iter(column).flatten();
                let words = cells.map(|cell| longest_word(&cell.content()));
                words.max().unwrap_or(0) + GAP
            })
            .collect();
        if least.iter().sum::<usize>() > columns {
            return None;
        }
        let mut table = self.table.clone();
        let width = |columns: usize| u16::try_from(columns).unwrap_or(u16::MAX);
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(width(columns));
        table.discover_columns();
        for column in table.column_iter_mut() {
            column.set_padding((0, 1));
        }
        table.set_constraints(
            least.iter().map(|least| ColumnConstraint::LowerBoundary(Width::Fixed(width(*least)))),
        );
        let text = table.to_string();
        let rows = self.table.row_count() + 1;
        (widest(&text) <= columns && text.lines().count() <= MOST_LINES * rows).then_some(text)
    }

    /// Every row as a block of lines: a column's name, and what stands in it.
    fn blocks(&self, columns: usize) -> String {
        let contents =
            |row: &comfy_table::Row| row.cell_iter().map(comfy_table::Cell::content).collect::<Vec<String>>();
        let names = self.table.header().map(contents).unwrap_or_default();
        let indent = names.iter().map(|name| name.chars().count()).max().unwrap_or(0) + 2 * GAP;
        let width = columns.saturating_sub(indent).max(1);
        let mut blocks = Vec::new();
        for row in self.table.row_iter() {
            let mut block = String::new();
            for (name, content) in names.iter().zip(contents(row)).filter(|(_, content)| !content.is_empty())
            {
                for (number, line) in content.lines().flat_map(|line| wrapped(line, width)).enumerate() {
                    let name = if number == 0 { name } else { "" };
                    block.push_str(&format!("{name:<indent$}{line}\n"));
                }
            }
            blocks.push(block);
        }
        blocks.join("\n").trim_end().to_owned()
    }
}

impl Deref for Grid {
    type Target = Table;

    fn deref(&self) -> &Table {
        &self.table
    }
}

impl DerefMut for Grid {
    fn deref_mut(&mut self) -> &mut Table {
        &mut self.table
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = self.table.to_string();
        let text = match self.columns.filter(|columns| widest(&whole) > *columns) {
            None => whole,
            Some(columns) => self.folded(columns).unwrap_or_else(|| self.blocks(columns)),
        };
        f.write_str(&text.replace(TIED, " "))
    }
}

/// Characters that a line may have: by `COLUMNS`, else by the terminal; none where there is no limit.
pub(super) fn columns() -> Option<usize> {
    let told = std::env::var("COLUMNS").ok().and_then(|told| told.trim().parse().ok());
    told.filter(|columns| *columns > 0).or_else(terminal_columns)
}

/// Characters a line of the terminal has that standard output goes to; none where it goes elsewhere.
fn terminal_columns() -> Option<usize> {
    #[cfg(target_os = "linux")]
    {
        let size = rustix::termios::tcgetwinsize(std::io::stdout()).ok()?;
        (size.ws_col > 0).then(|| usize::from(size.ws_col))
    }
    #[cfg(not(target_os = "linux"))]
    None
}

/// Characters of the longest line; blanks at its end are not seen.
fn widest(text: &str) -> usize {
    text.lines().map(|line| line.trim_end().chars().count()).max().unwrap_or(0)
}

fn longest_word(text: &str) -> usize {
    text.split([' ', '\n']).map(|word| word.chars().count()).max().unwrap_or(0)
}

/// A line in pieces of at most `width` characters, broken at blanks, and inside a word only where that is longer.
fn wrapped(line: &str, width: usize) -> Vec<String> {
    let (mut pieces, mut piece, mut length) = (Vec::new(), String::new(), 0);
    for word in line.split(' ').filter(|word| !word.is_empty()) {
        let letters: Vec<char> = word.chars().collect();
        for (number, part) in letters.chunks(width).enumerate() {
            let gap = usize::from(length > 0 && number == 0);
            if length > 0 && (number > 0 || length + gap + part.len() > width) {
                pieces.push(std::mem::take(&mut piece));
                length = 0;
            }
            if length > 0 {
                piece.push(' ');
                length += gap;
            }
            piece.extend(part);
            length += part.len();
        }
    }
    pieces.push(piece);
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(columns: Option<usize>, rows: &[[&str; 3]]) -> Grid {
        let mut grid = Grid::within(columns);
        grid.set_header(["name", "parameters", "does"]);
        grid.add_rows(rows.iter().copied());
        grid
    }

    const DROP: [&str; 3] = ["drop", "bytes, probability, seed", "bytes on the way to the client are lost"];

    #[test]
    fn a_table_without_a_limit_has_a_row_a_line() {
        let text = grid(None, &[DROP]).to_string();
        assert_eq!(text.lines().count(), 3, "{text}");
        assert!(text.contains("are lost"), "{text}");
    }

    #[test]
    fn a_table_that_fits_is_left_as_it_is() {
        let whole = grid(None, &[DROP]).to_string();
        assert_eq!(grid(Some(widest(&whole)), &[DROP]).to_string(), whole);
    }

    #[test]
    fn words_fold_before_rows_become_blocks() {
        let folded = grid(Some(50), &[DROP]).to_string();
        assert!(widest(&folded) <= 50 && folded.lines().count() > 3, "{folded}");
        assert!(folded.starts_with("name") && folded.contains("probability,"), "no word is cut: {folded}");
        let blocks = grid(Some(24), &[DROP, ["cut", "", "the link is cut"]]).to_string();
        let expected = "name        drop\nparameters  bytes,\n            probability,\n            seed\n\
                        does        bytes on the\n            way to the\n            client are\n            lost\n\n\
                        name        cut\ndoes        the link is\n            cut";
        assert_eq!(blocks, expected);
    }

    #[test]
    fn nothing_is_wider_than_it_may_be_and_no_letter_is_lost() {
        let long = "x".repeat(70);
        let rows = [DROP, ["µm²", &long, "–"]];
        let letters = |text: &str| text.chars().filter(|c| *c == 'x' || *c == 'µ').count();
        for columns in 14..130 {
            let text = grid(Some(columns), &rows).to_string();
            assert!(widest(&text) <= columns, "{columns}: {text}");
            assert_eq!(letters(&text), 71, "{columns}: {text}");
        }
    }
}
