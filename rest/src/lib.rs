//! The REST interface of scanners with Compact output, as SICK's clients use it: `GET` without login, `POST` with a challenge, variables and methods.
//!
//! [`Rest`] is the interface without I/O: a [`Request`] and the device in, an [`Answer`] out. [`Server`] serves it over HTTP, bounded. Variables are rows
//! of [`rowscan_protocol::device::variable::VARIABLES`], which CoLa is served by, too.

mod answer;
mod json;
mod login;
mod method;
mod rest;
mod schema;
mod server;
mod sha256;

pub use answer::{Answer, Status};
pub use login::{LOCKED_FOR, Login, MAX_CHALLENGES, MAX_FAILURES, PASSWORD, REALM, USERS, response};
pub use rest::{Request, Rest, Verb};
pub use schema::NOT_MODELLED;
pub use server::{Kept, RestError, Scanner, Server};
