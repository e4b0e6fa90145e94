//! One browser's socket: pictures as bytes, states as text, and for each the browser's word that it has drawn or taken it.

use axum::body::Bytes;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::response::Response;
use futures_util::{SinkExt, StreamExt};
use rowscan_control::Problem;
use tokio::sync::{OwnedSemaphorePermit, watch};
use tokio_tungstenite::tungstenite::Message;

use crate::clock;
use crate::socket::{Socket, upgrade};
use crate::studio::{BROWSERS, Exposure, Studio};

/// The protocol that the page asks for.
const PROTOCOL: &str = "rowscan";
/// Pictures that a browser may have and has not drawn yet, and states that it has not taken. Those that come meanwhile it misses.
const UNANSWERED: u32 = 2;
/// What a browser says when it has drawn a picture, and when it has taken a state.
const DRAWN: &str = "drawn";
const TAKEN: &str = "taken";
/// The longest message of a browser.
const MESSAGE_BYTES: usize = 256;

/// Opens a browser's socket, if there is a place for it.
pub(crate) async fn live(State(studio): State<Studio>, request: Request) -> Result<Response, Problem> {
    let Ok(seat) = studio.seats.try_acquire_owned() else {
        let message = format!("{BROWSERS} browsers look already; close one of them");
        return Err(Problem::new(StatusCode::SERVICE_UNAVAILABLE, message));
    };
    upgrade(request, PROTOCOL, MESSAGE_BYTES, |socket| serve(socket, studio.exposures, seat))
}

/// Shows what comes until the browser goes, or does not take it.
async fn serve(socket: Socket, exposures: watch::Receiver<Exposure>, seat: OwnedSemaphorePermit) {
    let mut browser = Browser { socket, undrawn: 0, untaken: 0, last: Bytes::new(), state_number: 0 };
    browser.follow(exposures).await;
    drop(seat);
}

struct Browser {
    socket: Socket,
    /// Pictures sent that it has not drawn.
    undrawn: u32,
    /// States sent that it has not taken.
    untaken: u32,
    /// The last picture sent.
    last: Bytes,
    state_number: u64,
}

enum Event {
    /// Of the browser; none once it is gone.
    Said(Option<Message>),
    /// There is something new; false if there will not be.
    Exposed(bool),
    /// It has said nothing for long.
    Quiet,
}

impl Browser {
    async fn follow(&mut self, mut exposures: watch::Receiver<Exposure>) {
        let mut is_asked = false;
        // Since the browser's last word: what it is sent says nothing about whether it still listens.
        let mut quiet = Box::pin(clock::quiet());
        loop {
            let event = tokio::select! {
                said = self.socket.next() => Event::Said(said.and_then(Result::ok)),
                changed = exposures.changed() => Event::Exposed(changed.is_ok()),
                () = &mut quiet => Event::Quiet,
            };
            match event {
                Event::Said(Some(Message::Close(_)) | None) | Event::Exposed(false) => return,
                Event::Said(Some(said)) => {
                    is_asked = false;
                    quiet.set(clock::quiet());
                    self.hear(&said);
                }
                Event::Exposed(true) => {}
                // A page in the background draws nothing, and answers all the same.
                Event::Quiet if is_asked => return,
                Event::Quiet => {
                    is_asked = true;
                    quiet.set(clock::quiet());
                    if !self.send(Message::Ping(Bytes::new())).await {
                        return;
                    }
                }
            }
            let exposure = exposures.borrow_and_update().clone();
            if !self.show(exposure).await {
                return;
            }
        }
    }

    fn hear(&mut self, said: &Message) {
        match said {
            Message::Text(text) if text.as_str() == DRAWN => self.undrawn = self.undrawn.saturating_sub(1),
            Message::Text(text) if text.as_str() == TAKEN => self.untaken = self.untaken.saturating_sub(1),
            _ => {}
        }
    }

    /// Sends what is new, as far as it may; false if it is not taken.
    async fn show(&mut self, exposure: Exposure) -> bool {
        let Exposure { picture, state_number, state } = exposure;
        if state_number != self.state_number && self.untaken < UNANSWERED {
            self.state_number = state_number;
            self.untaken += 1;
            if !self.send(Message::Text(state)).await {
                return false;
            }
        }
        // Each is another allocation.
        let is_new = !picture.is_empty() && picture.as_ptr() != self.last.as_ptr();
        if !is_new || self.undrawn >= UNANSWERED {
            return true;
        }
        self.last = picture.clone();
        self.undrawn += 1;
        self.send(Message::Binary(picture)).await
    }

    async fn send(&mut self, message: Message) -> bool {
        matches!(clock::send(self.socket.send(message)).await, Some(Ok(())))
    }
}
