//! Any text as an L-system: a grammar or a refusal; a grammar grows a tree or exceeds its bound.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_scenes::lsystem::{Grammar, GrammarSource, LSystemOverrides};
use rowscan_scenes::{GeneratorKind, Orchard, OrchardParameters};

fuzz_target!(|text: &str| {
    let Ok(grammar) = Grammar::read(text.lines()) else { return };
    assert!(!grammar.axiom.is_empty() && (1..=100).contains(&grammar.iterations));
    let lsystem = LSystemOverrides {
        rules: Some(GrammarSource::Inline(text.lines().map(str::to_owned).collect())),
        iterations: Some(3),
        max_symbols: Some(200),
        ..LSystemOverrides::default()
    };
    let orchard =
        OrchardParameters { generator: Some(GeneratorKind::LSystem), trees: Some(1), lsystem, ..OrchardParameters::default() };
    let _ = Orchard::grow(&orchard, 1, &|_, _| {});
});
