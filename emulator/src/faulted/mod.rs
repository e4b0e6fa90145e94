//! Faults of parts: what the plan of faults orders of devices, tractor and buses. Orders wait in queues with their instants, because the plan
//! may order while a part is in use; a part obeys before it acts.

mod bus;
mod device;
mod fits;
mod orders;
mod vehicle;

pub(crate) use bus::BusFaults;
pub(crate) use device::DeviceFaults;
pub(crate) use vehicle::{Receivers, VehiclePart};
