//! A scanner and a CAN bus of one virtual tractor, for a controller of yours. `cargo run --example your_rig --features files`
#![allow(clippy::print_stdout, reason = "an example prints")]

use rowscan_bench::rowscan_emulator::{clock::TimeScale, stage::Stage};
use rowscan_bench::rowscan_protocol::model::AnyModel;
use rowscan_bench::rowscan_scenes::files::load_scene;
use rowscan_bench::{Bench, BenchSpec, BusSpec, Endpoint, ScannerSpec};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stage = Stage::grow(load_scene("spindle", |_| {})?, &|_, _| {})?;
    let mut spec = BenchSpec::new(&stage, TimeScale::Paced(1.0));
    let scanner = ScannerSpec::new(0, AnyModel::named("lms111")?);
    spec.scanners.push(scanner.at(Endpoint::Tcp("127.0.0.1:0".to_owned())));
    spec.buses.push(BusSpec::new("can0", ["socketcand:127.0.0.1:0".parse()?]));
    let mut bench = Bench::open(spec).await?;
    bench.run();
    for place in bench.places() {
        println!("{} is at {} ({})", place.part, place.at, place.kind);
    }
    // Start your controller here; this one only waits for the end, which does not come.
    bench.ended().await?;
    Ok(())
}
