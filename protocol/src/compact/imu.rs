//! Type 2: attitude and motion of the scanner.

use super::wire::{Always, layout};

layout! {
    /// One reading of the inertial measurement unit; 64 bytes with frame. It has no counter.
    #[derive(Default)]
    pub struct Imu {
        /// Always 1.
        pub version: Always<1>,
        /// Acceleration with gravity, along x, y and z.
        pub acceleration_m_s2: [f32; 3] ["m/s²"],
        /// Rate of turn about x, y and z.
        pub rate_rad_s: [f32; 3] ["rad/s"],
        /// Attitude as a quaternion: w, x, y, z.
        pub orientation_wxyz: [f32; 4],
        /// When it was measured, on the scanner's clock.
        pub time_us: u64 ["µs"],
    }
}
