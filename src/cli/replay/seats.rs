//! Which stream goes where: every place of the command line gets the stream it names, or the next one that fits.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::{Path, PathBuf};

use rowscan_bench::Endpoint;
use rowscan_bench::replay::{DatagramPlaces, StreamPlaces, StreamSpec};
use rowscan_recording::StreamKind;

use super::super::Failure;
use super::super::endpoint::DEFAULT_ENDPOINTS;
use super::super::named::Named;
use rowscan_bus::BusAddress;
use rowscan_bus::nmea::NmeaAddress;
use rowscan_emulator::replay::{Part, ReplayError, Survey};

/// Where REST is served where nothing else is asked for.
const DEFAULT_REST: &str = "127.0.0.1:8080";

/// Places for streams.
#[derive(Debug, clap::Args)]
pub(super) struct PlaceArgs {
    /// Listen on this address; repeatable; port 0 takes a free one. `NAME=` before it says which stream it is for, else they are given out in the
    /// order of the scanners [default: 127.0.0.1:2111 and 127.0.0.1:2112]
    #[arg(long, value_name = "[NAME=]ADDR")]
    tcp: Vec<Named<String>>,
    /// Be a serial port of this name; repeatable, given out behind those of --tcp
    #[arg(long, value_name = "[NAME=]LINK")]
    pty: Vec<Named<PathBuf>>,
    /// Where a recorded GNSS receiver goes out; repeatable: tcp:ADDR, udp:ADDR, pty:LINK
    #[arg(long, value_name = "[NAME=]PLACE")]
    nmea: Vec<Named<NmeaAddress>>,
    /// A port of a recorded CAN bus; repeatable: slcan:LINK, socketcan:can0, socketcand:ADDR, socketcand-client:HOST:PORT/BUS, lines:LINK, lines-tcp:ADDR, agopengps:ADDR, udp-aog:ADDR, udp-aog-listen:ADDR, udp:GROUP:PORT, candump:FILE
    #[arg(long, value_name = "[NAME=]PORT")]
    can: Vec<Named<BusAddress>>,
    /// Serve the REST interface of a recorded picoScan here; repeatable; port 0 takes a free one. Its datagrams go where a client directs them [default where
    /// only datagrams are recorded: 127.0.0.1:8080]
    #[arg(long, value_name = "[NAME=]ADDR")]
    rest: Vec<Named<String>>,
    /// Send a picoScan's recorded scans to this address at once, and IMU and encoder telegrams to its ports 7503 and 7504; repeatable
    #[arg(long, value_name = "[NAME=]ADDR")]
    udp: Vec<Named<SocketAddrV4>>,
    /// Let clients direct datagrams to this address as well, not to loopback alone; repeatable
    #[arg(long, value_name = "ADDRESS")]
    allow_destination: Vec<Ipv4Addr>,
    /// Which scanners to be; repeatable [default: the first ones with scans, as many as there are places without a name]
    #[arg(long, value_name = "NAME")]
    stream: Vec<String>,
}

/// One place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place<'a> {
    Tcp(&'a str),
    Pty(&'a Path),
    Nmea(&'a NmeaAddress),
    Can(&'a BusAddress),
    Rest(&'a str),
    Udp(SocketAddrV4),
}

/// What a place is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    /// Any stream's bytes; a scanner answers there.
    Line,
    Nmea,
    Can,
    /// A picoScan's telegrams.
    Datagrams,
}

/// One stream with its places, all of one sort.
#[derive(Debug)]
pub(super) struct Seat<'a> {
    pub(super) part: &'a Part,
    pub(super) sort: Sort,
    pub(super) places: Vec<Place<'a>>,
    /// Where datagrams may go besides loopback.
    allowed: &'a [Ipv4Addr],
}

impl<'a> Seat<'a> {
    /// The same as a bench has it.
    pub(super) fn spec(&self) -> StreamSpec<'a> {
        let places = self.places.iter();
        let places = match self.sort {
            Sort::Line => StreamPlaces::Lines(places.filter_map(|place| place.endpoint()).collect()),
            Sort::Nmea => StreamPlaces::Nmea(
                places
                    .filter_map(|place| if let Place::Nmea(at) = place { Some((*at).clone()) } else { None })
                    .collect(),
            ),
            Sort::Can => StreamPlaces::Can(
                places
                    .filter_map(|place| if let Place::Can(at) = place { Some((*at).clone()) } else { None })
                    .collect(),
            ),
            Sort::Datagrams => StreamPlaces::Datagrams(self.datagrams()),
        };
        StreamSpec { part: self.part, places }
    }
}

impl Seat<'_> {
    fn datagrams(&self) -> DatagramPlaces {
        let mut places = DatagramPlaces {
            allowed: self.allowed.iter().copied().map(Into::into).collect(),
            ..DatagramPlaces::default()
        };
        for place in &self.places {
            match place {
                Place::Rest(address) => places.rest.push((*address).to_owned()),
                Place::Udp(to) => places.udp = Some(*to),
                _ => {}
            }
        }
        places
    }
}

impl Place<'_> {
    fn endpoint(&self) -> Option<Endpoint> {
        match self {
            Self::Tcp(address) => Some(Endpoint::Tcp((*address).to_owned())),
            Self::Pty(link) => Some(Endpoint::Pty(link.to_path_buf())),
            Self::Nmea(_) | Self::Can(_) | Self::Rest(_) | Self::Udp(_) => None,
        }
    }

    fn sort(&self) -> Sort {
        match self {
            Self::Tcp(_) | Self::Pty(_) => Sort::Line,
            Self::Nmea(_) => Sort::Nmea,
            Self::Can(_) => Sort::Can,
            Self::Rest(_) | Self::Udp(_) => Sort::Datagrams,
        }
    }
}

impl Sort {
    fn flag(self) -> &'static str {
        match self {
            Self::Line => "--tcp",
            Self::Nmea => "--nmea",
            Self::Can => "--can",
            Self::Datagrams => "--rest",
        }
    }

    /// What a stream of `kind` goes out on.
    pub(super) fn of(kind: StreamKind) -> Self {
        match kind {
            StreamKind::Nmea => Self::Nmea,
            StreamKind::Can => Self::Can,
            StreamKind::Compact => Self::Datagrams,
            StreamKind::Cola | StreamKind::Lms2xx | StreamKind::Bytes => Self::Line,
        }
    }

    /// The flag that plays a stream of `kind`.
    pub(super) fn flag_for(kind: StreamKind) -> &'static str {
        Self::of(kind).flag()
    }

    fn takes(self, kind: StreamKind) -> bool {
        self == Self::Line || self == Self::of(kind)
    }
}

impl PlaceArgs {
    fn places(&self) -> Vec<(Option<&str>, Place<'_>)> {
        fn with<'a, T>(
            named: &'a [Named<T>],
            place: fn(&'a T) -> Place<'a>,
        ) -> Vec<(Option<&'a str>, Place<'a>)> {
            named.iter().map(|named| (named.name.as_deref(), place(&named.it))).collect()
        }
        let places = [
            with(&self.tcp, |address| Place::Tcp(address)),
            with(&self.pty, |link| Place::Pty(link)),
            with(&self.nmea, Place::Nmea),
            with(&self.can, Place::Can),
            with(&self.rest, |address| Place::Rest(address)),
            with(&self.udp, |to| Place::Udp(*to)),
        ];
        places.concat()
    }

    /// The streams that are asked for by name.
    pub(super) fn names(&self) -> Vec<&str> {
        let of_places = self.places().into_iter().filter_map(|(name, _)| name);
        self.stream.iter().map(String::as_str).chain(of_places).collect()
    }

    /// Every place with its stream, in the order of the recording's streams.
    pub(super) fn seats<'a>(&'a self, survey: &'a Survey) -> Result<Vec<Seat<'a>>, Failure> {
        let mut places = self.places();
        let lines = places.iter().any(|(_, place)| place.sort() == Sort::Line);
        let scanner =
            survey.parts.iter().any(|part| Sort::of(part.kind) == Sort::Line && part.begins_ns.is_some());
        let sends = |part: &Part| part.kind == StreamKind::Compact && part.begins_ns.is_some();
        if places.is_empty() && !scanner && self.stream.is_empty() && survey.parts.iter().any(sends) {
            places.push((None, Place::Rest(DEFAULT_REST)));
        }
        // A stream that is asked for goes out on the places that were given for its sort, if any were.
        let has_place = |part: &&Part| places.iter().any(|(_, place)| place.sort() == Sort::of(part.kind));
        let wants_line = match self.stream.is_empty() {
            true => scanner || places.is_empty(),
            false => !survey.choose(&self.stream, self.stream.len())?.iter().all(has_place),
        };
        if !lines && wants_line {
            places.extend(DEFAULT_ENDPOINTS.map(|address| (None, Place::Tcp(address))));
        }
        let mut seats: Vec<Seat<'a>> = Vec::new();
        for (name, place) in &places {
            if let Some(name) = name {
                let part = survey.choose(&[(*name).to_owned()], 1)?.remove(0);
                seat(&mut seats, part, *place)?;
            }
        }
        // Both of a picoScan's places are given out by themselves: it has one of each.
        let is_udp = |place: &Place<'_>| matches!(place, Place::Udp(_));
        for (sort, udp) in [
            (Sort::Line, false),
            (Sort::Nmea, false),
            (Sort::Can, false),
            (Sort::Datagrams, false),
            (Sort::Datagrams, true),
        ] {
            let unnamed: Vec<Place<'a>> = places
                .iter()
                .filter(|(name, place)| name.is_none() && place.sort() == sort && is_udp(place) == udp)
                .map(|(_, place)| *place)
                .collect();
            let parts = self.parts(survey, sort, &seats, if lines { unnamed.len() } else { 1 })?;
            for (number, place) in unnamed.into_iter().enumerate() {
                // Places beyond the streams go to the last one: a scanner has several ports.
                let part = parts.get(number).or(parts.last()).ok_or_else(|| unfit(survey, sort))?;
                seat(&mut seats, part, place)?;
            }
        }
        seats.iter_mut().for_each(|seat| seat.allowed = &self.allow_destination);
        seats.sort_by_key(|seat| seat.part.stream);
        Ok(seats)
    }

    /// The streams for places of a sort that name none: those without a seat so far.
    fn parts<'a>(
        &self,
        survey: &'a Survey,
        sort: Sort,
        seats: &[Seat<'_>],
        count: usize,
    ) -> Result<Vec<&'a Part>, ReplayError> {
        let free = |part: &&Part| seats.iter().all(|seat| seat.part.stream != part.stream);
        if sort == Sort::Line {
            let chosen = match self.stream.is_empty() {
                true => survey.scanners(),
                false => survey.choose(&self.stream, self.stream.len())?,
            };
            let count = count.max(self.stream.len());
            return Ok(chosen.into_iter().filter(free).take(count).collect());
        }
        let fits = |part: &&Part| Sort::of(part.kind) == sort && part.begins_ns.is_some();
        let free = |part: &&Part| sort == Sort::Datagrams || free(part);
        Ok(survey.parts.iter().filter(fits).filter(free).collect())
    }
}

/// No stream goes out on places of this sort: there is nothing to play, or it wants places of another sort.
fn unfit(survey: &Survey, sort: Sort) -> Failure {
    match survey.parts.iter().find(|part| part.begins_ns.is_some() && Sort::of(part.kind) != sort) {
        Some(part) => carries_not(part, sort),
        None => survey.nothing().into(),
    }
}

/// A stream that places of this sort do not carry.
fn carries_not(part: &Part, sort: Sort) -> Failure {
    Failure::Usage(format!(
        "stream `{}` is {}, which {} cannot carry; expected {} for it",
        part.name,
        part.kind,
        sort.flag(),
        Sort::flag_for(part.kind)
    ))
}

/// Gives `part` one more place.
fn seat<'a>(seats: &mut Vec<Seat<'a>>, part: &'a Part, place: Place<'a>) -> Result<(), Failure> {
    let sort = place.sort();
    if !sort.takes(part.kind) {
        return Err(carries_not(part, sort));
    }
    match seats.iter_mut().find(|seat| seat.part.stream == part.stream) {
        Some(seat) if seat.sort != sort => Err(Failure::Usage(format!(
            "stream `{}` cannot go out on {} and {} at once: choose one",
            part.name,
            seat.sort.flag(),
            sort.flag()
        ))),
        Some(seat) => {
            seat.places.push(place);
            Ok(())
        }
        None => {
            seats.push(Seat { part, sort, places: vec![place], allowed: &[] });
            Ok(())
        }
    }
}
