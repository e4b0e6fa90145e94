//! The returns of scans as points: in the scene where the rig is known, else in the scanner's own plane.

use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::DeviceClock;

use super::Columns;

/// Where a scanner sits, and how far it has come.
#[derive(Clone, Debug)]
pub struct Placing {
    rig: Option<(Rig, Mount)>,
    clock: DeviceClock,
}

impl Placing {
    /// Scanner number `index` of a rig, in the scene's frame. Without a rig: x along device angle 0°, y along 90°, z = 0.
    pub fn new(rig: Option<Rig>, index: usize) -> Self {
        let mounted = rig.and_then(|rig| rig.scanners.get(index).cloned().map(|mount| (rig, mount)));
        Self { rig: mounted, clock: DeviceClock::default() }
    }

    /// A point, by time since the first scan, device angle and range.
    fn place(&self, time_s: f64, alpha_deg: f64, range_m: f64) -> [f64; 3] {
        let Some((rig, mount)) = &self.rig else {
            let (sin, cos) = alpha_deg.to_radians().sin_cos();
            return [range_m * cos, range_m * sin, 0.0];
        };
        let pose = mount.pose(rig.y_m(time_s));
        let (sin, cos) = mount.theta_deg(alpha_deg).to_radians().sin_cos();
        [pose.x_m + range_m * cos, pose.y_m, pose.z_m + range_m * sin]
    }
}

/// Every return of every scan: place, range, remission, and which beam of which scan it was. `time_s` counts on the device's clock.
pub fn points(scans: &[Scan], mut placing: Placing) -> Columns {
    let (mut x, mut y, mut z) = (Vec::new(), Vec::new(), Vec::new());
    let (mut range, mut remission, mut time) = (Vec::new(), Vec::new(), Vec::new());
    let (mut line, mut beams, mut echoes) = (Vec::new(), Vec::new(), Vec::new());
    for (number, scan) in scans.iter().enumerate() {
        let time_s = placing.clock.seconds(scan.scan_time_us);
        for (order, echo) in scan.echoes.iter().enumerate() {
            for (beam, &range_m) in echo.range_m.iter().enumerate().filter(|(_, range_m)| range_m.is_finite())
            {
                let [px, py, pz] = placing.place(time_s, scan.beams.angle_deg(beam), range_m);
                x.push(px);
                y.push(py);
                z.push(pz);
                range.push(range_m);
                remission.push(f64::from(echo.remission.get(beam).copied().unwrap_or_default()));
                time.push(time_s);
                line.push(number as u32);
                beams.push(beam as u32);
                echoes.push(order as u32);
            }
        }
    }
    Columns::default()
        .f64("x_m", x)
        .f64("y_m", y)
        .f64("z_m", z)
        .f64("range_m", range)
        .f64("remission", remission)
        .f64("time_s", time)
        .u32("scan", line)
        .u32("beam", beams)
        .u32("echo", echoes)
}
