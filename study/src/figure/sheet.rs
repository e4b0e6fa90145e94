//! A drawing with a window for a picture.

/// Axes, texts and legends around a picture that is drawn elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// SVG without paper: what is behind shows through.
    pub svg: String,
    /// Width and height of all.
    pub size: (u32, u32),
    /// Where the picture goes.
    pub window: Window,
}

/// A part of a sheet, in its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// From the left edge.
    pub left: u32,
    /// From the upper edge.
    pub top: u32,
    /// To the right.
    pub width: u32,
    /// Down.
    pub height: u32,
}
