//! The usual places to look from.

use glam::DVec3;

use crate::camera::Camera;
use crate::error::RenderError;
use crate::model::Model;

/// A place to look from; every view has the whole row in its picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// From beside and above the row's begin.
    #[default]
    ThreeQuarter,
    /// From the scanner's side, square to the row.
    Side,
    /// Along the row, from the alley in which the scanner drives, at the height of the eyes.
    Alley,
    /// From above; the row lies across the picture.
    Top,
}

/// Share of half the picture that is left free on each side.
const MARGIN: f64 = 0.05;

/// Height of the eyes in the alley, metres.
const EYES_M: f64 = 1.7;

impl View {
    /// All views.
    pub const ALL: [Self; 4] = [Self::ThreeQuarter, Self::Side, Self::Alley, Self::Top];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::ThreeQuarter => "three-quarter",
            Self::Side => "side",
            Self::Alley => "alley",
            Self::Top => "top",
        }
    }

    /// Angle of view from left to right, degrees.
    fn angle_deg(self) -> f64 {
        match self {
            Self::ThreeQuarter => 36.0,
            Self::Side => 30.0,
            Self::Alley => 56.0,
            Self::Top => 24.0,
        }
    }

    fn towards(self) -> DVec3 {
        match self {
            Self::ThreeQuarter => DVec3::new(1.0, 0.62, -0.17),
            Self::Side => DVec3::new(1.0, 0.0, -0.05),
            Self::Alley => DVec3::new(0.0, 1.0, 0.0),
            Self::Top => DVec3::NEG_Z,
        }
    }

    /// The camera of this view, with the usual lens.
    ///
    /// # Errors
    /// A size that no picture has.
    pub fn camera(self, model: &Model, size: (u32, u32)) -> Result<Camera, RenderError> {
        self.camera_with(model, self.angle_deg(), size)
    }

    /// The camera of this view with another angle of view, degrees.
    ///
    /// # Errors
    /// A size or angle that no picture has.
    pub fn camera_with(self, model: &Model, fov_deg: f64, size: (u32, u32)) -> Result<Camera, RenderError> {
        if !(1.0..=150.0).contains(&fov_deg) {
            return Err(RenderError::Angle { found: fov_deg });
        }
        let [low, high] = model.extent();
        let nowhere = || RenderError::Direction { from: low, look: high };
        let camera = Camera::facing(self.towards(), size)?.ok_or_else(nowhere)?.with_angle(fov_deg);
        let corners = model.points();
        let fitted = camera.fitted(&corners, MARGIN);
        if self != Self::Alley {
            return Ok(fitted);
        }
        // From the middle of the alley, at the eyes' height: as far back as all is in the picture.
        let at = DVec3::new(-0.5 * model.alley_m(), 0.0, EYES_M);
        let mirrored: Vec<DVec3> = corners
            .iter()
            .flat_map(|corner| [1.0, -1.0].map(|side| at + (*corner - at) * DVec3::new(side, 1.0, 1.0)))
            .flat_map(|corner| [1.0, -1.0].map(|up| at + (corner - at) * DVec3::new(1.0, 1.0, up)))
            .collect();
        Ok(camera.moved(DVec3::from_array(camera.fitted(&mirrored, MARGIN).eye())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Figure;
    use rowscan_scenes::Orchard;
    use rowscan_scenes::orchard::{OrchardParameters, Preset};

    #[test]
    fn every_view_has_the_whole_row_in_its_picture() {
        let parameters = OrchardParameters { trees: Some(3), ..OrchardParameters::of(Preset::FruitingWall) };
        let orchard = Orchard::grow(&parameters, 1, &|_, _| {}).unwrap();
        let model = Model::of(&orchard, usize::MAX).unwrap().with_figure(Figure::Person);
        for (view, size) in View::ALL.into_iter().flat_map(|view| [(view, (160, 90)), (view, (60, 120))]) {
            let camera = view.camera(&model, size).unwrap();
            let (mut least, mut most) = ([f64::INFINITY; 2], [0.0f64; 2]);
            for corner in &model.mesh.corners {
                let at = camera.project(corner.at.as_dvec3().to_array()).expect("before the camera");
                for axis in 0..2 {
                    least[axis] = least[axis].min(at[axis]);
                    most[axis] = most[axis].max(at[axis]);
                }
            }
            let (width, height) = (f64::from(size.0), f64::from(size.1));
            assert!(least[0] >= 0.0 && least[1] >= 0.0, "{view:?} {least:?}");
            assert!(most[0] <= width && most[1] <= height, "{view:?} {most:?}");
            let filled = ((most[0] - least[0]) / width).max((most[1] - least[1]) / height);
            assert!(filled > if view == View::Alley { 0.3 } else { 0.89 }, "{view:?} fills {filled}");
        }
    }
}
