//! Every fault of the byte path in CoLa A, CoLa B and LMS2xx: exactly what it does to the client, and that nothing does it without the fault.

use std::time::Duration;

use rowscan_faults::{FAULTS, Layer, What};

use crate::client::{PERIOD, SCANS, Seen, Speech, run};

/// A fault, and what holds of the client's view where it is at work and does not hold where it is not.
struct Case {
    fault: &'static str,
    /// Keys beside the name.
    keys: &'static str,
    holds: fn(Speech, &Seen) -> bool,
}

fn all() -> Vec<u16> {
    (1..=SCANS).collect()
}

fn without(lost: &[u16]) -> Vec<u16> {
    all().into_iter().filter(|scan| !lost.contains(scan)).collect()
}

/// Nothing is lost, to the byte.
fn whole(speech: Speech, seen: &Seen) -> bool {
    seen.bytes == all().into_iter().flat_map(|number| speech.scan(number)).collect::<Vec<_>>()
}

fn read_at(seen: &Seen, at: Duration) -> Option<usize> {
    seen.reads.iter().find(|(read, _)| read.abs_diff(at) <= TICK).map(|(_, len)| *len)
}

/// tokio's timer rounds up to its next millisecond.
const TICK: Duration = Duration::from_millis(1);
const FIFTH: Duration = Duration::from_millis(100);

const CASES: &[Case] = &[
    Case {
        fault: "split",
        keys: "offset = 3\ngap_us = 5000",
        holds: |speech, seen| {
            let rest = speech.scan(5).len() - 3;
            whole(speech, seen)
                && read_at(seen, FIFTH) == Some(3)
                && read_at(seen, FIFTH + Duration::from_millis(5)) == Some(rest)
        },
    },
    Case {
        fault: "coalesce",
        keys: "telegrams = 3",
        holds: |speech, seen| {
            let three = [5, 6, 7].map(|number| speech.scan(number).len()).iter().sum();
            whole(speech, seen) && read_at(seen, FIFTH).is_none() && read_at(seen, PERIOD * 7) == Some(three)
        },
    },
    Case {
        fault: "dribble",
        keys: "bytes = 4\ngap_us = 1000",
        holds: |speech, seen| {
            let pieces = speech.scan(5).len().div_ceil(4);
            whole(speech, seen) && seen.reads.iter().filter(|(_, len)| *len <= 4).count() >= pieces.min(15)
        },
    },
    Case {
        fault: "delay",
        keys: "ms = 250\nfor = { scans = 1 }",
        holds: |speech, seen| {
            // What comes behind the late scan waits for it: order is kept.
            whole(speech, seen)
                && read_at(seen, FIFTH).is_none()
                && read_at(seen, FIFTH + Duration::from_millis(250)).is_some()
        },
    },
    Case {
        fault: "jitter",
        keys: "sd_ms = 8\nfor = { s = 10 }",
        holds: |speech, seen| {
            let late = seen.reads.iter().filter(|(at, _)| at.as_micros() % 20_000 > 1_500).count();
            whole(speech, seen) && late >= 2
        },
    },
    Case {
        fault: "stall",
        keys: "for = { s = 2 }",
        holds: |speech, seen| {
            // From the fifth scan on all of them, at once, when it is over.
            let rest = (5..=SCANS).map(|number| speech.scan(number).len()).sum::<usize>();
            whole(speech, seen) && read_at(seen, FIFTH + Duration::from_secs(2)) == Some(rest)
        },
    },
    Case {
        fault: "bandwidth",
        keys: "bytes_s = 100\nfor = { s = 60 }",
        holds: |speech, seen| {
            let rest = (5..=SCANS).map(|number| speech.scan(number).len()).sum::<usize>();
            let expected = FIFTH + Duration::from_secs_f64(rest as f64 / 100.0);
            whole(speech, seen) && seen.latest().abs_diff(expected) <= Duration::from_millis(20)
        },
    },
    Case {
        fault: "drop",
        keys: "telegrams = 2",
        holds: |_, seen| seen.scans == without(&[5, 6]) && (seen.bad, seen.skipped) == (0, 0),
    },
    Case {
        fault: "duplicate",
        keys: "",
        holds: |_, seen| seen.scans == [1, 2, 3, 4, 5, 5, 6, 7, 8, 9, 10, 11, 12],
    },
    Case {
        fault: "reorder",
        keys: "by = 2",
        holds: |_, seen| seen.scans == [1, 2, 3, 4, 6, 7, 5, 8, 9, 10, 11, 12],
    },
    Case {
        fault: "flip",
        keys: "region = \"payload\"",
        holds: |speech, seen| match speech {
            // No checksum: at the worst a wrong value, and the next telegram is good.
            Speech::ColaA => !whole(speech, seen) && seen.bytes.len() == clean(speech) && ends_well(seen),
            _ => seen.scans == without(&[5]) && seen.bad == 1,
        },
    },
    Case {
        fault: "checksum",
        keys: "",
        holds: |speech, seen| match speech {
            Speech::ColaA => skipped(seen, "CoLa A has no checksum") && whole(speech, seen),
            _ => seen.scans == without(&[5]) && seen.bad == 1,
        },
    },
    Case {
        fault: "length",
        keys: "by = -2",
        holds: |speech, seen| match speech {
            Speech::ColaA => skipped(seen, "CoLa A has no length field") && whole(speech, seen),
            _ => seen.scans == without(&[5]) && seen.bad == 1,
        },
    },
    Case {
        fault: "truncate",
        keys: "bytes = 2",
        holds: |speech, seen| {
            seen.bytes.len() == clean(speech) - 2 && !seen.scans.contains(&5) && ends_well(seen)
        },
    },
    Case {
        fault: "inject",
        keys: "hex = \"0a 0b 0c\"",
        holds: |_, seen| seen.scans == all() && (seen.bad, seen.skipped) == (0, 3),
    },
    Case {
        fault: "half_open",
        keys: "for = { s = 0.05 }",
        holds: |speech, seen| match speech {
            // A wire is itself again.
            Speech::Lms2xx => seen.scans == without(&[5, 6, 7]),
            _ => seen.scans == [1, 2, 3, 4],
        },
    },
    Case { fault: "rst", keys: "", holds: |_, seen| seen.scans == [1, 2, 3, 4] },
    Case { fault: "fin", keys: "", holds: |_, seen| seen.scans == [1, 2, 3, 4] },
    Case { fault: "half_close", keys: "", holds: |_, seen| seen.scans == [1, 2, 3, 4] },
    Case {
        fault: "garble",
        keys: "lost_p = 1\nfor = { scans = 2 }",
        holds: |_, seen| seen.scans == without(&[5, 6]) && seen.skipped == 0,
    },
];

fn clean(speech: Speech) -> usize {
    all().into_iter().map(|number| speech.scan(number).len()).sum()
}

/// Recovered within two telegrams.
fn ends_well(seen: &Seen) -> bool {
    seen.scans.ends_with(&[7, 8, 9, 10, 11, 12]) || seen.scans.ends_with(&[8, 9, 10, 11, 12])
}

fn skipped(seen: &Seen, why: &str) -> bool {
    seen.events.iter().any(|event| event.what == What::Skipped && event.reason.as_deref() == Some(why))
}

#[tokio::test(start_paused = true)]
async fn each_fault_does_what_it_says_and_nothing_does_it_without_the_fault() {
    for case in CASES {
        let fault = FAULTS.iter().find(|fault| fault.name == case.fault).expect("in the table");
        for speech in Speech::ALL {
            if speech == Speech::Lms2xx && !fault.on_wires {
                continue;
            }
            let text = format!("[[fault]]\nname = \"{}\"\nat = {{ scan = 5 }}\n{}\n", case.fault, case.keys);
            let with = run(speech, &text, 1).await;
            assert!((case.holds)(speech, &with), "{} in {speech:?}: {with:?}", case.fault);
            let off = run(speech, "", 1).await;
            assert!(!(case.holds)(speech, &off), "{} in {speech:?} is seen without the fault", case.fault);
        }
    }
}

/// A fault that leaves a telegram as it was has not acted on it: a run that is green by it proves nothing.
#[tokio::test(start_paused = true)]
async fn what_changes_nothing_is_no_act() {
    let idle = [
        "length\"\nby = 0",
        "truncate\"\nkeep = 100000",
        "dribble\"\nbytes = 100000",
        "duplicate\"\ntimes = 0",
        "drop\"\nbytes = 0",
        "reorder\"\nby = 0",
        "flip\"\nbits = 0",
    ];
    for speech in Speech::ALL {
        let clean = run(speech, "", 1).await;
        let mut tried = 0;
        for keys in idle {
            let text = format!("[[fault]]\nname = \"{keys}\nat = {{ scan = 5 }}\n");
            // What the table refuses needs no run.
            if rowscan_faults::read(&text).is_err() {
                continue;
            }
            tried += 1;
            let seen = run(speech, &text, 1).await;
            assert_eq!(seen.bytes, clean.bytes, "{keys} in {speech:?}");
            let acts = seen.events.iter().filter(|event| event.what == What::Act).count();
            assert_eq!(acts, 0, "{keys} in {speech:?}: {:?}", seen.events);
        }
        assert!(tried >= 3, "{tried}");
    }
}

#[test]
fn every_fault_of_the_table_has_a_case() {
    for fault in FAULTS.iter().filter(|fault| !matches!(fault.layer, Layer::Accept | Layer::Part(_))) {
        assert!(CASES.iter().any(|case| case.fault == fault.name), "{} has no case", fault.name);
    }
}

#[tokio::test(start_paused = true)]
async fn a_cut_at_any_byte_of_a_telegram_changes_nothing_for_the_client() {
    for speech in Speech::ALL {
        let clean = run(speech, "", 1).await;
        for offset in 1..speech.scan(5).len() {
            let text = format!("[[fault]]\nname = \"split\"\nat = {{ scan = 5 }}\noffset = {offset}\n");
            let seen = run(speech, &text, 1).await;
            assert_eq!(seen.bytes, clean.bytes, "{speech:?} cut at {offset}");
            assert_eq!(seen.scans, all(), "{speech:?} cut at {offset}");
            assert!(
                read_at(&seen, FIFTH).is_some_and(|first| first == offset),
                "{speech:?} at {offset}: not cut"
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let text = "[[fault]]\nname = \"flip\"\np = 0.5\nbits = 3\n[[fault]]\nname = \"drop\"\np = 0.2\n";
    for speech in Speech::ALL {
        let (one, again) = (run(speech, text, 1).await, run(speech, text, 1).await);
        assert_eq!(one.bytes, again.bytes, "{speech:?}");
        let other = run(speech, text, 2).await;
        assert_ne!(one.bytes, other.bytes, "{speech:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn every_region_of_a_telegram_is_hit_where_there_is_one() {
    for (region, speech, from, to) in [
        ("header", Speech::ColaB, 0, 4),
        ("length", Speech::ColaB, 4, 8),
        ("checksum", Speech::Lms2xx, 14, 16),
        ("payload", Speech::Lms2xx, 4, 14),
        ("payload", Speech::ColaA, 1, usize::MAX),
    ] {
        for seed in 0..20 {
            let text = format!("[[fault]]\nname = \"flip\"\nat = {{ scan = 5 }}\nregion = \"{region}\"\n");
            let seen = run(speech, &text, seed).await;
            let sent: Vec<u8> = all().into_iter().flat_map(|number| speech.scan(number)).collect();
            let before: usize = (1..5).map(|number| speech.scan(number).len()).sum();
            let hits: Vec<usize> = (0..sent.len()).filter(|at| sent[*at] != seen.bytes[*at]).collect();
            let [hit] = hits.as_slice() else { panic!("{region} of {speech:?}: {hits:?}") };
            assert!((from..to).contains(&(hit - before)), "{region} of {speech:?}: {}", hit - before);
            assert_eq!((sent[*hit] ^ seen.bytes[*hit]).count_ones(), 1);
        }
    }
}
