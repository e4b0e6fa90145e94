//! A supply that is off, or dips as it does when the engine is cranked.

use std::time::Duration;

use crate::fault_table::device::{DeviceFault, Power};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};

/// LMS1xx data sheet: 10.8 to 30 V.
const LEAST_V: f64 = 10.8;

/// The supply is off for a time, or dips.
pub(super) const ROW: Row = Row {
    name: "power",
    family: Family::Device,
    parameters: &[
        Parameter::new("off_ms", Form::Number(0.0, 3.6e6), "as long as the fault", "off for so long, ms"),
        Parameter::new(
            "dips",
            Form::Timed(0.0, 60.0),
            "–",
            "the voltage from each instant on, V; off while it is below `least_v`",
        ),
        Parameter::new(
            "least_v",
            Form::Number(0.0, 60.0),
            "10.8, an LMS1xx's",
            "lowest voltage it works with, V",
        ),
    ],
    about: "The supply is off. Connections vanish without a word and new ones are refused until it is back; then the device boots as its profile says, with what is in its EEPROM and \
            counters at zero. An old connection that speaks is reset.",
    reports: "lost, booting, ready",
    recovery: "true boot time + 1 s; state from EEPROM only",
    make: |settings| {
        let off = settings.number("off_ms")?.map(|ms| Duration::from_secs_f64(ms / 1000.0));
        let dips = settings.timed("dips")?.unwrap_or_default();
        let least_v = settings.number("least_v")?.unwrap_or(LEAST_V);
        if !dips.is_empty() && dips.iter().all(|(_, volts)| *volts >= least_v) {
            return Err(settings.refuse(format!(
                "no voltage of `dips` is below the {least_v} V that the device works with, so nothing would happen; lower one, or give `least_v`"
            )));
        }
        Ok(PartFault::Device(DeviceFault::Power(Power { off, dips, least_v })))
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crank_is_off_from_the_first_low_voltage_to_the_last() {
        let ms = Duration::from_millis;
        let power = |dips: &[(u64, f64)], off: Option<u64>| Power {
            off: off.map(ms),
            dips: dips.iter().map(|(at, volts)| (ms(*at), *volts)).collect(),
            least_v: LEAST_V,
        };
        assert_eq!(power(&[(0, 6.0), (300, 9.0), (900, 12.0)], None).outage(), (ms(0), Some(ms(900))));
        assert_eq!(power(&[(50, 12.0), (100, 6.0)], None).outage(), (ms(100), None));
        assert_eq!(power(&[], Some(40)).outage(), (ms(0), Some(ms(40))));
        assert_eq!(
            power(&[(0, 6.0), (300, 12.0), (400, 5.0), (500, 12.0)], None).outage(),
            (ms(0), Some(ms(500)))
        );
    }
}
