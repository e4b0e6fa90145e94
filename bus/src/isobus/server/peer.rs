//! One client of the task controller: what it has sent, and what it was told.

use std::collections::BTreeMap;

use rowscan_protocol::time::SimTime;

use super::wishes::{questions, triggers};
use super::{LOST, REPEAT, Wishes};
use crate::isobus::ddi;
use crate::isobus::pool::{ElementKind, MOST_BYTES, Pool, PoolError, Version};
use crate::isobus::process_data::{ProcessData, descriptor, descriptor_message, refusal};
use crate::name::Name;

/// What a message about a pool is answered.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Answer {
    /// Nothing.
    Nothing,
    /// That it is not the client's to say.
    Unknown,
    /// This.
    Say([u8; 8]),
    /// This; the pool cannot be used, with what is wrong in it.
    Refuse([u8; 8], Option<PoolError>),
    /// This; its pool is in use, with so many sections.
    Activate([u8; 8], usize),
    /// This; its pool was in use.
    Lose([u8; 8]),
}

/// The pool of a client.
#[derive(Clone, Debug, Default)]
enum Held {
    /// None.
    #[default]
    None,
    /// Bytes that nobody has read yet.
    Bytes(Vec<u8>),
    /// One that is in order; in use or not.
    Sound { pool: Pool, bytes: usize, is_active: bool },
}

/// One client.
#[derive(Clone, Debug)]
pub(super) struct Peer {
    pub(super) address: u8,
    /// When its status was heard last; none while it is gone.
    heard: Option<SimTime>,
    version: Version,
    held: Held,
    /// What it told of its elements: no more than its pool has.
    values: BTreeMap<(u16, u16), i32>,
    /// It was told when to tell values.
    is_asked: bool,
    /// What was wanted of its sections, by element and DDI of their actual state; to be said again then.
    wanted: Vec<((u16, u16), i32)>,
    again: Option<SimTime>,
}

impl Peer {
    pub(super) fn new(at: SimTime, address: u8) -> Self {
        Self {
            address,
            heard: Some(at),
            version: Version::Fourth,
            held: Held::None,
            values: BTreeMap::new(),
            is_asked: false,
            wanted: Vec::new(),
            again: None,
        }
    }

    /// It turns to us, perhaps anew: then its pool is no longer in use.
    pub(super) fn introduced(&mut self, at: SimTime) {
        self.forget();
        self.heard = Some(at);
    }

    /// It is gone. Its pool stays, in case that it comes back.
    pub(super) fn forget(&mut self) {
        self.heard = None;
        self.rest();
    }

    /// Its pool is no longer in use.
    fn rest(&mut self) -> bool {
        self.values.clear();
        self.wanted.clear();
        (self.is_asked, self.again) = (false, None);
        match &mut self.held {
            Held::Sound { is_active, .. } => std::mem::take(is_active),
            _ => false,
        }
    }

    pub(super) fn is_gone(&self) -> bool {
        self.heard.is_none()
    }

    pub(super) fn heard(&mut self, at: SimTime) {
        self.heard = self.heard.map(|heard| heard.max(at));
    }

    pub(super) fn versioned(&mut self, byte: u8) {
        self.version = Version::of(byte);
    }

    /// True if its status has not come for too long.
    pub(super) fn is_over(&self, at: SimTime) -> bool {
        self.heard.is_some_and(|heard| heard + LOST <= at)
    }

    /// True if what is wanted is to be said again.
    pub(super) fn repeats(&self, at: SimTime) -> bool {
        self.again.is_some_and(|again| again <= at)
    }

    pub(super) fn next(&self) -> Option<SimTime> {
        [self.heard.map(|heard| heard + LOST), self.again].into_iter().flatten().min()
    }

    /// The pool in use.
    pub(super) fn active(&self) -> Option<&Pool> {
        match &self.held {
            Held::Sound { pool, is_active: true, .. } => Some(pool),
            _ => None,
        }
    }

    fn sound(&self) -> Option<&Pool> {
        match &self.held {
            Held::Sound { pool, .. } => Some(pool),
            _ => None,
        }
    }

    pub(super) fn value(&self, element: u16, ddi: u16) -> Option<i32> {
        self.values.get(&(element, ddi)).copied()
    }

    pub(super) fn held_bytes(&self) -> usize {
        match &self.held {
            Held::None => 0,
            Held::Bytes(bytes) => bytes.len(),
            Held::Sound { bytes, .. } => *bytes,
        }
    }

    /// True if its pool is of another control function than this one.
    pub(super) fn is_another(&self, name: Name) -> bool {
        self.sound().and_then(Pool::device).is_some_and(|device| device.name != name)
    }

    /// A message about its pool; `refusal` is what a fault has every activation answered with.
    pub(super) fn described(&mut self, data: &[u8], refused: Option<u8>) -> Answer {
        let &[first, b1, b2, b3, b4, ..] = data else { return Answer::Nothing };
        // Who asks for a label that is none asks for any.
        let asked = data.get(1..8).unwrap_or_default();
        let label = |subcommand, held: Option<&[u8; 7]>| {
            let held = held.filter(|held| asked == [0xFF; 7] || asked == *held);
            Answer::Say(descriptor_message(subcommand, held.map_or(&[], |label| label.as_slice())))
        };
        let device = self.sound().and_then(Pool::device);
        match first >> 4 {
            descriptor::REQUEST_STRUCTURE => {
                label(descriptor::STRUCTURE, device.map(|device| &device.structure))
            }
            descriptor::REQUEST_LOCALIZATION => {
                label(descriptor::LOCALIZATION, device.map(|device| &device.localization))
            }
            descriptor::REQUEST_TRANSFER => {
                let wanted = u32::from_le_bytes([b1, b2, b3, b4]);
                let fits = usize::try_from(wanted).is_ok_and(|wanted| wanted <= MOST_BYTES);
                // What has come of another one is left out.
                if matches!(self.held, Held::Bytes(_)) {
                    self.held = Held::None;
                }
                Answer::Say(descriptor_message(descriptor::TRANSFER_ANSWER, &[u8::from(!fits)]))
            }
            descriptor::TRANSFER => self.transferred(data.get(1..).unwrap_or_default()),
            descriptor::ACTIVATE if b1 == 0xFF => self.activate(refused),
            descriptor::ACTIVATE if b1 == 0 => {
                let answer = activated(0, None);
                if self.rest() { Answer::Lose(answer) } else { Answer::Say(answer) }
            }
            descriptor::DELETE => {
                let was_active = self.rest();
                self.held = Held::None;
                let answer = descriptor_message(descriptor::DELETED, &[0]);
                if was_active { Answer::Lose(answer) } else { Answer::Say(answer) }
            }
            descriptor::CHANGE_DESIGNATOR => {
                Answer::Say(descriptor_message(descriptor::DESIGNATOR_CHANGED, &[b1, b2, 1]))
            }
            descriptor::STRUCTURE
            | descriptor::LOCALIZATION
            | descriptor::TRANSFER_ANSWER
            | descriptor::TRANSFERRED
            | descriptor::ACTIVATED
            | descriptor::DELETED
            | descriptor::DESIGNATOR_CHANGED => Answer::Unknown,
            _ => Answer::Nothing,
        }
    }

    /// A pool, or a further part of one, has come.
    fn transferred(&mut self, part: &[u8]) -> Answer {
        let size = u32::try_from(part.len()).unwrap_or(u32::MAX).to_le_bytes();
        let [s0, s1, s2, s3] = size;
        let answer = |code| descriptor_message(descriptor::TRANSFERRED, &[code, s0, s1, s2, s3]);
        let mut bytes = match std::mem::take(&mut self.held) {
            Held::Bytes(bytes) => bytes,
            sound @ Held::Sound { is_active: true, .. } => {
                // A pool in use is given up first.
                self.held = sound;
                return Answer::Say(answer(2));
            }
            Held::None | Held::Sound { .. } => Vec::new(),
        };
        if bytes.len() + part.len() > MOST_BYTES {
            return Answer::Say(answer(1));
        }
        bytes.extend(part);
        self.held = Held::Bytes(bytes);
        Answer::Say(answer(0))
    }

    fn activate(&mut self, refused: Option<u8>) -> Answer {
        if let Some(code) = refused {
            return Answer::Refuse(activated(code, None), None);
        }
        let (pool, bytes) = match std::mem::take(&mut self.held) {
            Held::None => return Answer::Refuse(activated(4, None), None),
            Held::Bytes(bytes) => match Pool::read(&bytes, self.version) {
                Ok(pool) => (pool, bytes.len()),
                // A pool with errors is forgotten.
                Err(error) => return Answer::Refuse(activated(1, Some(&error)), Some(error)),
            },
            Held::Sound { pool, bytes, .. } => (pool, bytes),
        };
        let sections = pool.elements(ElementKind::Section).len();
        self.rest();
        self.held = Held::Sound { pool, bytes, is_active: true };
        Answer::Activate(activated(0, None), sections)
    }

    /// It tells a value: 0, or why it cannot be.
    pub(super) fn told(&mut self, told: ProcessData) -> u8 {
        let Some(pool) = self.active() else { return refusal::NOT_SETTABLE };
        let known = pool.process_data();
        let key = (told.element, told.ddi);
        if !known.iter().any(|known| (known.0, known.1) == key) {
            return if pool.has_element(told.element) { refusal::DDI } else { refusal::ELEMENT };
        }
        self.values.insert(key, told.value);
        if self.wanted.iter().all(|(key, value)| self.values.get(key) == Some(value)) {
            self.again = None;
        }
        0
    }

    /// What is wanted of it, as messages; nothing while its pool is not in use.
    pub(super) fn wishes(&mut self, at: SimTime, wishes: &Wishes) -> Vec<ProcessData> {
        let Some(pool) = self.active() else { return Vec::new() };
        let setpoints = wishes.setpoints(pool);
        let has = |key: (u16, u16)| pool.process_data().iter().any(|known| (known.0, known.1) == key);
        let mut wanted = Vec::new();
        for setpoint in &setpoints {
            if let Some(word) = ddi::word(setpoint.ddi, ddi::SETPOINT_SECTIONS) {
                let key = (setpoint.element, ddi::ACTUAL_SECTIONS + word);
                wanted.extend(has(key).then_some((key, setpoint.value)));
            }
        }
        let mut messages = if self.is_asked && self.again.is_none() { Vec::new() } else { triggers(pool) };
        if self.again.is_some_and(|again| again <= at) {
            messages.extend(questions(pool));
        }
        messages.extend(setpoints);
        self.is_asked = true;
        let is_shown = wanted.iter().all(|(key, value)| self.values.get(key) == Some(value));
        self.again = (!is_shown).then(|| at + REPEAT);
        self.wanted = wanted;
        messages
    }
}

/// The answer to an activation: bits of what is wrong, what it is wrong with (AgIsoStack++, `send_object_pool_activate_deactivate_response`).
fn activated(code: u8, error: Option<&PoolError>) -> [u8; 8] {
    let [p0, p1] = error.and_then(|error| error.parent).unwrap_or(0xFFFF).to_le_bytes();
    let [o0, o1] = error.and_then(|error| error.object).unwrap_or(0xFFFF).to_le_bytes();
    let objects = error.map_or(0, |error| error.fault.code());
    descriptor_message(descriptor::ACTIVATED, &[code, p0, p1, o0, o1, objects, 0xFF])
}
