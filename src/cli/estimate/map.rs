//! Maps of leaf area, for geographic information systems.

use std::path::PathBuf;

use rowscan_driver::Source;
use rowscan_protocol::rig::{Rig, RowSide};
use rowscan_scenes::Scene;

use super::super::Failure;
use super::super::output::{self, name_of, say};
use super::on_earth::{Antenna, SceneAntenna, Way, antenna, numbers, row_by_receiver};
use crate::export::map::{LeafMap, Lever, MapFormat, RowOnEarth, Stated};

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Map")]
pub(super) struct MapArgs {
    /// Write leaf area and LAI by metre as a map: .gpkg, .tif, .geojson or .parquet; repeatable. Metres lie where the GNSS receiver in the recording was
    #[arg(long, value_name = "FILE")]
    map: Vec<PathBuf>,
    /// Where the row's axis begins (Y = 0) and which way it runs, instead of a receiver: degrees north, east, and from north by east
    #[arg(long, value_name = "LAT,LON,AZIMUTH", value_parser = stated, allow_hyphen_values = true, requires = "map")]
    map_from: Option<Stated>,
    /// The GNSS antenna's place beside the scanner, metres ahead of it and to its right, instead of the scene's own [default: above the scanner]
    #[arg(long, value_name = "AHEAD,RIGHT", value_parser = antenna, allow_hyphen_values = true, conflicts_with = "map_from")]
    antenna: Option<Antenna>,
}

fn stated(text: &str) -> Result<Stated, String> {
    let ends = [(-80.0, 80.0), (-180.0, 180.0), (-360.0, 360.0)];
    let wanted = "LATITUDE,LONGITUDE,AZIMUTH in degrees such as 41.6,0.84,15 (latitude -80 to 80)";
    let [latitude_deg, longitude_deg, azimuth_deg] = numbers(text, ends, wanted)?;
    Ok(Stated { latitude_deg, longitude_deg, azimuth_deg })
}

/// The maps of an estimate.
pub(super) struct Maps {
    files: Vec<(PathBuf, MapFormat)>,
    stated: Option<Stated>,
    antenna: Option<Antenna>,
    /// The antenna of the rig's scene.
    of_scene: Option<SceneAntenna>,
}

impl MapArgs {
    /// True if none is asked for.
    pub(super) fn is_empty(&self) -> bool {
        self.map.is_empty()
    }

    /// The antenna's place, where it was said.
    pub(super) fn antenna(&self) -> Option<Antenna> {
        self.antenna
    }

    /// Refuses one stated row for scanners that look at the rows on both sides.
    pub(super) fn check_rows(&self, rigs: &[Rig], scanners: &[usize]) -> Result<(), Failure> {
        let sides =
            rigs.iter().zip(scanners).filter_map(|(rig, scanner)| Some(rig.scanners.get(*scanner)?.row));
        let mut sides: Vec<RowSide> = sides.collect();
        sides.dedup();
        if self.map_from.is_none() || sides.len() < 2 {
            return Ok(());
        }
        let why = "--map-from says where one row lies, and these scanners look at two, on the tractor's right and on its left: map each row by itself, with one source and its --scanner, or take a recording with a receiver";
        Err(Failure::Usage(why.to_owned()))
    }

    /// Refuses, before anything is read, what no map can be made of, and an antenna that nothing asks for.
    pub(super) fn check(
        &self,
        sources: &[Source],
        scene: Option<&Scene>,
        by_receiver: bool,
    ) -> Result<Maps, Failure> {
        if self.antenna.is_some() && self.map.is_empty() && !by_receiver {
            let why = "--antenna says where a receiver's positions are, for --map FILE or --other-start gnss: expected one of them, found none";
            return Err(Failure::Usage(why.to_owned()));
        }
        let mut files = Vec::new();
        for path in &self.map {
            let format = MapFormat::of(path).map_err(|cause| Failure::Usage(format!("--map: {cause}")))?;
            format.check()?;
            output::can_be_written(path)?;
            files.push((path.clone(), format));
        }
        let live = sources.iter().find(|source| source.file().is_none());
        if let Some(live) = live.filter(|_| !files.is_empty() && self.map_from.is_none()) {
            return Err(Failure::Usage(format!(
                "--map takes its places from a receiver in the recording, and {live} is live: `rowscan record` both first, or say where the row lies with --map-from LAT,LON,AZIMUTH"
            )));
        }
        Ok(Maps {
            files,
            stated: self.map_from,
            antenna: self.antenna,
            of_scene: scene.map(SceneAntenna::of),
        })
    }
}

impl Maps {
    /// True if none was asked for.
    pub(super) fn are_none(&self) -> bool {
        self.files.is_empty()
    }

    /// Where the row of the rig's scanner lies that drove this way.
    pub(super) fn row(
        &self,
        source: &Source,
        (rig, scanner): (&Rig, usize),
        way: &Way,
    ) -> Result<RowOnEarth, Failure> {
        if let Some(stated) = self.stated {
            return Ok(RowOnEarth::Stated(stated));
        }
        let Some(path) = source.file() else {
            return Ok(RowOnEarth::told(Vec::new(), Lever::default()));
        };
        let antenna = self.antenna.or_else(|| self.of_scene.map(|antenna| antenna.beside(rig, scanner)));
        let remedy = "say where the row lies with --map-from LAT,LON,AZIMUTH";
        row_by_receiver(path, (rig, scanner), way, antenna, remedy)
    }

    /// Writes every map; none, and false, where no metre has a place or none was estimated.
    pub(super) fn write(&self, map: &LeafMap) -> Result<bool, Failure> {
        if map.metres.is_empty() {
            let why = match map.without_place {
                0 => "no metre of row was estimated; the warnings say why".to_owned(),
                metres => format!("the receiver told no position within 3 m of any of {metres} metres"),
            };
            say(format_args!("no map is written: {why}"));
            return Ok(false);
        }
        for (path, format) in &self.files {
            let failed = |cause| Failure::Write { what: name_of(path), cause: std::io::Error::other(cause) };
            let bytes = format.write(map).map_err(failed)?;
            output::write_file(path, &bytes)?;
            say(format_args!("{}: {} metres of row", name_of(path), map.metres.len()));
        }
        if map.without_place > 0 && !self.are_none() {
            say(format_args!(
                "{} metres are on no map: the receiver told no position within 3 m of them",
                map.without_place
            ));
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_refused_with_what_was_expected() {
        assert_eq!(stated("41.6, 0.84,15").map(|row| row.azimuth_deg), Ok(15.0));
        for wrong in ["", "41.6,0.84", "90,0,0", "a,b,c", "41.6,0.84,15,1", "nan,0,0"] {
            assert!(stated(wrong).is_err_and(|why| why.contains("LATITUDE,LONGITUDE,AZIMUTH")), "{wrong}");
        }
    }
}
