//! Bounds that decide nothing: every value of what is expected keeps to them, or none.

use super::expect::Bounds;
use crate::what::What;

/// Refuses bounds that decide nothing, whatever the run does.
///
/// # Errors
/// The bounds, and which values there are.
pub(super) fn check(what: &What, bounds: &Bounds) -> Result<(), String> {
    let Some((least, most)) = what.reach().filter(|_| !bounds.is_empty()) else { return Ok(()) };
    let Bounds { equals, above, below, between, tolerance, .. } = *bounds;
    let never = equals.is_some_and(|value| value + tolerance < least || value - tolerance > most)
        || above.is_some_and(|value| value >= most)
        || below.is_some_and(|value| value <= least)
        || between.is_some_and(|(low, high)| low > most || high < least);
    // Each of them is an interval: what both ends keep to, everything between does.
    let always = bounds.hold(least) && bounds.hold(most);
    // A percentage, where a share is meant.
    let beyond = most.is_finite() && between.is_some_and(|(low, high)| low < least || high > most);
    let who = match (never, always, beyond) {
        (true, ..) => "none of them does",
        (_, true, _) => "all of them do",
        (.., true) => "`between` reaches beyond them",
        (false, false, false) => return Ok(()),
    };
    let values = if most.is_finite() { format!("{least} to {most}") } else { format!("{least} and more") };
    Err(format!(
        "`{}` is {values}: expected bounds that some of these values keep to and others do not, found {}: {who}",
        what.name,
        bounds.words()
    ))
}
