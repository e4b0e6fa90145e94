//! Branches and leaves as text, one a line, metres.
//!
//! Branches: `x1 y1 z1 x2 y2 z2 diameter`. Leaves: `n x1 y1 z1 … xn yn zn`. Fields are separated by blanks, commas or semicolons; `#`
//! starts a comment. After a first line `# tree …` every record begins with the number of its tree.

use std::fmt::Write as _;

use super::{ExchangeError, MOST_TREES, OrganRecordError};
use crate::orchard::grown::Orchard;
use crate::organ::{Cylinder, Leaf};
use crate::parameters::{SceneFile, fields, lines};

/// A record: number of the tree (0 where the file has none), line it stands on (from 1), and what it says.
#[derive(Clone, Debug, PartialEq)]
pub struct Record<T> {
    /// Number of the tree.
    pub tree: u32,
    /// Line in the file.
    pub line: usize,
    /// What it says.
    pub organ: T,
}

/// Reads branches.
///
/// # Errors
/// The first line that is none: see [`OrganRecordError`].
pub fn read_branches(file: &SceneFile) -> Result<Vec<Record<Cylinder>>, ExchangeError> {
    read(file, |fields| {
        let &[x1, y1, z1, x2, y2, z2, diameter_m] = fields else {
            return Err(OrganRecordError::Fields {
                expected: "x1 y1 z1 x2 y2 z2 diameter",
                found: fields.len(),
            });
        };
        Ok(Cylinder::new([x1, y1, z1], [x2, y2, z2], diameter_m / 2.0)?)
    })
}

/// Reads the outlines of leaves.
///
/// # Errors
/// The first line that is none: see [`OrganRecordError`].
pub fn read_leaves(file: &SceneFile) -> Result<Vec<Record<Leaf>>, ExchangeError> {
    read(file, |fields| {
        let expected = "n and three coordinates for each of n vertices";
        let wrong = OrganRecordError::Fields { expected, found: fields.len() };
        let Some((count, coordinates)) = fields.split_first() else { return Err(wrong) };
        let (vertices, rest) = coordinates.as_chunks::<3>();
        if vertices.len() as f64 != *count || !rest.is_empty() {
            return Err(wrong);
        }
        Ok(Leaf::new(vertices)?)
    })
}

fn read<T>(
    file: &SceneFile,
    record: impl Fn(&[f64]) -> Result<T, OrganRecordError>,
) -> Result<Vec<Record<T>>, ExchangeError> {
    let text = file.text()?;
    let numbered = text.lines().next().is_some_and(|first| {
        first.strip_prefix('#').is_some_and(|header| fields(header).next() == Some("tree"))
    });
    let mut numbers = Vec::new();
    lines(text)
        .map(|(line, content)| {
            let mut rest = fields(content);
            let mut parse = || {
                let tree = if numbered { tree_number(rest.next().unwrap_or(""))? } else { 0 };
                numbers.clear();
                for field in rest.by_ref() {
                    let not_a_number = |_| OrganRecordError::NotANumber { found: field.to_owned() };
                    numbers.push(field.parse::<f64>().map_err(not_a_number)?);
                }
                Ok((tree, record(&numbers)?))
            };
            let at = |cause| ExchangeError::Record { path: file.path().to_owned(), line, cause };
            let (tree, organ) = parse().map_err(at)?;
            Ok(Record { tree, line, organ })
        })
        .collect()
}

fn tree_number(field: &str) -> Result<u32, OrganRecordError> {
    let wrong = || OrganRecordError::Tree { most: MOST_TREES, found: field.to_owned() };
    field.parse().ok().filter(|tree| *tree <= MOST_TREES).ok_or_else(wrong)
}

/// Whether records begin with the number of their tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeColumn {
    /// They do.
    Written,
    /// They do not: which tree an organ belongs to is lost.
    LeftOut,
}

/// One branch segment a line, tree by tree. Digits read back to the same number.
pub fn write_branches(orchard: &Orchard, column: TreeColumn) -> String {
    let mut text = header("x1 y1 z1 x2 y2 z2 diameter (m)", column);
    for (number, tree) in orchard.trees().enumerate() {
        for piece in &tree.wood {
            begin(&mut text, number, column);
            let ([x1, y1, z1], [x2, y2, z2]) = (piece.base(), piece.tip());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{x1} {y1} {z1} {x2} {y2} {z2} {}", 2.0 * piece.radius_m());
        }
    }
    text
}

/// One leaf a line, tree by tree. Digits read back to the same number.
pub fn write_leaves(orchard: &Orchard, column: TreeColumn) -> String {
    let mut text = header("n x1 y1 z1 ... xn yn zn (m)", column);
    for (number, tree) in orchard.trees().enumerate() {
        for leaf in &tree.leaves {
            begin(&mut text, number, column);
            let _ = write!(text, "{}", leaf.outline().len());
            for [x, y, z] in leaf.outline() {
                let _ = write!(text, " {x} {y} {z}");
            }
            text.push('\n');
        }
    }
    text
}

fn header(columns: &str, column: TreeColumn) -> String {
    match column {
        TreeColumn::Written => format!("# tree {columns}\n"),
        TreeColumn::LeftOut => format!("# {columns}\n"),
    }
}

fn begin(text: &mut String, tree: usize, column: TreeColumn) {
    if column == TreeColumn::Written {
        let _ = write!(text, "{tree} ");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::organ::OrganError;

    fn file(text: &str) -> SceneFile {
        SceneFile::with_content("tree.txt", text.as_bytes())
    }

    #[test]
    fn separators_comments_and_tree_numbers_are_read() {
        let text = "# tree x1 y1 z1 x2 y2 z2 diameter\n3 0,0,0;0 0 1\t0.1 # trunk\n\n4 0 0 0 1 0 0 0.02\n";
        let branches = read_branches(&file(text)).unwrap();
        let found: Vec<_> = branches.iter().map(|b| (b.tree, b.line, b.organ.radius_m())).collect();
        assert_eq!(found, [(3, 2, 0.05), (4, 4, 0.01)]);
        let leaves = read_leaves(&file("3 0 0 0 1 0 0 0 1 0\n")).unwrap();
        assert_eq!((leaves[0].tree, leaves[0].organ.area_m2()), (0, 0.5));
    }

    #[test]
    fn records_that_are_none_are_refused_with_file_and_line() {
        let branch = |line: &str| read_branches(&file(&format!("# a comment\n{line}\n"))).unwrap_err();
        let leaf = |line: &str| read_leaves(&file(&format!("# a comment\n{line}\n"))).unwrap_err();
        let cause = |error: ExchangeError| match error {
            ExchangeError::Record { path, line, cause } => {
                assert_eq!((path.as_str(), line), ("tree.txt", 2));
                cause
            }
            other => panic!("{other}"),
        };
        assert_eq!(cause(branch("0 0 0 0 0 NaN 0.1")), OrganError::NotFinite.into());
        assert_eq!(cause(branch("1 2 3 1 2 3 0.1")), OrganError::NoLength.into());
        assert_eq!(cause(branch("0 0 0 0 0 1 0")), OrganError::Radius { found: 0.0 }.into());
        assert!(matches!(cause(branch("0 0 0 0 0 1")), OrganRecordError::Fields { found: 6, .. }));
        assert!(matches!(cause(branch("0 0 0 0 0 one 1")), OrganRecordError::NotANumber { .. }));
        assert_eq!(cause(leaf("2 0 0 0 1 0 0")), OrganError::TooFewVertices { found: 2 }.into());
        assert_eq!(cause(leaf("3 0 0 0 1 0 0 2 0 0")), OrganError::NoArea.into());
        assert!(matches!(cause(leaf("4 0 0 0 1 0 0 0 1 0")), OrganRecordError::Fields { found: 10, .. }));
        let tree = read_leaves(&file("# tree n\n-1 3 0 0 0 1 0 0 0 1 0\n")).unwrap_err();
        assert!(matches!(cause(tree), OrganRecordError::Tree { .. }));
        assert!(
            branch("0 0 0 0 0 1 -1").to_string().starts_with("tree.txt:2: the radius of a branch must be")
        );
    }
}
