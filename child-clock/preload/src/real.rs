//! The C library's own functions, found behind this library.

use std::ffi::CStr;
use std::sync::atomic::{AtomicPtr, Ordering};

/// A function of the C library, looked up at its first call.
pub(crate) struct Real {
    name: &'static CStr,
    at: AtomicPtr<libc::c_void>,
}

impl Real {
    pub(crate) const fn new(name: &'static CStr) -> Self {
        Self { name, at: AtomicPtr::new(std::ptr::null_mut()) }
    }

    /// Where it is; null where the C library has no such function.
    pub(crate) fn get(&self) -> *mut libc::c_void {
        let known = self.at.load(Ordering::Relaxed);
        if !known.is_null() {
            return known;
        }
        // SAFETY: the name ends with a zero.
        let found = unsafe { libc::dlsym(libc::RTLD_NEXT, self.name.as_ptr()) };
        self.at.store(found, Ordering::Relaxed);
        found
    }
}

/// Calls the C library's function of this name; where there is none the result is that of a call that the system does not know.
macro_rules! real {
    ($name:ident($($argument:expr => $type:ty),* $(,)?) -> $result:ty, else $missing:expr) => {{
        static REAL: $crate::real::Real = {
            const NAME: &std::ffi::CStr =
                match std::ffi::CStr::from_bytes_with_nul(concat!(stringify!($name), "\0").as_bytes()) {
                    Ok(name) => name,
                    Err(_) => c"",
                };
            $crate::real::Real::new(NAME)
        };
        let at = REAL.get();
        if at.is_null() {
            $missing
        } else {
            // SAFETY: the C library's function of this name has these arguments and this result.
            let function: unsafe extern "C" fn($($type),*) -> $result = unsafe { std::mem::transmute(at) };
            // SAFETY: the arguments are the caller's own, or ours that are valid for the call.
            unsafe { function($($argument),*) }
        }
    }};
    ($name:ident($($argument:expr => $type:ty),* $(,)?) -> $result:ty) => {
        real!($name($($argument => $type),*) -> $result, else { $crate::errno::set(libc::ENOSYS); -1 })
    };
}
pub(crate) use real;
