//! Device descriptor object pools: what a client tells a task controller of its machine.
//!
//! Layout of the objects: AgIsoStack++, `isobus_task_controller_client_objects.cpp`, the `get_binary_object` of each.

mod check;
mod read;
mod write;

use std::fmt;

pub use write::Version;

use crate::name::Name;

/// "No object" where one may be named.
pub const NO_OBJECT: u16 = 0xFFFF;
/// The most bytes of a pool that is read.
pub const MOST_BYTES: usize = 64 * 1024;
/// The most objects of a pool that is read.
pub const MOST_OBJECTS: usize = 4096;
/// The longest designator, bytes of UTF-8.
pub const LONGEST_DESIGNATOR: usize = 128;

/// What a process data object offers: bits (AgIsoStack++, `isobus_task_controller_client_objects.hpp`, `PropertiesBit`).
pub mod property {
    /// It is told without a trigger once the default set is asked for.
    pub const DEFAULT_SET: u8 = 0x01;
    /// It can be set.
    pub const SETTABLE: u8 = 0x02;
    /// Its setpoints may go to others.
    pub const CONTROL_SOURCE: u8 = 0x04;
}

/// What a value may be told by: bits (the same file, `AvailableTriggerMethods`).
pub mod trigger {
    /// So often.
    pub const TIME: u8 = 0x01;
    /// Every so many millimetres.
    pub const DISTANCE: u8 = 0x02;
    /// Above or below a threshold.
    pub const THRESHOLD: u8 = 0x04;
    /// When it changes.
    pub const ON_CHANGE: u8 = 0x08;
    /// It is a total.
    pub const TOTAL: u8 = 0x10;
}

/// What an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementKind {
    /// The device itself; there is one.
    Device,
    /// A function, such as a boom.
    Function,
    /// A tank.
    Bin,
    /// A section.
    Section,
    /// A nozzle.
    Unit,
    /// Where it hangs on the tractor.
    Connector,
    /// Where its receiver is.
    Navigation,
}

impl ElementKind {
    const ALL: [Self; 7] = [
        Self::Device,
        Self::Function,
        Self::Bin,
        Self::Section,
        Self::Unit,
        Self::Connector,
        Self::Navigation,
    ];

    fn number(self) -> u8 {
        self as u8 + 1
    }

    fn of(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.number() == number)
    }
}

/// One object of a pool.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its number in the pool.
    pub id: u16,
    /// Its name; of a presentation, its unit.
    pub designator: String,
    /// What it holds.
    pub kind: Kind,
}

/// What an object holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// DVC: the device.
    Device(Device),
    /// DET: a part of it.
    Element {
        /// What it is.
        kind: ElementKind,
        /// Its number in process data.
        number: u16,
        /// The object that it is part of.
        parent: u16,
        /// Its process data and properties.
        children: Vec<u16>,
    },
    /// DPD: a value that changes.
    Process {
        /// What it is.
        ddi: u16,
        /// Bits of [`property`].
        properties: u8,
        /// Bits of [`trigger`].
        triggers: u8,
        /// How it is shown.
        presentation: u16,
    },
    /// DPT: a value that stays.
    Property {
        /// What it is.
        ddi: u16,
        /// The value.
        value: i32,
        /// How it is shown.
        presentation: u16,
    },
    /// DVP: how values are shown.
    Presentation {
        /// Added before scaling.
        offset: i32,
        /// Factor.
        scale: f32,
        /// Digits behind the point.
        decimals: u8,
    },
}

/// The device of a pool.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// Version of its software.
    pub software: String,
    /// The NAME of the client.
    pub name: Name,
    /// Its serial number.
    pub serial: String,
    /// Changes whenever the pool does.
    pub structure: [u8; 7],
    /// Language and units of the pool.
    pub localization: [u8; 7],
    /// Continues `structure`; up to 32 bytes, from version 4 on.
    pub extended: Vec<u8>,
}

/// A pool: its objects in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pool(pub Vec<Object>);

/// Why a pool is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct PoolError {
    /// The object at fault, where it is known.
    pub object: Option<u16>,
    /// What it is part of, where that is known.
    pub parent: Option<u16>,
    /// What is wrong.
    pub fault: PoolFault,
}

impl fmt::Display for PoolError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(object) = self.object {
            write!(out, "object {object}: ")?;
        }
        self.fault.fmt(out)
    }
}

/// What is wrong with a pool.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PoolFault {
    /// Longer than any that is read.
    #[error("expected up to {MOST_BYTES} bytes, found {0}")]
    Bytes(usize),
    /// More objects than are read.
    #[error("expected up to {MOST_OBJECTS} objects, found more")]
    Objects,
    /// It ends within an object.
    #[error("the pool ends at byte {0}, within an object")]
    Cut(usize),
    /// No object begins so.
    #[error("at byte {at}: expected DVC, DET, DPD, DPT or DVP, found {found:02X?}")]
    Table {
        /// Where.
        at: usize,
        /// What stands there.
        found: [u8; 3],
    },
    /// A designator that is none.
    #[error("expected a designator of up to {LONGEST_DESIGNATOR} bytes of UTF-8")]
    Designator,
    /// An element type that is not known.
    #[error("expected an element type of 1 to 7, found {0}")]
    ElementKind(u8),
    /// Two objects of one number.
    #[error("another object has this number already")]
    Twice,
    /// Not one device with the number 0.
    #[error("expected one device (DVC), with the number 0")]
    Device,
    /// Not one element of the type device.
    #[error("expected one element (DET) of the type device")]
    DeviceElement,
    /// An element number that is taken or too high.
    #[error("expected an element number of its own, 0 to 4095, found {0}")]
    ElementNumber(u16),
    /// What it is part of is not there.
    #[error("its parent {0} is no device or element of this pool")]
    Parent(u16),
    /// It is part of itself.
    #[error("it is part of itself")]
    Circle,
    /// What is part of it is not there.
    #[error("its child {0} is no process data or property of this pool")]
    Child(u16),
    /// How it is shown is not there.
    #[error("its presentation {0} is none of this pool")]
    Presentation(u16),
    /// Two properties that exclude each other.
    #[error("it is settable and a control source; expected one of them")]
    SettableSource,
    /// A factor that is no number.
    #[error("its scale is no number")]
    Scale,
    /// One element has a value twice.
    #[error("it has DDI {0} twice")]
    DdiTwice(u16),
}

impl PoolFault {
    /// The bits that a task controller answers an activation with (AgIsoStack++, `isobus_task_controller_server.hpp`, `ObjectPoolErrorCodes`).
    pub fn code(&self) -> u8 {
        match self {
            Self::Parent(_) | Self::Child(_) | Self::Presentation(_) => 0x02,
            Self::ElementKind(_) | Self::SettableSource => 0x01,
            _ => 0x04,
        }
    }
}

impl Pool {
    /// The device; there is one in a pool that was checked.
    pub fn device(&self) -> Option<&Device> {
        self.0.iter().find_map(|object| match &object.kind {
            Kind::Device(device) => Some(device),
            _ => None,
        })
    }

    /// The object of this number.
    pub fn object(&self, id: u16) -> Option<&Object> {
        self.0.iter().find(|object| object.id == id)
    }

    /// Elements of this kind by their numbers in process data, in the order of these.
    pub fn elements(&self, wanted: ElementKind) -> Vec<u16> {
        let numbers = self.0.iter().filter_map(|object| match object.kind {
            Kind::Element { kind, number, .. } if kind == wanted => Some(number),
            _ => None,
        });
        let mut numbers: Vec<u16> = numbers.collect();
        numbers.sort_unstable();
        numbers
    }

    /// True if it has an element with this number, though that may have properties only.
    pub fn has_element(&self, wanted: u16) -> bool {
        self.0.iter().any(|object| matches!(object.kind, Kind::Element { number, .. } if number == wanted))
    }

    /// Process data by element and DDI, with its properties and triggers.
    pub fn process_data(&self) -> Vec<(u16, u16, u8, u8)> {
        let mut all = Vec::new();
        for object in &self.0 {
            let Kind::Element { number, children, .. } = &object.kind else { continue };
            for child in children {
                if let Some(Kind::Process { ddi, properties, triggers, .. }) =
                    self.object(*child).map(|object| &object.kind)
                {
                    all.push((*number, *ddi, *properties, *triggers));
                }
            }
        }
        all
    }

    /// A property of an element.
    pub fn property(&self, element: u16, wanted: u16) -> Option<i32> {
        let of = self.0.iter().find_map(|object| match &object.kind {
            Kind::Element { number, children, .. } if *number == element => Some(children),
            _ => None,
        })?;
        of.iter().find_map(|child| match self.object(*child)?.kind {
            Kind::Property { ddi, value, .. } if ddi == wanted => Some(value),
            _ => None,
        })
    }
}
