//! All that a row depends on.

use rowscan_scenes::Scene;
use serde_json::{Map, Value};

use crate::{calibrations, fingerprint};

/// All that a row depends on, besides study and program: by it a kept row is found again.
#[derive(Clone, Debug, PartialEq)]
pub struct Depends(Map<String, Value>);

impl Depends {
    /// On this scene with its seed, its rig, its optics and the content of its files, and on the calibration that its rig names for the scanner model `model`.
    pub fn on_pass(scene: &Scene, model: &str) -> Self {
        let rig = scene.resolved_rig();
        let named = rig.calibration.as_deref();
        let calibration = named.map(|name| {
            let loaded = calibrations::load_calibration_for(name, model, rig.optics);
            loaded.map_err(|cause| cause.to_string())
        });
        Self::on_scene(scene).and("model", &model).and("calibration_of_rig", &calibration)
    }

    /// On this scene with its seed, its rig, its optics and the content of its files.
    pub fn on_scene(scene: &Scene) -> Self {
        let mut filled = scene.clone();
        let files: Vec<(String, String)> = filled
            .files_mut()
            .into_iter()
            .map(|file| (file.path().to_owned(), fingerprint::of_content(file.bytes().unwrap_or_default())))
            .collect();
        Self(Map::new()).and("scene", scene).and("files", &files)
    }

    /// And on this.
    #[must_use]
    pub fn and(mut self, what: &str, value: &dyn erased_serde::Serialize) -> Self {
        // What has no JSON is told by its failure: it then equals only what fails alike, and no settings do.
        let value = serde_json::to_value(value).unwrap_or_else(|cause| Value::String(cause.to_string()));
        self.0.insert(what.to_owned(), value);
        self
    }

    /// One line that differs where anything does.
    pub(crate) fn to_line(&self) -> String {
        // A map of values always has JSON.
        serde_json::to_string(&self.0).unwrap_or_default()
    }

    pub(super) fn into_value(self) -> Value {
        Value::Object(self.0)
    }
}
