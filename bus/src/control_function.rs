//! A control function of the rig that sits on a bus beside the tractor's.

use std::fmt::Debug;

use rowscan_protocol::time::SimTime;

use super::frame::CanFrame;

/// A control function of the rig. No I/O and no clock: simulated time is handed in, and frames come out. Each call appends the frames to send.
pub trait ControlFunction: Debug + Send + Sync {
    /// A bus, or another port of it, opens. The rig's machines have sat on it for long, on whatever clock: a claim of an address stands, and no silence is kept.
    fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>);

    /// When [`ControlFunction::poll`] has something to do.
    fn next(&self) -> Option<SimTime>;

    /// Does what is due.
    fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>);

    /// Another has sent a frame.
    fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>);
}
