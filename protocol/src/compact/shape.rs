//! How a scan's beams are laid out: what every part of its definition asks for.

/// Most lines of a module; real scanners have 16.
pub const MAX_LINES: u32 = 64;
/// Most beams of a line: an LRS4000 at 0.02° has 14 400.
pub const MAX_BEAMS: u32 = 65_536;
/// Most echoes of a beam; real scanners have 3.
pub const MAX_ECHOES: u32 = 16;
/// Most modules of a telegram; a multiScan136 has 4.
pub const MAX_MODULES: usize = 64;

/// Version of a scan's layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Version {
    /// Older: no scale of distances, angle before properties.
    V3,
    /// Today's.
    #[default]
    V4,
}

impl Version {
    pub(super) fn number(self) -> u32 {
        match self {
            Self::V3 => 3,
            Self::V4 => 4,
        }
    }
}

/// How many lines, beams and echoes a module has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// Lines (layers), 1 to [`MAX_LINES`].
    pub lines: u32,
    /// Beams a line, at most [`MAX_BEAMS`].
    pub beams: u32,
    /// Echoes a beam, 1 to [`MAX_ECHOES`].
    pub echoes: u32,
}

impl Shape {
    /// Beams of all lines together.
    pub fn beams_of_lines(self) -> usize {
        self.lines as usize * self.beams as usize
    }
}

/// Which quantities a module has; all, as delivered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Content {
    /// Of an echo: bit 0 distance, bit 1 RSSI.
    pub echo: u8,
    /// Of a beam: bit 0 properties, bit 1 angle.
    pub beam: u8,
}

impl Default for Content {
    fn default() -> Self {
        Self { echo: 3, beam: 3 }
    }
}

impl Content {
    /// Echoes have a distance.
    pub fn has_distance(self) -> bool {
        self.echo & 1 != 0
    }

    /// Echoes have a strength.
    pub fn has_rssi(self) -> bool {
        self.echo & 2 != 0
    }

    /// Beams have properties.
    pub fn has_properties(self) -> bool {
        self.beam & 1 != 0
    }

    /// Beams have an angle of their own.
    pub fn has_theta(self) -> bool {
        self.beam & 2 != 0
    }
}
