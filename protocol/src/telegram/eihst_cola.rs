//! `EIHstCola`: the dialect of the host interface.

use super::Variable;
use super::wire::fields;
use crate::frame::Dialect;

fields! {
    /// Dialect of the host interface. The answer still comes in the old one.
    pub struct HostDialect {
        /// 0 CoLa A, 1 CoLa B.
        pub code: u8,
    }
}

impl Variable for HostDialect {
    const NAME: &'static str = "EIHstCola";
}

impl HostDialect {
    /// The dialect the code stands for.
    pub fn dialect(&self) -> Option<Dialect> {
        match self.code {
            0 => Some(Dialect::A),
            1 => Some(Dialect::B),
            _ => None,
        }
    }
}

impl From<Dialect> for HostDialect {
    fn from(dialect: Dialect) -> Self {
        Self { code: u8::from(dialect == Dialect::B) }
    }
}
