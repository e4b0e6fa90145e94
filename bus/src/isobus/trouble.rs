//! What goes wrong with a task controller or its client, by a fault.

/// What holds now. The same faults act on either role of ours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trouble {
    /// The two do not hear each other any more.
    pub is_lost: bool,
    /// The task controller says that it is busy, and commands nothing.
    pub is_busy: bool,
    /// Pools are refused, with these bits of an activation's answer.
    pub refusal: Option<u8>,
    /// Our status is not told any more; all else is.
    pub is_silent: bool,
}
