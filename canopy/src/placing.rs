//! Where returns came from: in the scene where the rig is known, else in the scanner's own plane.

use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::DeviceClock;

/// Where a scanner sits, and how far it has come.
#[derive(Clone, Debug)]
pub struct Placing {
    rig: Option<(Rig, Mount)>,
    clock: DeviceClock,
}

impl Placing {
    /// Scanner number `index` of a rig, in the scene's frame. Without a rig: x along device angle 0°, y along 90°, z up from
    /// the housing: 0 but for inclined layers.
    pub fn new(rig: Option<Rig>, index: usize) -> Self {
        let mounted = rig.and_then(|rig| rig.scanners.get(index).cloned().map(|mount| (rig, mount)));
        Self { rig: mounted, clock: DeviceClock::default() }
    }

    /// Where the first echoes of a scan came from; time counts from the first scan that is asked about.
    pub fn points(&mut self, scan: &Scan) -> Vec<[f64; 3]> {
        let time_s = self.time_s(scan);
        let layer_deg = f64::from(scan.layer_centideg) / 100.0;
        let ranges = scan.echoes.first().map_or(&[][..], |echo| &echo.range_m);
        let hits = ranges.iter().enumerate().filter(|(_, range_m)| range_m.is_finite());
        hits.map(|(beam, range_m)| self.place(time_s, scan.beams.angle_deg(beam), layer_deg, *range_m))
            .collect()
    }

    /// When a scan was taken, seconds since the first that was asked about.
    pub fn time_s(&mut self, scan: &Scan) -> f64 {
        self.clock.seconds(scan.scan_time_us)
    }

    /// A point, by time since the first scan, device angle, elevation of the layer and range.
    pub fn place(&self, time_s: f64, alpha_deg: f64, layer_deg: f64, range_m: f64) -> [f64; 3] {
        let (up, ahead) = layer_deg.to_radians().sin_cos();
        let (up_m, range_m) = (range_m * up, range_m * ahead);
        let Some((rig, mount)) = &self.rig else {
            let (sin, cos) = alpha_deg.to_radians().sin_cos();
            return [range_m * cos, range_m * sin, up_m];
        };
        let pose = mount.pose(rig.y_m(time_s));
        let (sin, cos) = mount.theta_deg(alpha_deg).to_radians().sin_cos();
        let met = [range_m * cos, mount.roof_sense() * up_m, range_m * sin];
        let [x, y, z] = mount.attitude().axes().turned(met);
        [pose.x_m + x, pose.y_m + y, pose.z_m + z]
    }
}
