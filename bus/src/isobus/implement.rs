//! The sprayer that a client describes: a boom whose sections stand one above the other.

use super::ddi;
use super::pool::{Device, ElementKind, Kind, NO_OBJECT, Object, Pool, property, trigger};
use crate::name::{Name, NameParts};

/// Numbers of elements in process data.
pub mod element {
    /// The sprayer.
    pub const DEVICE: u16 = 0;
    /// Where it hangs on the tractor.
    pub const CONNECTOR: u16 = 1;
    /// The boom.
    pub const BOOM: u16 = 2;
    /// The tank with its product.
    pub const TANK: u16 = 3;
    /// The first section; the others follow.
    pub const FIRST_SECTION: u16 = 4;
}

/// What there is to tell of a sprayer.
#[derive(Clone, Debug, PartialEq)]
pub struct Implement {
    /// The NAME of its control function.
    pub name: Name,
    /// Width that a pass treats, mm; 0 where it is not known.
    pub width_mm: i32,
    /// The nozzles are so far behind the connector, mm.
    pub behind_mm: i32,
    /// From a command to product, ms.
    pub on_ms: i32,
    /// From a command to none any more, ms.
    pub off_ms: i32,
    /// What its tank holds at the beginning, mL; none where that is not known.
    pub tank_ml: Option<i32>,
    /// Its sections by number, from 1.
    pub sections: Vec<ImplementSection>,
}

/// One section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplementSection {
    /// Its number in commands.
    pub number: u16,
    /// It sprays to the left.
    pub is_left: bool,
    /// Lower and upper end of its share of height, mm.
    pub height_mm: (i32, i32),
    /// Its nozzles.
    pub nozzles: i32,
    /// What they give together while it is open, litres per minute.
    pub flow_l_min: f64,
}

/// English, decimal point, metric: `en`, formats and units as AgIsoStack++ packs them (`isobus_language_command_interface.cpp`,
/// `send_language_command`).
pub const LOCALIZATION: [u8; 7] = [b'e', b'n', 0x50, 0x00, 0x00, 0x00, 0xFF];

impl Implement {
    /// The NAME of the virtual sprayer: agriculture, sprayers, section control (AgIsoStack++, `can_NAME.hpp`, `SectionOnOffControl`).
    pub fn name() -> Name {
        NameParts {
            self_configurable: true,
            industry_group: 2,
            class_instance: 0,
            class: 6,
            function: 129,
            function_instance: 0,
            ecu_instance: 0,
            manufacturer: 2047,
            identity: 4,
        }
        .into()
    }

    /// Words of condensed work states that its sections take.
    pub fn words(&self) -> u16 {
        u16::try_from(self.sections.len().div_ceil(usize::from(ddi::SECTIONS))).unwrap_or(ddi::WORDS)
    }

    /// The pool that describes it. Its structure label follows from what it holds: another boom has another one.
    pub fn pool(&self) -> Pool {
        let mut build = Build { objects: Vec::new(), next: 100 };
        let metres = build.presentation("m", 0.001, 3);
        let litres = build.presentation("l", 0.001, 1);
        let rate = build.presentation("l/ha", 0.0001, 1);
        build.element("Sprayer", ElementKind::Device, element::DEVICE, 0, device_values());
        let top = Build::id(element::DEVICE);
        let connector = vec![fixed("Connector X", ddi::OFFSET_X, 0, metres)];
        build.element("Connector", ElementKind::Connector, element::CONNECTOR, top, connector);
        let boom = self.boom_values(metres);
        build.element("Boom", ElementKind::Function, element::BOOM, top, boom);
        let boom = Build::id(element::BOOM);
        let tank = self.tank_values(litres, rate);
        build.element("Product", ElementKind::Bin, element::TANK, boom, tank);
        for (place, section) in self.sections.iter().enumerate() {
            let number = element::FIRST_SECTION + u16::try_from(place).unwrap_or(0);
            let values = self.section_values(section, metres);
            let name = format!("Section {}", section.number);
            build.element(&name, ElementKind::Section, number, boom, values);
        }
        let device = Device {
            software: "1".to_owned(),
            name: self.name,
            serial: "1".to_owned(),
            structure: structure(&build.objects),
            localization: LOCALIZATION,
            extended: Vec::new(),
        };
        let device = Object { id: 0, designator: "rowscan sprayer".to_owned(), kind: Kind::Device(device) };
        let mut objects = vec![device];
        objects.extend(build.objects);
        Pool(objects)
    }

    fn boom_values(&self, metres: u16) -> Vec<Object> {
        let mut values = vec![
            fixed("Offset X", ddi::OFFSET_X, -self.behind_mm, metres),
            fixed("Offset Y", ddi::OFFSET_Y, 0, metres),
            fixed("Offset Z", ddi::OFFSET_Z, 0, metres),
            told("Working width", ddi::ACTUAL_WIDTH, metres),
            told("Work state", ddi::ACTUAL_WORK, NO_OBJECT),
            set("Master switch", ddi::SETPOINT_WORK, NO_OBJECT),
            set("Section control", ddi::SECTION_CONTROL, NO_OBJECT),
            told("Turn-on time", ddi::TURN_ON_TIME, NO_OBJECT),
            told("Turn-off time", ddi::TURN_OFF_TIME, NO_OBJECT),
        ];
        for word in 0..self.words() {
            values.push(told("Sections", ddi::ACTUAL_SECTIONS + word, NO_OBJECT));
            values.push(set("Sections wanted", ddi::SETPOINT_SECTIONS + word, NO_OBJECT));
        }
        values
    }

    fn tank_values(&self, litres: u16, rate: u16) -> Vec<Object> {
        let mut values = vec![
            set("Rate wanted", ddi::SETPOINT_RATE, rate),
            told("Rate", ddi::ACTUAL_RATE, rate),
            set("Prescription", ddi::PRESCRIPTION_CONTROL, NO_OBJECT),
        ];
        values.extend(self.tank_ml.map(|_| told("Content", ddi::TANK, litres)));
        values
    }

    /// Sections lie as if the boom was folded down to both sides: a task controller knows no height, and takes sections of one offset for one (assumed).
    /// The height itself stands in offset Z.
    fn section_values(&self, section: &ImplementSection, metres: u16) -> Vec<Object> {
        let (low, high) = section.height_mm;
        let middle = low + (high - low) / 2;
        let across = if section.is_left { -middle } else { middle };
        vec![
            fixed("Offset X", ddi::OFFSET_X, -self.behind_mm, metres),
            fixed("Offset Y", ddi::OFFSET_Y, across, metres),
            fixed("Offset Z", ddi::OFFSET_Z, middle, metres),
            fixed("Width", ddi::ACTUAL_WIDTH, high - low, metres),
            fixed("Nozzles", ddi::SUB_UNITS, section.nozzles, NO_OBJECT),
        ]
    }
}

fn device_values() -> Vec<Object> {
    let all = Kind::Process {
        ddi: ddi::DEFAULT_SET,
        properties: 0,
        triggers: trigger::TOTAL,
        presentation: NO_OBJECT,
    };
    vec![
        told("Work state", ddi::ACTUAL_WORK, NO_OBJECT),
        told("Canopy height", ddi::CANOPY_HEIGHT, NO_OBJECT),
        Object { id: 0, designator: "Default set".to_owned(), kind: all },
    ]
}

fn process(designator: &str, ddi: u16, properties: u8, presentation: u16) -> Object {
    let triggers = trigger::TIME | trigger::ON_CHANGE;
    let kind = Kind::Process { ddi, properties, triggers, presentation };
    Object { id: 0, designator: designator.to_owned(), kind }
}

/// A value that is told.
fn told(designator: &str, ddi: u16, presentation: u16) -> Object {
    process(designator, ddi, property::DEFAULT_SET, presentation)
}

/// A value that can be set.
fn set(designator: &str, ddi: u16, presentation: u16) -> Object {
    process(designator, ddi, property::DEFAULT_SET | property::SETTABLE, presentation)
}

/// A value that stays.
fn fixed(designator: &str, ddi: u16, value: i32, presentation: u16) -> Object {
    Object { id: 0, designator: designator.to_owned(), kind: Kind::Property { ddi, value, presentation } }
}

/// Objects with numbers of their own: elements below 100, all others from there on.
struct Build {
    objects: Vec<Object>,
    next: u16,
}

impl Build {
    /// The object of the element with this number.
    fn id(element: u16) -> u16 {
        element + 1
    }

    fn add(&mut self, object: Object) -> u16 {
        let id = self.next;
        self.next += 1;
        self.objects.push(Object { id, ..object });
        id
    }

    fn presentation(&mut self, unit: &str, scale: f32, decimals: u8) -> u16 {
        let kind = Kind::Presentation { offset: 0, scale, decimals };
        self.add(Object { id: 0, designator: unit.to_owned(), kind })
    }

    fn element(&mut self, name: &str, kind: ElementKind, number: u16, parent: u16, values: Vec<Object>) {
        let children = values.into_iter().map(|value| self.add(value)).collect();
        let kind = Kind::Element { kind, number, parent, children };
        self.objects.push(Object { id: Self::id(number), designator: name.to_owned(), kind });
    }
}

/// Seven letters that follow from the objects, so that a task controller that has kept another pool notices.
fn structure(objects: &[Object]) -> [u8; 7] {
    let bytes = Pool(objects.to_vec()).bytes(super::pool::Version::Fourth);
    // FNV-1a, 64 bits.
    let hash = bytes.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
    });
    let mut rest = hash;
    std::array::from_fn(|_| {
        let letter = b'A' + (rest % 26) as u8;
        rest /= 26;
        letter
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::pool::{PoolFault, Version};
    use super::*;
    use proptest::prelude::*;

    /// A boom of so many sections, left and right in turns, half a metre each.
    pub(crate) fn implement(sections: u16) -> Implement {
        let section = |place: u16| ImplementSection {
            number: place + 1,
            is_left: place.is_multiple_of(2),
            height_mm: (500 * i32::from(place / 2), 500 * i32::from(place / 2 + 1)),
            nozzles: 2,
            flow_l_min: 2.0,
        };
        Implement {
            name: Implement::name(),
            width_mm: 4000,
            behind_mm: 2000,
            on_ms: 15,
            off_ms: 10,
            tank_ml: Some(400_000),
            sections: (0..sections).map(section).collect(),
        }
    }

    #[test]
    fn a_boom_is_read_as_it_was_described() {
        for (sections, words) in [(1, 1), (4, 1), (16, 1), (17, 2), (64, 4)] {
            let implement = implement(sections);
            let pool = implement.pool();
            for version in [Version::Third, Version::Fourth] {
                assert_eq!(Pool::read(&pool.bytes(version), version).as_ref(), Ok(&pool));
            }
            assert_eq!(pool.elements(ElementKind::Section).len(), usize::from(sections));
            assert_eq!(
                (pool.elements(ElementKind::Function), implement.words()),
                (vec![element::BOOM], words)
            );
            let settable = |wanted: u16| {
                let mut all = pool.process_data().into_iter();
                all.any(|(of, ddi, properties, _)| of == 2 && ddi == wanted && properties & 2 != 0)
            };
            assert!(settable(290) && settable(289) && !settable(161));
            assert_eq!(settable(291), words > 1);
            // Sections of a side lie beside each other: no two have one offset.
            let offsets: std::collections::BTreeSet<_> = (0..sections)
                .map(|place| pool.property(element::FIRST_SECTION + place, ddi::OFFSET_Y))
                .collect();
            assert_eq!(offsets.len(), usize::from(sections));
            assert_eq!(pool.property(element::FIRST_SECTION, ddi::OFFSET_Z), Some(250));
        }
        let labels: std::collections::BTreeSet<_> =
            (1..=64).map(|sections| implement(sections).pool().device().unwrap().structure).collect();
        assert_eq!(labels.len(), 64, "each boom has a label of its own");
    }

    #[test]
    fn the_first_bytes_are_those_that_other_stacks_write() {
        let bytes = implement(2).pool().bytes(Version::Fourth);
        let name = Implement::name().0.to_le_bytes();
        let head = [b"DVC\x00\x00\x0Frowscan sprayer\x011".as_slice(), &name, b"\x011"].concat();
        assert_eq!(bytes[..head.len()], head);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_object() {
        let wrong = |change: &dyn Fn(&mut Pool)| {
            let mut pool = implement(2).pool();
            change(&mut pool);
            Pool::read(&pool.bytes(Version::Fourth), Version::Fourth).expect_err("wrong")
        };
        let element = |pool: &mut Pool, wanted: u16, change: &dyn Fn(&mut u16, &mut u16, &mut Vec<u16>)| {
            for object in &mut pool.0 {
                if let Kind::Element { number, parent, children, .. } = &mut object.kind
                    && object.id == wanted
                {
                    change(number, parent, children);
                }
            }
        };
        let error = wrong(&|pool| element(pool, 3, &|_, _, children| children.push(999)));
        assert_eq!((error.object, error.parent, &error.fault), (Some(3), Some(1), &PoolFault::Child(999)));
        assert_eq!(error.to_string(), "object 3: its child 999 is no process data or property of this pool");
        assert_eq!(error.fault.code(), 2);
        let error = wrong(&|pool| element(pool, 5, &|_, parent, _| *parent = 777));
        assert_eq!((error.object, error.fault), (Some(5), PoolFault::Parent(777)));
        let error = wrong(&|pool| {
            element(pool, 3, &|_, parent, _| *parent = 4);
        });
        assert_eq!((error.object, error.fault), (Some(3), PoolFault::Circle));
        let error = wrong(&|pool| element(pool, 5, &|number, _, _| *number = 2));
        assert_eq!((error.object, error.fault), (Some(5), PoolFault::ElementNumber(2)));
        let error = wrong(&|pool| pool.0.push(pool.0[0].clone()));
        assert_eq!((error.object, error.fault), (Some(0), PoolFault::Twice));
        let error = wrong(&|pool| drop(pool.0.remove(0)));
        assert_eq!((error.object, error.fault), (None, PoolFault::Device));
        let cut = implement(2).pool().bytes(Version::Fourth);
        let error = Pool::read(&cut[..cut.len() - 1], Version::Fourth).expect_err("cut");
        assert!(matches!(error.fault, PoolFault::Cut(_)) && error.object.is_some(), "{error}");
        let error = Pool::read(b"DVX\0\0", Version::Fourth).expect_err("no table");
        assert_eq!(error.fault, PoolFault::Table { at: 0, found: *b"DVX" });
        let error = Pool::read(&[0; 65 * 1024], Version::Fourth).expect_err("long");
        assert_eq!(error.fault, PoolFault::Bytes(66_560));
    }

    proptest! {
        /// Hostile bytes are refused or read, in bounds; a pool with a byte changed is refused or is another sound pool.
        #[test]
        fn any_bytes_are_refused_or_read(
            at in any::<prop::sample::Index>(), byte in any::<u8>(), cut in any::<prop::sample::Index>(),
            noise in prop::collection::vec(any::<u8>(), 0..300),
        ) {
            let mut bytes = implement(4).pool().bytes(Version::Fourth);
            let place = at.index(bytes.len());
            bytes[place] = byte;
            if let Ok(pool) = Pool::read(&bytes, Version::Fourth) {
                prop_assert_eq!(pool.bytes(Version::Fourth), bytes.clone());
            }
            bytes.truncate(cut.index(bytes.len()));
            let _ = Pool::read(&bytes, Version::Fourth);
            let _ = Pool::read(&noise, Version::Third);
        }
    }
}
