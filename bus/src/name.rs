//! The NAME: 64 bits that say what a control function is, and decide who keeps an address (ISO 11783-5, SAE J1939-81).

/// A control function's NAME. The smaller number has the better claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Name(pub u64);

/// The parts of a [`Name`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NameParts {
    /// Takes another address when it loses one.
    pub self_configurable: bool,
    /// 2 is agriculture and forestry.
    pub industry_group: u8,
    /// Which of several alike systems.
    pub class_instance: u8,
    /// Device class; 1 tractor, 6 sprayers.
    pub class: u8,
    /// What it does.
    pub function: u8,
    /// Which of several with the same function.
    pub function_instance: u8,
    /// Which of several that make up a function together.
    pub ecu_instance: u8,
    /// Manufacturer code, 11 bits; we have none registered and say 2047.
    pub manufacturer: u16,
    /// Serial number, 21 bits.
    pub identity: u32,
}

impl From<NameParts> for Name {
    fn from(parts: NameParts) -> Self {
        let field = |value: u64, bits: u32, at: u32| (value & ((1 << bits) - 1)) << at;
        Self(
            field(parts.identity.into(), 21, 0)
                | field(parts.manufacturer.into(), 11, 21)
                | field(parts.ecu_instance.into(), 3, 32)
                | field(parts.function_instance.into(), 5, 35)
                | field(parts.function.into(), 8, 40)
                | field(parts.class.into(), 7, 49)
                | field(parts.class_instance.into(), 4, 56)
                | field(parts.industry_group.into(), 3, 60)
                | field(parts.self_configurable.into(), 1, 63),
        )
    }
}

impl Name {
    /// Whether it takes another address when it loses one.
    pub fn is_self_configurable(self) -> bool {
        self.0 >> 63 == 1
    }

    /// The virtual tractor: agriculture, tractor, machine control; it keeps to the address it prefers.
    pub fn tractor() -> Self {
        Self::tractor_parts().into()
    }

    /// A controller of a sprayer's valves: agriculture, class of sprayers; the function is assumed. It keeps to its address.
    pub fn sprayer_controller() -> Self {
        NameParts { class: 6, function: 133, ..Self::tractor_parts() }.into()
    }

    /// The boom's sensors: agriculture, class of sprayers, a function of its own class without a registered number; it takes what address is free.
    pub fn boom() -> Self {
        NameParts { self_configurable: true, class: 6, function: 254, identity: 3, ..Self::tractor_parts() }
            .into()
    }

    /// The parts of the tractor's.
    pub fn tractor_parts() -> NameParts {
        NameParts {
            self_configurable: false,
            industry_group: 2,
            class_instance: 0,
            class: 1,
            function: 132,
            function_instance: 0,
            ecu_instance: 0,
            manufacturer: 2047,
            identity: 1,
        }
    }

    /// The canopy sensor: agriculture, sprayers, a function of its own class without a registered number; it takes what address is free.
    /// `instance` tells several on one machine apart.
    pub fn canopy(instance: u8) -> Self {
        NameParts {
            self_configurable: true,
            industry_group: 2,
            class_instance: 0,
            class: 6,
            function: 255,
            function_instance: instance,
            ecu_instance: 0,
            manufacturer: 2047,
            identity: 2,
        }
        .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_stand_where_j1939_has_them() {
        let name = Name::tractor().0.to_le_bytes();
        assert_eq!(name, [0x01, 0x00, 0xE0, 0xFF, 0x00, 132, 1 << 1, 2 << 4]);
        assert!(Name::canopy(0).is_self_configurable() && !Name::tractor().is_self_configurable());
    }
}
