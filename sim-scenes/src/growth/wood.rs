//! How thick growth units are: the pipe model.

use super::markov::State;
use super::parameters::TreeParameters;
use super::skeleton::GrowthUnit;

/// Radius (metres) of every growth unit.
///
/// r^e of a unit is the sum of r^e over the units that stand on it (Shinozaki's pipe model with MAppleT's exponent). A
/// unit is never thinner than a terminal one of its own length, than the wood floor, or, as long trunk, than the trunk floor.
/// The floor of the trunk does not feed into what bears it.
pub(crate) fn radii(units: &[GrowthUnit], parameters: &TreeParameters) -> Vec<f64> {
    let exponent = parameters.pipe_exponent;
    let mut pipes = vec![0.0; units.len()];
    let mut radii = vec![0.0; units.len()];
    // Bearers come before what they bear, so that backwards every sum is complete when it is read.
    for (number, unit) in units.iter().enumerate().rev() {
        let borne: f64 = pipes.get(number).copied().unwrap_or(0.0);
        let radius =
            libm::pow(borne, 1.0 / exponent).max(terminal_radius_m(f64::from(unit.internodes), parameters));
        if let Some(below) = unit.bearer.and_then(|bearer| pipes.get_mut(bearer)) {
            *below += libm::pow(radius, exponent);
        }
        let is_trunk = unit.order == 0 && unit.state == State::Long;
        let floor = if is_trunk { 0.5 * parameters.trunk_floor_diameter_m } else { 0.0 };
        if let Some(target) = radii.get_mut(number) {
            *target = radius.max(floor);
        }
    }
    radii
}

/// Radius of a unit that bears nothing: linear from 4 to 70 internodes, not below the floor.
pub(crate) fn terminal_radius_m(internodes: f64, parameters: &TreeParameters) -> f64 {
    let (thin, thick) = (parameters.terminal_radius_m, parameters.terminal_radius_long_m);
    let share = (internodes - 4.0) / 66.0;
    (thin + share * (thick - thin)).max(parameters.wood_floor_radius_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn unit(bearer: Option<usize>, state: State, order: u32, internodes: u32) -> GrowthUnit {
        let (base, direction) = (DVec3::ZERO, DVec3::Z);
        GrowthUnit {
            bearer,
            bearer_node: 1,
            state,
            order,
            season: 1,
            internodes,
            first_node: 0,
            base,
            direction,
        }
    }

    #[test]
    fn three_equal_pipes_make_one_thicker_by_the_exponent() {
        let mut units = vec![unit(None, State::Long, 0, 4)];
        units.extend((0..3).map(|_| unit(Some(0), State::Long, 1, 70)));
        let parameters = TreeParameters { trunk_floor_diameter_m: 0.0, ..TreeParameters::default() };
        let radii_of = |parameters: &TreeParameters| radii(&units, parameters);
        let free = radii_of(&parameters);
        assert!(free[1..].iter().all(|r| (r - 0.006).abs() < 1e-12));
        assert!((free[0] - 0.006 * 3f64.powf(1.0 / 2.49)).abs() < 1e-9);
        let floored = radii_of(&TreeParameters { trunk_floor_diameter_m: 0.12, ..parameters });
        assert_eq!(floored[0], 0.06);
        assert_eq!(floored[1..], free[1..]);
    }

    #[test]
    fn spurs_are_held_at_the_floor() {
        let spur = [unit(None, State::Short, 3, 1)];
        assert_eq!(radii(&spur, &TreeParameters::default()), [0.00075]);
        assert_eq!(
            radii(&spur, &TreeParameters { wood_floor_radius_m: 0.002, ..TreeParameters::default() }),
            [0.002]
        );
    }
}
