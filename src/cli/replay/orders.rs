//! Orders to a running replay, from standard input.

use tokio::sync::mpsc;

use super::places::Seek;

/// What the user tells a running replay.
pub(super) enum Order {
    Pause(bool),
    Seek(Seek),
    Unknown(String),
}

/// Reads orders on a thread of its own: standard input cannot be waited for otherwise.
pub(super) fn read_orders() -> mpsc::Receiver<Order> {
    let (orders, taken) = mpsc::channel(16);
    std::thread::spawn(move || {
        for line in std::io::stdin().lines().map_while(Result::ok) {
            let order = match line.trim() {
                "" => continue,
                "pause" => Order::Pause(true),
                "play" => Order::Pause(false),
                other => match other.strip_prefix("seek ").map(|place| place.trim().parse()) {
                    Some(Ok(place)) => Order::Seek(place),
                    _ => Order::Unknown(other.to_owned()),
                },
            };
            if orders.blocking_send(order).is_err() {
                return;
            }
        }
    });
    taken
}

/// The next order; never, where none can come. Cancel safe.
pub(super) async fn next_order(orders: &mut Option<mpsc::Receiver<Order>>) -> Order {
    if let Some(taken) = orders {
        if let Some(order) = taken.recv().await {
            return order;
        }
        *orders = None;
    }
    std::future::pending().await
}
