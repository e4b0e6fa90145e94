//! Acknowledgements that the kernel can tell.

use std::collections::HashMap;
use std::io;
use std::net::{SocketAddr, SocketAddrV4};

use super::bystanders::Bystanders;
use super::children::ChildClock;
use super::hung_up::HungUp;
use super::level::KernelLevel;
use super::looked::Looked;
use super::sockets::{Connection, FarEnd, Sockets};
use crate::processes::{self, Doing};

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
    /// Programs that have hung up.
    hung_up: HungUp,
    /// Looks in a row that found everyone idle.
    calm: u8,
}

impl Watch {
    pub(super) fn open(level: KernelLevel, bystanders: Bystanders) -> io::Result<Self> {
        let sockets = Sockets::open(bystanders)?;
        let (owners, behind, hung_up) = (HashMap::new(), Vec::new(), HungUp::default());
        Ok(Self { level, sockets, owners, behind, hung_up, calm: 0 })
    }

    /// Whether somebody on this machine listens for datagrams to `to`, as far as the kernel tells.
    pub(super) fn has_receiver(&mut self, to: SocketAddrV4) -> bool {
        self.sockets.has_receiver(to).unwrap_or(true)
    }

    pub(super) fn look(&mut self, children: Option<&ChildClock>) -> Looked {
        self.behind.clear();
        let missing = match self.sockets.connections() {
            Ok(connections) => connections.iter().find_map(|connection| self.missing(connection, children)),
            Err(cause) => Some(format!("the kernel does not tell: {cause}")),
        };
        let missing = missing.or_else(|| self.unheard_connections(children));
        let missing = missing.or_else(|| self.at_work(children));
        // Who is behind the peers is known in full only once all of them are idle.
        if let Some(who) = missing.or_else(|| self.about_to_end()) {
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
    fn missing(&mut self, connection: &Connection, children: Option<&ChildClock>) -> Option<String> {
        let Connection { peer, unsent, unheard, far, left, .. } = *connection;
        if left && self.level > KernelLevel::Sent {
            // A connection may be kept on purpose, as one that a fault has left half open. Its end must have been read.
            return (unheard > 0)
                .then(|| format!("{unheard} bytes from {peer}, which has left, are not read"));
        }
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
        if unread > 0 && !self.sleeps(inode, children) {
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

    /// True if the programs behind a socket wait for a timer of simulated time and for nothing that has come: who waits for the socket would run. Time
    /// must come to that timer before they read.
    fn sleeps(&mut self, inode: u32, children: Option<&ChildClock>) -> bool {
        let Some(children) = children else { return false };
        let owners = owners(&mut self.owners, inode);
        let sleeps =
            |process: &u32| children.has_timer(*process) && processes::doing(*process) == Doing::Waits;
        !owners.is_empty() && owners.iter().all(sleeps)
    }

    /// The program that holds time up by a sleep: nobody behind the peers runs, and this one has not read what came, or waits for time alone.
    pub(super) fn sleeper(&mut self) -> Option<u32> {
        let connections = self.sockets.connections().ok()?;
        let own = std::process::id();
        let (mut late, mut all) = (None, Vec::new());
        for far in connections.iter().filter_map(|connection| connection.far) {
            for process in
                owners(&mut self.owners, far.inode).iter().copied().filter(|process| *process != own)
            {
                late = late.or((far.unread > 0).then_some(process));
                all.push(process);
            }
        }
        let sleeps = |process: &u32| matches!(processes::doing(*process), Doing::Works(_));
        let runs = all.iter().any(|process| !processes::is_asleep(*process));
        late.or_else(|| all.iter().copied().find(sleeps)).filter(|_| !runs)
    }

    /// Connections that this program has not taken yet. Where the children's own time has them dial, that belongs to the step.
    fn unheard_connections(&mut self, children: Option<&ChildClock>) -> Option<String> {
        children?;
        match self.sockets.unaccepted() {
            Ok(0) => None,
            Ok(connections) => Some(format!("{connections} connections are not taken yet")),
            Err(cause) => Some(format!("the kernel does not tell: {cause}")),
        }
    }

    /// A program that has hung up and is about to end.
    fn about_to_end(&mut self) -> Option<String> {
        let present = self.behind.iter().map(|(process, _)| *process);
        (self.level == KernelLevel::Idle).then(|| self.hung_up.look(present))?
    }

    /// A program behind a peer, or a child by the children's clock, that does not wait.
    fn at_work(&self, children: Option<&ChildClock>) -> Option<String> {
        let peers = self.behind.iter().find_map(|(process, peer)| match processes::doing(*process) {
            Doing::Waits | Doing::Gone => None,
            Doing::Works(what) => Some(format!("process {process} behind {peer}: {what}")),
        });
        let own = || children.and_then(|children| self.child_at_work(children));
        peers.or_else(own).or_else(|| match processes::doing_here() {
            Doing::Works(what) if self.level == KernelLevel::Idle => Some(format!("this program: {what}")),
            _ => None,
        })
    }

    /// A child by the children's clock that does not wait, whose timer is due, or that has ended and nobody has noticed.
    fn child_at_work(&self, children: &ChildClock) -> Option<String> {
        if let Some(process) = children.firing() {
            return Some(format!("process {process} has not taken in that its timer is due"));
        }
        let behind = |process: &u32| self.behind.iter().any(|(known, _)| known == process);
        children.processes().filter(|process| !behind(process)).find_map(|process| {
            match processes::doing(process) {
                Doing::Works(what) => Some(format!("process {process}: {what}")),
                Doing::Gone if processes::is_unnoticed(process) => {
                    Some(format!("process {process} has ended"))
                }
                Doing::Waits | Doing::Gone => None,
            }
        })
    }

    /// What the programs behind the peers and the children by the children's clock are in, for a message.
    pub(super) fn describe(&mut self, children: Option<&ChildClock>) -> String {
        let far = |connection: &Connection| connection.far.map(|far| far.inode);
        let inodes: Vec<u32> =
            self.sockets.connections().unwrap_or_default().iter().filter_map(far).collect();
        let mut all: Vec<u32> =
            inodes.into_iter().flat_map(|inode| owners(&mut self.owners, inode).to_vec()).collect();
        all.extend(children.into_iter().flat_map(ChildClock::processes));
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
