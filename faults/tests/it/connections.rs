//! Faults of connections, on real sockets. The control begins and ends them, so no test waits for time.

use std::io::ErrorKind;
use std::net::SocketAddr;
use std::sync::Arc;

use rowscan_faults::{FaultControl, FaultEvents, HostClock, Language, Medium, What, read};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpSocket, TcpStream};

/// A device that echoes, behind faults.
async fn echo() -> (FaultControl, FaultEvents, String) {
    let (control, events) = FaultControl::new(1, Arc::new(HostClock::start()), None);
    let faults = control.stream("left", Medium::Tcp, Language::Cola);
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let mut listener = faults.guard(listener).expect("bound");
    let address = listener_address(&listener);
    tokio::spawn(async move {
        while let Ok((stream, _)) = listener.accept().await {
            let stream = faults.wrap(stream, rowscan_faults::reset_on_drop);
            tokio::spawn(async move {
                let (mut reader, mut writer) = tokio::io::split(stream);
                let _ = tokio::io::copy(&mut reader, &mut writer).await;
                let _ = writer.shutdown().await;
            });
        }
    });
    (control, events, address)
}

fn listener_address(listener: &rowscan_faults::GatedListener) -> String {
    listener.address().to_string()
}

fn add(control: &FaultControl, text: &str) {
    control.add_all(read(&format!("[[fault]]\n{text}\n")).expect("sound")).expect("fits");
}

async fn ask(stream: &mut TcpStream) -> std::io::Result<usize> {
    stream.write_all(b"hello").await?;
    let mut got = [0; 5];
    stream.read(&mut got).await
}

/// Waits until faults have acted so often.
async fn acts(events: &mut FaultEvents, mut left: u32) {
    while left > 0 {
        let event = events.next().await.expect("the control is there");
        left -= u32::from(event.what == What::Act);
    }
}

/// Connects until it is served.
async fn served(address: &str) -> TcpStream {
    loop {
        if let Ok(mut stream) = TcpStream::connect(address).await
            && ask(&mut stream).await.is_ok_and(|read| read == 5)
        {
            return stream;
        }
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn a_reset_is_a_reset_and_a_finish_is_an_end() {
    for (fault, ends) in [("rst", Err(ErrorKind::ConnectionReset)), ("fin", Ok(0)), ("half_close", Ok(0))] {
        let (control, mut events, address) = echo().await;
        let mut stream = served(&address).await;
        add(&control, &format!("name = \"{fault}\""));
        let mut got = [0; 5];
        assert_eq!(stream.read(&mut got).await.map_err(|cause| cause.kind()), ends, "{fault}");
        let told: Vec<What> = std::iter::from_fn(|| events.take()).map(|event| event.what).collect();
        assert_eq!(told, [What::Begin, What::Act, What::End], "{fault}");
        // The next connection is none of its business.
        served(&address).await;
    }
}

/// A cut that meets no connection has cut nothing, and says so.
#[tokio::test]
async fn a_cut_without_a_connection_has_acted_on_nothing() {
    for fault in ["rst", "fin", "half_close"] {
        let (control, mut events, address) = echo().await;
        add(&control, &format!("name = \"{fault}\""));
        let told: Vec<_> =
            std::iter::from_fn(|| events.take()).map(|event| (event.what, event.acts)).collect();
        let begun_and_over = [(What::Begin, None), (What::Skipped, None), (What::End, Some(0))];
        assert_eq!(told, begun_and_over, "{fault}");
        served(&address).await;
    }
}

#[tokio::test]
async fn nobody_listens_while_connections_are_refused() {
    let (control, _events, address) = echo().await;
    let mut before = served(&address).await;
    add(&control, "name = \"refuse\"");
    loop {
        match TcpStream::connect(&address).await {
            Err(cause) if cause.kind() == ErrorKind::ConnectionRefused => break,
            _ => tokio::task::yield_now().await,
        }
    }
    assert_eq!(ask(&mut before).await.expect("what stands goes on"), 5);
    control.reset();
    served(&address).await;
}

/// Who asked for any port was given it, and then nobody could listen again.
#[tokio::test]
async fn a_port_that_is_refused_is_nobody_elses_meanwhile() {
    let (control, _events, address) = echo().await;
    let port: SocketAddr = address.parse().expect("an address");
    let bind = || TcpSocket::new_v4().and_then(|socket| socket.bind(port)).map_err(|cause| cause.kind());
    add(&control, "name = \"refuse\"");
    // No connection has the port: the listener alone had it.
    tokio::task::yield_now().await;
    for _ in 0..100 {
        assert_eq!(bind(), Err(ErrorKind::AddrInUse));
        tokio::task::yield_now().await;
    }
    let refused = TcpStream::connect(&address).await.map_err(|cause| cause.kind());
    assert_eq!(refused.map(drop), Err(ErrorKind::ConnectionRefused));
    control.reset();
    served(&address).await;
}

#[tokio::test]
async fn so_many_attempts_are_refused() {
    let (control, mut events, address) = echo().await;
    add(&control, "name = \"refuse\"\ncount = 3");
    for _ in 0..3 {
        let mut stream = TcpStream::connect(&address).await.expect("taken first");
        let ended = ask(&mut stream).await.expect_err("reset").kind();
        assert!(matches!(ended, ErrorKind::ConnectionReset | ErrorKind::BrokenPipe), "{ended:?}");
    }
    served(&address).await;
    let acts = std::iter::from_fn(|| events.take()).filter(|event| event.what == What::Act).count();
    assert_eq!(acts, 3);
}

#[tokio::test]
async fn who_is_taken_and_closed_reads_an_end() {
    let (control, _events, address) = echo().await;
    add(&control, "name = \"accept_close\"\ncount = 1");
    let mut stream = TcpStream::connect(&address).await.expect("taken");
    assert_eq!(stream.read(&mut [0; 5]).await.expect("in order"), 0);
    served(&address).await;
}

#[tokio::test]
async fn who_is_taken_in_silence_is_never_answered() {
    let (control, mut events, address) = echo().await;
    add(&control, "name = \"accept_silent\"\ncount = 1");
    let mut silent = TcpStream::connect(&address).await.expect("taken");
    silent.write_all(b"hello").await.expect("it is read");
    acts(&mut events, 1).await;
    control.reset();
    served(&address).await;
    let read = silent.try_read(&mut [0; 5]).expect_err("nothing came").kind();
    assert_eq!(read, ErrorKind::WouldBlock);
}

#[tokio::test]
async fn a_half_open_connection_never_comes_back_and_is_reset_when_it_speaks() {
    let (control, mut events, address) = echo().await;
    let mut old = served(&address).await;
    add(&control, "name = \"half_open\"");
    old.write_all(b"hello").await.expect("the cable is out, and the system does not know");
    let mut meanwhile = TcpStream::connect(&address).await.expect("the system completes the handshake");
    meanwhile.write_all(b"hello").await.expect("as above");
    acts(&mut events, 2).await;
    control.reset();
    served(&address).await;
    for stream in [&mut old, &mut meanwhile] {
        // What was sent meanwhile may be read only now, and then resets it; else what is sent now does.
        let ended = match stream.write_all(b"again").await {
            Ok(()) => stream.read(&mut [0; 5]).await.map_err(|cause| cause.kind()),
            Err(cause) => Err(cause.kind()),
        };
        assert!(matches!(ended, Err(ErrorKind::ConnectionReset | ErrorKind::BrokenPipe)), "{ended:?}");
    }
}

/// The rule: a relay ends as its device ended. A reset is none that a driver could take for an orderly close.
#[tokio::test]
async fn a_reset_by_the_device_reaches_the_client_and_an_orderly_close_stays_one() {
    for resets in [true, false] {
        let (control, _events) = FaultControl::new(1, Arc::new(HostClock::start()), None);
        let faults = control.stream("left", Medium::Tcp, Language::Cola);
        let [device, front] = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0"));
        let (device, front) = (device.await.expect("a free port"), front.await.expect("a free port"));
        let to_device = device.local_addr().expect("bound");
        let mut client = TcpStream::connect(front.local_addr().expect("bound")).await.expect("it listens");
        let (from_client, _) = front.accept().await.expect("it comes");
        let mut dialled = TcpStream::connect(to_device).await.expect("it listens");
        let (mut sender, _) = device.accept().await.expect("it comes");
        let mut wrapped = faults.wrap(from_client, rowscan_faults::reset_on_drop);
        let relaying = tokio::spawn(async move { rowscan_faults::relay(&mut wrapped, &mut dialled).await });
        sender.write_all(b"scans").await.expect("open");
        let mut got = [0; 5];
        client.read_exact(&mut got).await.expect("open");
        assert_eq!(&got, b"scans");
        if resets {
            rowscan_faults::reset_on_drop(&sender);
        } else {
            client.shutdown().await.expect("open");
        }
        drop(sender);
        let end = client.read(&mut got).await.map_err(|cause| cause.kind());
        let expected = if resets { Err(ErrorKind::ConnectionReset) } else { Ok(0) };
        assert_eq!(end, expected);
        assert_eq!(relaying.await.expect("no panic").is_err(), resets);
    }
}
