//! The gap between pieces of a telegram.

use rowscan_settings::fault_table::{Form, Parameter};

/// From one piece to the next.
pub(super) const GAP_US: Parameter =
    Parameter::new("gap_us", Form::Whole(0, 60_000_000), "1000", "from piece to piece, µs");
