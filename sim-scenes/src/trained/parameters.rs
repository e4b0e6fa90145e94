//! Every parameter of a training system, its default and where that comes from.

use crate::parameters::{ParameterError, choices, parameters, require};

choices! {
    /// What kind of frame the tree is given.
    pub enum Form {
        /// One leader to the top with fruiting branches all around, cut to a cone: spindles.
        Spindle = "spindle",
        /// A short trunk and scaffold limbs around an open centre.
        Vase = "vase",
        /// A leader with arms tied to the wires on both sides, flat.
        Palmette = "palmette",
        /// A leader with branches all around, sheared flat.
        Hedge = "hedge",
    }
}

impl Form {
    /// Sheared to planes along the row.
    pub(crate) fn is_flat(self) -> bool {
        matches!(self, Self::Palmette | Self::Hedge)
    }
}

parameters! {
    /// How a tree is trained: growth, tie and cut of every season, and how stiff its wood is.
    ///
    /// Seasons, leaves, floors of the wood and the room that it is cut back to are those of `[orchard.tree]`.
    pub struct TrainingParameters;
    /// Training parameters of which every one may be left to the preset: the `[orchard.training]` table of a scene file.
    pub overrides TrainingOverrides;

    /// Frame that the tree is given.
    form: Form = Form::Spindle, "spindle | vase | palmette | hedge", "what the preset is called after";
    /// Length of the tree as planted, above the ground.
    whip_m: f64 = 1.2, "m", "nursery trees of 1 to 1.5 m; headed at planting";
    /// Annual shoot of the leader, and of scaffold limbs.
    leader_shoot_m: f64 = 0.55, "m", "assumed: a spindle fills 3 m in four to five seasons";
    /// Shoots that last year's wood of a leader breaks into.
    laterals: f64 = 6.0, "a season", "assumed: a tier of 5 to 8";
    /// Angle at which a lateral leaves its bearer.
    lateral_deg: f64 = 65.0, "°", "crotches of 50 to 70° are kept, narrower ones removed";
    /// First annual shoot of a lateral.
    lateral_shoot_m: f64 = 0.45, "m", "assumed: annual shoots of 30 to 60 cm on dwarfing rootstocks";
    /// Length of an annual shoot over that of the year before, on the same lateral.
    shoot_decline: f64 = 0.8, "1", "assumed: fruiting branches calm down year by year";
    /// Angle from the vertical to which laterals are tied in their first winter; 0 for none.
    tie_deg: f64 = 80.0, "°", "slender spindle: near the horizontal; tall spindle: below it (Robinson 2007)";
    /// Side shoots that last year's wood of a lateral breaks into.
    side_shoots: f64 = 2.5, "a season", "assumed";
    /// Length of side shoots over that of their lateral's.
    side_share: f64 = 0.6, "1", "assumed";
    /// Angle at which side shoots leave.
    side_deg: f64 = 50.0, "°", "assumed";
    /// Orders of side shoots on a lateral.
    side_orders: u32 = 2, "orders", "finer wood is spurs";
    /// Seasons after which a lateral is cut back to a stub and replaced; 0 for never.
    renewal_seasons: u32 = 6, "seasons", "renewal pruning: one or two of the thickest branches a year (Robinson 2007)";
    /// Scaffold limbs of a vase.
    scaffolds: u32 = 4, "limbs", "open centre: three to five";
    /// Angle of scaffold limbs from the vertical.
    scaffold_deg: f64 = 42.0, "°", "spread to 40 to 50°";
    /// Share by which a new shoot turns up from the direction of the wood that it continues.
    upturn: f64 = 0.2, "1", "assumed";
    /// Largest angle by which a shoot strays from its course.
    stray_deg: f64 = 10.0, "°", "assumed";
    /// Share of the envelope's half widths that is left in winter, so that the season's shoots have room.
    winter_share: f64 = 0.9, "1", "assumed";
    /// How unevenly a person cuts: a cut falls short of the room by up to this share.
    cut_unevenness: f64 = 0.25, "1", "assumed: cuts go to a bud, a spur or a side shoot; 0 for a machine";

    /// Spurs on a metre of wood of two years or more.
    spurs_per_m: f64 = 8.0, "1/m", "assumed: what is left of every second bud; gives rosettes about half of the leaf area, as Forshey et al. 1987 counted (54 %)";
    /// Seasons that a spur lives.
    spur_seasons: u32 = 6, "seasons", "assumed: old spurs are thinned out";
    /// Growth of a spur in a season.
    spur_growth_m: f64 = 0.006, "m", "a spur's short shoot is a few millimetres";
    /// Leaves of a spur's rosette.
    spur_leaves: u32 = 7, "leaves", "rosettes of 6 to 10 leaves (van den Ende, Tree Fruit)";
    /// Length and width of a rosette's leaf over that of a shoot's leaf.
    spur_leaf_scale: f64 = 0.82, "1", "shoot leaves are nearly 50 % larger in area than spur leaves (Forshey et al. 1987)";

    /// Young's modulus of the living wood.
    young_gpa: f64 = 5.0, "GPa", "assumed: green apple wood below the 8.8 GPa of dry wood";
    /// Fresh wood.
    wood_kg_m3: f64 = 1000.0, "kg/m³", "assumed: green wood";
    /// Fresh leaves and their petioles.
    leaf_kg_m2: f64 = 0.25, "kg/m²", "assumed";
    /// Fruits a spur carries in the mean; they bend the wood whether fruit is drawn or not.
    crop_per_spur: f64 = 0.3, "fruits", "assumed: some 100 fruits on a spindle";
    /// Share of a season's bend that stays.
    bend_kept: f64 = 0.4, "1", "assumed: the season's ring is laid down on bent wood";
}

impl TrainingParameters {
    /// Checks all values; `wires` are those of the trellis.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self, wires: u32) -> Result<(), ParameterError> {
        let within = |name: &str, value: f64, low: f64, high: f64| {
            let expected = format!("a number from {low} to {high}");
            require((low..=high).contains(&value), &format!("orchard.training.{name}"), &expected, value)
        };
        let expected = "another form, or orchard.trellis.wires above 0: a palmette is tied to wires";
        let is_held = self.form != Form::Palmette || wires > 0;
        require(is_held, "orchard.training.form", expected, self.form)?;
        within("whip_m", self.whip_m, 0.1, 5.0)?;
        within("leader_shoot_m", self.leader_shoot_m, 0.01, 3.0)?;
        within("laterals", self.laterals, 0.0, 50.0)?;
        within("lateral_deg", self.lateral_deg, 0.0, 150.0)?;
        within("lateral_shoot_m", self.lateral_shoot_m, 0.01, 3.0)?;
        within("shoot_decline", self.shoot_decline, 0.0, 1.0)?;
        within("tie_deg", self.tie_deg, 0.0, 150.0)?;
        within("side_shoots", self.side_shoots, 0.0, 20.0)?;
        within("side_share", self.side_share, 0.0, 2.0)?;
        within("side_deg", self.side_deg, 0.0, 150.0)?;
        let key = |name: &str| format!("orchard.training.{name}");
        require(self.side_orders <= 5, &key("side_orders"), "0 to 5", self.side_orders)?;
        require((1..=12).contains(&self.scaffolds), &key("scaffolds"), "1 to 12", self.scaffolds)?;
        require(self.spur_leaves <= 40, &key("spur_leaves"), "0 to 40", self.spur_leaves)?;
        within("scaffold_deg", self.scaffold_deg, 0.0, 90.0)?;
        within("upturn", self.upturn, 0.0, 1.0)?;
        within("stray_deg", self.stray_deg, 0.0, 90.0)?;
        within("winter_share", self.winter_share, 0.05, 1.0)?;
        within("cut_unevenness", self.cut_unevenness, 0.0, 0.9)?;
        within("spurs_per_m", self.spurs_per_m, 0.0, 200.0)?;
        within("spur_growth_m", self.spur_growth_m, 1e-4, 0.2)?;
        within("spur_leaf_scale", self.spur_leaf_scale, 0.01, 5.0)?;
        within("young_gpa", self.young_gpa, 0.01, 1000.0)?;
        within("wood_kg_m3", self.wood_kg_m3, 0.0, 5000.0)?;
        within("leaf_kg_m2", self.leaf_kg_m2, 0.0, 10.0)?;
        within("crop_per_spur", self.crop_per_spur, 0.0, 10.0)?;
        within("bend_kept", self.bend_kept, 0.0, 1.0)
    }
}
