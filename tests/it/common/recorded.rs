//! Where recordings are made for a test, and what is estimated of them.

use std::path::PathBuf;

use super::binary::run;

/// A quick scene, the same rig for both sides.
const SCENE: &str = "version = 1\n[orchard]\ntrees = 2\n[orchard.tree]\niterations = 7\n";

/// A folder with that scene as `row.toml`; the paths in it.
pub fn folder() -> (tempfile::TempDir, impl Fn(&str) -> String) {
    let folder = tempfile::tempdir().expect("a folder");
    let base: PathBuf = folder.path().to_owned();
    std::fs::write(base.join("row.toml"), SCENE).expect("written");
    (folder, move |name: &str| base.join(name).to_str().expect("UTF-8").to_owned())
}

/// What is estimated of a source, as JSON.
pub fn estimate(source: &str, rig: &str, more: &[&str]) -> String {
    let args = [&["estimate", source, "--rig", rig, "--format", "json"], more].concat();
    let ended = run(&args);
    assert_eq!(ended.code, Some(0), "{args:?}: {}", ended.stderr);
    ended.stdout
}
