//! Serial ports of this machine.

use std::io;
use std::path::Path;

use rowscan_protocol::lms2xx::Rate;
pub(super) use tokio_serial::SerialStream;
use tokio_serial::{DataBits, FlowControl, Parity, SerialPort, SerialPortBuilderExt, StopBits};

/// Opens a port: 8 data bits, no parity, one stop bit.
pub(super) fn open(path: &Path) -> io::Result<SerialStream> {
    let port = tokio_serial::new(path.to_string_lossy(), Rate::default().bits_per_second())
        .data_bits(DataBits::Eight)
        .parity(Parity::None)
        .stop_bits(StopBits::One)
        .flow_control(FlowControl::None)
        .open_native_async()?;
    Ok(port)
}

pub(super) fn set_rate(port: &mut SerialStream, rate: Rate) -> io::Result<()> {
    Ok(port.set_baud_rate(rate.bits_per_second())?)
}
