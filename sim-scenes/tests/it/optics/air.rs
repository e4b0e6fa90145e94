//! Air and window on whole beams: what answers, what is dimmed, what stays when nothing is set.

use rowscan_scenes::optics::{Air, EyeEcho, OpticsSettings, Plume, Sun, WindowSector};

use super::bench::{Bench, fan, optics, plate, settings};

fn echoes(model: &str, stages: &str, air: Air, plate_m: f64, lines: u64) -> Vec<Vec<EyeEcho>> {
    let settings = OpticsSettings { air, ..settings(stages) };
    let mut bench = Bench::new(&optics(model), 2, &settings, vec![plate(plate_m)], &fan(0.5, 41));
    (0..lines).flat_map(|scan| bench.look(scan)).collect()
}

#[test]
fn clear_air_changes_nothing() {
    let clear = echoes("lms111", "spot,echoes,energy,air", Air::default(), 4.0, 3);
    assert_eq!(clear, echoes("lms111", "spot,echoes,energy", Air::default(), 4.0, 3));
}

#[test]
fn heavy_rain_answers_before_a_wall_as_often_as_drops_are_large_enough() {
    // OPTICS.md 4: 0.121 drops a beam of an LMS1xx at 50 mm/h, from 0.1 to 4 m. Nearer than 3 m they are echoes of their own.
    let air = Air { rain_mm_h: 50.0, ..Air::default() };
    let beams = echoes("lms111", "spot,echoes,energy,air", air, 4.0, 100);
    let drops = beams.iter().filter(|echoes| (0.05..2.9).contains(&echoes[0].range_m)).count();
    let share = drops as f64 / beams.len() as f64;
    let expected = 1.0 - (-0.12_f64).exp();
    // Four standard errors of 4100 beams, and the threshold's softness.
    assert!((share - expected).abs() < 0.03, "{share}, {expected}");
    let behind = beams.iter().filter(|echoes| echoes.iter().any(|echo| (echo.range_m - 4.0).abs() < 0.1));
    assert!(behind.count() as f64 > 0.98 * beams.len() as f64);
}

#[test]
fn fog_is_the_first_echo_where_it_is_thick_and_dims_the_wall() {
    let near = |visibility_m| {
        let air = Air { visibility_m: Some(visibility_m), ..Air::default() };
        let beams = echoes("lms111", "spot,echoes,energy,air", air, 8.0, 5);
        beams.iter().filter(|echoes| (0.9..1.6).contains(&echoes[0].range_m)).count() as f64
            / beams.len() as f64
    };
    assert!(near(50.0) > 0.99 && near(5000.0) < 0.01);
    let wall = |air| echoes("lms511", "energy,air", air, 30.0, 1)[20][0].remission;
    let foggy = Air { visibility_m: Some(2000.0), ..Air::default() };
    assert!(wall(foggy) < wall(Air::default()));
}

#[test]
fn a_fine_plume_blinds_an_lms111_near_by_and_a_coarse_one_less() {
    let seen = |plume: Plume| {
        let air = Air { plumes: vec![plume], ..Air::default() };
        let beams = echoes("lms111", "spot,echoes,energy,air", air, 6.0, 5);
        beams.iter().filter(|echoes| echoes[0].range_m < 4.0).count()
    };
    let fine = Plume { z_m: 0.0, ..Plume::default() };
    let coarse = Plume { drop_um: 2000.0, speed_m_s: 20.0, flow_l_min: 0.05, ..fine.clone() };
    assert!(seen(fine.clone()) > 180, "of 205");
    assert!(seen(coarse) < seen(fine.clone()) / 2);
    assert_eq!(seen(Plume { flow_l_min: 0.0, ..fine }), 0);
}

#[test]
fn dirt_dims_its_sector_only() {
    let air = Air {
        windows: vec![WindowSector { from_deg: 0.1, to_deg: 90.0, transmission: 0.5 }],
        ..Air::default()
    };
    let beams = echoes("lms111", "energy,air", air, 4.0, 1);
    let digits = |beam: usize| i32::from(beams[beam][0].remission >> 8);
    // 60 digits a decade, a quarter of the power.
    assert!((digits(10) - digits(30) - 36).abs() <= 1, "{} {}", digits(10), digits(30));
}

#[test]
fn a_low_sun_dazzles_half_the_shots_that_look_into_it_and_hides_what_is_weak() {
    let told = |azimuth_deg: f64, plate_m: f64| {
        let sun = Some(Sun { elevation_deg: 5.0, azimuth_deg });
        echoes("lms111", "energy,air", Air { sun, ..Air::default() }, plate_m, 200)
    };
    // Beams of half a degree about the axis, 41 a line; the sun 5° above it, seen 3° and half the spot's growth around.
    let into = |number: usize| ((number % 41) as f64 * 0.5 - 10.0 - 5.0).abs() < 3.0 + 0.4297;
    let dazzled = |echo: &EyeEcho| (echo.range_mm, echo.remission) == (0, u16::MAX);
    let near = told(90.0, 4.0);
    let (mut blinded, mut looks) = (0, 0);
    for (number, echoes) in near.iter().enumerate() {
        assert!(into(number) || !dazzled(&echoes[0]), "beam {}", number % 41);
        assert!(dazzled(&echoes[0]) || (echoes[0].range_m - 4.0).abs() < 0.2, "{:?}", echoes[0]);
        looks += usize::from(into(number));
        blinded += usize::from(dazzled(&echoes[0]));
    }
    // Four standard errors of 2600 shots.
    assert_eq!(looks, 13 * 200);
    assert!((blinded as f64 / looks as f64 - 0.5).abs() < 0.04, "{blinded} of {looks}");
    // A leaf at 15 m is seen by an LMS111, but not with a tenth of its sensitivity.
    let far = told(90.0, 15.0);
    let sees = |echoes: &Vec<EyeEcho>| echoes[0].range_m.is_finite();
    assert!(far.iter().enumerate().all(|(number, echoes)| sees(echoes) != into(number)));
    // Nothing is dazzled by a sun ahead of the tractor, or behind its back.
    for azimuth_deg in [0.0, 180.0, -90.0] {
        assert!(told(azimuth_deg, 15.0).iter().all(|echoes| sees(echoes) && !dazzled(&echoes[0])));
    }
}
