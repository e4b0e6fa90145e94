//! This process's page.

use std::sync::atomic::{AtomicPtr, Ordering};

use rowscan_child_clock::ChildPage;

static PAGE: AtomicPtr<ChildPage> = AtomicPtr::new(std::ptr::null_mut());

/// The page; none where time is the host's.
pub(crate) fn page() -> Option<&'static ChildPage> {
    // SAFETY: null, or a page that is never freed.
    unsafe { PAGE.load(Ordering::Acquire).as_ref() }
}

/// Has it be `page` from now on; none: the host's time.
pub(crate) fn set(page: Option<ChildPage>) {
    let page = page.map_or(std::ptr::null_mut(), |page| Box::into_raw(Box::new(page)));
    PAGE.store(page, Ordering::Release);
}
