//! Where the page is found, before `main`, and joined again, by a forked child.

use std::ffi::{CStr, OsStr};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use rowscan_child_clock::{ChildPage, VARIABLE};

use crate::page::{self, page};
use crate::{descriptors, keeper, locks};

/// Run by the loader before `main`.
#[used]
#[unsafe(link_section = ".init_array")]
static INIT: extern "C" fn() = init;

extern "C" fn init() {
    let mut name = [0_u8; 64];
    for (to, from) in name.iter_mut().zip(VARIABLE.bytes()) {
        *to = from;
    }
    // SAFETY: the name ends with a zero; nobody else runs yet who could change the environment.
    let value = unsafe { libc::getenv(name.as_ptr().cast()) };
    if value.is_null() {
        return;
    }
    // SAFETY: what `getenv` gives ends with a zero.
    let path = unsafe { CStr::from_ptr(value) };
    // A page that cannot be used leaves the program as it is without.
    let Ok(page) = ChildPage::open(Path::new(OsStr::from_bytes(path.to_bytes()))) else { return };
    page::set(Some(page));
    // SAFETY: the handler may run at any fork.
    unsafe { libc::pthread_atfork(None, None, Some(forked)) };
}

/// In a forked child: its parent's other threads are not here, and its number is another.
unsafe extern "C" fn forked() {
    keeper::forked();
    locks::forked();
    descriptors::forked();
    if page().is_some_and(|page| !page.join()) {
        page::set(None);
    }
}
