//! The scanner's side, without I/O: one [`Device`] (mirror, counters, settings), many [`Session`]s (dialect, login,
//! subscriptions).
//!
//! The host program turns the mirror: once a turn it hands what was measured to [`Device::measure`], encodes the telegram it gets
//! once a dialect with [`scan_event`] and sends those bytes to every session that is [subscribed](Session::subscribed).
//! Received bytes go to [`Session::handle_bytes`], which gives the replies.

mod access;
mod answer;
mod calendar;
mod change;
mod clock;
pub mod command;
mod condition;
mod context;
mod datagram;
mod eeprom;
mod effect;
mod encoder;
mod event;
mod filter;
mod hidden;
mod known;
mod layers;
mod lifecycle;
mod lines;
mod measure;
mod measured;
mod options;
mod playback;
mod random;
mod recorded;
mod refusal;
mod remote;
mod seen;
mod segment;
mod session;
mod settings;
mod state;
mod switching;
mod ticks;
mod trouble;
mod troubles;
mod turn;
pub mod variable;

pub use command::writable;
pub use datagram::{Datagram, Silent, Stream};
pub use eeprom::SavedSettingsError;
pub use event::{DeviceEvent, Subscriptions};
pub use measure::{monitor_event, scan_event};
pub use measured::{MeasuredEcho, MeasuredLine};
pub use options::{EncoderSpeed, Options, Profile, Start};
pub use playback::EchoOfTurns;
pub use refusal::{Evidence, Fault, REFUSALS, Refusal};
pub use remote::Action;
pub use session::{AfterReply, DialectPolicy, Reply, Session};
pub use state::{Device, Identity, Mirror, ModeError};
pub use switching::{DigitalLineError, FieldError};
pub use troubles::{LeftBehind, Part, RefusedWith, RestTrouble, Trouble};
