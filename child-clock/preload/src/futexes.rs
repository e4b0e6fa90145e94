//! `syscall`, for futexes with a time-out: Rust's standard library parks its threads that way.

use std::ffi::c_long;

use libc::timespec;

use crate::errno;
use crate::instant::{Clock, after, ns, read};
use crate::keeper::{Poke, Wait};
use crate::page::page;
use crate::system_call::call;

/// Waits as a futex with a time-out does; none if it is no such call.
fn timed(given: [c_long; 6]) -> Option<c_long> {
    let page = page()?;
    let [word, operation, value, timeout, other, bits] = given;
    let operation = i32::try_from(operation & 0xffff).ok()?;
    let clock = match operation & libc::FUTEX_CLOCK_REALTIME {
        0 => Clock::Monotonic,
        _ => Clock::Utc,
    };
    let command = operation & !(libc::FUTEX_PRIVATE_FLAG | libc::FUTEX_CLOCK_REALTIME);
    if !matches!(command, libc::FUTEX_WAIT | libc::FUTEX_WAIT_BITSET) {
        return None;
    }
    // SAFETY: of these commands it is a time-out, or null.
    let time = ns(&unsafe { read(timeout as *const timespec) }?)?;
    let deadline = match command {
        libc::FUTEX_WAIT => after(page, time),
        _ => clock.deadline(page, time),
    };
    if deadline <= page.now_ns() {
        errno::set(libc::ETIMEDOUT);
        return Some(-1);
    }
    let poke = Poke::Futex(word as *const u32, operation & libc::FUTEX_PRIVATE_FLAG);
    let wait = Wait::begin(page, deadline, poke)?;
    // Of a wait without an end the clock means nothing.
    let operation = c_long::from(operation & !libc::FUTEX_CLOCK_REALTIME);
    let waited = call(libc::SYS_futex, [word, operation, value, 0, other, bits]);
    if waited == 0 && wait.has_fired() {
        errno::set(libc::ETIMEDOUT);
        return Some(-1);
    }
    Some(waited)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn syscall(
    number: c_long,
    a: c_long,
    b: c_long,
    c: c_long,
    d: c_long,
    e: c_long,
    f: c_long,
) -> c_long {
    let given = [a, b, c, d, e, f];
    let waited = if number == libc::SYS_futex { timed(given) } else { None };
    waited.unwrap_or_else(|| call(number, given))
}
