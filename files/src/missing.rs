//! What is said of a file that is not there.

use std::error::Error;
use std::io;

/// What follows an error's words where a file that was to be read is not there: where it was looked for. None for any other error. Errors of files that
/// are read carry the system's as their source.
pub fn missing_file(error: &(dyn Error + 'static)) -> Option<String> {
    let mut next = Some(error);
    while let Some(error) = next {
        let system = error.downcast_ref::<io::Error>();
        if system.is_some_and(|cause| cause.kind() == io::ErrorKind::NotFound) {
            return where_from();
        }
        next = error.source();
    }
    None
}

fn where_from() -> Option<String> {
    let folder = std::env::current_dir().ok()?;
    Some(format!("; check the name: a relative path starts at {}", folder.display()))
}
