//! What a build leaves out stays visible, and is refused with the command that builds it.

use crate::common;

use common::binary::{assert_says, refused, run};
use rowscan::feature::Feature;

/// A use of each feature, and where the help names it.
const USES: [(Feature, &[&str], &[&str], &str); 8] = [
    (Feature::Foxglove, &["emulate", "--foxglove", "127.0.0.1:0"], &["emulate", "--help"], "--foxglove"),
    (Feature::Tables, &["export", "x.bin", "--to", "las", "-o", "x.las"], &["export", "--help"], "las"),
    (Feature::Tables, &["export", "x.bin", "--to", "parquet", "-o", "x"], &["export", "--help"], "parquet"),
    (Feature::Tables, &["scan", "--output", "x", "--write", "las"], &["scan", "--help"], "las"),
    (Feature::Manual, &["completions", "bash"], &["completions", "--help"], "powershell"),
    (Feature::Manual, &["man", "x"], &["--help"], "man"),
    (Feature::Figures, &["study", "areas", "--figure", "x.pdf"], &["study", "areas", "--help"], "PDF"),
    (Feature::Figures, &["demo", "--picture", "x.png"], &["demo", "--help"], "PNG"),
];

#[test]
fn what_a_build_leaves_out_is_in_the_help_and_names_its_feature() {
    for (feature, asked, help, named) in USES {
        assert_says(&run(help).stdout, &[named]);
        if !feature.is_built() {
            let built_by = format!("cargo build --release --features {}", feature.name());
            assert_says(&refused(asked), &[&format!("needs the feature `{}`", feature.name()), &built_by]);
        }
    }
}
