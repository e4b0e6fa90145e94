//! Acknowledgements by the participants themselves: a TCP endpoint that says which step has been sent, and is told when it has been worked in.
//!
//! ```text
//! rowscan      STEP 17 340000000     step 17 is out; simulated time is 340 000 000 ns
//! participant  ACK 17                all of it is worked in, and what it said in answer is on its way
//! ```

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_ports::task;
use rowscan_protocol::time::SimTime;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Notify, watch};
use tokio::task::JoinSet;

use super::looked::Looked;

/// Participants at once.
const MOST: usize = 32;
/// The longest line a participant may send.
const LONGEST: u64 = 64;

/// A step that was sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ReplyQuery {
    pub(super) step: u64,
    pub(super) at: SimTime,
}

/// The endpoint with its participants.
#[derive(Debug)]
pub(super) struct Replies {
    address: SocketAddr,
    asked: watch::Sender<ReplyQuery>,
    heard: Arc<Mutex<Vec<Participant>>>,
    _tasks: JoinSet<()>,
}

/// One participant.
#[derive(Clone, Debug)]
pub(super) struct Participant {
    number: u64,
    pub(super) peer: SocketAddr,
    /// The last step it has acknowledged.
    pub(super) acknowledged: u64,
    /// What it said that is no acknowledgement.
    pub(super) nonsense: Option<String>,
}

impl Replies {
    pub(super) async fn listen(address: &str, joined: Arc<Notify>) -> std::io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        let address = listener.local_addr()?;
        let asked = watch::Sender::new(ReplyQuery::default());
        let heard = Arc::<Mutex<Vec<Participant>>>::default();
        let mut tasks = JoinSet::new();
        let table = Table { heard: Arc::clone(&heard), joined };
        tasks.spawn(task(accept(listener, asked.clone(), table)));
        Ok(Self { address, asked, heard, _tasks: tasks })
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Tells everyone that a step is out.
    pub(super) fn ask(&self, asked: ReplyQuery) {
        self.asked.send_replace(asked);
    }

    /// Who takes part, with what they said last.
    pub(super) fn participants(&self) -> Vec<Participant> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Replies {
    /// Whether everyone has acknowledged this step.
    pub(super) fn look(&self, step: u64) -> Looked {
        for Participant { peer, acknowledged, nonsense, .. } in self.participants() {
            if let Some(nonsense) = nonsense {
                return Looked::Missing(format!("{peer} said `{nonsense}`, expected `ACK {step}`"));
            }
            if acknowledged < step {
                return Looked::Missing(format!("{peer} has not sent `ACK {step}`"));
            }
        }
        Looked::Acknowledged
    }
}

/// Where participants take their places.
#[derive(Clone)]
struct Table {
    heard: Arc<Mutex<Vec<Participant>>>,
    /// Notified when one does.
    joined: Arc<Notify>,
}

impl Table {
    fn lock(&self) -> MutexGuard<'_, Vec<Participant>> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

async fn accept(listener: TcpListener, asked: watch::Sender<ReplyQuery>, table: Table) {
    let (mut serving, mut number) = (JoinSet::new(), 0);
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, peer)) if serving.len() < MOST => {
                    number += 1;
                    serving.spawn(task(serve(stream, peer, number, asked.subscribe(), table.clone())));
                }
                Ok(_) => {}
                Err(_) => rowscan_ports::clock::retry_pause().await,
            },
            Some(_) = serving.join_next() => {}
        }
    }
}

/// Serves one participant until it leaves: it drops out of the steps at once.
async fn serve(
    stream: TcpStream,
    peer: SocketAddr,
    number: u64,
    mut asked: watch::Receiver<ReplyQuery>,
    table: Table,
) {
    let change = |change: &dyn Fn(&mut Participant)| {
        table.lock().iter_mut().filter(|participant| participant.number == number).for_each(change);
    };
    let _ = stream.set_nodelay(true);
    let (reader, mut writer) = stream.into_split();
    let mut reader = BufReader::new(reader);
    // Steps before it came are none of its.
    let joined = *asked.borrow_and_update();
    table.lock().push(Participant { number, peer, acknowledged: joined.step, nonsense: None });
    table.joined.notify_one();
    let mut line = Vec::new();
    loop {
        let mut limited = (&mut reader).take(LONGEST);
        tokio::select! {
            changed = asked.changed() => {
                let ReplyQuery { step, at } = *asked.borrow_and_update();
                let text = format!("STEP {step} {}\n", at.0);
                if changed.is_err() || writer.write_all(text.as_bytes()).await.is_err() {
                    break;
                }
            }
            read = limited.read_until(b'\n', &mut line) => {
                if !matches!(read, Ok(1..)) {
                    break;
                }
                let asked = asked.borrow().step;
                let text = String::from_utf8_lossy(&line).trim().to_owned();
                let step = text.strip_prefix("ACK ").and_then(|step| step.parse::<u64>().ok());
                match step {
                    // One that comes again changes nothing.
                    Some(step) if step <= asked => change(&|participant| {
                        participant.acknowledged = participant.acknowledged.max(step);
                    }),
                    _ => change(&|participant| participant.nonsense = Some(text.clone())),
                }
                line.clear();
            }
        }
    }
    table.lock().retain(|participant| participant.number != number);
}
