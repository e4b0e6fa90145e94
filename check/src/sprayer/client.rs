//! The sprayer as client of a task controller: what it tells of its boom, and what its sections were told.

use rowscan_bus::isobus::client::{OnLoss, TaskClient};
use rowscan_bus::isobus::implement::{Implement, ImplementSection};
use rowscan_bus::isobus::role::{Role, SectionLog};
use rowscan_bus::isobus::trouble::TroubleDesk;
use rowscan_sprayer::{Boom, Command, Side, Target};
use serde::Deserialize;

/// What sections do without their task controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum OnLossValue {
    /// They close.
    #[default]
    Close,
    /// They stay as they are.
    Hold,
}

/// The sprayer as client of a task controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClientSpec {
    on_loss: OnLoss,
    tank_l: Option<f64>,
}

impl ClientSpec {
    /// Of these keys.
    pub(super) fn new(on_loss: Option<OnLossValue>, tank_l: Option<f64>) -> Result<Self, String> {
        if let Some(tank_l) = tank_l.filter(|tank_l| !(1.0..=100_000.0).contains(tank_l)) {
            return Err(format!("`sprayer.tank_l`: expected 1 to 100000 litres, found {tank_l}"));
        }
        let on_loss = match on_loss.unwrap_or_default() {
            OnLossValue::Close => OnLoss::Close,
            OnLossValue::Hold => OnLoss::Hold,
        };
        Ok(Self { on_loss, tank_l })
    }

    /// The control function of this boom, on a machine that treats so many metres in a pass.
    pub(crate) fn role(
        &self,
        boom: &Boom,
        width_m: Option<f64>,
        (log, troubles): (SectionLog, TroubleDesk),
    ) -> Role {
        let client = Box::new(TaskClient::new(implement(boom, width_m, self.tank_l), self.on_loss));
        Role::Client { client, log, troubles }
    }
}

/// What a boom's client tells of it. Its sections stand in the order of their numbers: in condensed work states as well.
fn implement(boom: &Boom, width_m: Option<f64>, tank_l: Option<f64>) -> Implement {
    let mm = |m: f64| (m * 1000.0).round() as i32;
    let nozzles = boom.nozzles();
    let mut sections: Vec<ImplementSection> = boom
        .numbers()
        .zip(&boom.sections)
        .enumerate()
        .map(|(place, (number, section))| {
            let own = nozzles.iter().filter(|nozzle| nozzle.section == place);
            let (count, flow_l_s) =
                own.fold((0, 0.0), |(count, flow), nozzle| (count + 1, flow + nozzle.flow_l_s));
            ImplementSection {
                number,
                is_left: section.side == Side::Left,
                height_mm: (mm(section.z_from_m), mm(section.z_to_m)),
                nozzles: count,
                flow_l_min: flow_l_s * 60.0,
            }
        })
        .collect();
    sections.sort_by_key(|section| section.number);
    let slowest =
        |of: fn(&rowscan_sprayer::boom::Nozzle) -> f64| nozzles.iter().map(of).fold(0.0, f64::max).round();
    Implement {
        name: Implement::name(),
        width_mm: width_m.map_or(0, mm),
        behind_mm: mm(boom.offset_y_m),
        on_ms: slowest(|nozzle| nozzle.valve.on_ms) as i32,
        off_ms: slowest(|nozzle| nozzle.valve.off_ms) as i32,
        tank_ml: tank_l.map(mm),
        sections,
    }
}

/// What sections were told from order number `from` on, as commands.
pub(super) fn commands(log: &SectionLog, from: usize) -> impl Iterator<Item = Command> + use<> {
    log.orders_from(from).into_iter().map(|order| Command {
        at: order.at,
        target: Target::Section(order.number),
        duty: if order.is_open { 1.0 } else { 0.0 },
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use super::*;

    #[test]
    fn a_boom_is_told_as_it_is() {
        let section = |id: &str, side: &str, number: u16, z_m: f64| {
            format!(
                "[[section]]\nid = \"{id}\"\nside = \"{side}\"\nnumber = {number}\nz_from_m = {z_m}\nz_to_m = {}\nnozzles = 2\n",
                z_m + 0.5
            )
        };
        let boom = format!(
            "version = 1\noffset_y_m = 1.5\n[valve]\non_ms = 150\noff_ms = 100\n{}{}",
            section("high", "right", 4, 1.0),
            section("low", "left", 1, 0.5)
        );
        let told = implement(&Boom::read(&boom).expect("a boom"), Some(4.0), Some(400.0));
        assert_eq!((told.width_mm, told.behind_mm, told.on_ms, told.off_ms), (4000, 1500, 150, 100));
        assert_eq!(told.tank_ml, Some(400_000));
        let sections: Vec<_> = told
            .sections
            .iter()
            .map(|section| (section.number, section.is_left, section.height_mm, section.nozzles))
            .collect();
        assert_eq!(sections, [(1, true, (500, 1000), 2), (4, false, (1000, 1500), 2)]);
        assert!((told.sections[0].flow_l_min - 2.0).abs() < 1e-9);
        told.pool().check().expect("a sound pool");
        let told = ClientSpec::new(None, Some(0.0)).expect_err("no tank");
        assert!(told.contains("expected 1 to 100000 litres, found 0"), "{told}");
    }
}
