//! What can go wrong with a scanner, its tractor, its bus and its sprayer: one row a fault. A row's parameters are read here, strictly; what a fault does is
//! the business of whoever owns the part.
//!
//! | part | is |
//! |---|---|
//! | [`ROWS`] | the table |
//! | [`Row`] | one fault: its name, family and parameters, in words and as data |
//! | [`PartFault`] | a fault as its part gets it |
//! | [`Settings`] | parameters as they were written, checked against their rows |

pub mod bus;
pub mod clock;
pub mod datagrams;
pub mod device;
mod parameter;
mod part_fault;
mod row;
mod rows;
mod settings;
pub mod sprayer;
pub mod task_controller;
pub mod vehicle;

pub use parameter::{Form, Parameter};
pub use part_fault::PartFault;
pub use row::{Family, Row};
pub use rows::ROWS;
pub use settings::{Settings, read_number, read_text, read_whole};
