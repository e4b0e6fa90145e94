use rayon::prelude::*;
use rowscan_canopy::estimator::TABLE;
use rowscan_canopy::*;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::Scan;
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_study::trial::{Asked, each_scan};
use std::env;

fn list(name: &str, default: &str) -> Vec<String> {
    env::var(name).unwrap_or_else(|_| default.into()).split(' ').map(String::from).collect()
}
struct Row { raw: f64, by_k: Vec<Vec<(String, f64)>> }
fn main() {
    let seeds: Vec<u64> = list("SEEDS", "301 302").iter().map(|s| s.parse().unwrap()).collect();
    let ks: Vec<f64> = list("K", "0.6 1.0").iter().map(|s| s.parse().unwrap()).collect();
    let merged: Vec<f64> = list("L", "0 1").iter().map(|s| s.parse().unwrap()).collect();
    let wanted = list("EST", "contact_raw voxel polar gap impacted");
    for scene_name in list("SCENES", "spindle") {
        for optics in list("OPTICS", "device") {
        let scene = files::load_scene(&scene_name).unwrap();
        for model in list("MODELS", "lms111 tim561 lms511 lms291") {
            let any = AnyModel::by_name(&model).unwrap();
            for distance in list("DIST", "1 2 4") {
                let d: f64 = distance.parse().unwrap();
                let rows: Vec<Row> = seeds.par_iter().map(|&seed| {
                    let mut s = Scene { seed, ..scene.clone() };
                    s.optics.stages = optics.parse().unwrap();
                    s.rig.scanners[0].distance_m = d;
                    s.rig.scanners[0].model = model.clone();
                    let spacing = d * 2.0;
                    s.rig.row_spacing_m = Some(spacing.max(4.0));
                    let stage = Stage::grow(s, &|_, _| {}).unwrap();
                    let rig = rig_with(&stage.rig, 0, any.name());
                    let r = Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(None)).unwrap();
                    let mut scans: Vec<Scan> = Vec::new();
                    each_scan(&stage, any, Asked { cola: r.cola, lms2xx: r.lms2xx }, &mut |scan| scans.push(scan.clone())).unwrap();
                    let truth = stage.orchard.truth().leaf_area_m2;
                    let run = |footprint: Option<Footprint>| {
                        let all: Vec<_> = TABLE.iter().collect();
                        let mut p = Pipeline::with_parameters(Some(&rig), 0, None, Parameters { footprint, ..Default::default() }).unwrap().with_estimators(&all);
                        for scan in &scans { p.push(scan); }
                        p.finish()
                    };
                    let values = |e: &Estimate| wanted.iter().map(|w| {
                        let v = if w == "contact_raw" { e.leaf_area_contact_raw_m2.unwrap() / truth }
                        else if w == "I_T" { e.impacted_total_area_m2.unwrap() }
                        else { e.measures.iter().find(|m| m.estimator == w && m.band_m().is_none()).and_then(|m| m.value).unwrap_or(f64::NAN) / if w == "impacted" { 1.0 } else { truth } };
                        (w.clone(), v)
                    }).collect::<Vec<_>>();
                    let mut by_k = Vec::new();
                    for &l in &merged { for &k in &ks {
                        let mut f = Footprint::of(any.optics(), LeafShape::default());
                        f.clump_m = k * 0.035; if l == 0.0 { f.merged_m = 0.0 }
                        by_k.push(values(&run(Some(f))));
                    } }
                    let raw = run(None);
                    by_k.push(values(&raw));
                    Row { raw: truth, by_k }
                }).collect();
                let n = rows.len() as f64;
                let mut i = 0;
                let mut show = |label: String| {
                    print!("{scene_name} {optics} {model} {d} m {label}:");
                    for (j, w) in wanted.iter().enumerate() {
                        let m = rows.iter().map(|r| r.by_k[i][j].1).sum::<f64>() / n;
                        let sd = (rows.iter().map(|r| (r.by_k[i][j].1 - m).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
                        if w == "I_T" || w == "impacted" { print!("  {w} {m:.2}±{sd:.2}") } else { print!("  {w} {:+.1}±{:.1}", 100.0 * (m - 1.0), 100.0 * sd) }
                    }
                    println!();
                    i += 1;
                };
                for l in &merged { for k in &ks { show(format!("L {l} k {k}")); } }
                show("uncorrected".into());
                let _ = rows[0].raw;
            }
        } }
    }
}
