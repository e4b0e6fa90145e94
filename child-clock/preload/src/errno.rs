//! What the C library says went wrong.

/// The calling thread's.
pub(crate) fn get() -> i32 {
    // SAFETY: the address is that of the calling thread's own, always valid.
    unsafe { *libc::__errno_location() }
}

pub(crate) fn set(code: i32) {
    // SAFETY: as above.
    unsafe { *libc::__errno_location() = code };
}
