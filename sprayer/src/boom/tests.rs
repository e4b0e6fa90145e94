use super::*;

const TEXT: &str = "version = 1\noffset_y_m = 1.5\npressure_bar = 2.5\n[valve]\nkind = \"pwm\"\nhz = 10\n\
    [[section]]\nid = \"low\"\nside = \"left\"\nz_from_m = 0.5\nz_to_m = 1.5\nnozzles = 2\n\
    [[section]]\nid = \"high\"\nside = \"right\"\nnumber = 9\nz_from_m = 1.5\nz_to_m = 2\nvalve = { on_ms = 1 }\n\
    [[section.nozzle]]\nz_from_m = 1.4\nz_to_m = 2.1\nbehind_m = 0.25\nflow_l_min = 3\n";

#[test]
fn nozzles_share_their_sections_height_and_may_be_staggered() {
    let boom = Boom::read(TEXT).expect("a boom");
    let nozzles = boom.nozzles();
    let heights: Vec<(f64, f64)> =
        nozzles.iter().map(|nozzle| (nozzle.height.from, nozzle.height.to)).collect();
    assert_eq!(heights, [(0.5, 1.0), (1.0, 1.5), (1.4, 2.1)]);
    assert_eq!(nozzles.iter().map(|nozzle| nozzle.ahead_m).collect::<Vec<_>>(), [-1.5, -1.5, -1.75]);
    // Flow by the root of pressure: a quarter of 10 bar is half the flow.
    assert!((nozzles[2].flow_l_s - 0.5 * 3.0 / 60.0).abs() < 1e-12);
    assert_eq!((boom.section(1), boom.section(9), boom.section(2)), (Some(0), Some(1), None));
}

#[test]
fn a_tank_has_one_limit_whichever_key_says_it() {
    let own = |l: f64| Boom::read(&format!("tank_l = {l}\n{TEXT}"));
    let of_sensors =
        |l: f64| Boom::read(&TEXT.replace("[valve]", &format!("[sensors]\ntank_l = {l}\n[valve]")));
    let beside = |l: f64| Boom::read(TEXT).expect("a boom").with_tank("sprayer.tank_l", l);
    for (l, is_sound) in [(0.01, true), (7000.0, true), (100_000.0, true), (0.009, false), (100_001.0, false)]
    {
        for found in [own(l), of_sensors(l), beside(l)] {
            let why = found.as_ref().map_or_else(ToString::to_string, |_| String::new());
            assert!(is_sound || why.contains("tank_l`: expected 0.01 to 100000 l, found"), "{l}: {why}");
            assert_eq!(found.ok().and_then(|boom| boom.tank_l), is_sound.then_some(l));
        }
    }
}

#[test]
fn what_cannot_be_is_refused_with_its_key() {
    let said = |from: &str, to: &str| Boom::read(&TEXT.replace(from, to)).expect_err(to).to_string();
    assert!(
        said("offset_y_m", "offset_m").contains("line 2: unknown key `offset_m`; did you mean `offset_y_m`?")
    );
    assert!(said("number = 9", "number = 1").contains("two sections have the number 1"));
    assert!(said("id = \"high\"", "id = \"low\"").contains("the id `low`"));
    assert!(
        said("z_to_m = 1.5", "z_to_m = 0.5").contains("`z_to_m of section low`: expected a number above")
    );
    assert!(said("hz = 10", "hz = 0").contains("`hz`: expected 0.1 to 1000, found 0"));
    assert!(said("version = 1", "version = 2").contains("`version`: expected 1, found 2"));
}
