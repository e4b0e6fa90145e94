//! The C library's clocks, sleeps and time-outs on the simulated time of a test bench: a library for `LD_PRELOAD`.
//!
//! It stands in for what programs call and hands on what is none of its business. Without a page ([`rowscan_child_clock::VARIABLE`]), or with one that
//! cannot be used, every call goes to the C library as it is. A wait with a time-out becomes one without, plus a slot in the page; when the bench
//! fires the slot, [`keeper`] ends the wait.
//!
//! Nothing here panics: there is no frame above that could take it.
#![cfg(all(target_os = "linux", target_pointer_width = "64"))]

mod clocks;
mod descriptors;
mod epolls;
mod errno;
mod futexes;
mod instant;
mod keeper;
mod lock;
mod locks;
mod page;
mod polls;
mod process;
mod real;
mod receives;
mod selects;
mod sleeps;
mod sockets;
mod system_call;
mod timer;
mod timers;
