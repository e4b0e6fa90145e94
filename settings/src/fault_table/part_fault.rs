//! A fault as its part gets it.

use std::time::Duration;

use crate::fault_table::bus::BusFault;
use crate::fault_table::clock::ClockFault;
use crate::fault_table::datagrams::DatagramFault;
use crate::fault_table::device::DeviceFault;
use crate::fault_table::sprayer::SprayerFault;
use crate::fault_table::task_controller::TaskControllerFault;
use crate::fault_table::vehicle::{DriveFault, EncoderFault, GnssFault};

/// A fault as its part gets it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PartFault {
    /// Of a scanner.
    Device(DeviceFault),
    /// Of a scanner's clock.
    Clock(ClockFault),
    /// Of the wheel encoder.
    Encoder(EncoderFault),
    /// Of the GNSS receiver.
    Gnss(GnssFault),
    /// Of the drive.
    Drive(DriveFault),
    /// Of a bus.
    Bus(BusFault),
    /// Of datagrams.
    Datagrams(DatagramFault),
    /// Of a sprayer.
    Sprayer(SprayerFault),
    /// Between a task controller and its client.
    TaskController(TaskControllerFault),
}

impl PartFault {
    /// How long it lasts by itself, where neither `for` nor `until` says.
    pub fn lasts(&self) -> Option<Duration> {
        match self {
            Self::Device(DeviceFault::Power(power)) => power.lasts(),
            Self::Bus(BusFault::Off { restart: Some(restart) }) => Some(*restart),
            _ => None,
        }
    }

    /// True if its probability is each datagram's, and not each beginning's.
    pub fn draws_each(&self) -> bool {
        matches!(self, Self::Datagrams(_))
    }

    /// True if its part must know beforehand when it begins.
    pub fn is_foreseen(&self) -> bool {
        matches!(self, Self::Clock(ClockFault::Wrap))
    }

    /// True if nothing passes to or from the device meanwhile, and its connections never come back.
    pub fn cuts_connections(&self) -> bool {
        matches!(self, Self::Device(DeviceFault::Power(_)))
    }
}
