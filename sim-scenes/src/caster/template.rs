//! Outlines that many leaves share. Nearly all leaves of an orchard are copies of one blade: moved, turned, mirrored, stretched.

use glam::DVec3;
use rayon::prelude::*;

/// A leaf belongs to a template if no vertex lies farther from where the template has it than this part of the leaf's size, which is that
/// of its u and v: less than a nanometre on a leaf of any size that grows.
const ALIKE: f64 = 1e-9;

/// Outlines with fewer vertices gain little; and triangles of a mesh share the crossings of their edges to the last bit, so long as
/// they are cut by their own vertices.
const FEWEST_VERTICES: usize = 5;

/// Templates of a field, at most.
const MOST: usize = 16;

/// Outlines that are looked at side by side.
const BATCH: usize = 1 << 14;

/// Leaves that are worth a field of their own.
const WORTH: usize = 64;

/// An outline but for where it lies, how it is turned and stretched: vertex i is at middle + aᵢ u + bᵢ v.
#[derive(Clone, Debug)]
pub(super) struct Template {
    /// (aᵢ, bᵢ) of every vertex.
    pub(super) shares: Vec<[f64; 2]>,
    /// The vertices at which u and v end.
    ends: [usize; 2],
}

/// Where a leaf of a template lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// The mean of the vertices.
    pub(super) middle: DVec3,
    pub(super) u: DVec3,
    pub(super) v: DVec3,
}

impl Template {
    /// The templates of outlines, those first that come first, and outline by outline which one fits.
    pub(super) fn among<T: AsRef<[[f64; 3]]> + Sync>(outlines: &[T]) -> (Vec<Self>, Vec<Option<u8>>) {
        let mut templates: Vec<Self> = Vec::new();
        let mut of: Vec<Option<u8>> = Vec::with_capacity(outlines.len());
        for batch in outlines.chunks(BATCH) {
            // Those that fit a template of earlier batches fit no template before it; the others make new ones in their order.
            let known: Vec<Option<u8>> =
                batch.par_iter().map(|outline| fitting(&templates, outline.as_ref())).collect();
            of.extend(batch.iter().zip(known).map(|(outline, known)| {
                known.or_else(|| fitting(&templates, outline.as_ref())).or_else(|| {
                    templates.push(Self::of(outline.as_ref()).filter(|_| templates.len() < MOST)?);
                    u8::try_from(templates.len() - 1).ok()
                })
            }));
        }
        let mut leaves = [0_usize; MOST];
        for of in of.iter().flatten() {
            leaves[usize::from(*of) % MOST] += 1;
        }
        let mut places = [None; MOST];
        let mut kept = Vec::new();
        for ((template, leaves), place) in templates.into_iter().zip(leaves).zip(&mut places) {
            if leaves >= WORTH {
                *place = u8::try_from(kept.len()).ok();
                kept.push(template);
            }
        }
        for of in &mut of {
            *of = of.and_then(|of| places[usize::from(of) % MOST]);
        }
        (kept, of)
    }

    /// The template of an outline. u and v end at the two vertices that span most.
    fn of(outline: &[[f64; 3]]) -> Option<Self> {
        if outline.len() < FEWEST_VERTICES {
            return None;
        }
        let middle = middle(outline);
        let arm =
            |number: usize| outline.get(number).map_or(DVec3::ZERO, |at| DVec3::from_array(*at) - middle);
        let pairs = (0..outline.len()).flat_map(|i| (0..i).map(move |j| [j, i]));
        let ends = pairs.max_by(|a, b| {
            let spanned = |[i, j]: &[usize; 2]| arm(*i).cross(arm(*j)).length_squared();
            spanned(a).total_cmp(&spanned(b))
        })?;
        let [u, v] = ends.map(arm);
        let normal = u.cross(v);
        let square = normal.length_squared();
        let share = |number| {
            let arm = arm(number);
            [arm.cross(v).dot(normal) / square, u.cross(arm).dot(normal) / square]
        };
        let template = Self { shares: (0..outline.len()).map(share).collect(), ends };
        template.frame(outline).is_some().then_some(template)
    }

    /// Where a leaf with this outline lies; None if it has another.
    pub(super) fn frame(&self, outline: &[[f64; 3]]) -> Option<Frame> {
        if outline.len() != self.shares.len() {
            return None;
        }
        let middle = middle(outline);
        let [u, v] = self.ends.map(|end| outline.get(end).map(|at| DVec3::from_array(*at) - middle));
        let frame = Frame { middle, u: u?, v: v? };
        let off = |(at, [a, b]): (&[f64; 3], &[f64; 2])| {
            (DVec3::from_array(*at) - middle - frame.u * *a - frame.v * *b).length_squared()
        };
        let most = ALIKE * ALIKE * (frame.u.length_squared() + frame.v.length_squared());
        outline.iter().zip(&self.shares).all(|pair| off(pair) <= most).then_some(frame)
    }
}

/// The first template that an outline fits.
fn fitting(templates: &[Template], outline: &[[f64; 3]]) -> Option<u8> {
    u8::try_from(templates.iter().position(|template| template.frame(outline).is_some())?).ok()
}

fn middle(outline: &[[f64; 3]]) -> DVec3 {
    outline.iter().map(|at| DVec3::from_array(*at)).sum::<DVec3>() / outline.len() as f64
}
