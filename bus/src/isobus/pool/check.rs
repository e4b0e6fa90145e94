//! What must hold of a pool as a whole.

use std::collections::{BTreeMap, BTreeSet};

use super::{ElementKind, Kind, NO_OBJECT, Object, Pool, PoolError, PoolFault, property};

/// Element numbers have twelve bits.
const MOST_ELEMENT: u16 = 0xFFF;

impl Pool {
    /// Checks that its objects fit together.
    ///
    /// # Errors
    /// The first thing that is wrong, with the number of its object.
    pub fn check(&self) -> Result<(), PoolError> {
        let mut by_id = BTreeMap::new();
        for object in &self.0 {
            if object.id == NO_OBJECT || by_id.insert(object.id, object).is_some() {
                return Err(object.wrong(PoolFault::Twice));
            }
        }
        let devices: Vec<u16> = self.of(|kind| matches!(kind, Kind::Device(_)));
        if devices != [0] {
            return Err(PoolError {
                object: devices.into_iter().find(|id| *id != 0),
                parent: None,
                fault: PoolFault::Device,
            });
        }
        let is_device = |kind: &Kind| matches!(kind, Kind::Element { kind: ElementKind::Device, .. });
        let elements = self.of(is_device);
        if elements.len() != 1 {
            return Err(PoolError {
                object: elements.get(1).copied(),
                parent: None,
                fault: PoolFault::DeviceElement,
            });
        }
        let mut numbers = BTreeSet::new();
        for object in &self.0 {
            object.check(&by_id, &mut numbers)?;
        }
        Ok(())
    }

    fn of(&self, which: impl Fn(&Kind) -> bool) -> Vec<u16> {
        self.0.iter().filter(|object| which(&object.kind)).map(|object| object.id).collect()
    }
}

impl Object {
    fn parent(&self) -> Option<u16> {
        match self.kind {
            Kind::Element { parent, .. } => Some(parent),
            _ => None,
        }
    }

    fn wrong(&self, fault: PoolFault) -> PoolError {
        PoolError { object: Some(self.id), parent: self.parent(), fault }
    }

    fn check(&self, by_id: &BTreeMap<u16, &Object>, numbers: &mut BTreeSet<u16>) -> Result<(), PoolError> {
        let shown = |presentation: u16| match by_id.get(&presentation).map(|object| &object.kind) {
            _ if presentation == NO_OBJECT => Ok(()),
            Some(Kind::Presentation { .. }) => Ok(()),
            _ => Err(self.wrong(PoolFault::Presentation(presentation))),
        };
        match &self.kind {
            Kind::Device(_) => Ok(()),
            Kind::Element { number, children, .. } => {
                if *number > MOST_ELEMENT || !numbers.insert(*number) {
                    return Err(self.wrong(PoolFault::ElementNumber(*number)));
                }
                self.check_parents(by_id)?;
                self.check_children(children, by_id)
            }
            Kind::Process { properties, presentation, .. } => {
                let both = property::SETTABLE | property::CONTROL_SOURCE;
                if properties & both == both {
                    return Err(self.wrong(PoolFault::SettableSource));
                }
                shown(*presentation)
            }
            Kind::Property { presentation, .. } => shown(*presentation),
            Kind::Presentation { scale, .. } if !scale.is_finite() => Err(self.wrong(PoolFault::Scale)),
            Kind::Presentation { .. } => Ok(()),
        }
    }

    /// Every way up ends at the device.
    fn check_parents(&self, by_id: &BTreeMap<u16, &Object>) -> Result<(), PoolError> {
        let (mut seen, mut of) = (BTreeSet::from([self.id]), self);
        while let Some(parent) = of.parent() {
            let up =
                by_id.get(&parent).filter(|up| matches!(up.kind, Kind::Device(_) | Kind::Element { .. }));
            let up = up.ok_or_else(|| of.wrong(PoolFault::Parent(parent)))?;
            if !seen.insert(parent) {
                return Err(self.wrong(PoolFault::Circle));
            }
            of = up;
        }
        Ok(())
    }

    fn check_children(&self, children: &[u16], by_id: &BTreeMap<u16, &Object>) -> Result<(), PoolError> {
        let mut ddis = BTreeSet::new();
        for child in children {
            match by_id.get(child).map(|object| &object.kind) {
                Some(Kind::Process { ddi, .. } | Kind::Property { ddi, .. }) => {
                    if !ddis.insert(*ddi) {
                        return Err(self.wrong(PoolFault::DdiTwice(*ddi)));
                    }
                }
                _ => return Err(self.wrong(PoolFault::Child(*child))),
            }
        }
        Ok(())
    }
}
