//! Wavefront OBJ: `v`, `f`, `usemtl`, `o`; the rest is passed over.
//!
//! A reader of our own: the one on the shelf (tobj) names no line in its errors and splits faces from their order.

use std::fmt::Write as _;

use super::mesh::{self, Face, Material, RawFace};
use super::{ExchangeError, MOST_TREES, OrganRecordError};
use crate::orchard::grown::Orchard;
use crate::parameters::{SceneFile, lines};

/// How the objects of a tree are named: this and the tree's number.
const TREE: &str = "tree_";

/// Reads the faces of a file.
///
/// # Errors
/// The first line that says nothing, with its number.
pub fn read(file: &SceneFile) -> Result<Vec<RawFace>, ExchangeError> {
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut faces = Vec::new();
    let (mut material, mut tree) = (None, 0);
    for (line, content) in lines(file.text()?) {
        let (key, rest) = content.split_once(char::is_whitespace).unwrap_or((content, ""));
        let rest = rest.trim();
        let at = |cause| ExchangeError::Record { path: file.path().to_owned(), line, cause };
        match key {
            "v" => vertices.push(vertex(rest).map_err(at)?),
            "f" => {
                let corner = |field: &str| index(field, &vertices);
                let outline = rest.split_whitespace().map(corner).collect::<Result<_, _>>().map_err(at)?;
                faces.push(RawFace { tree, line, material: material.clone(), outline });
            }
            "usemtl" => material = Some(rest.to_owned()),
            "o" | "g" => tree = tree_number(rest),
            _ => {}
        }
    }
    Ok(faces)
}

/// The tree that an object is part of; objects of other names are part of the first.
fn tree_number(name: &str) -> u32 {
    let number = name.strip_prefix(TREE).and_then(|number| number.parse().ok());
    number.filter(|tree| *tree <= MOST_TREES).unwrap_or(0)
}

fn vertex(rest: &str) -> Result<[f64; 3], OrganRecordError> {
    let mut numbers = [0.0; 3];
    let fields: Vec<&str> = rest.split_whitespace().collect();
    // A weight, or a colour, may follow.
    let Some(coordinates) = fields.get(..3) else {
        return Err(OrganRecordError::Fields { expected: "x y z", found: fields.len() });
    };
    for (number, field) in numbers.iter_mut().zip(coordinates) {
        *number = field.parse().map_err(|_| OrganRecordError::NotANumber { found: (*field).to_owned() })?;
    }
    Ok(numbers)
}

/// The vertex of a corner such as `7`, `7/1/3` or `-1`.
fn index(field: &str, vertices: &[[f64; 3]]) -> Result<[f64; 3], OrganRecordError> {
    let number = field.split('/').next().and_then(|number| number.parse::<i64>().ok());
    let place = number.and_then(|number| match number {
        1.. => usize::try_from(number - 1).ok(),
        0 => None,
        _ => vertices.len().checked_sub(usize::try_from(number.unsigned_abs()).ok()?),
    });
    let found = place.and_then(|place| vertices.get(place)).copied();
    found.ok_or_else(|| OrganRecordError::Index { vertices: vertices.len(), found: field.to_owned() })
}

/// Writes an orchard, and the library of its materials that is named `library` in it.
pub fn write(orchard: &Orchard, library: &str) -> (String, String) {
    let mut text = format!("# metres, Z up\nmtllib {library}\n");
    let mut count = 0usize;
    for (number, tree) in orchard.trees().enumerate() {
        let _ = writeln!(text, "o {TREE}{number}");
        write_faces(&mut text, &mut count, &mesh::faces_of_tree(&tree));
    }
    let supports = mesh::faces_of_supports(orchard);
    if !supports.is_empty() {
        text.push_str("o supports\n");
        write_faces(&mut text, &mut count, &supports);
    }
    (text, materials())
}

fn write_faces(text: &mut String, count: &mut usize, faces: &[Face]) {
    let mut material = None;
    for face in faces {
        if material != Some(face.material) {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "usemtl {}", face.material);
            material = Some(face.material);
        }
        for [x, y, z] in &face.outline {
            let _ = writeln!(text, "v {} {} {}", *x as f32, *y as f32, *z as f32);
        }
        text.push('f');
        for corner in 1..=face.outline.len() {
            let _ = write!(text, " {}", *count + corner);
        }
        text.push('\n');
        *count += face.outline.len();
    }
}

fn materials() -> String {
    let mut text = String::new();
    for material in Material::ALL {
        let [r, g, b] = material.rgb().map(|value| f64::from(value) / 255.0);
        let _ = writeln!(text, "newmtl {material}\nKd {r:.3} {g:.3} {b:.3}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<RawFace>, ExchangeError> {
        read(&SceneFile::with_content("tree.obj", text.as_bytes()))
    }

    #[test]
    fn faces_carry_material_tree_and_corners_of_every_kind() {
        let text = "mtllib x.mtl\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nvn 0 0 1\no tree_7\nusemtl Leaf\nf 1//1 2//1 -1\n\
                    g rest\nusemtl bark\nv 0 1 0\nf 1 2 3 4\n";
        let faces = read_text(text).unwrap();
        assert_eq!((faces[0].tree, faces[0].material.as_deref(), faces[0].line), (7, Some("Leaf"), 8));
        assert_eq!(faces[0].outline, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
        assert_eq!((faces[1].tree, faces[1].outline.len()), (0, 4));
    }

    #[test]
    fn a_bad_index_is_refused_with_file_and_line() {
        for (corner, vertices) in [("4", 3), ("0", 3), ("-4", 3), ("two", 3), ("99999999999999999999", 3)] {
            let error = read_text(&format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 {corner}\n")).unwrap_err();
            let cause = OrganRecordError::Index { vertices, found: corner.to_owned() };
            assert_eq!(error, ExchangeError::Record { path: "tree.obj".into(), line: 4, cause });
        }
        let error = read_text("v 0 zero 0\n").unwrap_err();
        assert_eq!(error.to_string(), "tree.obj:1: a number expected, found `zero`");
        assert!(read_text("v 0 0\n").unwrap_err().to_string().contains("x y z expected"));
    }
}
