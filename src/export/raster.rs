//! A drawing as pixels: how many, in how many colours, and over which picture.

use rowscan_render::Picture;

/// Pixels of a file for each of its drawing's: the picture in a sheet's window must be so many times as large.
pub const SCALE: u32 = 2;

/// Colours of a file with a picture: enough for trees, and a small file.
pub(super) const COLOURS: u16 = 256;

/// A picture below a drawing, and where it begins: pixels of the file to the right and down.
pub(super) type Behind<'a> = (&'a Picture, (u32, u32));
