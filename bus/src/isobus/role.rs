//! What of ISOBUS the rig itself has on a bus.

use std::sync::{Arc, Mutex, PoisonError};

use rowscan_protocol::time::SimTime;

use super::client::{SectionOrder, TaskClient};
use super::trouble::Trouble;
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

/// A control function of the rig that speaks ISOBUS.
#[derive(Debug)]
pub enum Role {
    /// The sprayer, a client of somebody's task controller; what its sections are told goes to the log.
    Client(Box<TaskClient>, SectionLog),
}

impl Role {
    /// A bus, or another port of it, opens.
    pub fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client(client, _) => client.open(at, out),
        }
    }

    /// The same where it has sat on the bus for long.
    pub fn open_settled(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client(client, _) => client.open_settled(at, out),
        }
    }

    /// When [`Role::poll`] has something to do.
    pub fn next(&self) -> Option<SimTime> {
        match self {
            Self::Client(client, _) => client.next(),
        }
    }

    /// Does what is due.
    pub fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client(client, log) => {
                client.poll(at, out);
                log.extend(client.take_orders());
            }
        }
    }

    /// A frame was received.
    pub fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client(client, log) => {
                client.handle(at, frame, out);
                log.extend(client.take_orders());
            }
        }
    }

    /// From now on this is wrong.
    pub fn set_trouble(&mut self, trouble: Trouble) {
        match self {
            Self::Client(client, _) => client.set_trouble(trouble),
        }
    }
}
