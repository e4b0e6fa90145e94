//! Beams by the height at which they pass the row plane: fired, and let through.

use super::contract::{Setting, SightedLine};

/// Beams of one band.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Band {
    /// Σ line weight over the beams.
    pub(super) fired: f64,
    /// The same over those that the canopy let pass.
    pub(super) through: f64,
    /// Σ line weight · cos θ.
    pub(super) cosine: f64,
    /// Beams, unweighted.
    pub(super) beams: u64,
}

/// Beams by band of equal height, from the ground up.
#[derive(Clone, Debug)]
pub(super) struct Bands {
    bands: Vec<Band>,
    band_m: f64,
    height_m: f64,
    distance_m: f64,
    hits: f64,
    patches: f64,
}

impl Bands {
    pub(super) fn new(setting: &Setting, band_m: f64) -> Self {
        let count = (setting.parameters.top_m / band_m).ceil().max(1.0) as usize;
        Self {
            bands: vec![Band::default(); count],
            band_m,
            height_m: setting.frame.height_m,
            distance_m: setting.frame.distance_m,
            hits: 0.0,
            patches: 0.0,
        }
    }

    pub(super) fn line(&mut self, line: &SightedLine<'_>) {
        for sighting in line.sightings {
            let z_m = self.height_m + self.distance_m * sighting.beam.sin / sighting.beam.cos;
            // A beam into the ground before the row tells nothing of the row.
            if z_m < 0.0 {
                continue;
            }
            let Some(band) = self.bands.get_mut((z_m / self.band_m) as usize) else { continue };
            band.fired += line.weight_m;
            band.cosine += line.weight_m * sighting.beam.cos;
            band.beams += 1;
            match sighting.canopy {
                None => band.through += line.weight_m,
                Some(contact) => {
                    self.hits += 1.0;
                    self.patches += f64::from(u8::from(contact.fresh));
                }
            }
        }
    }

    /// The bands with their edges, from below.
    pub(super) fn iter(&self) -> impl Iterator<Item = ([f64; 2], &Band)> {
        let edge = |k: usize| k as f64 * self.band_m;
        self.bands.iter().enumerate().map(move |(k, band)| ([edge(k), edge(k + 1)], band))
    }

    /// Hits a patch of surface: so many beams are worth one independent look.
    pub(super) fn hits_per_patch(&self) -> f64 {
        (self.hits / self.patches.max(1.0)).max(1.0)
    }

    pub(super) fn clear(&mut self) {
        self.bands.fill(Band::default());
        (self.hits, self.patches) = (0.0, 0.0);
    }
}

/// Wilson's 95 % interval of a share seen on `looks` independent looks (Wilson 1927, J. Am. Stat. Assoc. 22:209).
pub(super) fn wilson(share: f64, looks: f64) -> [f64; 2] {
    let z = crate::regression::Z95;
    let (middle, scale) = (share + z * z / (2.0 * looks), 1.0 + z * z / looks);
    let half = z * (share * (1.0 - share) / looks + z * z / (4.0 * looks * looks)).sqrt();
    [((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_interval_is_the_published_one() {
        // 15 of 20: 0.531 to 0.888; 0 of 10: 0 to 0.278.
        let [low, high] = wilson(0.75, 20.0);
        assert!((low - 0.5313).abs() < 1e-3 && (high - 0.8881).abs() < 1e-3, "{low} {high}");
        let [low, high] = wilson(0.0, 10.0);
        assert!(low < 1e-12 && (high - 0.2775).abs() < 1e-3, "{low} {high}");
    }
}
