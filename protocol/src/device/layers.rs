//! A unit's layers: where the lines of a turn point.

use alloc::vec::Vec;

use super::seen::LayersSent;
use super::state::{Device, Mirror};
use crate::angle::BeamGrid;
use crate::compact::TO_COLA;
use crate::model::Layer;
use crate::random::Stream;

/// Key of the random streams.
const PURPOSE: u64 = 0x1A7E;
/// 1/10000° a 1/100°.
const PER_CENTIDEG: i32 = 100;
/// Half a turn, 1/100°.
const HALF_TURN: i32 = 18_000;

/// A layer of this unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct UnitLayer {
    /// Its place in the model's table.
    pub(super) number: usize,
    pub(super) layer: Layer,
    /// The unit's own elevation, 1/100°, as Compact's phi counts it.
    pub(super) elevation_centideg: i16,
}

impl UnitLayer {
    /// The layer as scans name it: [`Scan::layer_centideg`](crate::scan::Scan::layer_centideg).
    pub(super) fn code(&self) -> i16 {
        -self.elevation_centideg
    }

    /// Its beams of a whole turn.
    fn beams(&self) -> BeamGrid {
        let Layer { azimuth_centideg, step, .. } = self.layer;
        let azimuth = i32::from(azimuth_centideg);
        // Angles of Compact end at 180°.
        let from = if azimuth >= 2 * HALF_TURN { azimuth - 2 * HALF_TURN } else { azimuth } - HALF_TURN;
        let start = from * PER_CENTIDEG + TO_COLA;
        let turn = 2 * HALF_TURN * PER_CENTIDEG;
        BeamGrid::spanning(start, start + turn - i32::from(step), step)
    }
}

impl Device {
    /// This unit's layers: the one nearest to the level first, the others in the order of the model's table. None where a turn is one line.
    pub(super) fn unit_layers(&self) -> Vec<UnitLayer> {
        let Some(compact) = self.model.compact else { return Vec::new() };
        let off_centideg = 100.0 * compact.elevation_off_deg.value;
        let of_unit = |(number, layer): (usize, &Layer)| {
            let part = 2.0 * Stream::keyed(self.identity.unit, &[PURPOSE, number as u64]).unit() - 1.0;
            let off = libm::round(off_centideg * part) as i16;
            UnitLayer { number, layer: *layer, elevation_centideg: layer.elevation_centideg + off }
        };
        let mut layers: Vec<_> = compact.layers.iter().enumerate().map(of_unit).collect();
        let level = layers
            .iter()
            .position(|found| found.layer.elevation_centideg.unsigned_abs() == least(compact.layers));
        if let Some(level) = level {
            let found = layers.remove(level);
            layers.insert(0, found);
        }
        layers
    }

    /// Whether a turn has lines of several layers.
    pub fn has_layers(&self) -> bool {
        self.model.compact.is_some_and(|compact| !compact.layers.is_empty())
    }

    /// The layers that have a line in each turn as somebody sees it: the level one, and those that are sent.
    pub(super) fn layers_seen(&self) -> Vec<UnitLayer> {
        let sent = LayersSent::new(&self.settings.variables);
        let mut layers = self.unit_layers();
        let mut place = 0;
        layers.retain(|found| {
            place += 1;
            place == 1 || sent.sends(found.number)
        });
        layers
    }

    /// What the mirror does for each line of its next turn: the line of [`mirror`](Self::mirror) first. Layers that are not sent have none but that.
    pub fn mirrors(&self) -> Vec<Mirror> {
        let mirror = self.mirror();
        let of_layer =
            |found: &UnitLayer| Mirror { beams: found.beams(), layer_centideg: found.code(), ..mirror };
        let layers = self.layers_seen();
        if layers.is_empty() { alloc::vec![mirror] } else { layers.iter().map(of_layer).collect() }
    }

    /// The layer that the turn with this number since power-up is of, or that stands for the layers of each turn.
    pub(super) fn layer_of_turn(&self, turn: u64) -> i16 {
        self.unit_layers().first().map_or_else(|| self.model.layer(turn), UnitLayer::code)
    }
}

/// How near to the level a layer comes by design, 1/100°.
fn least(layers: &[Layer]) -> u16 {
    layers.iter().map(|layer| layer.elevation_centideg.unsigned_abs()).min().unwrap_or_default()
}
