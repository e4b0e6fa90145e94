//! One look-up over both families of scanners.

use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;

use super::{CompactOutput, Model};
use crate::lms2xx;
use crate::optics::Optics;

/// A scanner model of either family.
#[derive(Clone, Copy, Debug)]
pub enum AnyModel {
    /// Speaks CoLa.
    Cola(&'static Model),
    /// Speaks the LMS2xx's own telegrams, on a serial line.
    Lms2xx(&'static lms2xx::model::Model),
}

impl From<&'static Model> for AnyModel {
    fn from(model: &'static Model) -> Self {
        Self::Cola(model)
    }
}

impl From<&'static lms2xx::model::Model> for AnyModel {
    fn from(model: &'static lms2xx::model::Model) -> Self {
        Self::Lms2xx(model)
    }
}

/// A name that is no scanner model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown scanner model `{found}`; known are {known} (see `rowscan models`)")]
pub struct UnknownModel {
    /// What was asked for.
    pub found: String,
    /// All names.
    pub known: String,
}

/// Models are told apart by their names.
impl PartialEq for AnyModel {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for AnyModel {}

impl AnyModel {
    /// All, CoLa first.
    pub fn all() -> impl Iterator<Item = Self> {
        let cola = super::all().map(Self::Cola);
        cola.chain(lms2xx::model::MODELS.iter().copied().map(Self::Lms2xx))
    }

    /// The model of that name, whatever the case.
    ///
    /// ```
    /// use rowscan_protocol::model::AnyModel;
    /// assert_eq!(AnyModel::by_name("LMS291").unwrap().title(), "LMS291-S05");
    /// assert_eq!(AnyModel::by_name("lms111").unwrap().title(), "LMS111");
    /// ```
    pub fn by_name(name: &str) -> Option<Self> {
        Self::all().find(|model| model.name().eq_ignore_ascii_case(name))
    }

    /// The same, or what to tell the user.
    ///
    /// # Errors
    /// There is no model of that name.
    pub fn named(name: &str) -> Result<Self, UnknownModel> {
        Self::by_name(name).ok_or_else(|| UnknownModel {
            found: name.to_owned(),
            known: Self::all().map(Self::name).collect::<Vec<_>>().join(", "),
        })
    }

    /// The models that a scanner can be by what it says it is: its DeviceIdent or its type text, and its firmware. Several where it names a family;
    /// none where no model here is called so.
    ///
    /// ```
    /// use rowscan_protocol::model::AnyModel;
    /// let names = |ident, firmware| AnyModel::of_device(ident, firmware).into_iter().map(AnyModel::name).collect::<Vec<_>>();
    /// assert_eq!(names("LMS200;S18063", "V02.19"), ["lms200"]);
    /// assert_eq!(names("LMS5xx_FieldEval_PRO", "S1.60-24.06.2015"), ["lms511", "lms500"]);
    /// assert_eq!(names("MRS1xxxx", "1.0.0.0R"), ["mrs1000"]);
    /// ```
    pub fn of_device(ident: &str, firmware: &str) -> Vec<Self> {
        match lms2xx::model::by_type_text(&alloc::format!("{};{firmware}", ident.trim())) {
            Some(serial) => alloc::vec![Self::Lms2xx(serial)],
            None => super::by_ident(ident).map(Self::Cola).collect(),
        }
    }

    /// Turns from one line of a layer to its next: those of the other layers lie between.
    pub fn turns_a_line(self) -> u32 {
        match self {
            Self::Cola(model) => model.layers.len().max(1) as u32,
            Self::Lms2xx(_) => 1,
        }
    }

    /// Name on the command line and in rig files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cola(model) => model.name,
            Self::Lms2xx(model) => model.name,
        }
    }

    /// Name in print.
    pub fn title(self) -> &'static str {
        match self {
            Self::Cola(model) => model.title,
            Self::Lms2xx(model) => model.title,
        }
    }

    /// Angle between beams out of the box, 1/10000°.
    pub fn default_step(self) -> u16 {
        match self {
            Self::Cola(model) => model.default_mode.step,
            Self::Lms2xx(model) => model.default_variant.beams().step,
        }
    }

    /// Whether its scans tell what a wheel encoder counts; an LMS2xx has no input for one.
    pub fn tells_ticks(self) -> bool {
        matches!(self, Self::Cola(model) if model.tells_ticks())
    }

    /// What light does in it.
    pub fn optics(self) -> &'static Optics {
        match self {
            Self::Cola(model) => &model.optics,
            Self::Lms2xx(model) => &model.optics,
        }
    }

    /// Echoes it can tell apart.
    pub fn echoes(self) -> u8 {
        match self {
            Self::Cola(model) => model.echoes,
            // The first return wins.
            Self::Lms2xx(_) => 1,
        }
    }

    /// Nearest and farthest range it reports, metres.
    pub fn range_m(self) -> (f64, f64) {
        match self {
            Self::Cola(model) => (model.min_range_m, model.max_range_m),
            Self::Lms2xx(model) => (model.min_range_m, model.max_range_m),
        }
    }

    /// Its Compact telegrams over UDP; none where it sends none.
    pub fn compact(self) -> Option<&'static CompactOutput> {
        match self {
            Self::Cola(model) => model.compact,
            Self::Lms2xx(_) => None,
        }
    }

    /// The model of the LMS2xx family; none if it speaks CoLa.
    pub fn lms2xx(self) -> Option<&'static lms2xx::model::Model> {
        match self {
            Self::Cola(_) => None,
            Self::Lms2xx(model) => Some(model),
        }
    }
}
