//! `TSCRole`, `TSCTCInterface`, `TSCTCSrvAddr`, `TSCTCtimezone`, `TSCTCupdatetime`, `TSCTCmaxoffset`, `TSCTCdelay`: the device as a client of a time
//! server.

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

    /// Where its time is valid.
    #[derive(Copy)]
    pub struct TimeZone {
        /// Hours east of Greenwich, and 12: 0 to 24.
        pub hours_plus_12: u8 ["h"],
    }

    /// The largest difference from the server's time.
    #[derive(Copy)]
    pub struct TimeOffset {
        /// Seconds.
        pub seconds: f32 ["s"],
    }

    /// How long the server's answer took.
    #[derive(Copy)]
    pub struct TimeDelay {
        /// Seconds.
        pub seconds: f32 ["s"],
    }
}

impl Variable for TimeZone {
    const NAME: &'static str = "TSCTCtimezone";
}

impl Variable for TimeOffset {
    const NAME: &'static str = "TSCTCmaxoffset";
}

impl Variable for TimeDelay {
    const NAME: &'static str = "TSCTCdelay";
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
