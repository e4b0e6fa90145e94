//! `EIIpAddr`, `EImask`, `EIgate`: the device's place in the network. A change takes effect after mEEwriteall and a restart.

use super::Variable;
use super::wire::fields;

fields! {
    /// IPv4 address.
    #[derive(Copy)]
    pub struct IpAddress {
        /// The address.
        pub address: [u8; 4],
    }

    /// IPv4 network mask.
    #[derive(Copy)]
    pub struct NetworkMask {
        /// The mask.
        pub mask: [u8; 4],
    }

    /// IPv4 gateway.
    #[derive(Copy)]
    pub struct Gateway {
        /// The address.
        pub address: [u8; 4],
    }
}

impl Variable for IpAddress {
    const NAME: &'static str = "EIIpAddr";
}

impl Variable for NetworkMask {
    const NAME: &'static str = "EImask";
}

impl Variable for Gateway {
    const NAME: &'static str = "EIgate";
}
