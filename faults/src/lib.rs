//! Faults of a byte path, for a test bench: telegrams cut, late, lost, doubled or damaged; connections that end badly or never answer.
//!
//! One middleware, [`FaultyStream`], stands between a host (an emulated scanner, a proxy before a real one) and its client. It knows bytes
//! and the boundaries of telegrams, and no device knows about it. While no fault is active it is byte-transparent.
//!
//! | part | is |
//! |---|---|
//! | [`FAULTS`] | the table: every fault with its parameters |
//! | [`FaultSpec`], [`read`] | one fault as it is written in TOML or JSON |
//! | [`FaultControl`] | the plan that all streams share: list, add, remove, reset |
//! | [`StreamFaults`] | one stream's part of it: wraps connections, guards its listener |
//! | [`Part`] | what else faults act on: a device, a drive, a bus; their owners act, this crate says when |
//! | [`FaultEvent`] | begin, act and end of a fault, for the host to log |
//!
//! Randomness is keyed by (seed, fault, stream, event number). Time comes from a [`Clock`].
//!
//! ```
//! # #[tokio::main(flavor = "current_thread", start_paused = true)]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use std::sync::Arc;
//! use rowscan_faults::{FaultControl, HostClock, Language, Medium, read};
//! use tokio::io::{AsyncReadExt, AsyncWriteExt};
//!
//! let (control, _events) = FaultControl::new(7, Arc::new(HostClock::start()), None);
//! let left = control.stream("left", Medium::Tcp, Language::Cola);
//! control.add_all(read("[[fault]]\nname = \"drop\"\nat = { scan = 2 }\n")?)?;
//! let (mut client, device) = tokio::io::duplex(1024);
//! let mut device = left.wrap(device, |_| ());
//! for scan in [b"\x02sSN LMDscandata 1\x03", b"\x02sSN LMDscandata 2\x03", b"\x02sSN LMDscandata 3\x03"] {
//!     device.write_all(scan).await?;
//! }
//! drop(device);
//! let mut got = String::new();
//! client.read_to_string(&mut got).await?;
//! assert_eq!(got, "\x02sSN LMDscandata 1\x03\x02sSN LMDscandata 3\x03");
//! # Ok(())
//! # }
//! ```

mod clock;
mod control;
mod event;
mod fault;
mod handle;
mod in_lane;
mod instance;
mod kinds;
mod lane;
mod listener;
mod page;
mod part;
mod plan;
mod relay;
mod spec;
mod stream;
mod telegram;
mod when;

pub use clock::{Clock, HostClock, Wait};
pub use control::{FaultControl, FaultError, FaultStatus, free_id};
pub use event::{Direction, FaultEvent, FaultEvents, What};
pub use fault::{Fault, Layer};
pub use handle::StreamFaults;
pub use kinds::{FAULTS, NOT_HERE};
pub use listener::{GatedListener, reset_on_drop};
pub use page::markdown;
pub use part::{Fit, Order, Part};
pub use plan::{Medium, Row};
pub use relay::relay;
pub use rowscan_settings::fault_table::{Family, Form, Parameter, PartFault};
pub use spec::{COMMON, FaultSpec, read};
pub use stream::FaultyStream;
pub use telegram::Language;
pub use when::{At, Lasts};
