//! One connection to a device: dialect, user level, subscriptions.

use alloc::vec::Vec;
use core::time::Duration;

use super::access::Access;
use super::answer::{answer, refuse, write_event};
use super::context::Context;
use super::event::{DeviceEvent, Subscriptions};
use super::refusal::Fault;
use super::state::Device;
use crate::frame::{Accept, Dialect, Frame, FrameCounts, FrameDecoder, encode};
use crate::telegram::Telegram;
use crate::time::SimTime;

/// Largest payload a device takes. Commands are short; clients' longest known ones are below 300 bytes.
const MAX_PAYLOAD: usize = 4096;

/// How a connection decides on its dialect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DialectPolicy {
    /// The first valid frame decides.
    Auto,
    /// This one, or the one EIHstCola has set since; silent in the other.
    Strict(Dialect),
}

/// One answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// One whole frame, to be sent in one write: some clients take what one read gives for the whole reply.
    pub bytes: Vec<u8>,
    /// How long the device takes to answer; nothing in the bench profile.
    pub delay: Duration,
    /// What happens to the connection afterwards.
    pub after: Option<AfterReply>,
}

/// What happens to a connection after a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AfterReply {
    /// The device drops it, as a restart does.
    Close,
}

/// One connection.
#[derive(Clone, Debug)]
pub struct Session {
    policy: DialectPolicy,
    decoder: FrameDecoder,
    access: Access,
    /// The first bytes have come.
    begun: bool,
    told: Reported,
}

/// The changes of the device's digital lines that this connection has received: a count per kind.
#[derive(Clone, Copy, Debug, Default)]
struct Reported {
    inputs: u32,
    outputs: u32,
    field: u32,
}

impl Session {
    /// A fresh connection.
    pub fn new(policy: DialectPolicy) -> Self {
        let (accept, dialect) = match policy {
            DialectPolicy::Auto => (Accept::Either, Dialect::B),
            DialectPolicy::Strict(dialect) => (Accept::Only(dialect), dialect),
        };
        Self {
            policy,
            decoder: FrameDecoder::new(accept, MAX_PAYLOAD),
            access: Access::new(dialect),
            begun: false,
            told: Reported::default(),
        }
    }

    /// Handles bytes from the host and appends the replies, in order.
    pub fn handle_bytes(&mut self, device: &mut Device, now: SimTime, bytes: &[u8], out: &mut Vec<Reply>) {
        self.handle_bytes_with(device, now, bytes, out, &mut |_, _, _| {});
    }

    /// The same; `amend` sees the device after each request, the request and the reply, and may replace the reply.
    pub fn handle_bytes_with(
        &mut self,
        device: &mut Device,
        now: SimTime,
        bytes: &[u8],
        out: &mut Vec<Reply>,
        amend: &mut dyn FnMut(&Device, &Frame<'_>, &mut Reply),
    ) {
        if !core::mem::replace(&mut self.begun, true) {
            self.begin(device);
        }
        // While the device starts up, connections are accepted and not read.
        if device.is_silent(now) {
            return;
        }
        self.decoder.push(bytes);
        while !self.access.closing {
            let Self { decoder, access, .. } = self;
            let Some(frame) = decoder.next_frame() else { break };
            access.dialect = frame.dialect;
            access.delay = device.takes(device.model.times.reply);
            let subscribed = access.subscriptions;
            let reply = reply(&frame, &mut Context { device, access, now });
            let after = self.access.closing.then_some(AfterReply::Close);
            let mut reply = Reply { bytes: reply, delay: self.access.delay, after };
            amend(device, &frame, &mut reply);
            out.push(reply);
            self.begin_subscriptions(device, subscribed);
            self.settle_dialect();
        }
        self.poll_events(device, now, out);
    }

    /// Appends the pending events of this connection's subscriptions: inputs, outputs, fields. Scans are not among them, see
    /// [`Device::measure`]. To be called after [`Device::changes`] has changed.
    pub fn poll_events(&mut self, device: &mut Device, now: SimTime, out: &mut Vec<Reply>) {
        let Self { access, told, .. } = self;
        let changes = device.lines.changes;
        for (event, told, count) in [
            (DeviceEvent::InputState, &mut told.inputs, changes.inputs.count),
            (DeviceEvent::OutputState, &mut told.outputs, changes.outputs.count),
            (DeviceEvent::FieldResult, &mut told.field, changes.field.count),
        ] {
            if device.recorded.is_some()
                || !access.subscriptions.has(event)
                || core::mem::replace(told, count) == count
            {
                continue;
            }
            let mut payload = Vec::new();
            write_event(event, &Context { device, access, now }, &mut payload);
            let mut bytes = Vec::new();
            encode(access.dialect, &payload, &mut bytes);
            out.push(Reply { bytes, delay: Duration::ZERO, after: None });
        }
    }

    /// Changes before the subscription are not sent; except those of the outputs, on models that do so.
    fn begin_subscriptions(&mut self, device: &Device, before: Subscriptions) {
        let changes = device.lines.changes;
        let now = self.access.subscriptions;
        let began = |event: DeviceEvent| now.has(event) && !before.has(event);
        if began(DeviceEvent::InputState) {
            self.told.inputs = changes.inputs.count;
        }
        if began(DeviceEvent::OutputState) {
            let owed = u32::from(device.model.lines.outputs_told_at_once);
            self.told.outputs = changes.outputs.count.wrapping_sub(owed);
        }
        if began(DeviceEvent::FieldResult) {
            self.told.field = changes.field.count;
        }
    }

    /// Subscribed to LMDscandata.
    pub fn subscribed(&self) -> bool {
        self.access.subscriptions.has(DeviceEvent::ScanData)
    }

    /// All it has subscribed to.
    pub fn subscriptions(&self) -> Subscriptions {
        self.access.subscriptions
    }

    /// The dialect to encode events in.
    pub fn dialect(&self) -> Dialect {
        self.access.dialect
    }

    /// What was received.
    pub fn counts(&self) -> FrameCounts {
        self.decoder.counts()
    }

    fn begin(&mut self, device: &Device) {
        if let (DialectPolicy::Strict(_), Some(dialect)) = (self.policy, device.host_dialect) {
            self.access.dialect = dialect;
            self.decoder.accept_only(dialect);
        }
    }

    /// Before the next frame: a connection keeps its dialect, unless EIHstCola has changed it.
    fn settle_dialect(&mut self) {
        let current = self.access.dialect;
        match (self.access.next_dialect.take(), self.policy) {
            (Some(next), DialectPolicy::Strict(_)) => {
                self.access.dialect = next;
                self.decoder.accept_only(next);
            }
            // Clients reconnect, or go on in either dialect: the next frame tells.
            (Some(next), DialectPolicy::Auto) if next != current => self.decoder.accept(Accept::Either),
            _ => self.decoder.accept_only(current),
        }
    }
}

fn reply(frame: &Frame<'_>, context: &mut Context<'_>) -> Vec<u8> {
    let mut payload = Vec::new();
    match Telegram::parse(frame.dialect, frame.payload) {
        Ok(telegram) => {
            if !context.device.refuses(&telegram, &mut payload) {
                answer(context, &telegram, &mut payload);
            }
        }
        Err(_) => refuse(frame.dialect, Fault::NoCommand.into(), &mut payload),
    }
    let mut bytes = Vec::new();
    encode(frame.dialect, &payload, &mut bytes);
    bytes
}
