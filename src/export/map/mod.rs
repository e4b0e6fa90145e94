//! Leaf area by metre of a row as a map, for geographic information systems.
//!
//! | file | format | coordinates |
//! |---|---|---|
//! | `.geojson` | GeoJSON (RFC 7946), a polygon a metre | longitude, latitude (WGS 84) |
//! | `.gpkg` | GeoPackage 1.3, a polygon a metre | EPSG:4326 |
//! | `.parquet` | GeoParquet 1.1, a polygon a metre | longitude, latitude (OGC:CRS84) |
//! | `.tif`, `.tiff` | GeoTIFF, LAI as 32-bit floats, NaN where it is not known | the UTM zone of the row (WGS 84) |
//!
//! What is withheld is null in all of them.

mod along;
mod geojson;
#[cfg(feature = "maps")]
mod geopackage;
#[cfg(feature = "tables")]
mod geoparquet;
#[cfg(feature = "maps")]
mod geotiff;
mod registered;
#[cfg(any(feature = "maps", feature = "tables"))]
mod wkb;

use std::path::Path;

pub use along::{AxisPoint, Lever, RowOnEarth, Stated, Station};
pub use registered::Registered;

use rowscan_canopy::Estimate;

use super::ExportError;
use crate::feature::{Feature, MissingFeature};

/// Width of a metre's rectangle where nothing tells how far apart the rows are, metres.
const NARROW_M: f64 = 1.0;

/// Rectangles on Earth, each with what was measured there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeafMap {
    /// A metre of a row each.
    pub metres: Vec<MapMetre>,
    /// Metres of which nothing tells where they lie.
    pub without_place: usize,
}

/// A metre of a row.
#[derive(Clone, Debug, PartialEq)]
pub struct MapMetre {
    /// Longitude and latitude of its corners, counter-clockwise from above, degrees.
    pub corners: [[f64; 2]; 4],
    /// The source's place on the command line, from 0.
    pub source: usize,
    /// Its numbers, in the order of [`ATTRIBUTES`].
    pub values: [Option<f64>; ATTRIBUTES.len()],
}

/// What a metre's numbers are.
pub const ATTRIBUTES: [&str; 10] = [
    "y_m",
    "scanned_m",
    "leaf_area_m2",
    "leaf_area_low_m2",
    "leaf_area_high_m2",
    "leaf_area_sampling_low_m2",
    "leaf_area_sampling_high_m2",
    "lai",
    "impacted_total_area_m2",
    "gnss_quality",
];

/// The place of the leaf area index among [`ATTRIBUTES`].
#[cfg(feature = "maps")]
const LAI: usize = 7;
/// That of the metres that were scanned.
#[cfg(feature = "maps")]
const SCANNED: usize = 1;

impl LeafMap {
    /// Adds an estimate's metres: those of source number `source`, of a row that lies so. A rectangle is as wide as the rows are apart.
    pub fn add(&mut self, source: usize, estimate: &Estimate, row: &RowOnEarth, spacing_m: Option<f64>) {
        let half_m = spacing_m.unwrap_or(NARROW_M) / 2.0;
        for metre in &estimate.slices {
            let (Some(from), Some(to)) = (row.at(metre.y_m - 0.5), row.at(metre.y_m + 0.5)) else {
                self.without_place += 1;
                continue;
            };
            let worst =
                from.quality.into_iter().chain(to.quality).max_by_key(|quality| along::rank(*quality));
            let (interval, sampling) = (metre.leaf.interval_m2, metre.leaf.sampling_error_m2);
            self.metres.push(MapMetre {
                corners: [from.right(half_m), to.right(half_m), to.right(-half_m), from.right(-half_m)],
                source,
                values: [
                    Some(metre.y_m),
                    Some(metre.scanned_m),
                    metre.leaf.areas.best_m2().ok(),
                    interval.map(|[low_m2, _]| low_m2),
                    interval.map(|[_, high_m2]| high_m2),
                    sampling.map(|[low_m2, _]| low_m2),
                    sampling.map(|[_, high_m2]| high_m2),
                    metre.leaf.areas.lai().ok(),
                    Some(metre.impacted_total_area_m2),
                    worst.map(f64::from),
                ],
            });
        }
    }

    /// West, south, east and north of all of it, degrees; `None` of an empty map.
    pub fn bounds(&self) -> Option<[f64; 4]> {
        let corners = self.metres.iter().flat_map(|metre| metre.corners);
        corners.fold(None, |bounds: Option<[f64; 4]>, [lon, lat]| {
            let [west, south, east, north] = bounds.unwrap_or([lon, lat, lon, lat]);
            Some([west.min(lon), south.min(lat), east.max(lon), north.max(lat)])
        })
    }
}

/// How a map is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapFormat {
    /// GeoJSON.
    GeoJson,
    /// GeoPackage.
    GeoPackage,
    /// GeoParquet.
    GeoParquet,
    /// GeoTIFF.
    GeoTiff,
}

/// A map across the date line, where longitudes jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the map meets the meridian of 180 degrees, where a rectangle would go round the Earth: such rows cannot be mapped"
)]
pub struct DateLine;

/// A file name that is no map's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is no map's name: expected one that ends in .gpkg, .tif, .geojson or .parquet")]
pub struct NoMapName {
    name: String,
}

impl MapFormat {
    /// By a file's ending.
    ///
    /// # Errors
    /// It is that of no map.
    pub fn of(path: &Path) -> Result<Self, NoMapName> {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        match ending.to_ascii_lowercase().as_str() {
            "geojson" | "json" => Ok(Self::GeoJson),
            "gpkg" => Ok(Self::GeoPackage),
            "parquet" | "geoparquet" => Ok(Self::GeoParquet),
            "tif" | "tiff" => Ok(Self::GeoTiff),
            _ => Err(NoMapName { name: path.display().to_string() }),
        }
    }

    /// Refuses a format that this build cannot write.
    ///
    /// # Errors
    /// GeoPackage and GeoTIFF without the feature `maps`, GeoParquet without `tables`.
    pub fn check(self) -> Result<(), MissingFeature> {
        match self {
            Self::GeoJson => Ok(()),
            Self::GeoPackage => Feature::Maps.needed_by("a map as GeoPackage"),
            Self::GeoTiff => Feature::Maps.needed_by("a map as GeoTIFF"),
            Self::GeoParquet => Feature::Tables.needed_by("a map as GeoParquet"),
        }
    }

    /// The map as a file of this format.
    ///
    /// # Errors
    /// This build does not have it, or the map does not go into it.
    pub fn write(self, map: &LeafMap) -> Result<Vec<u8>, ExportError> {
        self.check()?;
        if map.bounds().is_some_and(|[west, _, east, _]| east - west > 180.0) {
            return Err(DateLine.into());
        }
        match self {
            Self::GeoJson => geojson::write(map),
            #[cfg(feature = "maps")]
            Self::GeoPackage => geopackage::write(map),
            #[cfg(feature = "maps")]
            Self::GeoTiff => geotiff::write(map),
            #[cfg(feature = "tables")]
            Self::GeoParquet => geoparquet::write(map),
            #[cfg(not(feature = "maps"))]
            Self::GeoPackage | Self::GeoTiff => Err(Feature::Maps.missing("a map so").into()),
            #[cfg(not(feature = "tables"))]
            Self::GeoParquet => Err(Feature::Tables.missing("a map so").into()),
        }
    }
}

#[cfg(test)]
mod tests;
