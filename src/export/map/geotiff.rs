//! GeoTIFF 1.1 (OGC 19-008r4): the leaf area index, north up, in the UTM zone of the map's middle.

use std::io::Cursor;

use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray32Float;
use tiff::tags::Tag;

use super::{LAI, LeafMap, SCANNED};
use crate::export::ExportError;

/// Side of a pixel, metres.
const PIXEL_M: f64 = 0.5;
/// A larger picture is refused.
const MOST_PIXELS: f64 = 1e8;

/// A map too wide for a picture.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a GeoTIFF of {wide_m:.0} m by {high_m:.0} m would have more than 1e8 pixels of {PIXEL_M} m: write the rows one by one, or a GeoPackage (.gpkg)"
)]
pub(super) struct TooWide {
    wide_m: f64,
    high_m: f64,
}

/// A map without a metre whose place is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a GeoTIFF needs at least one metre whose place is known, and the map has none")]
pub(super) struct Empty;

/// A metre in the plane of the zone.
struct Flat {
    corners: [[f64; 2]; 4],
    lai: Option<f64>,
    scanned_m: f64,
}

pub(super) fn write(map: &LeafMap) -> Result<Vec<u8>, ExportError> {
    let [west, south, east, north] = map.bounds().ok_or(Empty)?;
    let (longitude, latitude) = ((west + east) / 2.0, (south + north) / 2.0);
    let zone = utm::lat_lon_to_zone_number(latitude, longitude);
    let flat: Vec<Flat> = map
        .metres
        .iter()
        .map(|metre| Flat {
            corners: metre.corners.map(|[lon, lat]| {
                let (northing, easting, _) = utm::to_utm_wgs84(lat, lon, zone);
                [easting, northing]
            }),
            lai: metre.values.get(LAI).copied().flatten(),
            scanned_m: metre.values.get(SCANNED).copied().flatten().unwrap_or(0.0),
        })
        .collect();
    let all = || flat.iter().flat_map(|metre| metre.corners);
    let low = |axis: usize| all().map(|corner| corner[axis]).fold(f64::INFINITY, f64::min);
    let high = |axis: usize| all().map(|corner| corner[axis]).fold(f64::NEG_INFINITY, f64::max);
    // Whole pixels of the zone's own grid, so that maps of neighbouring rows lie on one another.
    let left = (low(0) / PIXEL_M).floor() * PIXEL_M;
    let top = (high(1) / PIXEL_M).ceil() * PIXEL_M;
    let (wide, tall) = (((high(0) - left) / PIXEL_M).ceil(), ((top - low(1)) / PIXEL_M).ceil());
    if wide * tall > MOST_PIXELS {
        return Err(TooWide { wide_m: wide * PIXEL_M, high_m: tall * PIXEL_M }.into());
    }
    let (wide, tall) = (wide.max(1.0) as usize, tall.max(1.0) as usize);
    let pixels = drawn(&flat, (left, top), (wide, tall));
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file)?;
    let mut image = encoder.new_image::<Gray32Float>(u32::try_from(wide)?, u32::try_from(tall)?)?;
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[PIXEL_M, PIXEL_M, 0.0][..])?;
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, left, top, 0.0][..])?;
    tags.write_tag(Tag::GeoKeyDirectoryTag, &geo_keys(zone, latitude)[..])?;
    tags.write_tag(Tag::GdalNodata, "nan")?;
    image.write_data(&pixels)?;
    Ok(file.into_inner())
}

/// The mean index of the metres that cover each pixel's centre, each by how much of it was scanned; NaN where none does, or none is known.
fn drawn(metres: &[Flat], (left, top): (f64, f64), (wide, tall): (usize, usize)) -> Vec<f32> {
    let mut sums = vec![(0.0_f64, 0.0_f64); wide * tall];
    for metre in metres {
        let Some(lai) = metre.lai else { continue };
        let ends = |axis: usize| {
            metre
                .corners
                .iter()
                .map(|corner| corner[axis])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |ends, at| (ends.0.min(at), ends.1.max(at)))
        };
        let ((west, east), (south, north)) = (ends(0), ends(1));
        let columns = pixel(west - left)..=pixel(east - left).min(wide.saturating_sub(1));
        for row in pixel(top - north)..=pixel(top - south).min(tall.saturating_sub(1)) {
            for column in columns.clone() {
                let centre = [left + (column as f64 + 0.5) * PIXEL_M, top - (row as f64 + 0.5) * PIXEL_M];
                if let Some(sum) =
                    sums.get_mut(row * wide + column).filter(|_| covers(&metre.corners, centre))
                {
                    *sum = (sum.0 + lai * metre.scanned_m, sum.1 + metre.scanned_m);
                }
            }
        }
    }
    let mean = |(sum, weight): (f64, f64)| if weight > 0.0 { (sum / weight) as f32 } else { f32::NAN };
    sums.into_iter().map(mean).collect()
}

/// The pixel that lies so far from the first one's edge.
fn pixel(metres: f64) -> usize {
    (metres / PIXEL_M).floor().max(0.0) as usize
}

/// True if a point lies in a rectangle whose corners go counter-clockwise.
fn covers(corners: &[[f64; 2]; 4], [x, y]: [f64; 2]) -> bool {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).all(|([x0, y0], [x1, y1])| (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) >= 0.0)
}

/// The keys of a picture in a UTM zone: version, revision, number of keys, then key, place, count, value.
fn geo_keys(zone: u8, latitude_deg: f64) -> Vec<u16> {
    const PROJECTED: u16 = 1;
    const PIXEL_IS_AREA: u16 = 1;
    const METRES: u16 = 9001;
    // EPSG numbers the zones of WGS 84: 32601 to 32660 north, 32701 to 32760 south.
    let system = if latitude_deg < 0.0 { 32700 } else { 32600 } + u16::from(zone);
    let keys = [(1024, PROJECTED), (1025, PIXEL_IS_AREA), (3072, system), (3076, METRES)];
    let entries = keys.into_iter().flat_map(|(key, value)| [key, 0, 1, value]);
    [1, 1, 1, keys.len() as u16].into_iter().chain(entries).collect()
}
