//! A rig among its rows, drawn from above, from behind and from the row: where scanners sit, where their beams point, what is how far apart.

use rowscan_protocol::rig::{Apart, Mount, Orientation, Rig, RowSide};

use super::pen::{BEAM, FAINT, INK, Pen, SCANNER, TREE};

/// Pixels of a metre.
const SCALE_PX: f64 = 80.0;
/// Room around a view, pixels.
const MARGIN_PX: f64 = 40.0;
/// Height of a drawn tree, metres; it says nothing.
const TREE_M: f64 = 3.0;
/// Drawn of a row, metres, at most.
const LONGEST_M: f64 = 8.0;
/// Length of a drawn beam, metres.
const BEAM_M: f64 = 0.9;
/// Length of the arrow that shows which way a roof looks, metres.
const ROOF_M: f64 = 0.35;
/// What stands for a row spacing that is unknown, beside the scanner that is farthest from its row.
const MIDDLE_M: f64 = 0.4;

/// Less than this is no distance, metres.
const NOTHING_M: f64 = 0.005;

/// The rows that a rig drives between.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rows {
    /// Rows of different trees; 0 where nobody says.
    pub count: u32,
    /// The alley it starts in: alley `a` lies between rows `a − 1` and `a`.
    pub alley: i32,
}

/// A length without the last bits of a sum.
fn shown(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e6
}

/// One scanner in words: model, mount, place and pose.
pub fn mount_words(mount: &Mount) -> String {
    let looks = match mount.orientation {
        Orientation::Side => "side (90° looks at the row)",
        Orientation::Up => "up (90° looks at the sky)",
    };
    let roof = mount.roof_in_force().name();
    let (sense, _) = mount.angle_map();
    let zero = match mount.orientation {
        Orientation::Side if sense > 0.0 => "down, angles grow upwards",
        Orientation::Side => "up, angles grow downwards",
        Orientation::Up if sense * mount.side() > 0.0 => "to the tractor's right",
        Orientation::Up => "to the tractor's left",
    };
    let row = match mount.row {
        RowSide::Right => "right",
        RowSide::Left => "left",
    };
    format!(
        "{}, {looks}, roof {roof} (0° points {zero}), row on the {row}; {} m high, {} m from the row axis, {} m ahead of the reference point; yaw {}°, pitch {}°, roll {}°",
        mount.model,
        shown(mount.height_m),
        shown(mount.distance_m),
        shown(mount.offset_y_m),
        mount.yaw_deg,
        mount.pitch_deg,
        mount.roll_deg
    )
}

/// How far a scanner is from the one before it, in words.
pub fn apart_words(apart: &Apart) -> String {
    let ways = [
        (Some(apart.ahead_m), "ahead of", "behind"),
        (Some(apart.above_m), "above", "below"),
        (apart.right_m, "to the right of", "to the left of"),
    ];
    let mut parts: Vec<String> = Vec::new();
    for (value, more, less) in ways {
        if let Some(value) = value.filter(|value| value.abs() > NOTHING_M) {
            parts.push(format!("{:.2} m {} it", value.abs(), if value < 0.0 { less } else { more }));
        }
    }
    match apart.straight_m() {
        None => parts.push("how far across is unknown: give row_spacing_m".to_owned()),
        Some(straight_m) if straight_m > NOTHING_M => parts.push(format!("{straight_m:.2} m apart")),
        Some(_) => parts.push("at the same place".to_owned()),
    }
    parts.join(", ")
}

/// The drawing of a rig, as SVG.
pub fn draw_rig(rig: &Rig, rows: Rows) -> String {
    let sheet = Sheet::of(rig, rows);
    let (half_m, length_m) = (sheet.half_m, sheet.length_m);
    let across_px = (2.0 * half_m + 2.4) * SCALE_PX;
    let along_px = (length_m + 1.6) * SCALE_PX;
    let tall_px = (sheet.top_m + 0.5) * SCALE_PX;
    let plan_px = [MARGIN_PX + 1.2 * SCALE_PX, 2.0 * MARGIN_PX + across_px / 2.0];
    let second_px = 4.0 * MARGIN_PX + across_px + tall_px;
    let behind_px = [MARGIN_PX + across_px / 2.0, second_px];
    let beside_px = [2.0 * MARGIN_PX + across_px + 1.2 * SCALE_PX, second_px];
    let mut body = title([MARGIN_PX, MARGIN_PX], "from above; the tractor drives to the right");
    body += &sheet.plan(Pen::new(plan_px, SCALE_PX, false));
    body += &title([MARGIN_PX, second_px - tall_px - 14.0], "from behind, along the drive");
    body += &sheet.behind(Pen::new(behind_px, SCALE_PX, true));
    body += &title(
        [beside_px[0] - SCALE_PX, second_px - tall_px - 14.0],
        "from the right; the tractor drives to the right",
    );
    body += &sheet.beside(Pen::new(beside_px, SCALE_PX, true));
    let mut line_px = second_px + 1.5 * MARGIN_PX;
    for words in sheet.legend() {
        body += &title([MARGIN_PX, line_px], &words);
        line_px += 17.0;
    }
    let width_px = (3.0 * MARGIN_PX + across_px + along_px).max(960.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px:.0}\" height=\"{line_px:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}

fn title([x, y]: [f64; 2], words: &str) -> String {
    format!("<text x=\"{x:.0}\" y=\"{y:.0}\">{}</text>\n", words.replace('&', "&amp;").replace('<', "&lt;"))
}

/// The way that the roof looks, in the axes of its row: to it, along the drive, up.
fn roof(mount: &Mount) -> [f64; 3] {
    mount.attitude().axes().ahead.map(|part| mount.roof_sense() * part)
}

fn mark_roof(pen: &mut Pen, at: [f64; 2], way: [f64; 2]) {
    let to = [at[0] + ROOF_M * way[0], at[1] + ROOF_M * way[1]];
    pen.arrow(at, to, SCANNER);
    pen.words(to, [12.0 * way[0].signum(), -5.0], SCANNER, "roof");
}

/// What is drawn, in metres: to the right of the middle between the rows, ahead of the reference point at the start, up.
struct Sheet<'a> {
    rig: &'a Rig,
    rows: Rows,
    /// From the middle to a row axis.
    half_m: f64,
    length_m: f64,
    top_m: f64,
}

impl<'a> Sheet<'a> {
    fn of(rig: &'a Rig, rows: Rows) -> Self {
        let farthest_m = rig.scanners.iter().map(|mount| mount.distance_m).fold(0.0, f64::max);
        let ahead_m = rig.scanners.iter().map(|mount| mount.offset_y_m.abs()).fold(0.0, f64::max);
        let highest_m = rig.scanners.iter().map(|mount| mount.height_m).fold(TREE_M, f64::max);
        let half_m = rig.row_spacing_m.map_or(farthest_m + MIDDLE_M, |spacing_m| spacing_m / 2.0);
        let trees_m = rig.tree_spacing_m.map_or(3.0, |spacing_m| 3.0 * spacing_m);
        let length_m = trees_m.max(2.0 * ahead_m + 1.0).min(LONGEST_M.max(ahead_m + 1.0));
        Self { rig, rows, half_m: half_m.min(20.0), length_m, top_m: highest_m + BEAM_M }
    }

    /// Where a mirror is to the right of the middle.
    fn right_m(&self, mount: &Mount) -> f64 {
        mount.side() * (self.half_m - mount.distance_m)
    }

    /// The reference point at the start, on the drawing's way along the rows.
    fn start_m(&self) -> f64 {
        let behind_m = self.rig.scanners.iter().map(|mount| mount.offset_y_m).fold(0.0, f64::min);
        self.rig.start_m.clamp(-0.8, self.length_m) - behind_m.min(0.0)
    }

    /// Rows that are there: right and left of the alley.
    fn sides(&self) -> Vec<(f64, Option<i32>)> {
        let count = i64::from(self.rows.count);
        let there = |row: i32| (0..count).contains(&i64::from(row));
        let looked_at = |side: f64| self.rig.scanners.iter().any(|mount| mount.side() == side);
        [(1.0, self.rows.alley), (-1.0, self.rows.alley.saturating_sub(1))]
            .into_iter()
            .filter(|(side, row)| there(*row) || looked_at(*side))
            .map(|(side, row)| (side, there(row).then_some(row)))
            .collect()
    }

    fn plan(&self, mut pen: Pen) -> String {
        let (half_m, length_m, start_m) = (self.half_m, self.length_m, self.start_m());
        for (side, row) in self.sides() {
            let x_m = side * half_m;
            pen.line([-0.3, x_m], [length_m + 0.2, x_m], TREE, true);
            let name = row.map_or_else(
                || "row axis".to_owned(),
                |row| format!("row {row}: its axis, X = {row} row spacings"),
            );
            pen.words([length_m / 2.0, x_m], [0.0, if side > 0.0 { 74.0 } else { -50.0 }], TREE, &name);
            if let Some(spacing_m) = self.rig.tree_spacing_m.filter(|spacing_m| *spacing_m > 0.2) {
                let most = self.rig.trees.unwrap_or(u32::MAX);
                let seen = ((length_m / spacing_m).floor() as u32).min(most);
                for tree in 0..seen {
                    let y_m = (f64::from(tree) + 0.5) * spacing_m;
                    pen.circle([y_m, x_m], (0.35 * spacing_m).min(0.5), TREE, false);
                    pen.words([y_m, x_m], [0.0, 4.0], TREE, &tree.to_string());
                }
                if side > 0.0 && seen > 1 {
                    let y_m = 0.5 * spacing_m;
                    let beside_m = x_m + 0.62;
                    pen.length(
                        [y_m, beside_m],
                        [y_m + spacing_m, beside_m],
                        &format!("tree_spacing_m {spacing_m}"),
                    );
                }
            }
        }
        pen.words([length_m / 2.0, 0.0], [0.0, -6.0], FAINT, &format!("alley {}", self.rows.alley));
        if let (Some(spacing_m), [_, _]) = (self.rig.row_spacing_m, self.sides().as_slice()) {
            pen.length([length_m, -half_m], [length_m, half_m], &format!("row_spacing_m {spacing_m}"));
        }
        pen.rectangle([start_m - 1.6, -0.55], [start_m + 0.8, 0.55], FAINT);
        pen.arrow([start_m + 0.8, 0.0], [start_m + 1.5, 0.0], INK);
        pen.line([start_m, -0.7], [start_m, 0.7], INK, true);
        pen.words(
            [start_m, -0.7],
            [0.0, -4.0],
            INK,
            &format!("reference point, first line at Y = {} m", self.rig.start_m),
        );
        for (number, mount) in self.rig.scanners.iter().enumerate() {
            let at = [start_m + mount.offset_y_m, self.right_m(mount)];
            self.mark(&mut pen, at, number);
            let axes = mount.attitude().axes();
            // The scan plane seen from above: the way to the row, turned by yaw.
            let [to_row, ahead, _] = axes.to_row;
            pen.arrow(at, [at[0] + ahead * BEAM_M, at[1] + mount.side() * to_row * BEAM_M], BEAM);
            let [to_row, ahead, _] = roof(mount);
            mark_roof(&mut pen, at, [ahead, mount.side() * to_row]);
            let axis = [at[0] + 0.12, mount.side() * self.half_m];
            let share = if number % 2 == 0 { 0.45 } else { 0.6 };
            pen.length_at(
                [at[0] + 0.12, at[1]],
                axis,
                share,
                &format!("distance_m {}", shown(mount.distance_m)),
            );
        }
        for (one, other) in self.rig.scanners.iter().zip(self.rig.scanners.iter().skip(1)) {
            let apart = self.rig.apart(one, other);
            if apart.ahead_m.abs() > 0.01 {
                let (from_m, to_m) = (start_m + one.offset_y_m, start_m + other.offset_y_m);
                let x_m = self.right_m(one).min(self.right_m(other)) - 0.3;
                pen.length([from_m, x_m], [to_m, x_m], &format!("{:.2} m apart", apart.ahead_m.abs()));
            }
        }
        pen.into_text()
    }

    fn behind(&self, mut pen: Pen) -> String {
        let half_m = self.half_m;
        pen.line([-half_m - 1.0, 0.0], [half_m + 1.0, 0.0], INK, false);
        pen.words([0.0, 0.0], [0.0, 16.0], INK, "Z = 0: the ground");
        for (side, _) in self.sides() {
            let x_m = side * half_m;
            pen.line([x_m, 0.0], [x_m, 0.7], TREE, false);
            pen.ellipse([x_m, 0.5 * (TREE_M + 0.6)], [0.7, 0.5 * (TREE_M - 0.6)], TREE);
            pen.words(
                [x_m, 0.0],
                [0.0, 16.0],
                TREE,
                if side > 0.0 { "row on the right" } else { "row on the left" },
            );
        }
        for (number, mount) in self.rig.scanners.iter().enumerate() {
            let at = [self.right_m(mount), mount.height_m];
            let axes = mount.attitude().axes();
            for alpha_deg in [0.0, 45.0, 90.0, 135.0, 180.0] {
                let theta = mount.theta_deg(alpha_deg).to_radians();
                let [to_row, _, up] = axes.beam(libm::cos(theta), libm::sin(theta));
                let long_m = if alpha_deg % 90.0 == 0.0 { BEAM_M } else { 0.5 * BEAM_M };
                let to = [at[0] + mount.side() * to_row * long_m, at[1] + up * long_m];
                pen.arrow(at, to, BEAM);
                if alpha_deg % 90.0 == 0.0 {
                    let beyond = [at[0] + 1.14 * (to[0] - at[0]), at[1] + 1.14 * (to[1] - at[1])];
                    pen.words(beyond, [0.0, 4.0], BEAM, &format!("{alpha_deg}°"));
                }
            }
            self.mark(&mut pen, at, number);
            let beside_m = at[0] - mount.side() * (0.25 + 0.16 * number as f64);
            let share = 0.12 + 0.11 * (number % 4) as f64;
            pen.length_at(
                [beside_m, 0.0],
                [beside_m, mount.height_m],
                share,
                &format!("{} m", shown(mount.height_m)),
            );
        }
        pen.into_text()
    }

    fn beside(&self, mut pen: Pen) -> String {
        let start_m = self.start_m();
        pen.line([-1.0, 0.0], [self.length_m + 0.2, 0.0], INK, false);
        pen.line([start_m, 0.0], [start_m, self.top_m], INK, true);
        pen.words([start_m, 0.0], [0.0, 16.0], INK, "reference point");
        pen.arrow([start_m, 0.25], [start_m + 0.9, 0.25], INK);
        let mut before: Option<[f64; 2]> = None;
        for (number, mount) in self.rig.scanners.iter().enumerate() {
            let at = [start_m + mount.offset_y_m, mount.height_m];
            let [_, ahead, up] = mount.attitude().axes().up;
            pen.line(
                [at[0] - 0.8 * ahead, at[1] - 0.8 * up],
                [at[0] + 0.8 * ahead, at[1] + 0.8 * up],
                BEAM,
                true,
            );
            let [_, ahead, up] = roof(mount);
            mark_roof(&mut pen, at, [ahead, up]);
            self.mark(&mut pen, at, number);
            if mount.offset_y_m.abs() > 0.01 {
                let up_m = 0.55 + 0.3 * number as f64;
                pen.length(
                    [start_m, up_m],
                    [at[0], up_m],
                    &format!("offset_y_m {}", shown(mount.offset_y_m)),
                );
            }
            if let Some([_, height_m]) = before.filter(|[_, height_m]| (height_m - at[1]).abs() > 0.01) {
                let beside_m = at[0] + 0.25;
                pen.length(
                    [beside_m, height_m],
                    [beside_m, at[1]],
                    &format!("{:.2} m", (height_m - at[1]).abs()),
                );
            }
            before = Some(at);
        }
        pen.into_text()
    }

    fn mark(&self, pen: &mut Pen, at: [f64; 2], number: usize) {
        pen.circle(at, 0.07, SCANNER, true);
        pen.words(at, [0.0, -9.0], SCANNER, &number.to_string());
    }

    /// What is drawn, in words.
    fn legend(&self) -> Vec<String> {
        let mut lines = vec![
            "X points to the right of the drive and is 0 on the axis of row 0, Y along the drive, Z up. Tree i owns Y from i to i + 1 tree spacings.".to_owned(),
            "Orange: beams at device angles 0°, 90° and 180°, with the mount's yaw, pitch and roll; broken: the scan plane. Arrow `roof`: the way that the roof looks. Violet: lengths.".to_owned(),
        ];
        if self.rig.row_spacing_m.is_none() {
            lines.push(
                "The rig has no row_spacing_m: where the middle between the rows is drawn means nothing."
                    .to_owned(),
            );
        }
        for (number, mount) in self.rig.scanners.iter().enumerate() {
            let words = mount_words(mount);
            let (looks, place) = words.split_once("; ").unwrap_or((&words, ""));
            lines.push(format!("scanner {number}: {looks};"));
            lines.push(format!("    {place}"));
        }
        for (number, pair) in self.rig.scanners.windows(2).enumerate() {
            if let [one, other] = pair {
                lines.push(format!(
                    "scanner {} beside scanner {number}: {}",
                    number + 1,
                    apart_words(&self.rig.apart(one, other))
                ));
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::rig::Roof;

    fn rig() -> Rig {
        let front = Mount { offset_y_m: 0.4, ..Mount::default() };
        let rear = Mount { offset_y_m: -0.5, height_m: 2.1, roll_deg: 30.0, ..Mount::default() };
        Rig {
            scanners: vec![front, rear],
            tree_spacing_m: Some(1.5),
            row_spacing_m: Some(4.0),
            ..Rig::default()
        }
    }

    #[test]
    fn a_rig_s_drawing_tells_its_lengths_and_repeats() {
        let drawn = draw_rig(&rig(), Rows { count: 2, alley: 0 });
        for words in
            ["distance_m 1.9", "tree_spacing_m 1.5", "0.90 m apart", "0.50 m<", "roll 30°", "row 0", ">90°<"]
        {
            assert!(drawn.contains(words), "{words} is missing in {drawn}");
        }
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{drawn}");
        assert_eq!(drawn, draw_rig(&rig(), Rows { count: 2, alley: 0 }));
    }

    #[test]
    fn a_beam_points_where_the_mount_says() {
        let up = Rig {
            scanners: vec![Mount { orientation: Orientation::Up, ..Mount::default() }],
            ..Rig::default()
        };
        let side = Rig::default();
        let behind = |rig: &Rig| Sheet::of(rig, Rows::default()).behind(Pen::new([0.0; 2], 100.0, true));
        // The word of 90° stands above an upright scanner, and level with one at the side.
        let place = |text: &str| {
            let line = text.lines().find(|line| line.contains(">90°<")).expect("drawn").to_owned();
            let number = |key: &str| -> f64 {
                line.split(key)
                    .nth(1)
                    .and_then(|rest| rest.split('"').next())
                    .expect("there")
                    .parse()
                    .expect("a number")
            };
            [number("x=\""), number("y=\"")]
        };
        assert_eq!(place(&behind(&up))[1], -258.6);
        assert_eq!(place(&behind(&side))[1], -156.0);
    }

    #[test]
    fn a_roof_s_arrow_points_where_it_looks_and_words_say_where_0_is() {
        for (orientation, row, roof, zero) in [
            (
                Orientation::Side,
                RowSide::Right,
                Roof::Forward,
                "roof forward (0° points up, angles grow downwards)",
            ),
            (
                Orientation::Side,
                RowSide::Left,
                Roof::Forward,
                "roof forward (0° points down, angles grow upwards)",
            ),
            (
                Orientation::Up,
                RowSide::Right,
                Roof::Forward,
                "roof forward (0° points to the tractor's left)",
            ),
            (
                Orientation::Up,
                RowSide::Left,
                Roof::Backward,
                "roof backward (0° points to the tractor's right)",
            ),
        ] {
            let mount = Mount { orientation, row, roof: Some(roof), ..Mount::default() };
            assert!(mount_words(&mount).contains(zero), "{}", mount_words(&mount));
            let rig = Rig { scanners: vec![mount], ..Rig::default() };
            let sheet = Sheet::of(&rig, Rows::default());
            let pen = || Pen::new([0.0; 2], 100.0, false);
            for view in [sheet.plan(pen()), sheet.beside(pen())] {
                let tip = view.lines().find(|line| line.contains(">roof<")).expect("drawn");
                let x_px: f64 = tip.split('"').nth(1).and_then(|x| x.parse().ok()).expect("a place");
                let from_scanner_px = x_px - 100.0 * sheet.start_m();
                assert_eq!(from_scanner_px > 0.0, roof == Roof::Forward, "{tip}");
            }
        }
    }

    #[test]
    fn words_say_which_way_and_how_far() {
        let rig = rig();
        let [front, rear] = rig.scanners.as_slice() else { panic!("two") };
        let words = apart_words(&rig.apart(front, rear));
        assert_eq!(words, "0.90 m behind it, 0.50 m above it, 1.03 m apart");
        assert_eq!(apart_words(&rig.apart(front, front)), "at the same place");
        assert!(mount_words(front).contains("1.6 m high, 1.9 m from the row axis, 0.4 m ahead"));
    }
}
