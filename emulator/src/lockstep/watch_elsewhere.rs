//! Where no kernel tells what its sockets hold.

use std::io;
use std::net::SocketAddrV4;

use super::bystanders::Bystanders;
use super::children::ChildClock;
use super::level::KernelLevel;
use super::looked::Looked;

/// Watches nothing: it cannot be opened.
#[derive(Debug)]
pub(super) struct Watch;

impl Watch {
    pub(super) fn open(_: KernelLevel, _: Bystanders) -> io::Result<Self> {
        Err(io::Error::new(io::ErrorKind::Unsupported, "this needs Linux"))
    }

    pub(super) fn has_receiver(&mut self, _: SocketAddrV4) -> bool {
        true
    }

    pub(super) fn look(&mut self, _: Option<&ChildClock>) -> Looked {
        Looked::Missing("this needs Linux".to_owned())
    }

    pub(super) fn sleeper(&mut self) -> Option<u32> {
        None
    }

    pub(super) fn describe(&mut self, _: Option<&ChildClock>) -> String {
        String::new()
    }
}
