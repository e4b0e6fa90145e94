//! Growth units in space.

use crate::parameters::choices;

choices! {
    /// Internodes of long growth units.
    pub enum InternodeLaw {
        /// By the age of the tree: 96.436·exp(−0.37·Ta) on the trunk, 68.525·exp(−0.33·Ta) elsewhere.
        Table2 = "table2",
        /// 20, always.
        Flat20 = "flat20",
    }
}
