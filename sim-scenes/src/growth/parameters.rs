//! Every parameter of a growing tree, its default and where that comes from.

use super::internodes::InternodeSource;
use super::leaf_angle::{LeafAngle, LeafAngleLaw};
use super::markov::{BranchingSource, MatrixSource, State, TransitionMatrix};
use super::options::{LeafLifetime, RankScale, RaySet, RayWeight, ShadeScope};
use super::rules::{Attachment, AxesLimit, ChildDraw, PowerRule, RuleSource};
use crate::parameters::{ParameterError, parameters, require};

parameters! {
    /// How a tree grows, is clothed with leaves, thickens, loses shaded leaves and is pruned.
    ///
    /// The defaults are those of Méndez et al. (2013) as far as the text gives them (their lost tables rebuilt); the presets
    /// depart from them.
    pub struct TreeParameters;
    /// Tree parameters of which every one may be left to the preset: the `[orchard.tree]` table of a scene file.
    pub overrides TreeOverrides;

    /// Seasons. The first makes the first growth unit; each later one a transition of every live axis.
    iterations: u32 = 9, "seasons", "the paper grows 7 to 11";
    /// Seasons of a replanted tree.
    replanted_seasons: u32 = 2, "seasons", "a gap is filled with a nursery tree that has stood a year or two";
    /// State of the first growth unit.
    initial_state: State = State::Long, "L | M | S | F", "paper: start vector (1, 0, 0, 0)";
    /// Transition matrix: a name, or four rows (parent L M S F) of four probabilities (child L M S F).
    transitions: MatrixSource = MatrixSource::named("P_fuji"), "matrix", "the paper's table 1 is lost; refitted to the public Fuji trees with its internode counts, any entry ± 0.1, row F ± 0.2";
    /// Matrix for the states of branching axes: `as_transitions`, or like `transitions`.
    branching_transitions: BranchingSource = BranchingSource::AsTransitions, "matrix", "the original program has two slots and sets them equal";
    /// Whether rows that do not sum to 1 are divided by their sum instead of refused; which ones were is said.
    renormalise: bool = false, "true | false", "a published row of MAppleT's sums to 1.001";
    /// Which (parent, child) continue the axis (`>`) and which end it and start new axes (`+`): a name, or four rows of four signs.
    rules: RuleSource = RuleSource::named("vase"), "rules", "the paper's table 3 is lost; its trees are open vases, and floral shoots never continue by succession in the Fuji data";
    /// How the powers of the matrix are read.
    power_rule: PowerRule = PowerRule::Literal, "literal | marginal | plain", "paper: a new power of P is used in succession; literal = row of the current state of P^k";
    /// Most axes that one branching starts.
    max_new_axes: u32 = 3, "axes", "paper: up to three";
    /// Whose internodes limit the number of new axes.
    axes_limit: AxesLimit = AxesLimit::BearingUnit, "bearing_unit | child_unit", "the paper's wording allows both";
    /// Where new axes leave the bearing growth unit.
    attachment: Attachment = Attachment::LastNodes, "last_nodes | tip", "one a node, from the tip down; not in the text";
    /// One state for all new axes of a branching, or one each.
    child_draw: ChildDraw = ChildDraw::One, "one | each", "paper: the new state";
    /// Internodes of long growth units: a name, or two rows (trunk; other axes) of internodes by year.
    internodes: InternodeSource = InternodeSource::named("flat20"), "flat20 | table2 | rows", "flat20: the paper's mean of long shoots, and a 0.7 m trunk, as vases have; table2, its two falling exponentials read by the tree's age, makes a pole of 2.3 m with a tuft";
    /// Years by which long shoots (not the trunk) count younger in table2.
    long_age_offset: u32 = 0, "years", "one clock for all; 1 fits the Fuji data better";
    /// Angle between a new axis and its bearer.
    branching_angle_deg: f64 = 35.0, "°", "paper";
    /// Azimuth from one leaf, or one new axis, to the next.
    phyllotaxis_deg: f64 = 144.0, "°", "paper";
    /// Length of an internode.
    internode_m: f64 = 0.035, "m", "paper";

    /// Length of a leaf blade.
    leaf_length_m: f64 = 0.08, "m", "about 25 cm² with the width; MAppleT at most 30 cm², Helios 50 to 60";
    /// Greatest width of a leaf blade.
    leaf_width_m: f64 = 0.045, "m", "see the length";
    /// Whether the first leaves of a growth unit are smaller.
    leaf_rank_scale: RankScale = RankScale::Off, "off | preformed | linear", "preformed: area · rank/8 up to rank 8 (MAppleT 2012); linear: 10 to 30 cm² (2007)";
    /// Distance from the axis to the blade.
    petiole_m: f64 = 0.03, "m", "Helios 0.04";
    /// Radius of the petiole; 0 for one that stops no beam.
    petiole_radius_m: f64 = 0.0, "m", "MAppleT 0.0006, Helios 0.00075";
    /// Angle between petiole and axis.
    leaf_insertion_deg: f64 = 60.0, "°", "not in the text";
    /// Angle by which the blade bends away from the axis at the end of its petiole.
    leaf_droop_deg: f64 = 0.0, "°", "not in the text";
    /// Largest random turn of a blade about its midrib, either way.
    leaf_twist_deg: f64 = 0.0, "°", "not in the text";
    /// Law of the blades' inclinations.
    leaf_angle: LeafAngle = LeafAngle::AsInserted, "as_inserted | spherical | ellipsoidal | beta", "as_inserted: what insertion, droop and twist give; the laws turn the blade about its foot to a drawn inclination, azimuth kept";
    /// Ratio of horizontal to vertical projections of the ellipsoidal law.
    leaf_angle_chi: f64 = 1.0, "1", "Campbell 1986: 1 is spherical, below 1 erect, above 1 flat";
    /// Mean inclination of the beta law, from the horizontal.
    leaf_angle_mean_deg: f64 = 45.0, "°", "Goel and Strebel 1984";
    /// Standard deviation of the beta law.
    leaf_angle_sd_deg: f64 = 20.0, "°", "Goel and Strebel 1984";
    /// How long leaves stay.
    leaf_lifetime: LeafLifetime = LeafLifetime::EveryYear, "every_year | current_season", "the paper's foliage thickens with iterations, hence its shady index";

    /// Fruits on every floral growth unit of the last two seasons.
    fruits_per_cluster: u32 = 0, "fruits", "the paper has none; one or two are left after thinning by hand";
    /// Diameter of a fruit.
    fruit_diameter_m: f64 = 0.07, "m", "a table apple of 65 to 80 mm";

    /// Exponent of the pipe model: r^e of a bearer is the sum over what it bears.
    pipe_exponent: f64 = 2.49, "1", "MAppleT";
    /// Radius of a terminal growth unit of 4 internodes.
    terminal_radius_m: f64 = 0.000_75, "m", "MAppleT";
    /// Radius of a terminal growth unit of 70 internodes; linear between.
    terminal_radius_long_m: f64 = 0.006, "m", "MAppleT, C++ version; its .ini caps at 0.003";
    /// Least radius of any wood.
    wood_floor_radius_m: f64 = 0.000_75, "m", "MAppleT; 0.002 comes nearer the paper's share of wood";
    /// Least diameter of the trunk (its long growth units); 0 for none.
    trunk_floor_diameter_m: f64 = 0.0, "m", "none in the paper; 120 mm for a vase, 50 to 80 mm for a spindle, where the pipe model alone gives 12 to 48 mm";

    /// Leaves shaded at least this much are deleted; above 100, none.
    shady_percent: f64 = 101.0, "%", "the paper tests 60, 70, 80, 101; thresholds of different ray sets do not compare";
    /// Half-lines that shade is counted on.
    shady_rays: RaySet = RaySet::Distinct90, "distinct90 | literal117 | literal104 | upper49", "readings of the paper's bearing 0…360 step 45, elevation −90…90 step 15";
    /// Weight of a half-line.
    shady_weight: RayWeight = RayWeight::Count, "count | cos", "equal counts weigh the poles too much by solid angle";
    /// Whose leaves shade.
    shady_scope: ShadeScope = ShadeScope::Tree, "tree | orchard", "not in the text";

    /// Whether the tree is cut back to the envelope, after shading.
    pruned: bool = false, "true | false", "unpruned trees reach 4 to 5 m across and would hit the tractor";
    /// Half width of the envelope across the row.
    envelope_half_width_m: f64 = 1.1, "m", "room for the tractor between 4 m rows";
    /// Half width of the envelope at its top, where it tapers from the clear trunk up; 0 for no taper.
    envelope_top_half_width_m: f64 = 0.0, "m", "walls and hedges are cut narrower at the top so that light reaches the foot";
    /// Half length of the envelope along the row; 0 for none.
    envelope_half_length_m: f64 = 0.0, "m", "neighbours in a row may grow together; free-standing crowns may not";
    /// Half angle of the cone about the vertical that is kept free of wood and leaves; 0 for none.
    hollow_deg: f64 = 0.0, "°", "an open vase is pruned open to the light";
    /// Height of that cone's apex.
    hollow_from_m: f64 = 0.0, "m", "just above the fork of the scaffold branches";
    /// Height below which only the trunk is left.
    clear_trunk_m: f64 = 0.5, "m", "clear trunk of a trained tree";
    /// Top of the envelope.
    envelope_top_m: f64 = 3.6, "m", "what a picker reaches from a sledge";
    /// Metamers at which a tree counts as exploded.
    max_metamers: u32 = 1_000_000, "metamers", "some matrices and rules double every season";
}

impl TreeParameters {
    /// The law of the blades' inclinations.
    pub fn leaf_angle_law(&self) -> LeafAngleLaw {
        let &Self { leaf_angle, leaf_angle_chi, leaf_angle_mean_deg, leaf_angle_sd_deg, .. } = self;
        LeafAngleLaw {
            kind: leaf_angle,
            chi: leaf_angle_chi,
            mean_deg: leaf_angle_mean_deg,
            sd_deg: leaf_angle_sd_deg,
        }
    }

    /// The matrices of succession and, where it has one of its own, of branching.
    pub(crate) fn matrices(&self) -> Result<(TransitionMatrix, Option<TransitionMatrix>), ParameterError> {
        let read = |source: &MatrixSource, name| {
            let matrix = match self.renormalise {
                true => source.renormalised().map(|(matrix, _)| matrix),
                false => source.matrix(),
            };
            matrix.map_err(|error| error.at(format!("orchard.tree.{name}")))
        };
        let branching = match &self.branching_transitions {
            BranchingSource::AsTransitions => None,
            BranchingSource::Own(source) => Some(read(source, "branching_transitions")?),
        };
        Ok((read(&self.transitions, "transitions")?, branching))
    }

    /// The rows that were divided by their sums: key, parent state, sum.
    pub(crate) fn renormalised_rows(&self) -> Vec<(&'static str, State, f64)> {
        if !self.renormalise {
            return Vec::new();
        }
        let mut sources = vec![("transitions", &self.transitions)];
        if let BranchingSource::Own(source) = &self.branching_transitions {
            sources.push(("branching_transitions", source));
        }
        let rows = sources.into_iter().filter_map(|(key, source)| Some((key, source.renormalised().ok()?.1)));
        rows.flat_map(|(key, off)| off.into_iter().map(move |(state, sum)| (key, state, sum))).collect()
    }

    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let key = |name: &str| format!("orchard.tree.{name}");
        let within = |name: &str, value: f64, low: f64, high: f64| {
            require(
                (low..=high).contains(&value),
                &key(name),
                &format!("a number from {low} to {high}"),
                value,
            )
        };
        require((1..=40).contains(&self.iterations), &key("iterations"), "1 to 40", self.iterations)?;
        require(
            (1..=40).contains(&self.replanted_seasons),
            &key("replanted_seasons"),
            "1 to 40",
            self.replanted_seasons,
        )?;
        require((1..=100).contains(&self.max_new_axes), &key("max_new_axes"), "1 to 100", self.max_new_axes)?;
        require(self.max_metamers > 0, &key("max_metamers"), "1 or more", self.max_metamers)?;
        self.matrices()?;
        self.rules.rules().map_err(|error| error.at(key("rules")))?;
        self.internodes.table().map_err(|error| error.at(key("internodes")))?;
        within("branching_angle_deg", self.branching_angle_deg, 0.0, 180.0)?;
        within("phyllotaxis_deg", self.phyllotaxis_deg, -360.0, 360.0)?;
        within("internode_m", self.internode_m, 1e-4, 1.0)?;
        within("leaf_length_m", self.leaf_length_m, 1e-4, 10.0)?;
        within("leaf_width_m", self.leaf_width_m, 1e-4, 10.0)?;
        within("petiole_m", self.petiole_m, 0.0, 10.0)?;
        within("petiole_radius_m", self.petiole_radius_m, 0.0, 0.1)?;
        within("leaf_insertion_deg", self.leaf_insertion_deg, 0.0, 180.0)?;
        within("leaf_droop_deg", self.leaf_droop_deg, -180.0, 180.0)?;
        within("leaf_twist_deg", self.leaf_twist_deg, 0.0, 180.0)?;
        within("leaf_angle_chi", self.leaf_angle_chi, 0.05, 20.0)?;
        within("leaf_angle_mean_deg", self.leaf_angle_mean_deg, 1.0, 89.0)?;
        within("leaf_angle_sd_deg", self.leaf_angle_sd_deg, 0.1, 44.0)?;
        require(
            self.leaf_angle_law().is_valid(),
            &key("leaf_angle_sd_deg"),
            "small enough for a beta law of that mean",
            self.leaf_angle_sd_deg,
        )?;
        require(
            self.fruits_per_cluster <= 20,
            &key("fruits_per_cluster"),
            "0 to 20",
            self.fruits_per_cluster,
        )?;
        within("fruit_diameter_m", self.fruit_diameter_m, 0.001, 1.0)?;
        within("pipe_exponent", self.pipe_exponent, 0.5, 10.0)?;
        within("terminal_radius_m", self.terminal_radius_m, 1e-5, 1.0)?;
        within("terminal_radius_long_m", self.terminal_radius_long_m, 1e-5, 1.0)?;
        within("wood_floor_radius_m", self.wood_floor_radius_m, 1e-5, 1.0)?;
        within("trunk_floor_diameter_m", self.trunk_floor_diameter_m, 0.0, 5.0)?;
        within("shady_percent", self.shady_percent, 0.0, 1000.0)?;
        within("envelope_half_width_m", self.envelope_half_width_m, 0.01, 100.0)?;
        within("envelope_top_half_width_m", self.envelope_top_half_width_m, 0.0, 100.0)?;
        within("envelope_half_length_m", self.envelope_half_length_m, 0.0, 100.0)?;
        within("hollow_deg", self.hollow_deg, 0.0, 89.0)?;
        within("hollow_from_m", self.hollow_from_m, 0.0, 100.0)?;
        within("clear_trunk_m", self.clear_trunk_m, 0.0, 100.0)?;
        within("envelope_top_m", self.envelope_top_m, 0.01, 100.0)?;
        let expected = "above clear_trunk_m";
        require(
            self.envelope_top_m > self.clear_trunk_m,
            &key("envelope_top_m"),
            expected,
            self.envelope_top_m,
        )
    }
}
