//! `--web`: the live page beside a command.

mod feed;
#[cfg_attr(not(feature = "foxglove"), path = "no_foxglove.rs")]
mod foxglove;
mod meter;
mod rig_gauges;
mod scans;
mod talk;
mod tape;
mod watching;

use std::net::SocketAddr;

use rowscan_control::{Bench, Server};
use rowscan_web::{Show, Web};

use self::foxglove::FoxgloveServer;
use super::control::{guard_at, token};
use super::endpoint::announce_stream;
use super::output::say;
use super::{Failure, Format};
use crate::feature::Feature;

pub(super) use feed::{Feed, Feeds};
pub(super) use meter::Meter;
pub(super) use rig_gauges::{GaugeOf, RigGauges, gauge_of};
pub(super) use scans::Scans;
pub(super) use talk::Talk;
pub(super) use tape::Tape;
pub(super) use watching::Watching;

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Page")]
pub(super) struct WebArgs {
    /// Show what happens on a live page at this address; port 0 takes a free one (docs/watch.md)
    #[arg(long, value_name = "ADDR")]
    web: Option<String>,
    /// Ask everyone for this token [default: on loopback none; elsewhere one that is made up and printed]
    #[arg(long, value_name = "TOKEN", requires = "web", value_parser = token)]
    web_token: Option<String>,
    /// Show what happens in Foxglove or Lichtblick, which connect to this address, on loopback; port 0 takes a free one. Its protocol has no token: any program of this machine may connect, as often as it likes
    #[arg(long, value_name = "ADDR", value_parser = address)]
    foxglove: Option<SocketAddr>,
}

/// An address by its number.
fn address(text: &str) -> Result<SocketAddr, String> {
    Feature::Foxglove.needed_by("a server for Foxglove").map_err(|missing| missing.to_string())?;
    text.parse().map_err(|_| format!("expected an address and a port such as 127.0.0.1:8765, found `{text}`"))
}

/// What shows it. Dropped, it is shown no longer.
#[derive(Debug, Default)]
pub(super) struct Opened {
    web: Option<Web>,
    foxglove: Option<FoxgloveServer>,
}

impl Opened {
    /// Shows it no longer: when this returns, its addresses are free.
    pub(super) async fn close(self) {
        if let Some(web) = self.web {
            web.close().await;
        }
        if let Some(foxglove) = self.foxglove {
            foxglove.close().await;
        }
    }

    /// Where it listens.
    pub(super) fn addresses(&self) -> impl Iterator<Item = SocketAddr> {
        let foxglove = self.foxglove.as_ref().map(FoxgloveServer::address);
        self.web.as_ref().map(Web::address).into_iter().chain(foxglove)
    }
}

impl WebArgs {
    /// Whether anyone may look.
    pub(super) fn is_given(&self) -> bool {
        self.web.is_some() || self.foxglove.is_some()
    }

    /// The same, at `address` unless another place is asked for.
    pub(super) fn at_least(self, address: &str) -> Self {
        Self { web: self.web.or_else(|| Some(address.to_owned())), ..self }
    }

    /// The same with the ports that are had now in place of 0: pages that come one after the other are at one place.
    ///
    /// # Errors
    /// An address is not to be had.
    pub(super) async fn settled(self) -> Result<Self, Failure> {
        let mut settled = self;
        if let Some(place) = &mut settled.web {
            *place = Server::vacant(place).await?.to_string();
        }
        Ok(settled)
    }

    /// Opens all that is asked for, for `show`; the page with the routes of `bench` if there is one. Announces where they are.
    pub(super) async fn open(
        &self,
        show: Show,
        bench: Option<Bench>,
        format: Format,
    ) -> Result<Opened, Failure> {
        let foxglove = self.open_foxglove(&show, format).await?;
        Ok(Opened { foxglove, web: self.open_page(show, bench, format).await? })
    }

    async fn open_foxglove(&self, show: &Show, format: Format) -> Result<Option<FoxgloveServer>, Failure> {
        let Some(place) = self.foxglove else { return Ok(None) };
        let server = FoxgloveServer::open(place, show).await?;
        announce_stream(format, None, "foxglove", &server.address())?;
        Ok(Some(server))
    }

    async fn open_page(
        &self,
        show: Show,
        bench: Option<Bench>,
        format: Format,
    ) -> Result<Option<Web>, Failure> {
        let Some(place) = &self.web else { return Ok(None) };
        let mut made_up = None;
        let guard = |address: &SocketAddr| guard_at(address, self.web_token.as_ref(), &mut made_up);
        let web = Web::open(place, show, bench, guard).await?;
        announce_stream(format, None, "web", &web.address())?;
        if let Some(token) = made_up {
            say(format_args!("the page needs the token {token}: http://{}/#token={token}", web.address()));
        } else if matches!(format, Format::Table | Format::Csv) {
            say(format_args!("watch at http://{}/", web.address()));
        }
        Ok(Some(web))
    }
}
