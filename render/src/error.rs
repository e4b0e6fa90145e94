//! Why there is no picture.

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// Too much to draw.
    #[error("an orchard of at most {most} triangles can be drawn, found {found}; draw fewer trees")]
    TooMany {
        /// Most.
        most: usize,
        /// Found.
        found: usize,
    },
    /// Nothing to look at.
    #[error("there is nothing to draw: the orchard has neither leaf nor wood nor post")]
    Nothing,
    /// A size that no picture has.
    #[error("a picture of 1 to {most} pixels a side expected, found {width} x {height}")]
    Size {
        /// Most pixels a side.
        most: u32,
        /// Found.
        width: u32,
        /// Found.
        height: u32,
    },
    /// An angle of view that no lens has.
    #[error("an angle of view from 1 to 150 degrees expected, found {found}")]
    Angle {
        /// Degrees.
        found: f64,
    },
    /// A camera that looks nowhere.
    #[error(
        "the camera must look at another point than it stands at, both numbers: it stands at {from:?} and looks at {look:?}"
    )]
    Direction {
        /// Where it stands, metres.
        from: [f64; 3],
        /// Where it looks, metres.
        look: [f64; 3],
    },
    /// The picture could not be packed.
    #[error("the picture cannot be written as PNG: {0}")]
    Png(String),
}
