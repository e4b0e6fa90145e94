use super::*;
use alloc::format;
use alloc::vec::Vec;
use core::time::Duration;

fn scan(counter: u16, time_us: u32) -> Scan {
    Scan { telegram_counter: counter, scan_time_us: time_us, scan_frequency_hz: 50.0, ..Scan::default() }
}

/// Counters of telegrams and of turns.
fn left_out(readings: &[(u16, u16)]) -> u64 {
    let mut counting = Counting::default();
    for (counter, turn) in readings {
        let first = readings.first().map_or(0, |(_, turn)| *turn);
        let time_us = 20_000 * u32::from(turn.wrapping_sub(first));
        counting.observe(&Scan { scan_counter: *turn, ..scan(*counter, time_us) });
    }
    counting.turns_left_out()
}

#[test]
fn turns_without_a_telegram_are_told_from_lost_telegrams_and_from_output_intervals() {
    assert_eq!(left_out(&[(0, 0), (1, 1), (2, 2), (3, 3)]), 0, "every turn");
    assert_eq!(left_out(&[(0, 7), (1, 8), (2, 11), (3, 12)]), 2, "two turns left out");
    assert_eq!(left_out(&[(0, 0), (1, 3), (2, 6), (3, 9)]), 0, "every third turn is sent");
    assert_eq!(left_out(&[(0, 0), (1, 3), (2, 9), (3, 12)]), 1, "one third turn left out");
    assert_eq!(left_out(&[(0, 0), (1, 1), (4, 4), (5, 5)]), 0, "lost telegrams are another thing");
    assert_eq!(left_out(&[(0, 65_534), (1, 65_535), (2, 1), (3, 2)]), 1, "through the wrap");
    assert_eq!(left_out(&[(0, 0), (1, 0), (2, 0)]), 0, "a device without a turn counter");
}

/// As of CoLa A, which has no checksum.
#[test]
fn a_turn_counter_with_a_flipped_bit_is_no_turn_left_out() {
    for bit in 0..16 {
        let mut counting = Counting::default();
        for place in 0..40_u16 {
            let flipped = if place == 20 { 1 << bit } else { 0 };
            let scan_counter = (1000 + place) ^ flipped;
            counting.observe(&Scan { scan_counter, ..scan(place, 20_000 * u32::from(place)) });
        }
        // A turn more or less is within what a clock tells.
        let found = (counting.turns_left_out(), counting.contradicting);
        assert!(found.0 <= 2, "bit {bit}: {found:?}");
        // The highest bit takes the counter as far ahead as back.
        let expected = if bit == 15 { 2 } else { 1 };
        assert!(bit < 2 || found.1 == expected, "bit {bit}: {found:?}");
        assert_eq!((counting.lost, counting.restarts, counting.scans), (0, 0, 40), "bit {bit}");
    }
}

fn count(readings: impl IntoIterator<Item = (u16, u32)>) -> (Counting, Vec<Turn>) {
    let mut counting = Counting::default();
    let turns = readings.into_iter().map(|(c, t)| counting.observe(&scan(c, t))).collect();
    (counting, turns)
}

fn travel_s(turn: &Turn) -> f64 {
    match turn {
        Turn::Line { travel_s, .. } => *travel_s,
        Turn::Repeated | Turn::Late => f64::NAN,
    }
}

#[test]
fn counter_and_clock_wrap_without_a_gap() {
    let start = u32::MAX - 50_000;
    let (c, turns) =
        count((0..10u16).map(|i| (65_530u16.wrapping_add(i), start.wrapping_add(u32::from(i) * 20_000))));
    assert_eq!((c.scans, c.lost, c.restarts, c.repeated), (10, 0, 0, 0));
    assert!((travel_s(&turns[9]) - 0.18).abs() < 1e-9);
    assert!((c.frequency_hz().unwrap() - 50.0).abs() < 1e-9);
}

#[test]
fn lost_telegrams_are_counted_and_keep_the_frequency() {
    // 65534, 65535, [0, 1 lost], 2, [3 lost], 4
    let (c, turns) = count([(65_534, 0), (65_535, 20_000), (2, 80_000), (4, 120_000)]);
    assert_eq!((c.lost, c.restarts), (3, 0));
    assert!((c.frequency_hz().unwrap() - 50.0).abs() < 1e-9);
    assert!(matches!(turns[2], Turn::Line { link: Link::Steps(3), .. }));
}

#[test]
fn a_repeated_telegram_neither_counts_as_line_nor_as_gap() {
    let (c, turns) = count([(7, 0), (8, 20_000), (8, 20_000), (8, 20_000), (9, 40_000)]);
    assert_eq!((c.scans, c.repeated, c.lost), (5, 2, 0));
    assert_eq!(turns[2], Turn::Repeated);
    assert!((c.frequency_hz().unwrap() - 50.0).abs() < 1e-9);
}

/// Of a scanner with several layers a turn is as many lines.
#[test]
fn turns_are_counted_whatever_lines_they_have() {
    for lines in [1_u64, 2, 16] {
        let (mut counting, mut counter) = (Counting::default(), 0);
        // Every fourth turn is left out.
        let turns: Vec<u16> = (0..40).filter(|turn| turn % 4 != 2).collect();
        for turn in &turns {
            for line in 0..lines {
                let time_us = 20_000 * u32::from(*turn);
                let layer_centideg = 100 * line as i16;
                counting.observe(&Scan { scan_counter: *turn, layer_centideg, ..scan(counter, time_us) });
                counter += 1;
            }
        }
        assert_eq!((counting.scans, counting.turns_left_out()), (30 * lines, 10), "{lines} lines");
        assert_eq!(counting.turns(), 40, "{lines} lines");
    }
}

#[test]
fn a_restart_is_no_gap_and_goes_on_one_period_later() {
    // The device is switched off and on: counter and clock begin again.
    let (c, turns) = count([(100, 9_000_000), (101, 9_020_000), (1, 500_000), (2, 520_000), (3, 540_000)]);
    assert_eq!((c.lost, c.all_lost(), c.restarts), (0, None, 1));
    // The clock alone is set back: the counter goes on, and tells that nothing is lost.
    let (set_back, _) = count([(100, 9_000_000), (101, 9_020_000), (102, 500_000), (103, 520_000)]);
    assert_eq!((set_back.all_lost(), set_back.restarts), (Some(0), 1));
    assert!((travel_s(&turns[2]) - 0.04).abs() < 1e-9);
    assert!((travel_s(&turns[4]) - 0.08).abs() < 1e-9);
    assert!((c.frequency_hz().unwrap() - 50.0).abs() < 1e-9);
}

#[test]
fn a_counter_that_jumps_ahead_against_the_clock_is_a_restart() {
    let (c, _) = count([(100, 0), (101, 20_000), (20_000, 40_000), (20_001, 60_000)]);
    assert_eq!((c.lost, c.restarts), (0, 1));
    // Ahead on the clock alone, by an hour and more.
    let (c, _) = count([(100, 0), (101, 20_000), (105, 2_000_000_000), (106, 2_000_020_000)]);
    assert_eq!((c.lost, c.restarts), (0, 1));
}

#[test]
fn a_pause_of_the_measurement_keeps_the_clock_but_not_the_frequency() {
    let (c, turns) = count([(1, 0), (2, 20_000), (3, 5_020_000), (4, 5_040_000)]);
    assert_eq!((c.lost, c.restarts), (0, 0));
    assert!(matches!(turns[2], Turn::Line { link: Link::Broken, .. }));
    assert!((travel_s(&turns[3]) - 5.04).abs() < 1e-9);
    assert!((c.frequency_hz().unwrap() - 50.0).abs() < 1e-9);
}

#[test]
fn a_long_gap_is_counted_in_full() {
    // A connection lost for ten minutes while the device went on.
    let (c, turns) = count([(0, 0), (1, 20_000), (30_001, 600_020_000)]);
    assert_eq!((c.lost, c.restarts), (29_999, 0));
    assert!((travel_s(&turns[2]) - 600.02).abs() < 1e-6);
}

#[test]
fn beyond_half_a_turn_of_the_counter_a_gap_is_what_the_clock_says() {
    let (c, _) = count([(0, 0), (1, 20_000), (32_768, 20_000 + 32_767 * 20_000)]);
    assert_eq!((c.lost, c.restarts), (32_766, 0));
    // 32 768 telegrams ahead is as far back as ahead.
    let (c, turns) = count([(0, 0), (1, 20_000), (32_769, 20_000 + 32_768 * 20_000)]);
    assert_eq!((c.lost, c.restarts), (32_767, 0));
    assert!((travel_s(&turns[2]) - 655.38).abs() < 1e-6);
    // Of a clock that has gone on by less, or by more, the device began anew.
    for clock_us in [20_000 * 32_000, 20_000 * 33_500, 40_000] {
        let (c, _) = count([(0, 0), (1, 20_000), (32_769, 20_000 + clock_us)]);
        assert_eq!((c.lost, c.restarts), (0, 1), "{clock_us}");
    }
    // Without a device clock as well.
    let (c, _) = count([(0, 0), (1, 0), (40_000, 0)]);
    assert_eq!((c.lost, c.restarts), (0, 1));
}

#[test]
fn a_counter_that_stands_while_the_clock_runs_back_is_a_restart() {
    let (c, _) = count([(5, 80_000), (6, 100_000), (6, 60_000), (7, 80_000)]);
    assert_eq!((c.repeated, c.lost, c.restarts), (0, 0, 1));
}

#[test]
fn a_device_that_begins_anew_at_once_repeats_nothing_however_few_scans_came_before() {
    for (first, before) in [(0_u16, 1_u16), (1, 2), (1, 20), (1, 45), (1, 62), (1, 64), (1, 80), (7, 30)] {
        // Its clock begins anew, too, with another part of a turn past.
        for phase_us in (1..20_000).step_by(997) {
            let scans = (0..before).map(|n| (first + n, 20_000 * (u32::from(n) + 1)));
            let anew = (0..before).map(|n| (first + n, 20_000 * u32::from(n) + phase_us));
            let (c, turns) = count(scans.chain(anew));
            let told = format!("{first}, {before} scans, {phase_us} us: {c:?}");
            assert_eq!((c.repeated, c.late, c.restarts, c.all_lost()), (0, 0, 1, None), "{told}");
            let way_s = turns.last().map(travel_s).unwrap();
            assert!((way_s - 0.02 * f64::from(2 * before - 1)).abs() < 1e-3, "{way_s} s: {told}");
        }
    }
}

#[test]
fn another_scanner_in_the_stream_repeats_nothing_and_is_told() {
    let of = |serial_number: u32, n: u16| Scan { serial_number, ..scan(n, 20_000 * u32::from(n)) };
    let told = |scans: &[Scan]| {
        let mut counting = Counting::default();
        scans.iter().for_each(|scan| {
            counting.observe(scan);
        });
        (counting.repeated, counting.restarts, counting.all_lost())
    };
    let one: Vec<Scan> = (1..30).map(|n| of(7, n)).collect();
    let other: Vec<Scan> = (30..60).map(|n| of(8, n)).collect();
    assert_eq!(told(&[&one[..], &other].concat()).1, 1, "its counter goes on");
    // Two that send the same numbers at the same times.
    let both: Vec<Scan> = (1..30).flat_map(|n| [of(7, n), of(8, n)]).collect();
    assert_eq!(told(&both), (0, 57, None));
    // A number that is not told is that of nobody else.
    let unknown: Vec<Scan> = (30..60).map(|n| of(0, n)).collect();
    assert_eq!(told(&[&one[..], &unknown].concat()), (0, 0, Some(0)));
}

/// A client that was away for long: the counter alone tells less than half a turn of it, 22 minutes at 25 Hz.
#[test]
fn a_long_gap_is_counted_by_the_clock_and_a_device_that_begins_anew_is_none() {
    // Of each layer of a turn, or one; at 50 turns a second.
    for (layers, with_host) in [(1_u64, true), (1, false), (4, true), (4, false)] {
        for lost in [
            5_u64, 30_000, 32_767, 32_768, 33_000, 65_534, 65_535, 65_536, 70_000, 99_996, 300_000, 1_000_000,
        ] {
            let far = |place: u64| {
                let turn = place / layers;
                Scan {
                    scan_counter: turn as u16,
                    layer_centideg: (place % layers) as i16,
                    received: with_host.then(|| Duration::from_micros(7_000_000 + 20_010 * turn)),
                    ..scan(place as u16, (500_000 + 20_000 * turn) as u32)
                }
            };
            let lost = lost / layers * layers;
            let case = format!("{lost} lost, {layers} layers, host's clock {with_host}");
            let mut counting = Counting::default();
            (0..400).chain(400 + lost..800 + lost).for_each(|place| {
                counting.observe(&far(place));
            });
            // Without the host's, the device's clock tells half of its own round.
            let is_known = with_host || lost / layers < 107_000;
            if is_known {
                assert_eq!((counting.restarts, counting.all_lost()), (0, Some(lost)), "{case}");
                let found_hz = counting.frequency_hz().unwrap();
                assert!((found_hz - 50.0).abs() < 0.01, "{case}: {found_hz}");
            } else {
                assert_eq!((counting.restarts, counting.all_lost()), (1, None), "{case}");
            }
        }
    }
    // One that begins anew meanwhile: at any counter, with a clock from 0.
    for (counter, away_s) in [(0_u16, 900), (0, 5000), (7, 1400), (40_000, 700), (401, 100)] {
        let of = |place: u64, from: u16, us: u64, host_us: u64| Scan {
            received: Some(Duration::from_micros(host_us + 20_000 * place)),
            ..scan(from.wrapping_add(place as u16), (us + 20_000 * place) as u32)
        };
        let mut counting = Counting::default();
        (0..400).for_each(|place| {
            counting.observe(&of(place, 0, 500_000, 0));
        });
        (0..400).for_each(|place| {
            counting.observe(&of(place, counter, 30_000, away_s * 1_000_000));
        });
        assert_eq!((counting.restarts, counting.all_lost()), (1, None), "{counter} after {away_s} s");
    }
}

#[test]
fn telegrams_that_others_overtook_are_late_once_and_repeated_after() {
    // Six telegrams a turn: its layers have one time.
    for layers in [1_u16, 6] {
        let of = |n: u16| (n, 20_000 * u32::from(n / layers));
        let mut order: Vec<u16> = (10..60).collect();
        let moved = order.remove(12);
        order.insert(12 + 2, moved);
        order.insert(30, moved);
        let readings = order.into_iter().map(|n| {
            let (counter, time_us) = of(n);
            Scan { layer_centideg: (n % layers) as i16, ..scan(counter, time_us) }
        });
        let mut counting = Counting::default();
        readings.for_each(|scan| {
            counting.observe(&scan);
        });
        let found = (counting.late, counting.repeated, counting.restarts, counting.lost);
        assert_eq!(found, (1, 1, 0, 0), "{layers} layers");
    }
}

#[test]
fn an_output_interval_gives_the_telegrams_own_frequency() {
    let (c, _) = count((0..5u16).map(|i| (i, u32::from(i) * 100_000)));
    assert_eq!((c.lost, c.restarts), (0, 0));
    assert!((c.frequency_hz().unwrap() - 10.0).abs() < 1e-9);
}

#[test]
fn without_a_device_clock_the_nominal_frequency_stands_in() {
    let (c, turns) = count([(0, 0), (1, 0), (4, 0)]);
    assert_eq!((c.lost, c.untimed, c.restarts), (2, 2, 0));
    assert!((travel_s(&turns[2]) - 0.08).abs() < 1e-12);
    assert_eq!(c.frequency_hz(), None);
    assert_eq!(c.timeless, 0);
}

/// An LMS2xx without a scan index: the reader counts what comes, and times it when it comes.
#[test]
fn of_a_device_that_does_not_count_lost_telegrams_are_unknown_and_a_burst_takes_no_time() {
    let mut counting = Counting::default();
    // 20 in order, then nothing for 2 s, and 10 of them at once: held up, or lost, nobody knows.
    let times = (0..20).map(|place| 200_000 * place).chain([5_800_000; 10]);
    let turns: Vec<Turn> = (0..)
        .zip(times)
        .map(|(counter, time_us)| counting.observe(&Scan { uncounted: true, ..scan(counter, time_us) }))
        .collect();
    assert!((travel_s(&turns[29]) - 5.8).abs() < 1e-9, "{:?}", turns[29]);
    assert_eq!((counting.all_lost(), counting.frequency_hz(), counting.untimed), (None, None, 0));
    assert!(!counting.counts());
    // Where all have one time, it tells nothing: the rate stands in.
    let mut still = Counting::default();
    let last = (0..4).map(|counter| still.observe(&Scan { uncounted: true, ..scan(counter, 0) })).last();
    assert!((travel_s(&last.unwrap()) - 0.06).abs() < 1e-12);
    assert_eq!((still.all_lost(), still.untimed), (None, 3));
    let mut first = Counting::default();
    first.observe(&Scan { uncounted: true, ..scan(0, 0) });
    assert_eq!(first.all_lost(), Some(0), "nothing is missing before the first");
}

#[test]
fn without_a_frequency_too_nothing_is_known_unless_it_is_given() {
    let bare = |counter| Scan { scan_frequency_hz: 0.0, ..scan(counter, 0) };
    let mut counting = Counting::default();
    (0..4).for_each(|counter| {
        counting.observe(&bare(counter));
    });
    assert_eq!((counting.untimed, counting.timeless), (3, 3));
    let mut counting = Counting::default();
    counting.assume_hz(4.7);
    let last = (0..4).map(|counter| counting.observe(&bare(counter))).last();
    assert!((travel_s(&last.unwrap()) - 3.0 / 4.7).abs() < 1e-12);
    assert_eq!((counting.untimed, counting.timeless), (3, 0));
}

/// A client sets another output interval, or a mean filter, while scans come: after two of them the lines are neighbours again, and the rate is theirs.
#[test]
fn scans_that_come_less_often_from_now_on_are_no_pauses() {
    for apart in [2_u16, 5, 20, 32] {
        let (mut counting, mut turn, mut broken, mut telegrams) = (Counting::default(), 0_u16, 0, 0_u16);
        let mut take = |counting: &mut Counting, turns: u16| {
            turn += turns;
            telegrams += 1;
            let scan = Scan { scan_counter: turn, ..scan(telegrams, 20_000 * u32::from(turn)) };
            broken += u32::from(matches!(counting.observe(&scan), Turn::Line { link: Link::Broken, .. }));
        };
        (0..50).for_each(|_| take(&mut counting, 1));
        (0..50).for_each(|_| take(&mut counting, apart));
        (0..50).for_each(|_| take(&mut counting, 1));
        assert!(broken <= 1, "{apart}: {broken}");
        assert_eq!((counting.restarts, counting.lost), (0, 0), "{apart}");
        let expected_hz = 149.0 / (0.02 * f64::from(99 + 50 * apart));
        let found_hz = counting.frequency_hz().unwrap();
        assert!(
            (found_hz / expected_hz - 1.0).abs() < 0.02 * f64::from(apart),
            "{apart}: {found_hz} {expected_hz}"
        );
    }
    // Pauses of measurement, each of another length, stay pauses.
    let mut counting = Counting::default();
    let (mut turn, mut broken) = (0_u16, 0);
    for telegram in 0..40_u16 {
        turn += if telegram % 10 == 9 { 20 + telegram } else { 1 };
        let scan = Scan { scan_counter: turn, ..scan(telegram, 20_000 * u32::from(turn)) };
        broken += u32::from(matches!(counting.observe(&scan), Turn::Line { link: Link::Broken, .. }));
    }
    assert_eq!(broken, 4);
}
