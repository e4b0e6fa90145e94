//! `TSCRole`, `TSCTCInterface`, `TSCTCSrvAddr`, `TSCTCupdatetime`: the device as a client of a time server.

use super::Variable;
use super::wire::fields;

fields! {
    /// Role: 0 none, 1 client.
    #[derive(Copy)]
    pub struct TimeRole {
        /// The code.
        pub code: u8,
    }

    /// Interface: 0 Ethernet.
    #[derive(Copy)]
    pub struct TimeInterface {
        /// The code.
        pub code: u8,
    }

    /// The server's IPv4 address.
    #[derive(Copy)]
    pub struct TimeServer {
        /// The address.
        pub address: [u8; 4],
    }

    /// How often the server is asked.
    #[derive(Copy)]
    pub struct TimeUpdate {
        /// Seconds.
        pub seconds: u32 ["s"],
    }
}

impl Variable for TimeRole {
    const NAME: &'static str = "TSCRole";
}

impl Variable for TimeInterface {
    const NAME: &'static str = "TSCTCInterface";
}

impl Variable for TimeServer {
    const NAME: &'static str = "TSCTCSrvAddr";
}

impl Variable for TimeUpdate {
    const NAME: &'static str = "TSCTCupdatetime";
}
