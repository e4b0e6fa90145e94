//! Time that can be stopped.

use std::future::Future;
use std::pin::Pin;

use serde::Serialize;

/// A wait for an event.
pub type Wait = Pin<Box<dyn Future<Output = ()> + Send>>;

/// The way to a place: done once time is there, or has refused.
pub type Seeking = Pin<Box<dyn Future<Output = Result<(), Refused>> + Send>>;

/// Why time does not do what was asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refused(pub String);

/// Time at one moment. What does not apply is left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TimeState {
    /// What drives it: `paced`, `max`, `lockstep`, `granted`.
    pub mode: &'static str,
    /// Simulated time, seconds.
    pub now_s: f64,
    /// Somebody has stopped it.
    pub paused: bool,
    /// Simulated seconds a host second, on a paced clock.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Steps taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    /// Steps granted in all, where they are counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub granted: Option<u64>,
    /// When the drive started, seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_began_s: Option<f64>,
    /// Where a replay stands in recorded time, seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded_s: Option<f64>,
    /// Where the recording begins and ends in that time, seconds, once it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded_span_s: Option<[f64; 2]>,
    /// Where the tractor is along its row, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_m: Option<f64>,
}

/// A clock in others' hands. Every call returns at once.
pub trait Time: Send + Sync {
    /// Time now.
    fn state(&self) -> TimeState;

    /// Stops it, or lets it run on.
    fn pause(&self, paused: bool);

    /// So many simulated seconds a host second.
    ///
    /// # Errors
    /// It is no scale, or this clock has none.
    fn set_scale(&self, scale: f64) -> Result<(), Refused>;

    /// Lets so many steps go, and stops then. The number of the last of them.
    ///
    /// # Errors
    /// This clock has no steps.
    fn step(&self, count: u64) -> Result<u64, Refused>;

    /// Resolves once step `last` is taken.
    fn stepped(&self, last: u64) -> Wait;

    /// Goes to a place, such as `scan:100`.
    ///
    /// # Errors
    /// There is no such place, or this clock only goes on.
    fn seek(&self, place: &str) -> Seeking;
}
