//! Acknowledges the steps of `rowscan emulate --clock lockstep --ack reply:HOST:PORT`; as a program, all of them at once:
//! `cargo run -p rowscan-emulator --example ack -- 127.0.0.1:4000`.

use std::io::{self, BufRead, BufReader, Write};
use std::net::TcpStream;

/// Steps that wait for their acknowledgement.
struct Steps(BufReader<TcpStream>);

impl Steps {
    fn connect(address: &str) -> io::Result<Self> {
        let stream = TcpStream::connect(address)?;
        stream.set_nodelay(true)?;
        Ok(Self(BufReader::new(stream)))
    }

    /// The next step and its simulated time, ns: all of it is out. None once rowscan has ended.
    fn wait(&mut self) -> io::Result<Option<(u64, u64)>> {
        let mut line = String::new();
        self.0.read_line(&mut line)?;
        let mut words = line.split_whitespace().skip(1).map_while(|word| word.parse().ok());
        Ok(words.next().zip(words.next()))
    }

    /// Everything of the step is worked in: the next one comes only after that.
    fn acknowledge(&mut self, number: u64) -> io::Result<()> {
        self.0.get_mut().write_all(format!("ACK {number}\n").as_bytes())
    }
}

fn main() -> io::Result<()> {
    let address = std::env::args().nth(1).ok_or_else(|| io::Error::other("expected HOST:PORT"))?;
    let mut steps = Steps::connect(&address)?;
    while let Some((number, _time_ns)) = steps.wait()? {
        // Here: read what is there on every stream, and work it in.
        steps.acknowledge(number)?;
    }
    Ok(())
}
