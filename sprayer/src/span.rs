//! Stretches of time or way.

use serde::{Deserialize, Serialize};

/// The sum of no numbers is 0; `Iterator::sum` makes it −0.
pub(crate) fn total(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |sum, value| sum + value)
}

/// From one number to another that is not smaller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// Its beginning.
    pub from: f64,
    /// Its end.
    pub to: f64,
}

impl Span {
    /// From `from` to `to`.
    pub fn new(from: f64, to: f64) -> Self {
        Self { from, to }
    }

    /// How long it is; negative where its end comes before its beginning.
    pub fn length(self) -> f64 {
        self.to - self.from
    }

    /// What two have in common; none where that has no length.
    pub fn common(self, other: Self) -> Option<Self> {
        let common = Self { from: self.from.max(other.from), to: self.to.min(other.to) };
        (common.to > common.from).then_some(common)
    }
}

/// Spans in their order, none touching another, each with a length.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Spans(Vec<Span>);

impl Spans {
    /// What any of these covers, given in any order. Those without length are left out.
    pub fn of(spans: impl IntoIterator<Item = Span>) -> Self {
        let mut spans: Vec<Span> = spans.into_iter().filter(|span| span.to > span.from).collect();
        spans.sort_by(|a, b| a.from.total_cmp(&b.from));
        let mut kept: Vec<Span> = Vec::with_capacity(spans.len());
        for span in spans {
            match kept.last_mut() {
                Some(last) if span.from <= last.to => last.to = last.to.max(span.to),
                _ => kept.push(span),
            }
        }
        Self(kept)
    }

    /// The spans, in their order.
    pub fn iter(&self) -> std::slice::Iter<'_, Span> {
        self.0.iter()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True where there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The same with every gap shorter than `gap` covered.
    #[must_use]
    pub fn joined(&self, gap: f64) -> Self {
        let mut kept: Vec<Span> = Vec::with_capacity(self.0.len());
        for span in &self.0 {
            match kept.last_mut() {
                Some(last) if span.from - last.to < gap => last.to = span.to,
                _ => kept.push(*span),
            }
        }
        Self(kept)
    }

    /// What either covers.
    #[must_use]
    pub fn or(&self, other: &Self) -> Self {
        Self::of(self.0.iter().chain(&other.0).copied())
    }

    /// What both cover.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let (mut a, mut b) = (self.0.iter().peekable(), other.0.iter().peekable());
        let mut kept = Vec::new();
        while let (Some(one), Some(two)) = (a.peek(), b.peek()) {
            kept.extend(one.common(**two));
            if one.to < two.to {
                a.next()
            } else {
                b.next()
            };
        }
        Self(kept)
    }

    /// What of `within` is not covered.
    #[must_use]
    pub fn gaps(&self, within: Span) -> Self {
        let mut from = within.from;
        let mut kept = Vec::new();
        for span in &self.0 {
            kept.extend(Span::new(from, span.from).common(within));
            from = from.max(span.to);
        }
        kept.extend(Span::new(from, within.to).common(within));
        Self(kept)
    }

    /// The part within `within`.
    #[must_use]
    pub fn within(&self, within: Span) -> Self {
        Self(self.0.iter().filter_map(|span| span.common(within)).collect())
    }

    /// How long all are together.
    pub fn length(&self) -> f64 {
        total(self.0.iter().map(|span| span.length()))
    }

    /// True if one covers `at`, its beginning included and its end not.
    pub fn has(&self, at: f64) -> bool {
        let after = self.0.partition_point(|span| span.from <= at);
        self.0.get(after.wrapping_sub(1)).is_some_and(|span| at < span.to)
    }
}

impl FromIterator<Span> for Spans {
    fn from_iter<T: IntoIterator<Item = Span>>(spans: T) -> Self {
        Self::of(spans)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any() -> impl Strategy<Value = Spans> {
        prop::collection::vec((0u8..60, 0u8..8), 0..8).prop_map(|all| {
            all.into_iter().map(|(from, long)| Span::new(from.into(), (from + long).into())).collect()
        })
    }

    proptest! {
        #[test]
        fn sets_are_those_of_their_points(a in any(), b in any()) {
            let whole = Span::new(5.0, 50.0);
            for half in 0..140 {
                // Between whole numbers, so that no point is an edge.
                let at = f64::from(half) * 0.5 + 0.25;
                let (in_a, in_b) = (a.has(at), b.has(at));
                prop_assert_eq!(a.or(&b).has(at), in_a || in_b);
                prop_assert_eq!(a.and(&b).has(at), in_a && in_b);
                prop_assert_eq!(a.gaps(whole).has(at), !in_a && (5.0..50.0).contains(&at));
                prop_assert_eq!(a.within(whole).has(at), in_a && (5.0..50.0).contains(&at));
            }
            prop_assert!((a.or(&b).length() + a.and(&b).length() - a.length() - b.length()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_gap_as_long_as_the_limit_stays() {
        let spans = Spans::of([Span::new(0.0, 1.0), Span::new(2.0, 3.0), Span::new(3.5, 4.0)]);
        let joined = spans.joined(1.0);
        assert_eq!(joined.iter().copied().collect::<Vec<_>>(), [Span::new(0.0, 1.0), Span::new(2.0, 4.0)]);
    }
}
