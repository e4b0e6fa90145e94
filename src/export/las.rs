//! LAS 1.4, point format 6, tenths of a millimetre. GPS time holds `time_s`, the intensity `remission`.

use std::io::Cursor;

use las::point::Format;
use las::{Builder, Transform, Vector};

use super::{Columns, ExportError};

pub(super) fn encode(columns: &Columns) -> Result<Vec<u8>, ExportError> {
    let need = |name: &str| {
        columns.floats(name).ok_or_else(|| format!("LAS holds points: expected a column `{name}`"))
    };
    let (x, y, z) = (need("x_m")?, need("y_m")?, need("z_m")?);
    let optional = |name: &str, row: usize| columns.floats(name).and_then(|values| values.get(row).copied());
    let mut builder = Builder::from((1, 4));
    builder.point_format = Format::new(6)?;
    builder.generating_software = format!("rowscan {}", env!("CARGO_PKG_VERSION"));
    let tenth = Transform { scale: 1e-4, offset: 0.0 };
    builder.transforms = Vector { x: tenth, y: tenth, z: tenth };
    let mut writer = las::Writer::new(Cursor::new(Vec::new()), builder.into_header()?)?;
    for (row, ((&x, &y), &z)) in x.iter().zip(y).zip(z).enumerate() {
        writer.write_point(las::Point {
            x,
            y,
            z,
            return_number: 1,
            number_of_returns: 1,
            intensity: optional("remission", row).unwrap_or_default() as u16,
            gps_time: Some(optional("time_s", row).unwrap_or_default()),
            ..las::Point::default()
        })?;
    }
    writer.close()?;
    Ok(writer.into_inner()?.into_inner())
}
