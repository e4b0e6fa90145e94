//! `InertialMeasurementUnit`: event of an MRS1000 that has one. Layout by a public client, no recorded bytes; units assumed.

use super::Variable;
use super::wire::fields;

fields! {
    /// One reading.
    #[derive(Copy)]
    pub struct InertialMeasurementUnit {
        /// Acceleration along x.
        pub acceleration_x: f32 ["m/s²"],
        /// Acceleration along y.
        pub acceleration_y: f32 ["m/s²"],
        /// Acceleration along z.
        pub acceleration_z: f32 ["m/s²"],
        /// Rate of turn about x.
        pub rate_x: f32 ["rad/s"],
        /// Rate of turn about y.
        pub rate_y: f32 ["rad/s"],
        /// Rate of turn about z.
        pub rate_z: f32 ["rad/s"],
        /// Magnetic field along x.
        pub magnetic_x: f32,
        /// Magnetic field along y.
        pub magnetic_y: f32,
        /// Magnetic field along z.
        pub magnetic_z: f32,
        /// Quaternion, w.
        pub orientation_w: f32,
        /// Quaternion, x.
        pub orientation_x: f32,
        /// Quaternion, y.
        pub orientation_y: f32,
        /// Quaternion, z.
        pub orientation_z: f32,
        /// When, by the device's clock.
        pub time_us: u32 ["µs"],
    }
}

impl Variable for InertialMeasurementUnit {
    const NAME: &'static str = "InertialMeasurementUnit";
}
