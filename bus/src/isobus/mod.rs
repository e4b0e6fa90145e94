//! ISOBUS above the address claim: the transport protocol, and both ends of a task controller (ISO 11783-10).
//!
//! Everything is a state machine without I/O and without a clock: frames and simulated time are handed in, frames come out. The standard's text was not
//! at hand. What is here was read in AgIsoStack++ (Open-Agriculture/AgIsoStack-plus-plus, MIT): the comments name its file and function. What was not found
//! there is said to be assumed.

pub mod client;
pub mod ddi;
pub mod implement;
pub mod pool;
pub mod process_data;
pub mod role;
pub mod server;
pub mod transport;
pub mod trouble;
