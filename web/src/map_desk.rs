//! A map that is drawn when a browser asks for it: one drawing for all of them, and never two at once.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use rowscan_ports::clock::Stopwatch;
use tokio::sync::Mutex;

/// A drawing serves so long.
const FRESH: Duration = Duration::from_secs(2);

/// Draws a map of what was done so far, as SVG; none while there is nothing to draw. It may take a second.
type Draw = dyn Fn() -> Option<String> + Send + Sync;

/// The last drawing, and since when it is there.
type Drawn = Option<(Stopwatch, Option<String>)>;

/// Where a map is drawn.
#[derive(Clone)]
pub(crate) struct MapDesk {
    draw: Arc<Draw>,
    drawn: Arc<Mutex<Drawn>>,
}

impl MapDesk {
    pub(crate) fn new(draw: impl Fn() -> Option<String> + Send + Sync + 'static) -> Self {
        Self { draw: Arc::new(draw), drawn: Arc::default() }
    }

    /// The map of now, or of a moment ago.
    pub(crate) async fn svg(&self) -> Option<String> {
        let mut drawn = self.drawn.lock().await;
        if let Some((_, svg)) = drawn.as_ref().filter(|(since, _)| since.elapsed() < FRESH) {
            return svg.clone();
        }
        let draw = Arc::clone(&self.draw);
        let svg = tokio::task::spawn_blocking(move || draw()).await.ok().flatten();
        *drawn = Some((Stopwatch::start(), svg.clone()));
        svg
    }
}

impl fmt::Debug for MapDesk {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("MapDesk")
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[tokio::test]
    async fn browsers_that_ask_at_once_share_one_drawing() {
        let count = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&count);
        let desk = MapDesk::new(move || Some(format!("map {}", counted.fetch_add(1, Ordering::Relaxed))));
        let found = tokio::join!(desk.svg(), desk.svg(), desk.svg());
        let first = Some("map 0".to_owned());
        assert_eq!(found, (first.clone(), first.clone(), first));
        assert_eq!(count.load(Ordering::Relaxed), 1);
    }
}
