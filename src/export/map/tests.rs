use rowscan_canopy::Estimate;

use super::*;

/// A row that runs east from 41.6° N, 0.84° E.
fn row() -> RowOnEarth {
    RowOnEarth::Stated(Stated { latitude_deg: 41.6, longitude_deg: 0.84, azimuth_deg: 90.0 })
}

/// Metres with these leaf area indices.
pub(super) fn map(lai: &[Option<f64>]) -> LeafMap {
    let row = row();
    let metres = lai.iter().enumerate().map(|(y, lai)| {
        let y_m = y as f64;
        let (from, to) = (row.at(y_m).expect("known"), row.at(y_m + 1.0).expect("known"));
        let mut values = [Some(1.0); ATTRIBUTES.len()];
        (values[0], values[7]) = (Some(y_m + 0.5), *lai);
        let corners = [from.right(2.0), to.right(2.0), to.right(-2.0), from.right(-2.0)];
        MapMetre { corners, source: 0, values }
    });
    LeafMap { metres: metres.collect(), without_place: 0 }
}

#[test]
fn names_say_how_a_map_is_written() {
    for (name, expected) in [
        ("a.gpkg", MapFormat::GeoPackage),
        ("b.TIF", MapFormat::GeoTiff),
        ("c.tiff", MapFormat::GeoTiff),
        ("d.geojson", MapFormat::GeoJson),
        ("e.parquet", MapFormat::GeoParquet),
    ] {
        assert_eq!(MapFormat::of(Path::new(name)), Ok(expected));
    }
    let refused = MapFormat::of(Path::new("map.shp")).expect_err("refused").to_string();
    assert!(refused.contains("map.shp") && refused.contains(".gpkg"), "{refused}");
}

#[test]
fn a_row_across_the_date_line_is_refused_in_every_format() {
    let row =
        |longitude_deg| RowOnEarth::Stated(Stated { latitude_deg: -17.0, longitude_deg, azimuth_deg: 90.0 });
    let mapped = |row: &RowOnEarth| {
        let (from, to) = (row.at(0.0).expect("known"), row.at(1.0).expect("known"));
        let corners = [from.right(2.0), to.right(2.0), to.right(-2.0), from.right(-2.0)];
        LeafMap {
            metres: vec![MapMetre { corners, source: 0, values: [Some(1.0); ATTRIBUTES.len()] }],
            without_place: 0,
        }
    };
    let (across, beside) = (mapped(&row(179.999_995)), mapped(&row(179.999)));
    for format in [MapFormat::GeoJson, MapFormat::GeoPackage, MapFormat::GeoParquet, MapFormat::GeoTiff] {
        if format.check().is_ok() {
            let refused = format.write(&across).expect_err("refused").to_string();
            assert!(refused.contains("180 degrees"), "{refused}");
            assert!(format.write(&beside).is_ok());
        }
    }
}

#[test]
fn an_estimate_of_nothing_is_a_map_of_nothing() {
    let mut map = LeafMap::default();
    map.add(0, &Estimate::default(), &row(), Some(4.0));
    assert_eq!((map.metres.len(), map.bounds()), (0, None));
}

#[test]
fn geojson_goes_round_counter_clockwise_and_leaves_unknown_null() {
    let text = MapFormat::GeoJson.write(&map(&[Some(1.5), None])).expect("written");
    let json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
    let ring: Vec<[f64; 2]> =
        serde_json::from_value(json["features"][0]["geometry"]["coordinates"][0].clone()).expect("a ring");
    assert_eq!((ring.len(), ring[0]), (5, ring[4]));
    let twice_area: f64 = ring.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum();
    assert!(twice_area > 0.0, "clockwise");
    assert_eq!(json["features"][0]["properties"]["lai"], 1.5);
    assert!(json["features"][1]["properties"]["lai"].is_null());
}

#[cfg(feature = "maps")]
#[test]
fn a_geopackage_says_what_it_is_and_holds_every_metre() {
    let bytes = MapFormat::GeoPackage.write(&map(&[Some(1.5), None])).expect("written");
    assert_eq!(&bytes[68..72], b"GPKG");
    let mut file = rusqlite::Connection::open_in_memory().expect("a base");
    file.deserialize_read_exact(rusqlite::MAIN_DB, &bytes[..], bytes.len(), true).expect("SQLite");
    let rows: Vec<(Vec<u8>, Option<f64>)> = file
        .prepare("SELECT geom, lai FROM leaf_area ORDER BY y_m")
        .and_then(|mut rows| rows.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect())
        .expect("rows");
    assert_eq!(rows.iter().map(|(_, lai)| *lai).collect::<Vec<_>>(), [Some(1.5), None]);
    // Magic, version 0, flags, EPSG 4326; then a polygon of one ring of five points.
    assert_eq!(rows[0].0[..8], [b'G', b'P', 0, 1, 0xE6, 0x10, 0, 0]);
    assert_eq!(rows[0].0[8..21], [1, 3, 0, 0, 0, 1, 0, 0, 0, 5, 0, 0, 0]);
    assert_eq!(rows[0].0.len(), 21 + 5 * 16);
}

#[cfg(feature = "maps")]
#[test]
fn a_geotiff_has_the_index_where_the_metres_lie() {
    use tiff::decoder::{Decoder, DecodingResult};
    use tiff::tags::Tag;

    let bytes = MapFormat::GeoTiff.write(&map(&[Some(1.5), None, Some(0.25)])).expect("written");
    let mut file = Decoder::new(std::io::Cursor::new(bytes)).expect("TIFF");
    let (wide, tall) = file.dimensions().expect("its size");
    let keys = file.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).expect("keys");
    assert!(keys.chunks(4).any(|key| key == [3072, 0, 1, 32631]), "{keys:?}");
    let corner = file.get_tag_f64_vec(Tag::ModelTiepointTag).expect("a corner");
    let DecodingResult::F32(pixels) = file.read_image().expect("pixels") else { panic!("32-bit floats") };
    let at = |[lon, lat]: [f64; 2]| {
        let (northing, easting, _) = utm::to_utm_wgs84(lat, lon, 31);
        let (column, row) = (((easting - corner[3]) * 2.0) as usize, ((corner[4] - northing) * 2.0) as usize);
        pixels[row * wide as usize + column]
    };
    let centre = |y_m: f64| row().at(y_m).expect("known").lon_lat;
    assert_eq!((at(centre(0.5)), at(centre(2.5))), (1.5, 0.25));
    assert!(at(centre(1.5)).is_nan(), "what is not known is no number");
    // 12 m² of four pixels a square metre, of which a metre is unknown.
    let known = pixels.iter().filter(|lai| !lai.is_nan()).count();
    assert!((28..=36).contains(&known), "{known} of {wide} by {tall}");
}

#[cfg(feature = "maps")]
#[test]
fn a_geotiff_of_nothing_or_of_half_the_world_is_refused() {
    let nothing = MapFormat::GeoTiff.write(&LeafMap::default()).expect_err("refused");
    assert!(nothing.to_string().contains("at least one metre"), "{nothing}");
    let mut wide = map(&[Some(1.0), Some(1.0)]);
    wide.metres[1].corners = wide.metres[1].corners.map(|[lon, lat]| [lon + 1.0, lat + 1.0]);
    let refused = MapFormat::GeoTiff.write(&wide).expect_err("refused");
    assert!(refused.to_string().contains("pixels"), "{refused}");
}

#[cfg(feature = "tables")]
#[test]
fn a_geoparquet_names_its_geometry_and_has_null_where_nothing_is_known() {
    use parquet::file::reader::{FileReader, SerializedFileReader};

    let bytes = MapFormat::GeoParquet.write(&map(&[Some(1.5), None])).expect("written");
    let file = SerializedFileReader::new(bytes::Bytes::from(bytes)).expect("Parquet");
    let about = file.metadata().file_metadata().key_value_metadata().expect("keys");
    let geo =
        about.iter().find(|entry| entry.key == "geo").and_then(|entry| entry.value.clone()).expect("geo");
    let geo: serde_json::Value = serde_json::from_str(&geo).expect("JSON");
    assert_eq!(geo["columns"]["geometry"]["encoding"], "WKB");
    let rows: Vec<String> =
        file.get_row_iter(None).expect("rows").map(|row| row.expect("a row").to_string()).collect();
    assert!(rows[0].contains("lai: 1.5") && rows[1].contains("lai: null"), "{rows:?}");
}
