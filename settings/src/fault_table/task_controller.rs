//! Faults between a task controller and its client on ISOBUS.

/// A fault between a task controller and its client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskControllerFault {
    /// The two do not hear each other any more.
    Lost,
    /// The task controller says that it is busy; it answers and commands nothing.
    Busy,
    /// Object pools are refused: an activation is answered with these bits.
    PoolRefused(u8),
    /// The client's status is not told any more; all else is.
    Silent,
}
