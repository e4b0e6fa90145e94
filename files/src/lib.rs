//! Files that a program reads and writes, opened in one place:
//! inputs [within bounds](read), outputs [whole or not at all](OutputFile), and [never both at once](KeptApart).

mod apart;
mod input;
mod leftovers;
mod missing;
mod name_lock;
mod output_file;

pub use apart::KeptApart;
pub use input::{Bounded, MOST_BYTES_WHOLE, open, read, read_own, read_text, will_be_read};
pub use leftovers::{Leftover, remove_leftovers};
pub use missing::missing_file;
pub use name_lock::NameLock;
pub use output_file::{NewFile, OutputFile, STANDARD_OUTPUT, is_standard_output};
