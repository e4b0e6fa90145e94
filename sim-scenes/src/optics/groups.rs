//! Returns of eight beams at a time, in groups that are one pulse each: the sums that echoes are made of.
//!
//! In the order of their ranges, a return joins as long as it lies within a pulse of the group's mean, which moves away as returns join. So
//! a group is all that lies up to a pulse beyond its mean, and no list has to be sorted: sums up to there are taken until no more join.

use pulp::{Simd, WithSimd};

use super::parts::{Column, Parts};
use crate::lanes::{Lanes, Row};

/// Sums over the returns of one group of each of eight beams. A group without power is none. Ranges count from the nearest one, so that the spread
/// keeps its digits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    pub(super) from_m: Row,
    pub(super) power: Row,
    pub(super) share: Row,
    /// Power times range.
    pub(super) first: Row,
    /// Power times range squared.
    pub(super) second: Row,
    /// Number of the column that returned most.
    pub(super) column: Row,
}

/// Sums for a register of beams.
struct Group<S: Simd> {
    power: Lanes<S>,
    share: Lanes<S>,
    first: Lanes<S>,
    second: Lanes<S>,
    column: Lanes<S>,
    /// The nearest return beyond the group.
    next_m: Lanes<S>,
}

/// Finds all groups.
pub(super) struct Grouping<'a> {
    pub(super) parts: &'a Parts,
    pub(super) merged_m: f64,
    pub(super) groups: &'a mut Vec<Sums>,
}

impl WithSimd for Grouping<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { parts, merged_m, groups } = self;
        groups.clear();
        let (mut beyond_m, mut from_m) = (Row::splat(f64::NEG_INFINITY), *parts.nearest_m());
        while from_m.0.iter().any(|nearest_m| nearest_m.is_finite()) {
            let none = Row::splat(0.0);
            let mut sums = Sums { from_m, power: none, share: none, first: none, second: none, column: none };
            for part in 0..Row::parts::<S>() {
                let near = [&beyond_m, &from_m].map(|row| row.load(simd, part));
                let (group, to_m) = group(simd, parts.columns(), part, near, merged_m);
                sums.power.store(part, group.power);
                sums.share.store(part, group.share);
                sums.first.store(part, group.first);
                sums.second.store(part, group.second);
                sums.column.store(part, group.column);
                beyond_m.store(part, to_m);
                from_m.store(part, group.next_m);
            }
            groups.push(sums);
        }
    }
}

/// The group that begins at the nearest return beyond `beyond_m`, `from_m`, and how far it reaches.
#[inline(always)]
fn group<S: Simd>(
    simd: S,
    columns: &[Column],
    part: usize,
    [beyond_m, from_m]: [Lanes<S>; 2],
    merged_m: f64,
) -> (Group<S>, Lanes<S>) {
    let (zero, merged) = (from_m.of(0.0), from_m.of(merged_m));
    let mut to_m = from_m + merged;
    loop {
        let group = sums(simd, columns, part, [beyond_m, from_m, to_m]);
        let mean_m = from_m + group.first / group.power;
        let reach_m = zero.lt(group.power).select(mean_m, group.next_m) + merged;
        let grows = group.next_m.le(reach_m).and(group.next_m.lt(zero.of(f64::INFINITY)));
        if grows.is_empty() {
            return (group, to_m);
        }
        to_m = grows.select(reach_m, to_m);
    }
}

/// Sums over what lies beyond `beyond_m`, and no farther than `to_m`.
#[inline(always)]
fn sums<S: Simd>(
    simd: S,
    columns: &[Column],
    part: usize,
    [beyond_m, from_m, to_m]: [Lanes<S>; 3],
) -> Group<S> {
    let zero = Lanes::splat(simd, 0.0);
    let mut group = Group {
        power: zero,
        share: zero,
        first: zero,
        second: zero,
        column: zero,
        next_m: zero.of(f64::INFINITY),
    };
    let mut strongest = zero;
    for (number, column) in columns.iter().enumerate() {
        let range_m = column.range_m.load(simd, part);
        let near_enough = range_m.le(to_m);
        let within = beyond_m.lt(range_m).and(near_enough);
        let power = within.select(column.power.load(simd, part), zero);
        let off_m = within.select(range_m - from_m, zero);
        let moment = power * off_m;
        group.power = group.power + power;
        group.share = group.share + within.select(column.share.load(simd, part), zero);
        group.first = group.first + moment;
        group.second = group.second + moment * off_m;
        let stronger = strongest.lt(power);
        strongest = stronger.select(power, strongest);
        group.column = stronger.select(zero.of(number as f64), group.column);
        group.next_m = near_enough.select(group.next_m, group.next_m.min(range_m));
    }
    group
}
