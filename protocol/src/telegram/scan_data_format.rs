//! `ScanDataFormat`: how a scanner with Compact output sends its scans.

use super::Variable;
use super::wire::fields;

fields! {
    /// 1 MSGPACK, 2 Compact, 3 LMDscandata to those who subscribe, 4 native ROS 2.
    pub struct ScanDataFormat {
        /// The code.
        pub code: u8,
    }
}

impl Variable for ScanDataFormat {
    const NAME: &'static str = "ScanDataFormat";
}

/// LMDscandata to those who subscribe.
pub const LMD_SCANDATA: u8 = 3;
