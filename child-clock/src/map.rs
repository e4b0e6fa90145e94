//! The page in memory. The one file of this crate with `unsafe`.

use std::ops::Deref;
use std::os::fd::AsFd;
use std::ptr::NonNull;

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::layout::Layout;

/// The page, mapped for as long as this lives.
#[derive(Debug)]
pub(crate) struct Map(NonNull<Layout>);

// SAFETY: all of a `Layout` is atomic.
unsafe impl Send for Map {}
// SAFETY: as above.
unsafe impl Sync for Map {}

impl Map {
    /// Maps a file, which must be as long as a page.
    pub(crate) fn of(file: impl AsFd) -> std::io::Result<Self> {
        let access = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: the kernel chooses the address, so no memory of ours is replaced.
        let at = unsafe {
            mmap(std::ptr::null_mut(), size_of::<Layout>(), access, MapFlags::SHARED, file.as_fd(), 0)?
        };
        NonNull::new(at.cast()).map(Self).ok_or_else(|| std::io::Error::other("mapped at address 0"))
    }
}

impl Deref for Map {
    type Target = Layout;

    fn deref(&self) -> &Layout {
        // SAFETY: mapped in `of` with the size of a `Layout`, page-aligned, until `drop`; every bit pattern is a `Layout`, and all of it is
        // atomic, so others may write it.
        unsafe { self.0.as_ref() }
    }
}

impl Drop for Map {
    fn drop(&mut self) {
        // SAFETY: mapped in `of` with this size; references into it cannot outlive `self`.
        let _ = unsafe { munmap(self.0.as_ptr().cast(), size_of::<Layout>()) };
    }
}
