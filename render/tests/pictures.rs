//! Pictures as a whole: the same bytes on any number of threads, things where they must be, returns in their own colours.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use rowscan_render::{Backdrop, Camera, Figure, Look, Mark, Model, Picture, RenderError, View, render};
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{Leaf, Orchard};

const PAPER: Look = Look {
    season: rowscan_scenes::season::Season::FullLeaf,
    sun: [-1.0, 0.0, 0.5],
    backdrop: Backdrop::Paper { pale: 0.0 },
    returns_on_top: false,
};

/// A wall across X = 2 m.
fn wall([y1, y2]: [f64; 2], [z1, z2]: [f64; 2]) -> Orchard {
    let outline = vec![[2.0, y1, z1], [2.0, y2, z1], [2.0, y2, z2], [2.0, y1, z2]];
    Orchard::from_organs(vec![Leaf::new(outline).unwrap()], Vec::new(), f64::INFINITY)
}

fn on_threads(threads: usize) -> Picture {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let parameters = OrchardParameters { trees: Some(2), ..OrchardParameters::of(Preset::FruitingWall) };
        let orchard = Orchard::grow(&parameters, 3, &|_, _| {}).unwrap();
        let marks = vec![Mark { at: [-0.5, 1.0, 1.5], radius_m: 0.05, rgb: [0, 114, 178] }];
        let model = Model::of(&orchard, usize::MAX).unwrap().with_figure(Figure::Person).with_marks(marks);
        render(&model, &View::ThreeQuarter.camera(&model, (160, 90)).unwrap(), &Look::default())
    })
}

#[test]
fn one_thread_and_five_draw_the_same_bytes() {
    let one = on_threads(1);
    assert!(one == on_threads(5), "pictures differ");
    let mut colours: Vec<&[u8]> = one.rgb().chunks(3).collect();
    colours.sort_unstable();
    colours.dedup();
    assert!(colours.len() > 500, "a picture, and no plain sheet: {} colours", colours.len());
}

#[test]
fn a_leaf_is_green_where_it_must_be_and_paper_is_white_beside_it() {
    let camera = Camera::parallel([2.0, 0.0, 1.0], [1.0, 0.0, 0.0], 4.0, (80, 40)).unwrap();
    let model = Model::of(&wall([-0.5, 1.0], [0.5, 1.5]), 1).unwrap();
    let picture = render(&model, &camera, &PAPER);
    // 20 pixels a metre; looking along +X, +Y is to the left: Y = 1 m is column 20, Z = 1.5 m row 10.
    for row in 0..40 {
        for column in 0..80 {
            let [red, green, blue] = picture.pixel(column, row).unwrap();
            let inside = (20..50).contains(&column) && (10..30).contains(&row);
            if inside {
                assert!(green > red && red > blue && green < 250, "{column} {row}: {red} {green} {blue}");
            } else {
                assert_eq!([red, green, blue], [255; 3], "{column} {row}");
            }
        }
    }
}

#[test]
fn a_return_has_its_own_colour_before_the_leaf_and_is_hidden_behind_it() {
    let camera = Camera::parallel([2.0, 0.0, 1.0], [1.0, 0.0, 0.0], 4.0, (80, 40)).unwrap();
    let at = |x: f64| Mark { at: [x, 0.0, 1.0], radius_m: 0.2, rgb: [213, 94, 0] };
    let drawn = |x: f64, returns_on_top: bool| {
        let model = Model::of(&wall([-1.0, 1.0], [0.0, 2.0]), 1).unwrap().with_marks(vec![at(x)]);
        render(&model, &camera, &Look { returns_on_top, ..PAPER }).pixel(40, 20)
    };
    assert_eq!(drawn(2.0, false), Some([213, 94, 0]), "on the leaf, in the colour of the legend");
    assert_ne!(drawn(3.0, false), Some([213, 94, 0]));
    assert_eq!(drawn(3.0, true), Some([213, 94, 0]), "over everything where that is asked for");
}

#[test]
fn a_shaded_leaf_is_darker_than_a_lit_one() {
    let camera = Camera::parallel([2.0, 0.0, 1.0], [1.0, 0.0, 0.0], 1.0, (9, 9)).unwrap();
    let wall =
        |x: f64| Leaf::new(vec![[x, -9.0, -9.0], [x, 9.0, -9.0], [x, 9.0, 9.0], [x, -9.0, 9.0]]).unwrap();
    let brightness = |leaves: Vec<Leaf>, sun: [f64; 3]| {
        let model = Model::of(&Orchard::from_organs(leaves, Vec::new(), f64::INFINITY), 1).unwrap();
        let picture = render(&model, &camera, &Look { sun, ..PAPER });
        u32::from(picture.pixel(4, 4).unwrap()[1])
    };
    let lit = brightness(vec![wall(2.0)], [-1.0, 0.0, 0.2]);
    let behind = brightness(vec![wall(2.0), wall(2.5)], [1.0, 0.0, 0.2]);
    assert!(lit > behind + 40, "lit {lit}, in the shade of another {behind}");
}

#[test]
fn an_empty_orchard_is_refused() {
    let empty = Orchard::from_organs(Vec::new(), Vec::new(), 1.0);
    assert_eq!(Model::of(&empty, 1).unwrap_err(), RenderError::Nothing);
}
