//! What leaves a nozzle over time, in closed form.

use crate::span::{Span, Spans, total};

/// A course of the flow's share of full: 0 to 1, and more while the pressure is above the nominal one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// In a straight line from one share to another.
    Ramp {
        /// At the beginning.
        from: f64,
        /// At the end.
        to: f64,
    },
    /// First order, from a share towards another.
    Settling {
        /// At the beginning.
        from: f64,
        /// Where it would come to.
        towards: f64,
        /// Time constant, seconds.
        tau_s: f64,
    },
}

/// A stretch of time with one course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// When, seconds.
    pub span: Span,
    /// How it goes.
    pub course: Course,
}

impl Piece {
    /// Share of full flow at `at`, which lies in the piece.
    pub fn share(&self, at: f64) -> f64 {
        let into_s = at - self.span.from;
        match self.course {
            Course::Ramp { from, to } if self.span.length() > 0.0 => {
                from + (to - from) * into_s / self.span.length()
            }
            Course::Ramp { to, .. } => to,
            Course::Settling { from, towards, tau_s } => {
                towards + (from - towards) * libm::exp(-into_s / tau_s)
            }
        }
    }

    /// The part of it that lies in `span`, if any.
    pub(crate) fn part(&self, span: Span) -> Option<Self> {
        let span = self.span.common(span)?;
        let course = match self.course {
            Course::Ramp { .. } => Course::Ramp { from: self.share(span.from), to: self.share(span.to) },
            Course::Settling { towards, tau_s, .. } => {
                Course::Settling { from: self.share(span.from), towards, tau_s }
            }
        };
        Some(Self { span, course })
    }

    /// Integral of the share over a part of the piece, seconds.
    fn integral(&self, part: Span) -> f64 {
        match self.course {
            Course::Ramp { .. } => part.length() * (self.share(part.from) + self.share(part.to)) / 2.0,
            Course::Settling { towards, tau_s, .. } => {
                let off = self.share(part.from) - towards;
                towards * part.length() - off * tau_s * libm::expm1(-part.length() / tau_s)
            }
        }
    }
}

/// The flow of one nozzle. Between its pieces nothing flows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flow {
    /// Full flow at the nominal pressure, litres a second.
    pub full_l_s: f64,
    /// In the order of time.
    pub pieces: Vec<Piece>,
    /// When the nozzle counts as open: while anything flows; with a pulsed valve also between its pulses, with a proportional one above a twentieth of full.
    pub open: Spans,
    /// When its valve is open by the same rule, whether or not there is liquid behind it and the nozzle lets it through.
    pub valve: Spans,
}

impl Flow {
    /// Full flow in these times and none between them.
    pub fn full(full_l_s: f64, open: Spans) -> Self {
        let full = |span: &Span| Piece { span: *span, course: Course::Ramp { from: 1.0, to: 1.0 } };
        Self { full_l_s, pieces: open.iter().map(full).collect(), valve: open.clone(), open }
    }

    /// Nothing leaves it from `at` on.
    pub(crate) fn end(&mut self, at: f64) {
        let before = Span::new(f64::NEG_INFINITY, at);
        self.pieces = self.pieces.iter().filter_map(|piece| piece.part(before)).collect();
        self.open = self.open.within(before);
    }

    /// What has left it in all, litres.
    pub fn litres(&self) -> f64 {
        total(self.pieces.iter().map(|piece| piece.integral(piece.span))) * self.full_l_s
    }

    /// What has left it in these times, litres: exact.
    pub fn litres_in(&self, times: &Spans) -> f64 {
        let mut seconds = 0.0;
        for time in times.iter() {
            let first = self.pieces.partition_point(|piece| piece.span.to <= time.from);
            let pieces = self.pieces.iter().skip(first).take_while(|piece| piece.span.from < time.to);
            seconds += total(pieces.filter_map(|piece| Some(piece.integral(piece.span.common(*time)?))));
        }
        seconds * self.full_l_s
    }

    /// Share of full flow at `at`.
    pub fn share(&self, at: f64) -> f64 {
        let next = self.pieces.partition_point(|piece| piece.span.from <= at);
        let last = self.pieces.get(next.wrapping_sub(1)).filter(|piece| at < piece.span.to);
        last.map_or(0.0, |piece| piece.share(at))
    }
}
