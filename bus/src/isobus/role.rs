//! What of ISOBUS the rig itself has on a bus.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use rowscan_protocol::time::SimTime;

use super::client::{SectionOrder, TaskClient};
use super::server::{News, TaskServer, What, Wishes};
use super::trouble::TroubleDesk;
use crate::control_function::ControlFunction;
use crate::frame::CanFrame;

/// What sections were told, in the order of time. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct SectionLog(Arc<Mutex<Vec<SectionOrder>>>);

impl SectionLog {
    /// All orders so far.
    pub fn orders(&self) -> Vec<SectionOrder> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn extend(&self, orders: Vec<SectionOrder>) {
        if !orders.is_empty() {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(orders);
        }
    }
}

/// What happened to clients of the rig's task controller, but for the values that they told. Clones share it; the first few are kept.
#[derive(Clone, Debug, Default)]
pub struct ClientLog(Arc<Mutex<Vec<News>>>);

/// The most news that are kept.
const MOST_NEWS: usize = 256;

impl ClientLog {
    /// All so far.
    pub fn news(&self) -> Vec<News> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn extend(&self, news: Vec<News>) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let room = MOST_NEWS.saturating_sub(kept.len());
        kept.extend(news.into_iter().filter(|news| !matches!(news.what, What::Told(_))).take(room));
    }
}

/// A control function of the rig that speaks ISOBUS.
#[derive(Debug)]
pub enum Role {
    /// The sprayer, a client of somebody's task controller.
    Client {
        /// It.
        client: Box<TaskClient>,
        /// Where goes what its sections are told.
        log: SectionLog,
        /// What is wrong with it.
        troubles: TroubleDesk,
    },
    /// A task controller, for somebody's client.
    Server {
        /// It.
        server: Box<TaskServer>,
        /// What it wants, and from when on.
        task: VecDeque<(SimTime, Wishes)>,
        /// Where goes what happens to its clients.
        log: ClientLog,
        /// What is wrong with it.
        troubles: TroubleDesk,
    },
}

impl ControlFunction for Role {
    fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client { client, .. } => client.open_settled(at, out),
            Self::Server { server, .. } => server.open_settled(at, out),
        }
    }

    fn next(&self) -> Option<SimTime> {
        match self {
            Self::Client { client, .. } => client.next(),
            Self::Server { server, task, .. } => {
                let due = task.front().map(|(due, _)| *due);
                server.next().into_iter().chain(due).min()
            }
        }
    }

    fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client { client, log, troubles } => {
                client.set_trouble(troubles.now());
                client.poll(at, out);
                log.extend(client.take_orders());
            }
            Self::Server { server, task, log, troubles } => {
                server.set_trouble(troubles.now());
                server.poll(at, out);
                while task.front().is_some_and(|(due, _)| *due <= at) {
                    let Some((_, wishes)) = task.pop_front() else { break };
                    server.command(at, wishes, out);
                }
                log.extend(server.take_news());
            }
        }
    }

    fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client { client, log, troubles } => {
                client.set_trouble(troubles.now());
                client.handle(at, frame, out);
                log.extend(client.take_orders());
            }
            Self::Server { server, log, troubles, .. } => {
                server.set_trouble(troubles.now());
                server.handle(at, frame, out);
                log.extend(server.take_news());
            }
        }
    }
}
