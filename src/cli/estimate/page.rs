//! The page beside an estimate, if one is asked for.

use std::sync::Arc;

use rowscan_driver::Source;
use rowscan_ports::clock::Stopwatch;
use rowscan_recording::Taps;
use rowscan_web::{About, ScannerAbout};

use super::super::web::{Feeds, Talk, Tape};
use super::super::{Failure, service};
use super::Args;

/// What is open of it.
#[derive(Default)]
pub(super) struct Page {
    pub(super) feeds: Option<Feeds>,
    pub(super) taps: Taps,
}

impl Page {
    pub(super) async fn open(args: &Args, scanners: &[usize]) -> Result<Self, Failure> {
        if !args.web.is_given() {
            return Ok(Self::default());
        }
        let watch = Stopwatch::start();
        let (taps, talk) = Talk::listen(Arc::new(move || watch.elapsed().as_secs_f64()));
        let sources: Vec<String> = args.sources.iter().map(Source::to_string).collect();
        let about = About {
            title: format!("rowscan {} {}", if args.paced { "watch" } else { "estimate" }, sources.join(" ")),
            scanners: scanners
                .iter()
                .map(|scanner| ScannerAbout {
                    name: format!("scanner{scanner}"),
                    model: args.model.clone().unwrap_or_default(),
                })
                .collect(),
        };
        let tape = args.paced.then(|| Tape::of(args.files()));
        let feeds =
            Feeds::open(&args.web, about, talk, tape.filter(|_| args.is_recorded()), args.format).await?;
        service::ready();
        Ok(Self { feeds: Some(feeds), taps })
    }
}
