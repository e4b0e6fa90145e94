//! Trees from files: branches and leaves as text, or a mesh.

pub(crate) mod error;
pub(crate) mod parameters;

pub use error::ImportError;
pub use parameters::{ImportParameters, NotPlane, PLANE_TOLERANCE, Stands, UpAxis};

use std::collections::HashSet;

use glam::DVec3;

use crate::exchange::mesh::RawFace;
use crate::exchange::text::Record;
use crate::exchange::{ExchangeError, OrganRecordError, obj, ply, text};
use crate::generator::draft::{Blade, Draft};
use crate::generator::error::GrowError;
use crate::generator::planting::{Generator, Planting};
use crate::generator::remark::Remark;
use crate::orchard::layout::Layout;
use crate::organ::{Facet, Leaf, OrganError};
use crate::parameters::SceneFile;
use crate::polygon::vector_area;
use crate::triangles::{crosses_itself, triangulate};
use parameters::MeshFormat;

impl ImportParameters {
    /// Trees in the files: the greatest number of a tree, and one.
    ///
    /// # Errors
    /// As growing them.
    pub fn count_trees(&self) -> Result<u32, GrowError> {
        self.validate()?;
        let mut reading = Reading::new(self);
        reading.read().map_err(ImportError::from)?;
        Ok(u32::try_from(reading.trees.len()).unwrap_or(u32::MAX).max(1))
    }
}

/// Trees read from files.
pub(crate) struct Imported {
    trees: Vec<Draft>,
    per_row: u32,
    is_placed: bool,
    remarks: Vec<Remark>,
}

impl Imported {
    pub(crate) fn new(parameters: &ImportParameters, layout: &Layout) -> Result<Self, GrowError> {
        parameters.validate()?;
        let mut reading = Reading::new(parameters);
        reading.read().map_err(ImportError::from)?;
        let places = layout.rows.saturating_mul(layout.trees);
        let is_placed = parameters.stands == Stands::InPlace;
        let found = u32::try_from(reading.trees.len()).unwrap_or(u32::MAX).saturating_sub(1);
        if is_placed && found >= places {
            return Err(ImportError::Places { found, places }.into());
        }
        Ok(Self { trees: reading.trees, per_row: layout.trees, is_placed, remarks: reading.remarks })
    }
}

impl Generator for Imported {
    fn draft(&self, planting: &Planting) -> Result<Draft, GrowError> {
        let place = planting.row as usize * self.per_row as usize + planting.tree as usize;
        let number = match (self.is_placed, self.trees.len()) {
            (_, 0) => return Ok(Draft::default()),
            (true, _) => place,
            (false, count) => place % count,
        };
        Ok(self.trees.get(number).cloned().unwrap_or_default())
    }

    fn is_placed(&self) -> bool {
        self.is_placed
    }

    fn remarks(&self) -> Vec<Remark> {
        self.remarks.clone()
    }
}

/// Refuses points so far away that the space between would fill the memory.
fn check_near(points: &[[f64; 3]]) -> Result<(), OrganRecordError> {
    const MOST_M: [f64; 3] = [200_000.0, 200_000.0, 1000.0];
    let far = |point: &[f64; 3]| {
        let mut found = point.iter().zip(MOST_M);
        // What is not a number is refused with a message of its own.
        found.find(|(value, most)| value.abs() > *most).map(|(value, _)| *value)
    };
    points.iter().find_map(far).map_or(Ok(()), |found| Err(OrganRecordError::TooFar { found }))
}

/// Files being turned into trees.
struct Reading<'a> {
    parameters: &'a ImportParameters,
    trees: Vec<Draft>,
    remarks: Vec<Remark>,
    /// Corners of the leaves so far, by tree.
    known: HashSet<(u32, Vec<[u64; 3]>)>,
}

impl<'a> Reading<'a> {
    fn new(parameters: &'a ImportParameters) -> Self {
        Self { parameters, trees: Vec::new(), remarks: Vec::new(), known: HashSet::new() }
    }

    fn read(&mut self) -> Result<(), ExchangeError> {
        let parameters = self.parameters;
        if let Some(file) = &parameters.branches {
            for Record { tree, organ, line } in text::read_branches(file)? {
                let (base, tip) = (parameters.point(organ.base()), parameters.point(organ.tip()));
                check_near(&[base, tip]).map_err(at(file, line))?;
                let radius_m = if parameters.scale == 1.0 {
                    organ.radius_m()
                } else {
                    organ.radius_m() * parameters.scale
                };
                let piece = crate::organ::Cylinder::new(base, tip, radius_m);
                self.tree(tree).wood.push(piece.map_err(|cause| at(file, line)(cause.into()))?);
            }
        }
        if let Some(file) = &parameters.leaves {
            for Record { tree, organ, line } in text::read_leaves(file)? {
                self.leaf(file, tree, line, organ.outline())?;
            }
        }
        if let Some(file) = &parameters.mesh {
            let faces = match MeshFormat::of(file.path()) {
                Some(MeshFormat::Ply) => ply::read(file)?,
                _ => obj::read(file)?,
            };
            if faces.is_empty() {
                let cause = "it holds no face: nothing would stand there".to_owned();
                return Err(ExchangeError::Format { path: file.path().to_owned(), cause });
            }
            for face in &faces {
                self.face(file, face)?;
            }
        }
        Ok(())
    }

    fn tree(&mut self, number: u32) -> &mut Draft {
        let number = number as usize;
        if self.trees.len() <= number {
            self.trees.resize_with(number + 1, Draft::default);
        }
        &mut self.trees[number]
    }

    fn face(&mut self, file: &SceneFile, face: &RawFace) -> Result<(), ExchangeError> {
        let RawFace { tree, line, material, outline } = face;
        let names = &self.parameters.materials;
        let material = match (material, self.parameters.material) {
            (Some(name), _) => match names.material(name) {
                Some(Some(material)) => material,
                Some(None) => return Ok(()),
                None => {
                    let cause = OrganRecordError::Material { found: name.clone(), known: names.known() };
                    return Err(at(file, *line)(cause));
                }
            },
            (None, Some(material)) => material,
            (None, None) => return Err(at(file, *line)(OrganRecordError::NoMaterial)),
        };
        let Some(surface) = material.surface() else { return self.leaf(file, *tree, *line, outline) };
        let outline: Vec<[f64; 3]> = outline.iter().map(|vertex| self.parameters.point(*vertex)).collect();
        check_near(&outline).map_err(at(file, *line))?;
        match Leaf::new(outline) {
            // Bark need not be plane to a thousandth: it is what stops beams.
            Ok(polygon) => {
                for polygon in plane_parts(polygon, NotPlane::Triangulate).unwrap_or_default() {
                    self.tree(*tree).facets.push(Facet { surface, polygon });
                }
            }
            Err(OrganError::NoArea) => self.no_area(file, *line),
            Err(cause) => return Err(at(file, *line)(cause.into())),
        }
        Ok(())
    }

    fn leaf(
        &mut self,
        file: &SceneFile,
        tree: u32,
        line: usize,
        outline: &[[f64; 3]],
    ) -> Result<(), ExchangeError> {
        let outline: Vec<[f64; 3]> = outline.iter().map(|vertex| self.parameters.point(*vertex)).collect();
        check_near(&outline).map_err(at(file, line))?;
        if !self.is_first(tree, &outline) {
            self.twice(file, line);
            return Ok(());
        }
        let leaf = match Leaf::new(outline) {
            Ok(leaf) if crosses_itself(leaf.outline(), leaf.normal()) => {
                return Err(at(file, line)(OrganRecordError::CrossesItself));
            }
            Ok(leaf) => leaf,
            // Meshes have slivers; a text file that lists one is wrong, and was refused when it was read.
            Err(OrganError::NoArea) => {
                self.no_area(file, line);
                return Ok(());
            }
            Err(cause) => return Err(at(file, line)(cause.into())),
        };
        let warp = leaf.warp();
        let parts = plane_parts(leaf, self.parameters.not_plane).map_err(at(file, line))?;
        if warp > PLANE_TOLERANCE && self.parameters.not_plane == NotPlane::Triangulate {
            self.not_plane(file, line, warp);
        }
        let blades = parts.into_iter().map(|leaf| Blade { segment: 0, along_m: 0.0, leaf, petiole: None });
        self.tree(tree).blades.extend(blades);
        Ok(())
    }

    /// True if no leaf of the tree had these corners so far, in whatever order.
    fn is_first(&mut self, tree: u32, outline: &[[f64; 3]]) -> bool {
        // 0 has two signs.
        let mut corners: Vec<[u64; 3]> =
            outline.iter().map(|corner| corner.map(|m| (m + 0.0).to_bits())).collect();
        corners.sort_unstable();
        self.known.insert((tree, corners))
    }

    fn twice(&mut self, file: &SceneFile, line: usize) {
        let known = self.remarks.iter_mut().find_map(|remark| match remark {
            Remark::Twice { path, leaves, .. } if path == file.path() => Some(leaves),
            _ => None,
        });
        match known {
            Some(leaves) => *leaves += 1,
            None => {
                self.remarks.push(Remark::Twice { path: file.path().to_owned(), leaves: 1, first: line });
            }
        }
    }

    fn no_area(&mut self, file: &SceneFile, line: usize) {
        let known = self.remarks.iter_mut().find_map(|remark| match remark {
            Remark::NoArea { path, faces, .. } if path == file.path() => Some(faces),
            _ => None,
        });
        match known {
            Some(faces) => *faces += 1,
            None => {
                self.remarks.push(Remark::NoArea { path: file.path().to_owned(), faces: 1, first: line });
            }
        }
    }

    fn not_plane(&mut self, file: &SceneFile, line: usize, warp: f64) {
        let known = self.remarks.iter_mut().find_map(|remark| match remark {
            Remark::NotPlane { path, leaves, .. } if path == file.path() => Some(leaves),
            _ => None,
        });
        match known {
            Some(leaves) => *leaves += 1,
            None => {
                let path = file.path().to_owned();
                self.remarks.push(Remark::NotPlane { path, leaves: 1, first: line, warp });
            }
        }
    }
}

fn at(file: &SceneFile, line: usize) -> impl Fn(OrganRecordError) -> ExchangeError + '_ {
    move |cause| ExchangeError::Record { path: file.path().to_owned(), line, cause }
}

/// The polygon where it is plane; what stands for it where it is not.
fn plane_parts(polygon: Leaf, not_plane: NotPlane) -> Result<Vec<Leaf>, OrganRecordError> {
    let warp = polygon.warp();
    if warp <= PLANE_TOLERANCE {
        return Ok(vec![polygon]);
    }
    let outline = polygon.outline();
    match not_plane {
        NotPlane::Refuse => Err(OrganRecordError::NotPlane { warp }),
        NotPlane::Flatten => {
            let (middle, normal) = (polygon.centroid(), polygon.normal());
            let pressed = outline.iter().map(|vertex| {
                let off: f64 = (0..3).map(|axis| (vertex[axis] - middle[axis]) * normal[axis]).sum();
                std::array::from_fn(|axis| vertex[axis] - off * normal[axis])
            });
            Ok(vec![Leaf::new(pressed.collect::<Vec<[f64; 3]>>())?])
        }
        NotPlane::Triangulate => {
            let Some((first, rest)) = outline.split_first() else { return Ok(Vec::new()) };
            let fan: Vec<[[f64; 3]; 3]> = rest.windows(2).map(|pair| [*first, pair[0], pair[1]]).collect();
            // Where a hollow lies before the first vertex, triangles about it lie upon each other.
            let normal = DVec3::from_array(polygon.normal());
            let parts = if fan.iter().all(|triangle| vector_area(triangle).dot(normal) >= 0.0) {
                fan
            } else {
                let ears = triangulate(outline, polygon.normal());
                ears.iter().map(|corners| corners.map(|corner| outline[corner])).collect()
            };
            // A triangle of three vertices on a line covers nothing.
            Ok(parts.into_iter().filter_map(|triangle| Leaf::new(triangle).ok()).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::mesh::Material;
    use crate::generator::GeneratorKind;
    use crate::orchard::{Orchard, OrchardParameters};

    fn orchard(import: ImportParameters, trees: u32) -> Result<Orchard, GrowError> {
        let parameters = OrchardParameters {
            generator: Some(GeneratorKind::Import),
            import,
            trees: Some(trees),
            tree_spacing_m: Some(2.0),
            ..OrchardParameters::default()
        };
        Orchard::grow(&parameters, 1, &|_, _| {})
    }

    fn file(name: &str, text: &str) -> Option<SceneFile> {
        Some(SceneFile::with_content(name, text.as_bytes()))
    }

    const BENT: &str = "4 0 0 1 1 0 1 1 1 1.2 0 1 1\n";

    #[test]
    fn one_tree_stands_at_every_place_and_files_may_hold_the_whole_orchard() {
        let one = ImportParameters {
            branches: file("b.txt", "0 0 0 0 0 1 0.1\n"),
            leaves: file("l.txt", "3 0 0 1 0.1 0 1 0 0.1 1\n"),
            ..ImportParameters::default()
        };
        let row = orchard(one, 3).unwrap();
        let feet: Vec<[f64; 3]> = row.trees().map(|tree| tree.wood[0].base()).collect();
        assert_eq!(feet, [[0.0, 1.0, 0.0], [0.0, 3.0, 0.0], [0.0, 5.0, 0.0]]);
        let whole = ImportParameters {
            branches: file("b.txt", "# tree x y z\n2 0 0.5 0 0 0.5 1 0.1\n"),
            stands: Stands::InPlace,
            ..ImportParameters::default()
        };
        let row = orchard(whole.clone(), 3).unwrap();
        let counts: Vec<usize> = row.trees().map(|tree| tree.wood.len()).collect();
        assert_eq!((counts, row.tree(2).unwrap().wood[0].base()), (vec![0, 0, 1], [0.0, 0.5, 0.0]));
        let error = orchard(whole, 2).unwrap_err();
        assert!(error.to_string().contains("a tree number 2, the orchard has 2 places"), "{error}");
    }

    #[test]
    fn a_leaf_that_is_not_plane_is_cut_pressed_or_refused_and_it_is_said() {
        let bent = |not_plane| {
            let leaves = file("l.txt", BENT);
            orchard(ImportParameters { leaves, not_plane, ..ImportParameters::default() }, 1)
        };
        let cut = bent(NotPlane::Triangulate).unwrap();
        assert_eq!(cut.tree(0).unwrap().leaves.len(), 2);
        assert!(cut.remarks()[0].to_string().contains("1 leaves are not plane"), "{:?}", cut.remarks());
        let pressed = bent(NotPlane::Flatten).unwrap();
        let leaf = &pressed.tree(0).unwrap().leaves[0];
        assert!(leaf.warp() < 1e-12 && leaf.outline().len() == 4);
        let error = bent(NotPlane::Refuse).unwrap_err().to_string();
        assert!(error.starts_with("l.txt:1: the leaf is not plane: off by"), "{error}");
    }

    fn leaf_area_m2(text: &str) -> f64 {
        let import = ImportParameters { leaves: file("l.txt", text), ..ImportParameters::default() };
        orchard(import, 1).unwrap().tree(0).unwrap().leaves.iter().map(Leaf::area_m2).sum()
    }

    /// The rule: a leaf has one area, whichever of its corners stands first, whatever hollows it has, bent a little or not.
    #[test]
    fn a_hollow_leaf_that_is_bent_has_the_area_of_the_flat_one_from_every_first_corner() {
        let hook = [[0.2, 0.0], [0.2, 0.1], [0.1, 0.1], [0.1, 0.2], [0.0, 0.2], [0.0, 0.0]].to_vec();
        let lobes = (0..10).map(|corner| {
            let (turn, radius_m) =
                (std::f64::consts::TAU * f64::from(corner) / 10.0, if corner % 2 == 0 { 0.06 } else { 0.02 });
            [radius_m * turn.cos(), radius_m * turn.sin()]
        });
        for outline in [hook, lobes.collect()] {
            for first in 0..outline.len() {
                let text = |bent_m: f64| {
                    let corner = |number: usize| {
                        let place = (first + number) % outline.len();
                        let [x, y] = outline[place];
                        let z = 1.0 + if place == 0 { bent_m } else { 0.0 };
                        format!(" {x} {y} {z}")
                    };
                    format!("{}{}\n", outline.len(), (0..outline.len()).map(corner).collect::<String>())
                };
                let (flat, bent) = (leaf_area_m2(&text(0.0)), leaf_area_m2(&text(0.002)));
                assert!((bent / flat - 1.0).abs() < 0.01, "from {first}: {bent} for {flat}");
            }
        }
    }

    #[test]
    fn an_outline_that_crosses_itself_has_no_area_and_is_refused() {
        for text in [
            "4 0 0 1 .2 .2 1 .2 0 1 0 .1 1\n",
            "5 0 0 1 .2 0 1 .2 .1 1 .1 -.05 1 0 .1 1\n",
            "4 0 0 1 .2 .2 1 .2 0 1.05 0 .1 1\n",
        ] {
            let import = ImportParameters { leaves: file("l.txt", text), ..ImportParameters::default() };
            let error = orchard(import, 1).unwrap_err().to_string();
            assert!(error.starts_with("l.txt:1: the leaf's outline crosses itself"), "{text}: {error}");
        }
        // A slit that goes in and out the same way crosses nothing.
        assert!((leaf_area_m2("6 0 0 1 .2 0 1 .2 .2 1 .1 .1 1 .2 .2 1 0 .2 1\n") - 0.04).abs() < 1e-12);
    }

    #[test]
    fn a_back_face_is_no_second_leaf_and_it_is_said() {
        let corners = "v 0 0 1\nv .1 0 1\nv .1 .1 1\nv 0 .1 1\nusemtl leaf\n";
        for back in ["f 4 3 2 1", "f 1 2 3 4", "f 2 1 4 3"] {
            let import = ImportParameters {
                mesh: file("t.obj", &format!("{corners}f 1 2 3 4\n{back}\n")),
                ..ImportParameters::default()
            };
            let row = orchard(import, 2).unwrap();
            let leaves = &row.tree(1).unwrap().leaves;
            assert!(leaves.len() == 1 && (leaves[0].area_m2() - 0.01).abs() < 1e-12, "{back}");
            let said = row.remarks()[0].to_string();
            assert!(said.contains("1 leaves have the corners of another one"), "{said}");
        }
        // Of two trees each has its own.
        let two = "# tree n x y z\n0 3 0 0 1 .1 0 1 0 .1 1\n1 3 0 0 1 .1 0 1 0 .1 1\n";
        let import = ImportParameters {
            leaves: file("l.txt", two),
            stands: Stands::InPlace,
            ..ImportParameters::default()
        };
        let row = orchard(import, 2).unwrap();
        assert_eq!([0, 1].map(|tree| row.tree(tree).unwrap().leaves.len()), [1, 1]);
    }

    #[test]
    fn meshes_are_sorted_by_material_turned_upright_and_scaled() {
        let text = "v 0 1000 0\nv 100 1000 0\nv 0 1000 100\nusemtl Leaf_a\nf 1 2 3\nusemtl bark\nf 1 3 2\n";
        let import = ImportParameters {
            mesh: file("t.obj", text),
            up: UpAxis::Y,
            scale: 0.001,
            ..ImportParameters::default()
        };
        let row = orchard(import.clone(), 1).unwrap();
        let tree = row.tree(0).unwrap();
        assert_eq!((tree.leaves.len(), tree.facets.len()), (1, 1));
        assert!((tree.leaves[0].area_m2() - 0.005).abs() < 1e-12);
        assert!(tree.leaves[0].outline().iter().all(|v| v[2] == 1.0), "Y became Z");
        let strange =
            ImportParameters { mesh: file("t.obj", &text.replace("bark", "chrome")), ..import.clone() };
        let error = orchard(strange, 1).unwrap_err().to_string();
        assert!(error.starts_with("t.obj:7: unknown material `chrome`; known are leaf,"), "{error}");
        let bare = ImportParameters { mesh: file("t.obj", &text.replace("usemtl", "#")), ..import };
        assert!(
            orchard(bare.clone(), 1).unwrap_err().to_string().contains("t.obj:5: the face has no material")
        );
        let told = ImportParameters { material: Some(Material::Leaf), ..bare };
        assert_eq!(orchard(told, 1).unwrap().tree(0).unwrap().leaves.len(), 1, "and its back face");
    }

    #[test]
    fn nothing_to_import_is_refused() {
        let error = orchard(ImportParameters::default(), 1).unwrap_err().to_string();
        assert!(error.contains("orchard.import must be at least one of branches, leaves, mesh"), "{error}");
        let stl = ImportParameters { mesh: file("t.stl", ""), ..ImportParameters::default() };
        assert!(orchard(stl, 1).unwrap_err().to_string().contains(".obj or .ply, found t.stl"));
    }
}
