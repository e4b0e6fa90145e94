//! SICK multiScan136: 16 layers of 360° a turn, two of them fine, three echoes, Compact over UDP; CoLa and REST for its settings.

use super::compact::CompactOutput;
use super::layer::Layer;
use super::picoscan150::{COMPACT_OUTPUT, PICOSCAN1XX};
use super::{Model, ScanMode};
use crate::optics::Fact;

/// Step of the fine layers, 1/10000°.
const FINE: u16 = 1250;
/// Step of the others.
const COARSE: u16 = 10_000;

const fn layer(elevation_centideg: i16, module: u8, azimuth_centideg: u16, step: u16) -> Layer {
    Layer { elevation_centideg, module, azimuth_centideg, step }
}

/// Counted from 1 as SICK's guide counts them: the fine ones are number 6 and 14. Lines of the second and the fourth module look the other way.
static LAYERS: [Layer; 16] = [
    layer(2271, 0, 1100, COARSE),
    layer(1756, 0, 50, COARSE),
    layer(1248, 0, 35_700, COARSE),
    layer(751, 0, 2650, COARSE),
    layer(249, 0, 35_750, COARSE),
    layer(7, 2, 2450, FINE),
    layer(-243, 0, 100, COARSE),
    layer(-729, 0, 1100, COARSE),
    layer(-1279, 1, 19_100, COARSE),
    layer(-1728, 1, 18_050, COARSE),
    layer(-2194, 1, 17_600, COARSE),
    layer(-2673, 1, 20_750, COARSE),
    layer(-3186, 1, 17_500, COARSE),
    layer(-3442, 3, 20_650, FINE),
    layer(-3718, 1, 17_800, COARSE),
    layer(-4279, 1, 19_050, COARSE),
];

static MODES: [ScanMode; 1] = [ScanMode { frequency_centihz: 2000, step: FINE }];

static COMPACT: CompactOutput = CompactOutput {
    profiles: 0,
    segment: 300_000,
    wide_segment: 300_000,
    transmit_us: 11_700,
    transmit_within_us: [7_900, 14_000],
    jitter_us: Fact::recorded(2.0),
    layers: &LAYERS,
    elevation_off_deg: Fact::assumed(0.7),
    lacks: &["PerformanceProfileNumber", "ScanConfig", "SensitivityMode", "EnableLongRangeMode"],
    ..COMPACT_OUTPUT
};

pub(super) static MULTISCAN136: Model = Model {
    name: "multiscan136",
    title: "multiScan136",
    ident_name: "multiScan",
    ident_version: "2.4.2.0R",
    type_code: "multiScan1xxx",
    order_number: "unknown",
    firmware: "2.4.2.0R",
    // The whole turn of its level layer, which begins at −155.5°; 90° more in CoLa.
    start_angle: -655_000,
    stop_angle: 2_943_750,
    modes: &MODES,
    default_mode: MODES[0],
    compact: Some(&COMPACT),
    emulates: &[
        "20 Hz; 16 layers of 360° a turn, 14 of 1° and two (number 6 and 14, near 0° and −34°) of 0.125°; 12 Compact telegrams of 30° a turn with four modules of 7, 7, 1 and 1 lines, 14 160 bytes with three echoes; each line with its own start angle, which may pass 180°; sent 7.7 ms after the last beam",
        "each unit's own elevations, from the scene's seed: within 0.7° of the design's; rays of a layer are a cone",
        "layer filter (LFPlayerFilter: lines of layers that are off are not in the telegrams), angle filter with both angles, interval filter, distance filter; one to three echoes, the echo filter, reflector bit; IMU and encoder telegrams",
        "CoLa A and B and REST with the variables of docs/picoscan.md that it has; LMDscandata of the level layer alone with ScanDataFormat 3",
    ],
    not_emulated: &[
        "interlaced modes (10 Hz/0.5° and 5 Hz/0.25°): nothing switches them on; rectified output (ScanDataPreformatting 2): sFA 4, REST status 6",
        "LMDscandata of the other layers: no bytes are public; with ScanDataFormat 3 only the level layer comes",
        "what a picoScan150 does not emulate either",
        "the estimate is of the layer within 1° of the level; the other 15 are counted and left out (`other_layer`). The page and Foxglove show the lines of that layer alone",
    ],
    evidence: &[
        "layout, modules, layers of each, number of beams, segments, times of lines (all lines of a telegram begin and end together), start angles (rounded to 0.5°; alike but for 0.5° in two units) and transmission 3.9 to 10 ms after the last beam: four recorded telegrams of two units",
        "elevations by design: a public client's table; units' own were up to 0.7° off it, which they are here in any direction (assumed)",
        "sign of phi: z = + d sin phi, as SICK's SDK and guide read it, and the first module looks up; sick_scan_xd reads z = − d sin phi of the same bytes. `phi = \"down\"` of a scanner in the rig reads, and simulates, it so",
        "LFPlayerFilter: that lines which are off are left out and not sent as zeros is taken from a recorded telegram of two lines (assumed); its order is that of the table of elevations, from the highest",
        "no calibration ships: leaf areas are the raw contact frequency and say so (`uncalibrated`), impacted area gives none. Optics: no public measurement of the spot was at hand; an LMS1xx's numbers stand for it (assumed)",
        "variables: SICK's OpenAPI file of 2.4.2 for names, ranges and values that the guide or clients use; the others as a picoScan150's (assumed). Order number, farthest range, times and counters over restarts: not verified",
    ],
    ..PICOSCAN1XX
};
