//! `syscall` as the C library has it.

use std::ffi::c_long;

use crate::real::real;

/// The call with as many arguments as any has. More than the caller gave are what its registers hold, and the kernel does not look at them.
pub(crate) fn call(number: c_long, given: [c_long; 6]) -> c_long {
    let [a, b, c, d, e, f] = given;
    real!(syscall(
        number => c_long,
        a => c_long,
        b => c_long,
        c => c_long,
        d => c_long,
        e => c_long,
        f => c_long,
    ) -> c_long)
}

/// Wakes all who wait for a word.
///
/// # Safety
/// The kernel looks at the address only; it need not be valid.
pub(crate) unsafe fn wake_all(word: *const u32, private: i32) {
    let operation = c_long::from(libc::FUTEX_WAKE | private);
    call(libc::SYS_futex, [word as c_long, operation, c_long::from(i32::MAX), 0, 0, 0]);
}
