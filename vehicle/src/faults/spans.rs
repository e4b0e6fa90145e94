//! What has a begin and, later, an end, in the order of time.

use rowscan_protocol::time::SimTime;

/// How many begins and ends of a kind are remembered. The oldest are forgotten first; the present never depends on them.
pub(super) const REMEMBERED: usize = 4096;

/// What has a begin and, later, an end.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Span<T> {
    key: u64,
    pub(super) fault: T,
    pub(super) from: SimTime,
    pub(super) to: Option<SimTime>,
}

impl<T> Span<T> {
    pub(super) fn covers(&self, at: SimTime) -> bool {
        self.from <= at && self.to.is_none_or(|to| at < to)
    }
}

/// Spans in the order of their begins.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spans<T>(pub(super) Vec<Span<T>>);

impl<T> Default for Spans<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Spans<T> {
    pub(super) fn begin(&mut self, key: u64, fault: T, at: SimTime) {
        if self.0.len() >= REMEMBERED
            && let Some(over) = self.0.iter().position(|span| span.to.is_some())
        {
            self.0.remove(over);
        }
        self.0.push(Span { key, fault, from: at, to: None });
    }

    /// False if there is none of this key.
    pub(super) fn end(&mut self, key: u64, at: SimTime) -> bool {
        let span = self.0.iter_mut().find(|span| span.key == key && span.to.is_none());
        span.map(|span| span.to = Some(at)).is_some()
    }

    pub(super) fn at(&self, at: SimTime) -> impl Iterator<Item = &Span<T>> {
        self.0.iter().filter(move |span| span.covers(at))
    }
}
