//! Events of a link beside its scans.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_protocol::host::{DeviceInfo, SettingNote};
use rowscan_protocol::validity::ScanFault;
use tokio::sync::Notify;

use crate::error::DriverError;

/// Something the user may want to know; taken from [`Scanner::link_events`](crate::Scanner::link_events).
#[derive(Debug)]
#[non_exhaustive]
pub enum LinkEvent {
    /// The device is configured and streams.
    Ready(DeviceInfo),
    /// A setting is not as it was to be, or was not as an earlier client should have left it.
    Setting(SettingNote),
    /// The first scan telegram with this cause that passed its checksum and gives no scan. Later ones are counted:
    /// [`Scanner::faults`](crate::Scanner::faults).
    Malformed {
        /// Why.
        fault: ScanFault,
    },
    /// The link was lost and will be dialled again after `pause`.
    Lost {
        /// What happened.
        cause: DriverError,
        /// The pause before the next attempt.
        pause: Duration,
    },
}

/// Link events kept for a user who does not take them.
const EVENTS_KEPT: usize = 64;

/// The newest link events, oldest first. Clones share them, so that one task can take them while another waits for a scan.
#[derive(Clone, Debug, Default)]
pub struct LinkEvents(Arc<Kept>);

#[derive(Debug, Default)]
struct Kept {
    events: Mutex<VecDeque<LinkEvent>>,
    /// What the device said it is, when it last became ready.
    device: Mutex<Option<DeviceInfo>>,
    /// What became of its settings, each once.
    settings: Mutex<Vec<SettingNote>>,
    more: Notify,
}

impl LinkEvents {
    pub(crate) fn push(&self, event: LinkEvent) {
        if let LinkEvent::Ready(device) = &event {
            *self.0.device.lock().unwrap_or_else(PoisonError::into_inner) = Some(device.clone());
        }
        if let LinkEvent::Setting(note) = &event {
            let mut settings = self.0.settings.lock().unwrap_or_else(PoisonError::into_inner);
            if !settings.contains(note) {
                settings.push(*note);
            }
        }
        let mut events = self.lock();
        if events.len() == EVENTS_KEPT {
            events.pop_front();
        }
        events.push_back(event);
        self.0.more.notify_one();
    }

    /// What the device said it is, when it last became ready; `None` before, and of a recording.
    pub fn device(&self) -> Option<DeviceInfo> {
        self.0.device.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// What became of the device's settings over all its connections, each note once.
    pub fn settings(&self) -> Vec<SettingNote> {
        self.0.settings.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The oldest event not yet taken, if there is one.
    pub fn take(&self) -> Option<LinkEvent> {
        self.lock().pop_front()
    }

    /// The oldest event not yet taken, once there is one. Cancel safe.
    pub async fn next(&self) -> LinkEvent {
        loop {
            if let Some(event) = self.take() {
                return event;
            }
            self.0.more.notified().await;
        }
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<LinkEvent>> {
        self.0.events.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
