//! Both ends of a connection in memory: the client's session sets a virtual LMS111 up and reads a scan. Your program moves the bytes:
//! `cargo run -p rowscan-protocol --example session_without_io`

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::time::Duration;

use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::device::{
    Device, DialectPolicy, Identity, MeasuredEcho, MeasuredLine, Session, scan_event,
};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::model;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;

fn main() -> Result<(), Box<dyn Error>> {
    let scan = first_scan(2500)?;
    println!("{} beams from {:.1}°", scan.beams.len(), scan.beams.angle_deg(0));
    println!("straight ahead: {} m", scan.echoes[0].range_m[270]);
    Ok(())
}

/// What a client reads of a mirror turn that meets a surface `range_mm` away in every direction.
pub(crate) fn first_scan(range_mm: u16) -> Result<Scan, Box<dyn Error>> {
    let mut device = Device::new(model::by_name("lms111").ok_or("no such model")?, Identity::default());
    let mut session = Session::new(DialectPolicy::Auto);
    let mut client = ColaClient::new(ColaConfig::default(), Dialect::B);
    let mut now = Duration::ZERO;

    // Requests go over, replies come back, until the client has nothing more to ask.
    while let Some(request) = client.poll_transmit().and_then(Transmit::into_frame) {
        let mut replies = Vec::new();
        session.handle_bytes(&mut device, SimTime::ZERO + now, &request, &mut replies);
        now += Duration::from_millis(2);
        for reply in replies {
            client.handle_bytes(now, &reply.bytes);
        }
        while let Some(event) = client.poll_event() {
            if let HostEvent::Refused { command, fatal: true, .. } = event {
                return Err(format!("{command} was refused").into());
            }
        }
    }

    // One mirror turn.
    let grid = device.mirror().beams;
    let echo = MeasuredEcho { range_mm: vec![range_mm; grid.len()], remission: vec![0; grid.len()] };
    let line = MeasuredLine { grid, echoes: &[echo] };
    let telegram = device.measure(SimTime::ZERO + now, &line).ok_or("it does not measure yet")?;
    let mut bytes = Vec::new();
    scan_event(session.dialect(), telegram, &mut bytes);
    client.handle_bytes(now, &bytes);
    match client.poll_event() {
        Some(HostEvent::Scan) => Ok(client.scan().clone()),
        other => Err(format!("expected a scan, found {other:?}").into()),
    }
}
