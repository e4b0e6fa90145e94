//! What the random streams of a scene are for. The streams themselves are [`rowscan_protocol::random`]'s.

pub use rowscan_protocol::random::Stream;

/// What a stream of random numbers is used for. The numbers are part of the scene format; 3 is the GNSS receiver's
/// ([`rowscan_vehicle::gnss::STREAM`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u64)]
pub enum Purpose {
    /// State draws and azimuths of the growing axes.
    Growth = 1,
    /// Jitter of leaf blades.
    Foliage = 2,
    /// Which leaves are thinned out for a target leaf area.
    Thinning = 4,
    /// Where leaves are added for a target leaf area.
    Seeding = 5,
    /// Which production of an L-system is taken.
    Rewriting = 6,
    /// Which of few distinct trees stands where, and how it is turned.
    Placing = 7,
    /// Which leaves are out in a season.
    Season = 8,
    /// Waves of the soil, and where grass stands.
    Ground = 9,
}

impl Purpose {
    /// The stream for this purpose of the tree numbered `tree` in row `row`, in the scene with seed `seed`.
    ///
    /// ```
    /// use rowscan_scenes::seed::Purpose;
    /// let mut azimuths = Purpose::Growth.stream(1, 0, 3);
    /// assert!((0.0..1.0).contains(&azimuths.unit()));
    /// ```
    pub fn stream(self, seed: u64, row: u32, tree: u32) -> Stream {
        Stream::keyed(seed, &[self as u64, u64::from(row), u64::from(tree)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_vehicle::gnss;

    #[test]
    fn no_purpose_shares_its_stream_with_the_gnss_receiver() {
        let all = [
            Purpose::Growth,
            Purpose::Foliage,
            Purpose::Thinning,
            Purpose::Seeding,
            Purpose::Rewriting,
            Purpose::Placing,
            Purpose::Season,
            Purpose::Ground,
        ];
        assert!(all.into_iter().all(|purpose| purpose as u64 != gnss::STREAM));
    }
}
