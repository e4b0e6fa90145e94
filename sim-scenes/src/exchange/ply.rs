//! Stanford PLY: `vertex` with x, y, z; `face` with `vertex_indices` or `vertex_index`.
//!
//! PLY has no materials. Faces may have a property `material_index`, which header lines `comment material NUMBER NAME` name, and a
//! property `tree`; written files have both.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Header, Property};

use super::mesh::{self, Face, Material, RawFace};
use super::{ExchangeError, MOST_TREES, OrganRecordError};
use crate::orchard::grown::Orchard;
use crate::parameters::SceneFile;

/// Reads the faces of a file, ASCII or binary.
///
/// # Errors
/// What is no PLY, and the first face that cannot be one, by its number.
pub fn read(file: &SceneFile) -> Result<Vec<RawFace>, ExchangeError> {
    let format = |cause: String| ExchangeError::Format { path: file.path().to_owned(), cause };
    let bytes = file.bytes()?;
    let parser = Parser::<DefaultElement>::new();
    let header = parser.read_ply_header(&mut &*bytes).map_err(|error| format(error.to_string()))?;
    for (name, element) in &header.elements {
        // Every element takes a byte or more: a header that promises more would keep the reader busy forever.
        if element.count > bytes.len() || (element.properties.is_empty() && element.count > 0) {
            return Err(format(format!("{} {name}s promised in {} bytes", element.count, bytes.len())));
        }
    }
    let names = material_names(&header);
    let ply = parser.read_ply(&mut &*bytes).map_err(|error| format(error.to_string()))?;
    let elements = |name: &str| ply.payload.get(name).map_or(&[][..], Vec::as_slice);
    let vertices: Vec<[f64; 3]> = elements("vertex")
        .iter()
        .map(|vertex| {
            let [x, y, z] = ["x", "y", "z"].map(|axis| vertex.get(axis).and_then(number));
            Some([x?, y?, z?])
        })
        .collect::<Option<_>>()
        .ok_or_else(|| format("vertices without numbers x, y, z".to_owned()))?;
    (1..)
        .zip(elements("face"))
        .map(|(line, face)| {
            raw_face(line, face, &vertices, &names).map_err(|cause| ExchangeError::Record {
                path: file.path().to_owned(),
                line,
                cause,
            })
        })
        .collect()
}

fn raw_face(
    line: usize,
    face: &DefaultElement,
    vertices: &[[f64; 3]],
    names: &BTreeMap<i64, String>,
) -> Result<RawFace, OrganRecordError> {
    let list = face.get("vertex_indices").or_else(|| face.get("vertex_index"));
    let wrong = |found: String| OrganRecordError::Index { vertices: vertices.len(), found };
    let indices = list.and_then(Property::to_u32_list).ok_or_else(|| wrong(format!("{list:?}")))?;
    let outline = indices
        .iter()
        .map(|index| vertices.get(*index as usize).copied().ok_or_else(|| wrong(index.to_string())))
        .collect::<Result<_, _>>()?;
    let whole = |name: &str| face.get(name).and_then(number).map(|value| value as i64);
    let material = whole("material_index")
        .map(|index| names.get(&index).cloned().unwrap_or_else(|| format!("material_index {index}")));
    let tree = whole("tree").and_then(|tree| u32::try_from(tree).ok());
    let tree = tree.filter(|tree| *tree <= MOST_TREES).unwrap_or(0);
    Ok(RawFace { tree, line, material, outline })
}

/// The names in header lines `comment material NUMBER NAME`.
fn material_names(header: &Header) -> BTreeMap<i64, String> {
    let name = |comment: &String| {
        let rest = comment.trim().strip_prefix("material")?.trim_start();
        let (number, name) = rest.split_once(char::is_whitespace)?;
        Some((number.parse().ok()?, name.trim().to_owned()))
    };
    header.comments.iter().filter_map(name).collect()
}

fn number(property: &Property) -> Option<f64> {
    Some(match property {
        Property::Char(value) => f64::from(*value),
        Property::UChar(value) => f64::from(*value),
        Property::Short(value) => f64::from(*value),
        Property::UShort(value) => f64::from(*value),
        Property::Int(value) => f64::from(*value),
        Property::UInt(value) => f64::from(*value),
        Property::Float(value) => f64::from(*value),
        Property::Double(value) => *value,
        _ => return None,
    })
}

/// Writes an orchard, binary little-endian. Posts and wires belong to tree −1.
pub fn write(orchard: &Orchard) -> Vec<u8> {
    let mut body = Body::default();
    for (number, tree) in (0..).zip(orchard.trees()) {
        mesh::faces_of_tree(&tree).iter().for_each(|face| body.push(face, number));
    }
    mesh::faces_of_supports(orchard).iter().for_each(|face| body.push(face, -1));
    let mut header = String::from("ply\nformat binary_little_endian 1.0\ncomment metres, Z up\n");
    for (number, material) in Material::ALL.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(header, "comment material {number} {material}");
    }
    let _ = write!(
        header,
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
         property list ushort uint vertex_indices\nproperty uchar material_index\nproperty int tree\nend_header\n",
        body.vertex_count, body.face_count
    );
    let mut bytes = header.into_bytes();
    bytes.extend(body.vertices);
    bytes.extend(body.faces);
    bytes
}

#[derive(Default)]
struct Body {
    vertices: Vec<u8>,
    faces: Vec<u8>,
    vertex_count: u32,
    face_count: usize,
}

impl Body {
    fn push(&mut self, face: &Face, tree: i32) {
        // The format counts the corners of a face in 16 bits here; no leaf has more.
        let corners = u16::try_from(face.outline.len()).unwrap_or(u16::MAX);
        self.faces.extend(corners.to_le_bytes());
        for vertex in face.outline.iter().take(usize::from(corners)) {
            self.vertices.extend(vertex.iter().flat_map(|c| (*c as f32).to_le_bytes()));
            self.faces.extend(self.vertex_count.to_le_bytes());
            self.vertex_count += 1;
        }
        self.faces.push(face.material as u8);
        self.faces.extend(tree.to_le_bytes());
        self.face_count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat ascii 1.0\ncomment material 3 Bark old\nelement vertex 3\nproperty float x\n\
                          property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\n\
                          property int material_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n";

    fn read_text(text: &str) -> Result<Vec<RawFace>, ExchangeError> {
        read(&SceneFile::with_content("tree.ply", text.as_bytes()))
    }

    #[test]
    fn materials_come_from_header_comments() {
        let faces = read_text(&format!("{HEADER}3 0 1 2 3\n")).unwrap();
        assert_eq!((faces[0].material.as_deref(), faces[0].outline.len()), (Some("Bark old"), 3));
        let unnamed = read_text(&format!("{HEADER}3 0 1 2 4\n")).unwrap();
        assert_eq!(unnamed[0].material.as_deref(), Some("material_index 4"));
    }

    #[test]
    fn what_is_no_ply_is_refused() {
        let error = read_text(&format!("{HEADER}3 0 1 7 3\n")).unwrap_err();
        assert!(error.to_string().starts_with("tree.ply:1: a vertex from 1 to 3 expected"), "{error}");
        assert!(matches!(read_text("solid stl\n"), Err(ExchangeError::Format { .. })));
        assert!(matches!(read_text(HEADER), Err(ExchangeError::Format { .. })), "the face is missing");
        let greedy = HEADER.replace("element face 1", "element face 4000000000");
        assert!(read_text(&greedy).unwrap_err().to_string().contains("4000000000 faces promised"));
    }
}
