//! Where scanners with Compact output are told to send, and where their REST interfaces are, as users list it.

use std::net::{Ipv4Addr, SocketAddrV4};

use crate::spec::ScannerSpec;

/// Lists in the order of the scanners that have Compact output; others are passed over.
#[derive(Clone, Debug, Default)]
pub struct Directed {
    /// Where each serves REST; one beyond the list's end stays as it is.
    pub rest: Vec<String>,
    /// Where each sends its datagrams.
    pub udp: Vec<SocketAddrV4>,
    /// Where clients may direct them besides loopback; of all scanners.
    pub allowed: Vec<Ipv4Addr>,
}

/// Some of it is for no such scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{unused} of the addresses are for no scanner with Compact output")]
pub struct Undirected {
    /// So many addresses are left.
    pub unused: usize,
}

impl Directed {
    /// Puts it into the specifications of scanners.
    ///
    /// # Errors
    /// There are fewer scanners with Compact output than addresses, or none to allow a destination to.
    pub fn add_to(&self, scanners: &mut [ScannerSpec]) -> Result<(), Undirected> {
        let (mut directed, mut served) = (self.udp.iter(), self.rest.iter());
        let mut streams = 0;
        for spec in scanners.iter_mut().filter(|spec| spec.model.compact().is_some()) {
            streams += 1;
            spec.udp = directed.next().copied();
            spec.rest = served.next().cloned().or_else(|| spec.rest.take());
            spec.allowed_destinations = self.allowed.iter().copied().map(Into::into).collect();
        }
        let nobodys = if streams == 0 { self.allowed.len() } else { 0 };
        let unused = directed.len() + served.len() + nobodys;
        if unused > 0 { Err(Undirected { unused }) } else { Ok(()) }
    }
}
