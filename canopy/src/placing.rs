//! Where returns came from: in the scene where the rig is known, else in the scanner's own plane.

use crate::odometry::Odometry;
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{Scan, elevation_deg};
use rowscan_protocol::time::DeviceClock;

/// Where a scanner sits, and how far it has come.
#[derive(Clone, Debug)]
pub struct Placing {
    rig: Option<(Rig, Mount)>,
    /// X of the axis of its row, and 1 where it looks towards greater X at it, else −1.
    row: (f64, f64),
    /// Z of the plane from which heights count.
    stands_at_m: f64,
    clock: DeviceClock,
    /// By the encoder in the scans, where the rig knows one and they have it; else by the rig's speed.
    odometry: Odometry,
}

impl Placing {
    /// Scanner number `index` of a rig, in the scene's frame: the tractor drives ahead in alley `alley`, as [`Rig::row_axis_m`] has it. Without a rig: x along device angle 0°, y along 90°, z up from the housing: 0 but for inclined layers.
    pub fn new(rig: Option<Rig>, index: usize, alley: Option<i32>) -> Self {
        let mounted = rig.and_then(|rig| rig.scanners.get(index).cloned().map(|mount| (rig, mount)));
        let row =
            mounted.as_ref().map_or((0.0, 1.0), |(rig, mount)| (rig.row_axis_m(mount, alley), mount.side()));
        let stands_at_m = mounted.as_ref().map_or(0.0, |(rig, _)| rig.stands_at_m(alley));
        Self { rig: mounted, row, stands_at_m, clock: DeviceClock::default(), odometry: Odometry::default() }
    }

    /// Where the first echoes of a scan came from; time counts from the first scan that is asked about.
    pub fn points(&mut self, scan: &Scan) -> Vec<[f64; 3]> {
        let line = self.line(scan);
        let ranges = scan.echoes.first().map_or(&[][..], |echo| &echo.range_m);
        let hits = ranges.iter().enumerate().filter(|(_, range_m)| range_m.is_finite());
        hits.map(|(beam, range_m)| self.place(&line, beam, *range_m)).collect()
    }

    /// How the beams of a scan lie; time counts from the first scan that is asked about.
    pub fn line(&mut self, scan: &Scan) -> PlacedLine {
        let time_s = self.clock.seconds(scan.scan_time_us);
        let layer_deg = self.layer_deg(scan.layer_centideg);
        let line = PlacedLine::new(time_s, scan.scan_frequency_hz, scan.beams, layer_deg);
        self.on_its_way(line, scan.encoders.first().map(|reading| reading.position_ticks))
    }

    /// The next line where the tractor was: by the encoder's count at its first beam, if the rig has an encoder and there is a count, else by the rig's speed.
    pub fn on_its_way(&mut self, line: PlacedLine, ticks: Option<u32>) -> PlacedLine {
        let Some((rig, _)) = &self.rig else { return line };
        let begins = self.odometry.source().is_none();
        let y_m = self.odometry.y_m(rig, ticks, line.time_s, None);
        // One count tells no speed yet.
        let speed_m_s = if begins { rig.speed_m_s } else { self.odometry.speed_m_s() };
        PlacedLine { way: Some((y_m, speed_m_s)), ..line }
    }

    /// Elevation of the layer with this code, degrees, as the rig reads its sign.
    pub fn layer_deg(&self, layer_centideg: i16) -> f64 {
        self.rig
            .as_ref()
            .map_or_else(|| elevation_deg(layer_centideg), |(_, mount)| mount.layer_deg(layer_centideg))
    }

    /// The point that a beam met at this range, from where the scanner was when the mirror turned to it.
    pub fn place(&self, line: &PlacedLine, beam: usize, range_m: f64) -> [f64; 3] {
        let alpha_deg = line.beams.angle_deg(beam);
        let (up, ahead) = line.layer_deg.to_radians().sin_cos();
        let (up_m, range_m) = (range_m * up, range_m * ahead);
        let Some((rig, mount)) = &self.rig else {
            let (sin, cos) = alpha_deg.to_radians().sin_cos();
            return [range_m * cos, range_m * sin, up_m];
        };
        let since_s = line.beam_s * beam as f64;
        let y_m = line.way.map_or_else(|| rig.y_m(line.time_s + since_s), |(y_m, m_s)| y_m + m_s * since_s);
        let pose = mount.pose(y_m);
        let (sin, cos) = mount.theta_deg(alpha_deg).to_radians().sin_cos();
        let met = [range_m * cos, mount.roof_sense() * up_m, range_m * sin];
        let [x, y, z] = mount.attitude().axes().turned(met);
        let (row_m, sense) = self.row;
        [row_m + sense * (pose.x_m + x), pose.y_m + y, self.stands_at_m + pose.z_m + z]
    }

    /// Where the scanner was when the mirror turned to a beam, metres, and the beam's unit direction: origin + range × direction is what
    /// [`place`](Self::place) gives.
    pub fn shot(&self, line: &PlacedLine, beam: usize) -> ([f64; 3], [f64; 3]) {
        let (origin, ahead) = (self.place(line, beam, 0.0), self.place(line, beam, 1.0));
        (origin, std::array::from_fn(|axis| ahead[axis] - origin[axis]))
    }
}

/// The beams of one scan, and when they were measured.
#[derive(Clone, Copy, Debug)]
pub struct PlacedLine {
    /// When the scan began, seconds since the first that was asked about.
    pub time_s: f64,
    /// From beam to beam, seconds.
    beam_s: f64,
    beams: BeamGrid,
    /// Elevation of the layer, degrees.
    pub layer_deg: f64,
    /// Y of the tractor at the first beam, metres, and its speed, m/s; by the rig's speed where that is left out.
    way: Option<(f64, f64)>,
}

impl PlacedLine {
    /// Beams of a mirror that turns so often a second. A rate that nothing tells, 0, leaves all of them where the first one was.
    pub fn new(time_s: f64, scan_frequency_hz: f64, beams: BeamGrid, layer_deg: f64) -> Self {
        let turns = scan_frequency_hz > 0.0;
        let beam_s = if turns { beams.step_deg().abs() / 360.0 / scan_frequency_hz } else { 0.0 };
        Self { time_s, beam_s, beams, layer_deg, way: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::rig::{Orientation, Roof, RowSide};

    /// A scanner a side of an alley between rows 4 m apart, at 2 m/s; the mirror turns ten times a second.
    fn both_sides() -> Rig {
        let mut rig = Rig { row_spacing_m: Some(4.0), speed_m_s: 2.0, ..Rig::default() };
        rig.scanners = vec![Mount::default(), Mount { row: RowSide::Left, ..Mount::default() }];
        rig
    }

    fn met(rig: &Rig, index: usize, alley: Option<i32>) -> [f64; 3] {
        let placing = Placing::new(Some(rig.clone()), index, alley);
        let line = PlacedLine::new(3.0, 10.0, BeamGrid::spanning(-450_000, 2_250_000, 5000), 0.0);
        // The beam that looks level at the row: 135° after the first one.
        placing.place(&line, 270, 1.5)
    }

    /// A tractor that stops: its rig's speed would have it go on.
    #[test]
    fn scans_with_an_encoder_stand_where_it_says() {
        use rowscan_protocol::scan::{Echo, EncoderReading};

        let rig = Rig { encoder_ticks_per_m: Some(1000.0), ..both_sides() };
        let along = |rig: &Rig| -> Vec<f64> {
            let mut placing = Placing::new(Some(rig.clone()), 0, None);
            let y_m = |(turn, ticks): (u32, u32)| {
                let scan = Scan {
                    beams: BeamGrid::spanning(-450_000, 2_250_000, 5000),
                    scan_frequency_hz: 10.0,
                    scan_time_us: turn * 100_000,
                    encoders: vec![EncoderReading { position_ticks: ticks, speed: 0 }],
                    echoes: vec![Echo { range_m: vec![1.5; 541], ..Echo::default() }],
                    ..Scan::default()
                };
                placing.points(&scan)[0][1]
            };
            (0..).zip([5000, 5200, 5300, 5300, 5300]).map(y_m).collect()
        };
        let near = |found: &[f64], expected: &[f64]| {
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9)
        };
        assert!(near(&along(&rig), &[0.0, 0.2, 0.3, 0.3, 0.3]), "{:?}", along(&rig));
        let without = Rig { encoder_ticks_per_m: None, ..rig };
        assert!(near(&along(&without), &[0.0, 0.2, 0.4, 0.6, 0.8]), "{:?}", along(&without));
    }

    #[test]
    fn a_layer_of_positive_elevation_lies_where_the_roof_looks() {
        for (row, roof, sense) in [
            (RowSide::Right, Roof::Forward, 1.0),
            (RowSide::Right, Roof::Backward, -1.0),
            (RowSide::Left, Roof::Forward, 1.0),
            (RowSide::Left, Roof::Backward, -1.0),
        ] {
            for orientation in [Orientation::Side, Orientation::Up] {
                let mount = Mount { row, orientation, roof: Some(roof), ..Mount::default() };
                let placing = Placing::new(Some(Rig { scanners: vec![mount], ..Rig::default() }), 0, Some(0));
                let line = PlacedLine::new(0.0, 0.0, BeamGrid::spanning(0, 1_800_000, 5000), 2.5);
                let [_, y_m, _] = placing.place(&line, 180, 2.0);
                assert!(
                    (y_m - sense * 2.0 * 2.5f64.to_radians().sin()).abs() < 1e-12,
                    "{roof:?} {row:?}: {y_m}"
                );
            }
        }
    }

    #[test]
    fn a_shot_leads_to_its_points_however_the_scanner_is_mounted() {
        for (row, orientation, yaw_deg, pitch_deg, layer_deg) in [
            (RowSide::Right, Orientation::Side, 0.0, 0.0, 0.0),
            (RowSide::Right, Orientation::Side, 12.0, -7.0, 2.5),
            (RowSide::Left, Orientation::Side, -30.0, 5.0, -5.0),
            (RowSide::Left, Orientation::Up, 9.0, 3.0, 2.5),
        ] {
            let mount = Mount { row, orientation, yaw_deg, pitch_deg, ..Mount::default() };
            let placing = Placing::new(Some(Rig { scanners: vec![mount], ..both_sides() }), 0, None);
            let line = PlacedLine::new(3.0, 10.0, BeamGrid::spanning(-450_000, 2_250_000, 5000), layer_deg);
            for beam in (0..540).step_by(27) {
                let (origin, direction) = placing.shot(&line, beam);
                let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt();
                assert!((length - 1.0).abs() < 1e-9, "beam {beam}: {length}");
                let point = placing.place(&line, beam, 37.5);
                for axis in 0..3 {
                    assert!(
                        (origin[axis] + 37.5 * direction[axis] - point[axis]).abs() < 1e-6,
                        "beam {beam}"
                    );
                }
            }
        }
    }

    #[test]
    fn each_row_stands_where_the_orchard_has_it_and_each_beam_where_the_tractor_was() {
        let rig = both_sides();
        let beside_m = rig.scanners[0].distance_m - 1.5;
        let y_m = rig.start_m + 2.0 * (3.0 + 0.1 * 135.0 / 360.0);
        let near = |found: [f64; 3], [x_m, z_m]: [f64; 2]| {
            let off = (found[0] - x_m).abs() + (found[1] - y_m).abs() + (found[2] - z_m).abs();
            assert!(off < 1e-9, "{found:?}, expected {x_m}, {y_m}, {z_m}");
        };
        let height_m = rig.scanners[0].height_m;
        // In alley 1, between rows 0 and 1.
        near(met(&rig, 0, None), [4.0 - beside_m, height_m]);
        near(met(&rig, 1, None), [beside_m, height_m]);
        near(met(&rig, 0, Some(3)), [12.0 - beside_m, height_m]);
        let right = Rig { scanners: rig.scanners[..1].to_vec(), ..rig };
        near(met(&right, 0, None), [-beside_m, height_m]);
    }
}
