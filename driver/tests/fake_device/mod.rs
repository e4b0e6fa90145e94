//! A CoLa A device for tests: answers the start-up, each reply after a delay, and streams scans with a running telegram counter.

use std::io;
use std::time::Duration;

use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::telegram::{Channel, Kind, LmdScandata, Variable, encode_frame};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

/// How the device behaves on one connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Behaviour {
    /// Before each reply.
    pub(crate) reply_delay: Duration,
    /// From scan to scan.
    pub(crate) scan_period: Duration,
    /// The connection is closed after so many scans.
    pub(crate) scans: usize,
}

/// Serves one connection until its scans are sent, or the host leaves.
pub(crate) async fn serve(
    mut stream: impl AsyncRead + AsyncWrite + Unpin,
    behaviour: Behaviour,
) -> io::Result<()> {
    let mut decoder = FrameDecoder::new(Accept::Either, 4096);
    let mut subscribed = false;
    while !subscribed {
        let mut chunk = [0; 256];
        let read = stream.read(&mut chunk).await?;
        if read == 0 {
            return Ok(());
        }
        decoder.push(&chunk[..read]);
        let mut replies = Vec::new();
        while let Some(frame) = decoder.next_frame() {
            let request = String::from_utf8_lossy(frame.payload).into_owned();
            subscribed |= request.starts_with("sEN LMDscandata");
            replies.push((frame.dialect, reply(&request)));
        }
        for (dialect, text) in replies {
            tokio::time::sleep(behaviour.reply_delay).await;
            // In a dialect it does not know, a device is silent.
            if dialect == Dialect::A {
                let mut bytes = Vec::new();
                encode(dialect, text.as_bytes(), &mut bytes);
                stream.write_all(&bytes).await?;
            }
        }
    }
    for counter in 0..behaviour.scans {
        tokio::time::sleep(behaviour.scan_period).await;
        stream.write_all(&scan(counter as u16)).await?;
    }
    Ok(())
}

fn reply(request: &str) -> String {
    let mut words = request.split(' ');
    let (kind, name) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    match (kind, name) {
        ("sRN", "DeviceIdent") => "sRA DeviceIdent 6 LMS111 5 V1.80".to_owned(),
        ("sRN", "FirmwareVersion") => "sRA FirmwareVersion 5 V1.80".to_owned(),
        // It has no filters.
        ("sRN", _) => "sFA 3".to_owned(),
        ("sMN", "LMCstartmeas") => "sAN LMCstartmeas 0".to_owned(),
        ("sMN", name) => format!("sAN {name} 1"),
        ("sEN", name) => format!("sEA {name} 1"),
        (_, name) => format!("sWA {name}"),
    }
}

fn scan(counter: u16) -> Vec<u8> {
    let channel = Channel { scale: 1.0, step: 5000, values: vec![1000; 3], ..Channel::default() };
    let scan = LmdScandata {
        version: 1,
        telegram_counter: counter,
        scan_frequency: 5000,
        channels16: vec![Channel { name: rowscan_protocol::telegram::wire::FixedText(*b"DIST1"), ..channel }],
        ..LmdScandata::default()
    };
    let mut bytes = Vec::new();
    encode_frame(Dialect::A, Kind::Sn, LmdScandata::NAME, &scan, &mut bytes);
    bytes
}
