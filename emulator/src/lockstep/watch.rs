//! Acknowledgements that the kernel can tell.

use std::collections::HashMap;
use std::io;
use std::net::SocketAddr;

use super::bystanders::Bystanders;
use super::level::KernelLevel;
use super::looked::Looked;
use super::processes::{self, Doing};
use super::sockets::{Connection, FarEnd, Sockets};

/// Looks in a row that must find a participant idle, some time apart: between reading and working a program may wait for a moment.
const CALM: u8 = 3;

/// Watches what the kernel knows of the peers.
#[derive(Debug)]
pub(super) struct Watch {
    level: KernelLevel,
    sockets: Sockets,
    /// The programs behind a socket.
    owners: HashMap<u32, Vec<u32>>,
    /// Programs behind the peers at this look, each once, with a peer for messages.
    behind: Vec<(u32, SocketAddr)>,
    /// Looks in a row that found everyone idle.
    calm: u8,
}

impl Watch {
    pub(super) fn open(level: KernelLevel, bystanders: Bystanders) -> io::Result<Self> {
        let sockets = Sockets::open(bystanders)?;
        Ok(Self { level, sockets, owners: HashMap::new(), behind: Vec::new(), calm: 0 })
    }

    pub(super) fn look(&mut self) -> Looked {
        self.behind.clear();
        let missing = match self.sockets.connections() {
            Ok(connections) => connections.iter().find_map(|connection| self.missing(connection)),
            Err(cause) => Some(format!("the kernel does not tell: {cause}")),
        };
        if let Some(who) = missing.or_else(|| self.at_work()) {
            self.calm = 0;
            return Looked::Missing(who);
        }
        self.calm += 1;
        if self.level == KernelLevel::Idle && self.calm < CALM {
            return Looked::Settling;
        }
        self.calm = 0;
        Looked::Acknowledged
    }

    /// What a peer has not done yet.
    fn missing(&mut self, connection: &Connection) -> Option<String> {
        let Connection { peer, unsent, unheard, far } = *connection;
        if unsent > 0 {
            return Some(format!("{unsent} bytes are on their way to {peer}"));
        }
        if self.level == KernelLevel::Sent {
            return None;
        }
        let Some(FarEnd { unread, unsent: answers, inode }) = far else {
            return Some(format!(
                "{peer} is not on this machine, nobody can see what it has read: take --ack sent, or reply:HOST:PORT"
            ));
        };
        if unread > 0 {
            return Some(format!("{peer} has not read {unread} bytes"));
        }
        if unheard > 0 || answers > 0 {
            return Some(format!("{} bytes from {peer} are on their way", unheard + answers));
        }
        if self.level == KernelLevel::Read {
            return None;
        }
        let owners = owners(&mut self.owners, inode);
        if owners.is_empty() {
            return Some(format!(
                "the program behind {peer} cannot be seen: take --ack read, or reply:HOST:PORT"
            ));
        }
        let own = std::process::id();
        for process in owners.iter().copied() {
            if process != own && self.behind.iter().all(|(known, _)| *known != process) {
                self.behind.push((process, peer));
            }
        }
        None
    }

    /// A program behind a peer that does not wait.
    fn at_work(&self) -> Option<String> {
        let peers = self.behind.iter().find_map(|(process, peer)| match processes::doing(*process) {
            Doing::Waits | Doing::Gone => None,
            Doing::Works(what) => Some(format!("process {process} behind {peer}: {what}")),
        });
        peers.or_else(|| match processes::doing_here() {
            Doing::Works(what) if self.level == KernelLevel::Idle => Some(format!("this program: {what}")),
            _ => None,
        })
    }

    /// What the programs behind the peers are in, for a message.
    pub(super) fn describe(&mut self) -> String {
        let far = |connection: &Connection| connection.far.map(|far| far.inode);
        let inodes: Vec<u32> =
            self.sockets.connections().unwrap_or_default().iter().filter_map(far).collect();
        let mut all: Vec<u32> =
            inodes.into_iter().flat_map(|inode| owners(&mut self.owners, inode).to_vec()).collect();
        all.retain(|process| *process != std::process::id());
        all.sort_unstable();
        all.dedup();
        let told =
            all.into_iter().map(|process| format!("; process {process} is in {}", processes::calls(process)));
        told.collect()
    }
}

/// The programs behind a socket; looked for once.
fn owners(known: &mut HashMap<u32, Vec<u32>>, inode: u32) -> &[u32] {
    known.entry(inode).or_insert_with(|| processes::owners(inode))
}
