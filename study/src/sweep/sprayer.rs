//! The sprayer of a sweep: a boom that is varied by key, driven past each orchard with the reference controller.

use rowscan_emulator::stage::Stage;
use rowscan_scenes::Orchard;
use rowscan_sprayer::boom::Section;
use rowscan_sprayer::interception::{Interception, Settings, intercept};
use rowscan_sprayer::{Boom, Edge, Edges, Flow, Score};
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::spraying::{self, Controlled, Sprayed, SprayingError};
use crate::{Setting, settings};

/// What its keys begin with in a study.
const PREFIX: &str = "sprayer.";
/// Rays of a bundle: a study is of means over many of them.
const RAYS: u32 = 8;
/// Square metres of a hectare.
const HECTARE_M2: f64 = 1e4;

/// A sprayer that a sweep varies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweptSprayer {
    /// The boom.
    pub boom: Boom,
    /// Latency that the controller does not know of, ms.
    #[serde(default)]
    pub latency_ms: f64,
    /// Sections of each side, evenly over the height of those in the boom, with its nozzles dealt out evenly, one each at least; as the boom has them where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sections: Option<u16>,
    /// Beams of a scan in a nozzle's share of height that the controller takes for canopy; the reference controller's 2 where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_beams: Option<u16>,
}

/// Those of the outputs that are shares, from 0 to 1: a figure has them on one scale.
pub(super) const SHARES: &[&str] = &["recall", "waste", "saved_share", "off_target_share", "leaf_share"];

/// What a sweep can keep of a sprayer, and what each is.
pub(super) const OUTPUTS: &[(&str, &str)] = &[
    ("recall", "share of the wanted leaf area that passed before an open nozzle"),
    ("waste", "share of the litres while the nozzle was not wanted"),
    ("litres", "litres"),
    ("saved_share", "share of the litres of a constant rate that was not sprayed"),
    ("latency_open_m", "median distance of edges that open, late is positive, m"),
    ("latency_close_m", "the same of edges that close, m"),
    ("off_target_share", "interception: share of the litres that meet neither leaf, wood nor fruit"),
    ("leaf_share", "interception: share of the litres on leaves"),
    ("ml_m2", "interception: mL a m² of leaf, mean"),
    ("cv", "interception: its coefficient of variation over cells of 0.1 by 0.5 m"),
    ("litres_ha", "litres a hectare"),
    ("litres_lwa", "litres for 10 000 m² of leaf wall"),
    ("litres_trv", "litres for 1000 m³ of tree row volume"),
    ("lwa_m2_ha", "leaf wall area of both sides, m²/ha"),
    ("trv_m3_ha", "tree row volume, m³/ha"),
];

impl SweptSprayer {
    /// The same with those settings that are of a sprayer; the others are left to the scene.
    pub(super) fn with(&self, all: &[Setting<'_>]) -> Result<Self, String> {
        let own: Vec<(&str, Value)> =
            all.iter().filter_map(|(key, value)| Some((key.strip_prefix(PREFIX)?, value.clone()))).collect();
        if own.is_empty() {
            return Ok(self.clone());
        }
        settings::set(self, &own, |text| {
            let read: Self = rowscan_scenes::files::from_toml(text).map_err(|error| error.to_string())?;
            read.checked()
        })
    }

    /// True for a key that is of a sprayer.
    pub(super) fn has(key: &str) -> bool {
        key.starts_with(PREFIX)
    }

    /// Refuses what cannot be.
    pub(super) fn checked(self) -> Result<Self, String> {
        if !(0.0..=5000.0).contains(&self.latency_ms) {
            return Err(format!("`latency_ms`: expected 0 to 5000 ms, found {}", self.latency_ms));
        }
        if self.sections.is_some_and(|sections| !(1..=32).contains(&sections)) {
            return Err("`sections`: expected 1 to 32".to_owned());
        }
        if self.least_beams.is_some_and(|beams| !(1..=1000).contains(&beams)) {
            return Err("`least_beams`: expected 1 to 1000".to_owned());
        }
        self.cut().validate().map_err(|error| error.to_string())?;
        Ok(self)
    }

    /// The controller.
    fn controlled(&self) -> Controlled {
        let usual = Controlled::default();
        Controlled {
            late_s: usual.late_s + self.latency_ms / 1e3,
            least_beams: self.least_beams.unwrap_or(usual.least_beams),
            ..usual
        }
    }

    /// The boom with its sections.
    fn cut(&self) -> Boom {
        let mut boom = self.boom.clone();
        let Some(count) = self.sections else { return boom };
        let old = std::mem::take(&mut boom.sections);
        for side in [rowscan_sprayer::Side::Left, rowscan_sprayer::Side::Right] {
            let own = || old.iter().filter(|section| section.side == side);
            let Some(first) = own().next() else { continue };
            let (low, high) = own().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), section| {
                (low.min(section.z_from_m), high.max(section.z_to_m))
            });
            // The same flow of the whole side, and the same nozzles where they can be dealt out: what differs is which of them open together.
            let sprays = self.boom.nozzles().into_iter().filter(|nozzle| nozzle.side == side);
            let (all, flow_l_s) =
                sprays.fold((0_u16, 0.0), |(all, flow_l_s), nozzle| (all + 1, flow_l_s + nozzle.flow_l_s));
            let nozzles = all.div_ceil(count).max(1);
            // As the first section's nozzles have it: at their pressure.
            let flow_l_min = flow_l_s * 60.0 / (self.boom.pressure_bar / first.at_bar).sqrt();
            let step_m = (high - low) / f64::from(count);
            boom.sections.extend((0..count).map(|place| Section {
                id: format!("{side:?}-{}", place + 1),
                number: None,
                z_from_m: low + f64::from(place) * step_m,
                z_to_m: low + f64::from(place + 1) * step_m,
                nozzles: Some(nozzles),
                flow_l_min: flow_l_min / f64::from(count * nozzles),
                each: Vec::new(),
                ..first.clone()
            }));
        }
        boom
    }

    /// Sprays a stage's row, and gives these outputs; one that is unknown is none.
    pub(super) fn spray(&self, stage: &Stage, keys: &[&str]) -> Result<Vec<Option<f64>>, SprayingError> {
        let sprayed = spraying::spray(stage, self.cut(), self.controlled())?;
        let found = Found::of(&sprayed, &stage.orchard);
        Ok(keys.iter().map(|key| found.value(key)).collect())
    }
}

/// What is known of a row that was sprayed.
struct Found {
    score: Score,
    edges: Edges,
    interception: Option<Interception>,
    /// Sprayed ground, m²; none where the distance of rows is unknown.
    ground_m2: Option<f64>,
    /// Leaf wall of one side, m² a metre of row.
    wall_m: Option<f64>,
    /// Across the row, metres.
    width_m: f64,
    spacing_m: Option<f64>,
}

impl Found {
    fn of(sprayed: &Sprayed, orchard: &Orchard) -> Self {
        let pass = &sprayed.pass;
        let flows = pass.flows(&sprayed.log);
        let runs: [&[Flow]; 1] = [&flows];
        let settings = Settings { rays: RAYS, ..Settings::new(pass.seed()) };
        let interception = intercept(pass, orchard, &runs, &settings).pop();
        let spacing_m = orchard.row_spacing_m();
        let going = pass.drive().going(pass.boom().standstill_m_s);
        let way_m: f64 = going.iter().map(|span| pass.way_m(span.to) - pass.way_m(span.from)).sum();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for leaf in orchard.trees_of_row(0).flat_map(|tree| tree.leaves.clone()) {
            for corner in leaf.outline() {
                for (end, axis) in [0, 2].into_iter().enumerate() {
                    low[end] = low[end].min(corner[axis]);
                    high[end] = high[end].max(corner[axis]);
                }
            }
        }
        let has_leaves = high[0] > low[0] || high[1] > low[1];
        Self {
            score: Score::of(pass, &flows).beside_sound(&pass.deliver_sound(&sprayed.log).flows),
            edges: Edges::of(pass, &flows),
            interception,
            ground_m2: spacing_m.map(|spacing_m| pass.boom().swath_m(spacing_m) * way_m),
            wall_m: has_leaves.then_some(high[1] - low[1]),
            width_m: high[0] - low[0],
            spacing_m,
        }
    }

    fn value(&self, key: &str) -> Option<f64> {
        let Score { recall, waste, litres, saved_litres, constant_litres, .. } = self.score;
        let of_edge = |edge| self.edges.summary(|pair| pair.edge == edge).p50_m;
        let interception = self.interception.as_ref();
        let leaves = interception.and_then(|found| found.on_leaves.as_ref());
        let litres_ha =
            self.ground_m2.filter(|ground_m2| *ground_m2 > 0.0).map(|m2| litres / m2 * HECTARE_M2);
        // EPPO PP 1/239: two walls a row; height times width.
        let lwa_m2_ha = self.wall_m.zip(self.spacing_m).map(|(h, row)| 2.0 * h * HECTARE_M2 / row);
        let trv_m3_ha = self.wall_m.zip(self.spacing_m).map(|(h, row)| h * self.width_m * HECTARE_M2 / row);
        let found = match key {
            "recall" => recall,
            "waste" => waste,
            "litres" => Some(litres),
            "saved_share" => {
                saved_litres.filter(|_| constant_litres > 0.0).map(|saved| saved / constant_litres)
            }
            "latency_open_m" => of_edge(Edge::Open),
            "latency_close_m" => of_edge(Edge::Close),
            "off_target_share" => interception.and_then(|found| found.off_target_share),
            "leaf_share" => interception.filter(|_| litres > 0.0).map(|found| found.sinks.leaf / litres),
            "ml_m2" => leaves.map(|leaves| leaves.mean_ml_m2),
            "cv" => leaves.and_then(|leaves| leaves.cv),
            "litres_ha" => litres_ha,
            "litres_lwa" => litres_ha.zip(lwa_m2_ha).map(|(litres, lwa)| litres / lwa * 1e4),
            "litres_trv" => litres_ha.zip(trv_m3_ha).map(|(litres, trv)| litres / trv * 1e3),
            "lwa_m2_ha" => lwa_m2_ha,
            "trv_m3_ha" => trv_m3_ha,
            _ => None,
        };
        found.filter(|found| found.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use rowscan_sprayer::Side;

    use super::*;

    #[test]
    fn other_sections_spray_as_much_whatever_their_nozzles_are_listed_by() {
        let text = "version = 1\npressure_bar = 5\n\
            [[section]]\nid = \"a\"\nside = \"left\"\nz_from_m = 0.5\nz_to_m = 1\nnozzles = 3\nflow_l_min = 0.8\n\
            [[section]]\nid = \"b\"\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\nat_bar = 3\n\
            [[section.nozzle]]\nz_from_m = 1\nz_to_m = 1.4\nflow_l_min = 2\n\
            [[section.nozzle]]\nz_from_m = 1.4\nz_to_m = 2\n\
            [[section]]\nid = \"c\"\nside = \"right\"\nz_from_m = 0\nz_to_m = 1\n";
        let boom = Boom::read(text).expect("a boom");
        let flow = |boom: &Boom, side| -> f64 {
            boom.nozzles().iter().filter(|nozzle| nozzle.side == side).map(|nozzle| nozzle.flow_l_s).sum()
        };
        for sections in [1, 2, 5, 9] {
            let cut = SweptSprayer {
                boom: boom.clone(),
                latency_ms: 0.0,
                sections: Some(sections),
                least_beams: None,
            }
            .cut();
            assert_eq!(cut.sections.len(), 2 * usize::from(sections));
            for side in [Side::Left, Side::Right] {
                let (now, before) = (flow(&cut, side), flow(&boom, side));
                assert!(
                    (now / before - 1.0).abs() < 1e-12,
                    "{sections} {side:?}: {now} l/s, {before} before"
                );
            }
        }
    }
}
