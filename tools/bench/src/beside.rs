//! rowscan's caster and parry3d as children of `tools/beside/beside.py`, which asks them for drives, line by line.
//!
//! `beside export SCENE FILE` writes a scene as PLY. `beside caster SCENE` and `beside parry3d FILE` load, cast one line, print it as
//! JSON, and then answer each line of standard input: `ready`, `drive`, `ranges FILE`. The parent reads their processor time from /proc.

use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, Write};
use std::path::Path;

use parry3d::math::Vector;
use parry3d::query::{Ray, RayCast};
use parry3d::shape::TriMesh;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::exchange::ply;
use rowscan_scenes::files::load_scene;
use rowscan_scenes::{BeamFan, Beams, Caster, Orchard, Return, Scratch};

/// Name by which the program is asked for this.
pub const NAME: &str = "beside";

/// The rays of the drive: those of `beside.py`. An LMS111 sees 270° in steps of half a degree.
const BEAMS: usize = 541;
const FIRST_DEG: f64 = -135.0;
const STEP_DEG: f64 = 0.5;

/// Lines of a drive, how far they are apart, and where the mirror is: metres.
const LINES: usize = 900;
const LINE_M: f64 = 0.02;
const MIRROR_X_M: f64 = -1.9;
const MIRROR_Z_M: f64 = 1.6;

/// As far as parry3d follows a ray, metres.
const FARTHEST_M: f32 = 1000.0;

/// A reason to stop.
type Failure = Box<dyn Error>;

/// Runs what the arguments after the name say.
///
/// # Errors
/// Files that cannot be read or written, scenes that do not grow, unknown arguments.
pub fn run(arguments: &[String]) -> Result<(), Failure> {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        ["export", scene, file] => Ok(std::fs::write(file, ply::write(&grown(scene)?))?),
        ["caster", scene] => {
            let caster = Caster::new(&grown(scene)?);
            let fan = BeamFan::from_degrees(FIRST_DEG, STEP_DEG, BEAMS);
            let (mut scratch, mut found) = (Scratch::default(), vec![Return::MISS; BEAMS]);
            answer(&mut |line, out| {
                caster.cast(origin(line), &fan, &mut scratch, &mut found);
                out.iter_mut().zip(&found).for_each(|(out, found)| *out = found.range_m);
            })
        }
        ["parry3d", file] => {
            let mesh = triangles(&std::fs::read(file)?)?;
            let beams = Beams::from(BeamFan::from_degrees(FIRST_DEG, STEP_DEG, BEAMS));
            answer(&mut |line, out| {
                for (out, (start, direction)) in out.iter_mut().zip(beams.rays(origin(line))) {
                    let ray = Ray::new(vector(start), vector(direction));
                    *out = mesh.cast_local_ray(&ray, FARTHEST_M, false).map_or(f64::INFINITY, f64::from);
                }
            })
        }
        _ => Err("usage: rowscan-benches beside export SCENE FILE | caster SCENE | parry3d FILE".into()),
    }
}

fn grown(scene: &str) -> Result<Orchard, Failure> {
    let scene = load_scene(scene, |_| {})?;
    Ok(Orchard::grow(&scene.orchard, scene.seed, &|_, _| {})?)
}

fn origin(line: usize) -> Pose {
    Pose { x_m: MIRROR_X_M, y_m: line as f64 * LINE_M, z_m: MIRROR_Z_M }
}

fn vector(v: [f64; 3]) -> Vector {
    Vector::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

/// Casts the first line, says so, and then does what standard input asks for.
fn answer(cast: &mut dyn FnMut(usize, &mut [f64])) -> Result<(), Failure> {
    let mut ranges = vec![f64::INFINITY; BEAMS];
    cast(0, &mut ranges);
    say(&serde_json::json!({ "first": BEAMS }))?;
    for asked in std::io::stdin().lock().lines() {
        let asked = asked?;
        match asked.split_once(' ') {
            // Nothing is to be prepared here: the beams are made already.
            None if asked == "ready" => {}
            None if asked == "drive" => {
                for line in 0..LINES {
                    cast(line, &mut ranges);
                    black_box(&ranges);
                }
            }
            Some(("ranges", file)) => write_ranges(Path::new(file), cast)?,
            _ => return Err(format!("expected `ready`, `drive` or `ranges FILE`, found `{asked}`").into()),
        }
        say(&serde_json::json!({ "rays": LINES * BEAMS }))?;
    }
    Ok(())
}

fn say(what: &serde_json::Value) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{what}")?;
    Ok(out.flush()?)
}

/// Writes the ranges of a drive as 64-bit floats, little-endian, line by line; infinite where a ray meets nothing.
fn write_ranges(file: &Path, cast: &mut dyn FnMut(usize, &mut [f64])) -> Result<(), Failure> {
    let mut ranges = vec![f64::INFINITY; BEAMS];
    let mut bytes = Vec::with_capacity(LINES * BEAMS * 8);
    for line in 0..LINES {
        cast(line, &mut ranges);
        bytes.extend(ranges.iter().flat_map(|range_m| range_m.to_le_bytes()));
    }
    Ok(std::fs::write(file, bytes)?)
}

/// Bytes of a vertex and of a face of the PLY files that `beside.py` writes: three 32-bit floats; a count of 3 and three 32-bit indices.
const VERTEX_BYTES: usize = 12;
const FACE_BYTES: usize = 13;

/// The triangles of a PLY that `beside.py` wrote.
fn triangles(bytes: &[u8]) -> Result<TriMesh, Failure> {
    const END: &[u8] = b"end_header\n";
    let end = bytes.windows(END.len()).position(|window| window == END).ok_or("PLY without end_header")?;
    let header = std::str::from_utf8(&bytes[..end])?;
    let body = &bytes[end + END.len()..];
    let vertex_bytes = count(header, "element vertex ")? * VERTEX_BYTES;
    let face_bytes = count(header, "element face ")? * FACE_BYTES;
    if body.len() != vertex_bytes + face_bytes {
        let wanted = vertex_bytes + face_bytes;
        return Err(format!("expected {wanted} bytes after the header, found {}", body.len()).into());
    }
    let (vertices, faces) = body.split_at(vertex_bytes);
    let words = |bytes: &[u8]| -> [[u8; 4]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|byte| bytes[4 * i + byte]))
    };
    let vertices = vertices.chunks_exact(VERTEX_BYTES).map(|bytes| {
        let [x, y, z] = words(bytes).map(f32::from_le_bytes);
        Vector::new(x, y, z)
    });
    let faces = faces.chunks_exact(FACE_BYTES).map(|bytes| words(&bytes[1..]).map(u32::from_le_bytes));
    Ok(TriMesh::new(vertices.collect(), faces.collect())?)
}

fn count(header: &str, element: &str) -> Result<usize, Failure> {
    let line = header.lines().find_map(|line| line.strip_prefix(element));
    Ok(line.ok_or_else(|| format!("PLY without `{element}`"))?.trim().parse()?)
}
