//! A page that shows scanners at work, live: the fan of their beams, the orchard in 3-D with the tractor in it, the strip of the canopy by metre,
//! speeds, counts, telegrams in words; and buttons for time and faults.
//!
//! | part | is |
//! |---|---|
//! | [`Show`] | what is shown: lines are handed in, everything else is asked for |
//! | [`Gauges`] | where tractor and scanners tell how they are |
//! | [`OrchardPicture`] | an orchard as a browser draws it: bytes, made once |
//! | [`Onlooker`] | another program that is told of every scan |
//! | `foxglove` | the same for Foxglove and Lichtblick, with the feature of that name |
//! | [`Web`] | the page at an address, with the routes of a [`Bench`](rowscan_control::Bench) beside it |
//!
//! Nobody who is watched waits for a browser. Lines are kept one a scanner, the newest. A picture is made of them every 40 ms while somebody looks, once for
//! all browsers; a browser has two pictures at most that it has not drawn yet, and misses those that come meanwhile.

mod clock;
#[cfg(feature = "foxglove")]
pub mod foxglove;
mod gauges;
mod line;
mod live;
mod map_desk;
mod onlooker;
mod orchard;
mod page;
mod picture;
mod routes;
mod show;
mod socket;
mod strip;
mod studio;
mod telegram_log;
mod web;

pub use gauges::{FixGauge, Gauges, ScannerGauge, Speeds, TractorGauge};
pub use onlooker::{Onlooker, Seen};
pub use orchard::OrchardPicture;
pub use show::{About, ScannerAbout, Show};
pub use strip::{Metre, Strip, TruthColumn};
pub use studio::BROWSERS;
pub use telegram_log::{Spoken, TelegramLog};
pub use web::Web;
