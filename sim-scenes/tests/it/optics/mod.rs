//! The device's eye against closed forms, true cone rays, and what real devices were recorded doing.

mod air;
mod bench;
mod device;
mod noise;
mod spot;
