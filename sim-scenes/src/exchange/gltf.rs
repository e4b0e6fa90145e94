//! glTF 2.0 as one binary file (GLB): triangles by material, one mesh a distinct tree, one node a standing tree.

use serde_json::{Value, json};

use super::mesh::{self, Face, Material};
use crate::caster::convex;
use crate::orchard::grown::Orchard;
use crate::organ::Leaf;
use crate::placement::Placement;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Writes an orchard. glTF counts Y up: the scene's root node turns Z up into that.
pub fn write(orchard: &Orchard) -> Vec<u8> {
    let mut file = File::default();
    let mut children = Vec::new();
    let meshes: Vec<Option<usize>> =
        orchard.distinct_trees().iter().map(|tree| file.mesh(&mesh::faces_of_tree(tree))).collect();
    for (number, (tree, placement)) in orchard.standing().enumerate() {
        if let Some(mesh) = meshes.get(tree).copied().flatten() {
            children.push(file.nodes.len());
            file.nodes.push(node(&format!("tree_{number}"), mesh, placement));
        }
    }
    if let Some(mesh) = file.mesh(&mesh::faces_of_supports(orchard)) {
        children.push(file.nodes.len());
        file.nodes.push(node("supports", mesh, &Placement::HERE));
    }
    let root = file.nodes.len();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    file.nodes.push(json!({ "name": "orchard", "children": children, "rotation": [-half, 0.0, 0.0, half] }));
    file.glb(root)
}

fn node(name: &str, mesh: usize, placement: &Placement) -> Value {
    let half = placement.turn_deg().to_radians() / 2.0;
    json!({
        "name": name, "mesh": mesh, "translation": placement.base_m(),
        "rotation": [0.0, 0.0, libm::sin(half), libm::cos(half)],
    })
}

#[derive(Default)]
struct File {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: Vec<u8>,
}

impl File {
    /// Adds a mesh, a primitive a material. None for no faces.
    fn mesh(&mut self, faces: &[Face]) -> Option<usize> {
        let mut primitives = Vec::new();
        for material in Material::ALL {
            let of_material: Vec<&Face> = faces.iter().filter(|face| face.material == *material).collect();
            if !of_material.is_empty() {
                primitives.push(self.primitive(&of_material, *material));
            }
        }
        (!primitives.is_empty()).then(|| {
            self.meshes.push(json!({ "primitives": primitives }));
            self.meshes.len() - 1
        })
    }

    fn primitive(&mut self, faces: &[&Face], material: Material) -> Value {
        let (mut positions, mut indices) = (Vec::<[f32; 3]>::new(), Vec::<u32>::new());
        for face in faces {
            for piece in pieces(face) {
                let first = positions.len() as u32;
                positions.extend(piece.iter().map(|vertex| vertex.map(|c| c as f32)));
                for k in 1..(piece.len() as u32).saturating_sub(1) {
                    indices.extend([first, first + k, first + k + 1]);
                }
            }
        }
        let bound = |pick: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
            (0..3).map(|axis| positions.iter().map(|p| p[axis]).fold(start, pick)).collect()
        };
        let (low, high) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
        let position = self.accessor(
            positions.iter().flatten().flat_map(|c| c.to_le_bytes()),
            ARRAY_BUFFER,
            json!({ "componentType": FLOAT, "count": positions.len(), "type": "VEC3", "min": low, "max": high }),
        );
        let index = self.accessor(
            indices.iter().flat_map(|i| i.to_le_bytes()),
            ELEMENT_ARRAY_BUFFER,
            json!({ "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR" }),
        );
        json!({ "attributes": { "POSITION": position }, "indices": index, "material": material as usize })
    }

    fn accessor(&mut self, content: impl Iterator<Item = u8>, target: u32, mut accessor: Value) -> usize {
        let from = self.bytes.len();
        self.bytes.extend(content);
        let length = self.bytes.len() - from;
        self.views.push(json!({ "buffer": 0, "byteOffset": from, "byteLength": length, "target": target }));
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// The container: a header, the JSON, the bytes, each filled up to whole words.
    fn glb(mut self, root: usize) -> Vec<u8> {
        let materials: Vec<Value> = Material::ALL
            .iter()
            .map(|material| {
                let [r, g, b] = material.rgb().map(|value| f64::from(value) / 255.0);
                let surface = json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0 });
                json!({ "name": material.to_string(), "doubleSided": true, "pbrMetallicRoughness": surface })
            })
            .collect();
        let mut document = json!({
            "asset": { "version": "2.0", "generator": concat!("rowscan ", env!("CARGO_PKG_VERSION")) },
            "scene": 0, "scenes": [{ "nodes": [root] }], "nodes": self.nodes, "materials": materials,
        });
        // The format allows no empty lists.
        if !self.meshes.is_empty() {
            document["meshes"] = json!(self.meshes);
            document["accessors"] = json!(self.accessors);
            document["bufferViews"] = json!(self.views);
            document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let chunks: Vec<(&[u8; 4], &[u8])> = match self.bytes.is_empty() {
            true => vec![(b"JSON", &text)],
            false => vec![(b"JSON", &text), (b"BIN\0", &self.bytes)],
        };
        let total = 12 + chunks.iter().map(|(_, chunk)| 8 + chunk.len()).sum::<usize>();
        let mut file = Vec::with_capacity(total);
        file.extend(b"glTF");
        file.extend(2u32.to_le_bytes());
        file.extend((total as u32).to_le_bytes());
        for (kind, chunk) in chunks {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }
}

/// Convex pieces of a face.
fn pieces(face: &Face) -> Vec<Vec<[f64; 3]>> {
    Leaf::new(face.outline.clone()).map_or_else(|_| vec![face.outline.clone()], |leaf| convex::pieces(&leaf))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::organ::{Cylinder, Tree};

    #[test]
    fn the_container_holds_every_triangle_and_its_lengths_agree() {
        let leaf = Leaf::new([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.1, 0.1, 1.0], [0.0, 0.1, 1.0]]).unwrap();
        let wood = Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], 0.05).unwrap();
        let tree = Tree { leaves: vec![leaf], wood: vec![wood], facets: Vec::new() };
        let bytes = write(&Orchard::from_trees(vec![tree], 1.0, None, None));
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let text = &bytes[20..20 + word(12)];
        let document: Value = serde_json::from_slice(text).unwrap();
        let counts: Vec<u64> =
            document["accessors"].as_array().unwrap().iter().map(|a| a["count"].as_u64().unwrap()).collect();
        // A square of two triangles; eight sides of two triangles each.
        assert_eq!(counts, [4, 6, 32, 48]);
        let binary = 20 + word(12);
        assert_eq!(&bytes[binary + 4..binary + 8], b"BIN\0");
        assert_eq!(document["buffers"][0]["byteLength"], (4 + 32) * 12 + (6 + 48) * 4);
        assert_eq!(document["meshes"][0]["primitives"][1]["material"], Material::Wood as usize);
    }

    #[test]
    fn an_orchard_of_nothing_is_still_a_file() {
        let bytes = write(&Orchard::from_trees(vec![Tree::default()], 1.0, None, None));
        assert!(bytes.starts_with(b"glTF") && bytes.len().is_multiple_of(4));
    }
}
