//! What state valves are expected to have.

/// The state of a valve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValveState {
    /// Something flows.
    Open,
    /// Nothing flows.
    Closed,
}

impl ValveState {
    /// As it is written.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Closed => "closed",
        }
    }

    pub(super) fn named(name: &str) -> Result<Self, String> {
        let known = [Self::Open, Self::Closed].into_iter().find(|state| state.name() == name);
        known.ok_or_else(|| format!("`all`: expected \"open\" or \"closed\", found \"{name}\""))
    }
}
