//! GeoPackage 1.3 (OGC 12-128r17): a table of features in an SQLite file.

use rusqlite::types::Value;
use rusqlite::{Connection, params, params_from_iter};

use super::{ATTRIBUTES, LeafMap, MapMetre, wkb};
use crate::export::ExportError;

/// WGS 84.
const EPSG: i32 = 4326;

/// What every GeoPackage has (tables 3, 5 and 11 of the standard), and the systems of reference that it must know.
const TABLES: &str = r#"
PRAGMA application_id = 0x47504B47;
PRAGMA user_version = 10300;
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
INSERT INTO gpkg_spatial_ref_sys VALUES
  ('Undefined Cartesian', -1, 'NONE', -1, 'undefined', NULL),
  ('Undefined geographic', 0, 'NONE', 0, 'undefined', NULL),
  ('WGS 84', 4326, 'EPSG', 4326, 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]', NULL);
CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE,
  description TEXT DEFAULT '', last_change DATETIME NOT NULL, min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, srs_id INTEGER);
CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL, geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL, PRIMARY KEY (table_name, column_name));
INSERT INTO gpkg_geometry_columns VALUES ('leaf_area', 'geom', 'POLYGON', 4326, 0, 0);
"#;

pub(super) fn write(map: &LeafMap) -> Result<Vec<u8>, ExportError> {
    let mut file = Connection::open_in_memory()?;
    file.execute_batch(TABLES)?;
    let columns: String = ATTRIBUTES.iter().map(|name| format!(", {name} DOUBLE")).collect();
    file.execute_batch(&format!(
        "CREATE TABLE leaf_area (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom POLYGON, source INTEGER{columns});"
    ))?;
    let [west, south, east, north] = map.bounds().unwrap_or([0.0; 4]);
    // The time of the last change would make two files of the same scans differ.
    file.execute(
        "INSERT INTO gpkg_contents VALUES ('leaf_area', 'features', 'leaf_area', 'Leaf area by metre of row', '1970-01-01T00:00:00.000Z', ?, ?, ?, ?, ?)",
        params![west, south, east, north, EPSG],
    )?;
    let places = ", ?".repeat(ATTRIBUTES.len());
    let mut insert = file.prepare(&format!("INSERT INTO leaf_area VALUES (NULL, ?, ?{places})"))?;
    for metre in &map.metres {
        let numbers = metre.values.into_iter().map(|value| value.map_or(Value::Null, Value::Real));
        let row = [Value::Blob(geometry(metre)), Value::Integer(metre.source as i64)];
        insert.execute(params_from_iter(row.into_iter().chain(numbers)))?;
    }
    drop(insert);
    Ok(file.serialize(rusqlite::MAIN_DB)?.to_vec())
}

/// A geometry as the standard's clause 2.1.3 has it: magic, version, flags (little-endian, no envelope), system of reference, well-known binary.
fn geometry(metre: &MapMetre) -> Vec<u8> {
    let mut bytes = b"GP\x00\x01".to_vec();
    bytes.extend_from_slice(&EPSG.to_le_bytes());
    bytes.extend_from_slice(&wkb::polygon(&metre.corners));
    bytes
}
