//! The recorded scatter of each family.

use super::scatter::Scatter;
use crate::optics::Fact;

/// 83 periods of an LMS111 at 50 Hz; the very first after LMCstartmeas, 19832 µs, is left out. The speed wanders slowly: with a triangle of
/// 23 turns, and a deviation of the single stamp.
pub(super) const LMS1XX: Scatter = Scatter {
    period_sd_us: Fact::recorded(25.3),
    lag_1: Fact::recorded(0.61),
    lag_2: Fact::recorded(0.68),
    weights: &[
        2.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 11.0, 10.0, 9.0, 8.0, 7.0, 6.0,
        5.0, 4.0, 3.0, 2.0, 1.0,
    ],
    delay_us: [
        3067, 3071, 3074, 3081, 3083, 3087, 3088, 3091, 3094, 3096, 3098, 3100, 3105, 3110, 3113, 3118, 3122,
        3128, 3132, 3148, 3185,
    ],
};

/// 89 periods of an LMS511 at 25 Hz. Every third period is alike.
pub(super) const LMS5XX: Scatter = Scatter {
    period_sd_us: Fact::recorded(127.8),
    lag_1: Fact::recorded(-0.22),
    lag_2: Fact::recorded(-0.5),
    weights: &[1.0, 1.12, 0.09, 1.28, 1.75],
    delay_us: [
        40234, 40409, 40453, 40477, 40503, 40517, 40556, 40573, 40600, 40627, 40652, 40681, 40697, 40729,
        40744, 40785, 40819, 40855, 40873, 40923, 40989,
    ],
};

/// 59 periods of a TiM781S.
pub(super) const TIM: Scatter = Scatter {
    period_sd_us: Fact::recorded(15.4),
    lag_1: Fact::recorded(0.48),
    lag_2: Fact::recorded(-0.13),
    weights: &[1.0, 2.27, 1.95, 1.39, 0.7],
    delay_us: [
        6208, 6230, 6248, 6271, 6280, 6283, 6298, 6303, 6307, 6310, 6313, 6319, 6333, 6338, 6342, 6382, 6458,
        6528, 6719, 6844, 7674,
    ],
};

/// 39 periods of an MRS1104. Every second one is 0.8 ms longer, and all of them grow: a triangle of 23 turns that alternates, on one that does not.
pub(super) const MRS1000: Scatter = Scatter {
    period_sd_us: Fact::recorded(385.6),
    lag_1: Fact::recorded(-0.85),
    lag_2: Fact::recorded(0.93),
    weights: &[
        5.0, 6.0, 15.0, 12.0, 25.0, 18.0, 35.0, 24.0, 45.0, 30.0, 55.0, 36.0, 55.0, 30.0, 45.0, 24.0, 35.0,
        18.0, 25.0, 12.0, 15.0, 6.0, 5.0,
    ],
    delay_us: [
        64146, 64279, 64377, 64463, 64553, 64584, 64687, 64690, 64703, 64775, 64814, 64851, 64928, 65001,
        65087, 65120, 65154, 65231, 65346, 65408, 65511,
    ],
};

/// None was recorded: an LMS1xx's, about the one time of transmission that a telegram in a manual tells.
pub(super) const LMS1000: Scatter = Scatter {
    period_sd_us: Fact::assumed(LMS1XX.period_sd_us.value),
    lag_1: Fact::assumed(LMS1XX.lag_1.value),
    lag_2: Fact::assumed(LMS1XX.lag_2.value),
    delay_us: later(LMS1XX.delay_us, 26_525),
    ..LMS1XX
};

const fn later(mut delay_us: [u16; 21], by_us: u16) -> [u16; 21] {
    let mut place = 0;
    while place < delay_us.len() {
        delay_us[place] += by_us;
        place += 1;
    }
    delay_us
}
