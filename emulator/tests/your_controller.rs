//! A test of your controller beside a virtual LMS111.

use rowscan_emulator::rowscan_protocol::model;
use rowscan_emulator::rowscan_scenes::files::load_scene;
use rowscan_emulator::{Emulator, EmulatorConfig, stage::Stage};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

#[tokio::test]
async fn my_controller_hears_scans() -> Result<(), Box<dyn std::error::Error>> {
    let stage = Stage::grow(load_scene("spindle", |_| {})?, &|_, _| {})?;
    let (device, view) = stage.scanner(0, model::by_name("lms111").ok_or("no such model")?)?;
    let mut scanner = Emulator::start(device, view, EmulatorConfig::default());
    let address = scanner.listen("127.0.0.1:0").await?.address;
    let mut link = TcpStream::connect(address).await?; // your controller connects here
    link.write_all(b"\x02sEN LMDscandata 1\x03").await?;
    let mut heard = [0; 1000];
    link.read_exact(&mut heard).await?;
    assert!(String::from_utf8_lossy(&heard).contains("sSN LMDscandata"));
    Ok(())
}
