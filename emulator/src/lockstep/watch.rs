//! Acknowledgements that the kernel can tell.

use std::collections::HashMap;
use std::io;

use super::bystanders::Bystanders;
use super::level::KernelLevel;
use super::looked::Looked;
use super::processes::{self, Doing};
use super::sockets::{Connection, FarEnd, Sockets};

/// Looks in a row that must find a participant idle: between reading and working a program may wait for a moment.
const CALM: u8 = 3;

/// Watches what the kernel knows of the peers.
#[derive(Debug)]
pub(super) struct Watch {
    level: KernelLevel,
    sockets: Sockets,
    /// The programs behind a socket.
    owners: HashMap<u32, Vec<u32>>,
    calm: u8,
}

impl Watch {
    pub(super) fn open(level: KernelLevel, bystanders: Bystanders) -> io::Result<Self> {
        Ok(Self { level, sockets: Sockets::open(bystanders)?, owners: HashMap::new(), calm: 0 })
    }

    pub(super) fn look(&mut self) -> Looked {
        let missing = match self.sockets.connections() {
            Ok(connections) => connections.iter().find_map(|connection| self.missing(connection)),
            Err(cause) => Some(format!("the kernel does not tell: {cause}")),
        };
        let wanted = if self.level == KernelLevel::Idle { CALM } else { 1 };
        match missing {
            Some(who) => {
                self.calm = 0;
                Looked::Missing(who)
            }
            None => {
                self.calm += 1;
                if self.calm < wanted {
                    return Looked::Missing("it has been idle for a moment only".to_owned());
                }
                self.calm = 0;
                Looked::Acknowledged
            }
        }
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
        let owners = self.owners(inode);
        if owners.is_empty() {
            return Some(format!(
                "the program behind {peer} cannot be seen: take --ack read, or reply:HOST:PORT"
            ));
        }
        owners.iter().copied().filter(|process| *process != std::process::id()).find_map(|process| {
            match processes::doing(process) {
                Doing::Waits | Doing::Gone => None,
                Doing::Works(what) => Some(format!("process {process} behind {peer}: {what}")),
            }
        })
    }

    /// The programs behind a socket; looked for once.
    fn owners(&mut self, inode: u32) -> &[u32] {
        self.owners.entry(inode).or_insert_with(|| processes::owners(inode))
    }

    /// What the programs behind the peers are in, for a message.
    pub(super) fn describe(&mut self) -> String {
        let far = |connection: &Connection| connection.far.map(|far| far.inode);
        let inodes: Vec<u32> =
            self.sockets.connections().unwrap_or_default().iter().filter_map(far).collect();
        let mut all: Vec<u32> = inodes.into_iter().flat_map(|inode| self.owners(inode).to_vec()).collect();
        all.retain(|process| *process != std::process::id());
        all.sort_unstable();
        all.dedup();
        let told =
            all.into_iter().map(|process| format!("; process {process} is in {}", processes::calls(process)));
        told.collect()
    }
}
