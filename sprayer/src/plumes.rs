//! What scanners see of a boom's spray: each nozzle is a plume of drops before those on its side.

use rowscan_protocol::rig::Mount;
use rowscan_scenes::optics::Plume;

use crate::boom::{Boom, Nozzle, Side};

/// What the boom's nozzles spray before a scanner on this mount: a plume a nozzle of its side, which gives what the nozzle's valve lets through. None
/// where the boom says nothing of drops.
pub fn plumes(boom: &Boom, mount: &Mount) -> Vec<Plume> {
    let Some(drops) = boom.drops else { return Vec::new() };
    let side = Side::from(mount.row);
    let plume = |nozzle: &Nozzle| {
        let jet = nozzle.jet;
        let (narrowest_deg, widest_deg) = Plume::HALF_ANGLES_DEG;
        Plume {
            x_m: mount.distance_m - jet.distance_m,
            y_m: nozzle.ahead_m - mount.offset_y_m,
            z_m: jet.z_m - mount.height_m,
            pitch_deg: jet.pitch_deg,
            flow_l_min: nozzle.flow_l_s * 60.0,
            drop_um: drops.drop_um,
            speed_m_s: drops.speed_m_s,
            half_angle_deg: (jet.fan_deg / 2.0).clamp(narrowest_deg, widest_deg),
            nozzle: Some(nozzle.number),
            ..Plume::default()
        }
    };
    boom.nozzles().iter().filter(|nozzle| nozzle.side == side).map(plume).collect()
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::rig::RowSide;

    use super::*;

    const TEXT: &str = "version = 1\noffset_y_m = 0.3\ndistance_m = 1.4\nfan_deg = 60\n[drops]\ndrop_um = 200\n\
        [[section]]\nid = \"l\"\nside = \"left\"\nz_from_m = 0.5\nz_to_m = 1.5\nnozzles = 2\n\
        [[section]]\nid = \"r\"\nside = \"right\"\nz_from_m = 1\nz_to_m = 2\n\
        [[section.nozzle]]\nz_from_m = 1\nz_to_m = 2\nout_m = 0.2\nbehind_m = 0.1\npitch_deg = 10\nflow_l_min = 2\n";

    #[test]
    fn a_nozzle_is_a_plume_at_its_own_place_before_the_scanners_of_its_side() {
        let boom = Boom::read(TEXT).expect("a boom");
        let mount = Mount { offset_y_m: 0.05, ..Mount::default() };
        let own = plumes(&boom, &mount);
        let [plume] = own.as_slice() else { panic!("{own:?}") };
        // The mirror: 1.9 m before the axis, 1.6 m high. The nozzle: 1.2 m before the axis, 1.5 m high, 0.4 m behind the scanners.
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-12;
        assert!(near(plume.x_m, 0.7) && near(plume.z_m, -0.1) && near(plume.y_m, -0.45), "{plume:?}");
        assert!(near(plume.flow_l_min, 2.0) && near(plume.half_angle_deg, 30.0), "{plume:?}");
        assert_eq!((plume.pitch_deg, plume.drop_um, plume.speed_m_s), (10.0, 200.0, 12.0));
        assert_eq!(plume.nozzle, Some(2), "the third of the boom");
        let left = plumes(&boom, &Mount { row: RowSide::Left, ..mount.clone() });
        assert_eq!(left.iter().map(|plume| plume.nozzle).collect::<Vec<_>>(), [Some(0), Some(1)]);
        let dry = Boom { drops: None, ..boom };
        assert!(plumes(&dry, &mount).is_empty());
    }
}
