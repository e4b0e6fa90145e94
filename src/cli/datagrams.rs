//! Flags of scanners that send their scans as datagrams and are set up over REST.

use std::net::{Ipv4Addr, SocketAddrV4};

use rowscan_bench::{Directed, ScannerSpec, Undirected};

use super::Failure;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Datagrams and REST (picoScans)")]
pub(super) struct DatagramArgs {
    /// Serve the REST interface at this address, such as 127.0.0.1:8080; repeatable, in the order of the scanners; port 0 takes a free one (docs/picoscan.md says
    /// how to bind port 80, which some clients require)
    #[arg(long, value_name = "ADDR")]
    rest: Vec<String>,
    /// Send scans to this address, and IMU and encoder to its ports 7503 and 7504, in place of 192.168.0.100; repeatable, in the order of the scanners.
    /// Scans go once a client has set ScanDataEnable, or at once with --start streaming
    #[arg(long, value_name = "ADDR")]
    udp: Vec<SocketAddrV4>,
    /// Let clients direct datagrams to this address as well, not to loopback alone; repeatable. Elsewhere nothing is sent, and the log says so
    #[arg(long, value_name = "ADDRESS")]
    allow_destination: Vec<Ipv4Addr>,
}

impl DatagramArgs {
    /// Puts them into the specifications of scanners, in their order.
    pub(super) fn add_to(&self, scanners: &mut [ScannerSpec]) -> Result<(), Failure> {
        let directed = Directed {
            rest: self.rest.clone(),
            udp: self.udp.clone(),
            allowed: self.allow_destination.clone(),
        };
        directed.add_to(scanners).map_err(|Undirected { unused }| {
            Failure::Usage(format!(
                "--udp, --allow-destination and --rest are for scanners with Compact output, such as --model picoscan150; found {} --udp and {} --rest, {unused} of all three for no such scanner",
                self.udp.len(),
                self.rest.len()
            ))
        })
    }
}
