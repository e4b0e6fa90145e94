//! Type 1: a segment of a turn.

use alloc::vec::Vec;

use super::beams::{self, Beams};
use super::error::{CompactError, EncodeError, Expected};
use super::shape::{Content, MAX_BEAMS, MAX_ECHOES, MAX_LINES, MAX_MODULES, Shape, Version};
use super::wire::{Fields, PerLine, Reader, Writer, layout, list};
use crate::visit::{Group, Visitor};

layout! {
    /// A segment of a turn.
    #[derive(Default)]
    pub struct ScanTelegram {
        /// Counts telegrams from power-up.
        pub telegram_counter: u64,
        /// When it was sent, on the scanner's clock; may lie before the last beam.
        pub transmit_time_us: u64 ["µs"],
        /// How modules are laid out.
        pub version: Version,
        /// Bytes of the first module, see [`seal`](Self::seal).
        pub module_bytes: ModuleSize ["bytes"],
        /// Lines of one number of beams and one spacing each.
        pub modules: Modules,
    }

    /// Lines with the same number of beams. Angles of a line are those of its first and last beam.
    #[derive(Default)]
    pub struct Module {
        /// Number of the segment in its turn, from 0.
        pub segment_counter: u64,
        /// Number of the turn.
        pub frame_number: u64,
        /// The scanner's serial number.
        pub sender_id: u32,
        /// Lines, beams, echoes.
        pub shape: Shape,
        /// When the first beam of each line was measured.
        pub time_start_us: PerLine<u64> ["µs"],
        /// When the last beam of each line was.
        pub time_stop_us: PerLine<u64> ["µs"],
        /// Elevation of each line.
        pub phi_rad: PerLine<f32> ["rad"],
        /// Angle of each line's first beam.
        pub theta_start_rad: PerLine<f32> ["rad"],
        /// Angle of each line's last beam.
        pub theta_stop_rad: PerLine<f32> ["rad"],
        /// Millimetres a count of distance; not sent in version 3, where it is 1.
        pub distance_scale: DistanceScale ["mm"],
        /// Bytes of the module that follows; 0 behind the last, see [`seal`](ScanTelegram::seal).
        pub next_module_bytes: ModuleSize ["bytes"],
        /// Reserved; real telegrams have 1.
        pub availability: u8,
        /// Which quantities are sent.
        pub content: Content,
        /// Reserved; 0.
        pub reserved: u8,
        /// What the beams met.
        pub beams: Beams,
    }
}

impl Version {
    pub(super) fn of(number: u32, at: usize) -> Result<Self, CompactError> {
        match number {
            3 => Ok(Self::V3),
            4 => Ok(Self::V4),
            other => Err(CompactError { expected: Expected::Version, found: other.into(), at }),
        }
    }
}

impl Fields for Version {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        let at = reader.at();
        let mut number = 0;
        u32::read(&mut number, reader)?;
        *self = Self::of(number, at)?;
        reader.context.version = *self;
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.context.version = *self;
        self.number().write(writer);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        self.number().visit(visitor);
    }
}

/// Bytes of a module that comes further on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ModuleSize(pub u32);

impl Fields for ModuleSize {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        self.0.read(reader)?;
        reader.context.next_module = self.0;
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.0.write(writer);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        self.0.visit(visitor);
    }
}

impl Shape {
    /// Each count with its name and bounds.
    fn counts(self) -> [(&'static str, u32, core::ops::RangeInclusive<u32>, Expected); 3] {
        [
            ("lines", self.lines, 1..=MAX_LINES, Expected::Lines),
            ("beams", self.beams, 0..=MAX_BEAMS, Expected::Beams),
            ("echoes", self.echoes, 1..=MAX_ECHOES, Expected::Echoes),
        ]
    }

    /// Refuses counts out of bounds, which memory would be asked for; `at`: offset of the first.
    pub(super) fn check(self, at: usize) -> Result<(), CompactError> {
        for (index, (_, count, bounds, expected)) in self.counts().into_iter().enumerate() {
            if !bounds.contains(&count) {
                return Err(CompactError { expected, found: count.into(), at: at + 4 * index });
            }
        }
        Ok(())
    }
}

impl Fields for Shape {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        let at = reader.at();
        for count in [&mut self.lines, &mut self.beams, &mut self.echoes] {
            count.read(reader)?;
        }
        self.check(at)?;
        reader.context.shape = *self;
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.context.shape = *self;
        self.counts().iter().for_each(|(_, count, ..)| count.write(writer));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        for (name, count, ..) in self.counts() {
            visitor.field(name, None);
            count.visit(visitor);
        }
        visitor.end();
    }
}

impl Fields for Content {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        self.echo.read(reader)?;
        self.beam.read(reader)?;
        reader.context.content = *self;
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.context.content = *self;
        [self.echo, self.beam].write(writer);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        visitor.field("echo", None);
        self.echo.visit(visitor);
        visitor.field("beam", None);
        self.beam.visit(visitor);
        visitor.end();
    }
}

/// Millimetres a count of distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceScale(pub f32);

impl Default for DistanceScale {
    fn default() -> Self {
        Self(1.0)
    }
}

impl Fields for DistanceScale {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        match reader.context.version {
            Version::V3 => *self = Self::default(),
            Version::V4 => self.0.read(reader)?,
        }
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        if writer.context.version == Version::V4 {
            self.0.write(writer);
        }
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        self.0.visit(visitor);
    }
}

/// The modules of a telegram, each led by its size.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Modules(pub Vec<Module>);

impl Fields for Modules {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        self.0.clear();
        while reader.context.next_module > 0 {
            let (at, claimed) = (reader.at(), reader.context.next_module);
            if self.0.len() == MAX_MODULES {
                let found = self.0.len() as u64 + 1;
                return Err(CompactError { expected: Expected::Modules, found, at });
            }
            reader.needs(claimed.into())?;
            let mut module = Module::default();
            module.read(reader)?;
            let read = (reader.at() - at) as u64;
            if read != u64::from(claimed) {
                let expected = Expected::ModuleSize(read);
                return Err(CompactError { expected, found: claimed.into(), at });
            }
            self.0.push(module);
        }
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.0.iter().for_each(|module| module.write(writer));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        list(&self.0, visitor);
    }
}

/// Bytes of a module's metadata without its lines: counters, sender, counts, and the four bytes and the size behind the lines.
const METADATA: u64 = 32 + 8;
/// Bytes a line adds: two times, three angles.
const METADATA_OF_LINE: u64 = 28;

impl Module {
    /// Bytes it takes on the wire.
    pub fn bytes(&self, version: Version) -> u64 {
        let scale = if version == Version::V4 { 4 } else { 0 };
        METADATA
            + scale
            + METADATA_OF_LINE * u64::from(self.shape.lines)
            + beams::bytes(self.shape, self.content)
    }

    /// Refuses counts out of bounds, and lists that are not as long as they say.
    fn check(&self) -> Result<(), EncodeError> {
        for (part, count, bounds, _) in self.shape.counts() {
            if !bounds.contains(&count) {
                let nearest = count.clamp(*bounds.start(), *bounds.end());
                return Err(EncodeError { part, expected: nearest.into(), found: count.into() });
            }
        }
        let lines = self.shape.lines as usize;
        let of_lines = [
            ("time_start_us", lines, self.time_start_us.0.len()),
            ("time_stop_us", lines, self.time_stop_us.0.len()),
            ("phi_rad", lines, self.phi_rad.0.len()),
            ("theta_start_rad", lines, self.theta_start_rad.0.len()),
            ("theta_stop_rad", lines, self.theta_stop_rad.0.len()),
        ];
        let of_beams = self.beams.lengths(self.shape, self.content);
        of_lines
            .into_iter()
            .chain(of_beams)
            .try_for_each(|(part, expected, found)| same(part, expected, found))
    }
}

fn same(part: &'static str, expected: usize, found: usize) -> Result<(), EncodeError> {
    if expected == found {
        return Ok(());
    }
    Err(EncodeError { part, expected: expected as u64, found: found as u64 })
}

impl ScanTelegram {
    /// Sets what follows from the rest: the sizes of its modules.
    #[must_use]
    pub fn seal(mut self) -> Self {
        let version = self.version;
        let mut next = 0;
        for module in self.modules.0.iter_mut().rev() {
            module.next_module_bytes = ModuleSize(next);
            next = u32::try_from(module.bytes(version)).unwrap_or(u32::MAX);
        }
        self.module_bytes = ModuleSize(next);
        self
    }

    /// Refuses what no reader could take apart.
    pub(super) fn check(&self) -> Result<(), EncodeError> {
        if self.modules.0.len() > MAX_MODULES {
            return same("modules", MAX_MODULES, self.modules.0.len());
        }
        let mut claimed = self.module_bytes;
        for module in &self.modules.0 {
            module.check()?;
            same("module_bytes", module.bytes(self.version) as usize, claimed.0 as usize)?;
            claimed = module.next_module_bytes;
        }
        same("module_bytes", 0, claimed.0 as usize)
    }
}
