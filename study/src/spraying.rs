//! The reference controller driven past a row in memory: scanner, controller and boom, without sockets.

use rowscan_emulator::offline::{Offline, SetUpError};
use rowscan_emulator::stage::{Stage, StageError};
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Mount;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;
use rowscan_protocol::validity::ScanFault;
use rowscan_sprayer::boom::{Side, Zone};
use rowscan_sprayer::controller::LEAST_BEAMS;
use rowscan_sprayer::{Boom, Command, CommandLog, Controller, ControllerError, Drive, Pass, Target};
use rowscan_vehicle::Tractor;

/// The tractor's ECU says its speed so often, ns.
const SPEED_NS: u64 = 100_000_000;
/// From the end of a scan until a valve hears of it, as the reference controller has it, seconds.
const LATE_S: f64 = 0.02;
/// Farther back than any nozzle sees, metres.
const FAR_M: f64 = 1e4;

/// Why a row could not be sprayed.
#[derive(Debug, thiserror::Error)]
pub enum SprayingError {
    /// A scanner does not fit the rig.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The start-up was refused.
    #[error(transparent)]
    SetUp(#[from] SetUpError),
    /// A telegram without a scan.
    #[error(transparent)]
    Scan(#[from] ScanFault),
    /// The controller does not fit the boom or the rig.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// Nobody sees the boom's spray here.
    #[error(
        "a boom with `[drops]`, whose spray scanners see, is driven in scenarios of `rowscan check` only; leave out `[drops]` here"
    )]
    Drops,
    /// A scanner that only speaks on a line.
    #[error("expected scanners with CoLa, found a {0}; name another model in the rig")]
    Line(&'static str),
}

/// How the reference controller is set, and how late what it says comes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controlled {
    /// A command reaches its valve so long after the scan that it follows from, seconds.
    pub late_s: f64,
    /// What the controller assumes of that, seconds.
    pub assumed_late_s: f64,
    /// Beams of a scan before a nozzle that it takes for canopy.
    pub least_beams: u16,
}

impl Default for Controlled {
    fn default() -> Self {
        Self { late_s: LATE_S, assumed_late_s: LATE_S, least_beams: LEAST_BEAMS }
    }
}

/// A row that was sprayed: what was wanted, and what the controller said.
#[derive(Clone, Debug)]
pub struct Sprayed {
    /// What was wanted.
    pub pass: Pass,
    /// What the controller said.
    pub log: CommandLog,
    /// Scans that it had.
    pub scans: u64,
}

/// Drives the scanners of a stage past its row, has the reference controller command `boom`, and ends at the row's end. What stands before the first scan nobody has seen: it is not wanted.
///
/// # Errors
/// Scanners, rig and boom that do not fit each other.
pub fn spray(
    stage: &Stage,
    boom: Boom,
    Controlled { late_s, assumed_late_s, least_beams }: Controlled,
) -> Result<Sprayed, SprayingError> {
    if boom.drops.is_some() {
        return Err(SprayingError::Drops);
    }
    let tractor = stage.tractor();
    let mut controller = Controller::new(boom.clone(), &stage.rig.scanners, assumed_late_s)?
        .with_ground(&stage.rig)
        .with_least_beams(least_beams);
    let mut eyes = eyes(stage, &tractor)?;
    let hertz = eyes.first().map_or(1.0, |(_, hertz, _)| *hertz);
    let end = SimTime((stage.scans_to_row_end(hertz) as f64 / hertz * 1e9) as u64);
    let (mut scan, mut said, mut told) = (Scan::default(), Vec::new(), vec![0.0; boom.sections.len()]);
    let numbers: Vec<u16> = boom.numbers().collect();
    let (mut scans, mut speed_due) = (0, 0);
    loop {
        let due = |(_, hertz, turn): &(Offline, f64, u64)| (*turn as f64 / hertz * 1e9) as u64;
        let next =
            eyes.iter().enumerate().min_by_key(|(_, eye)| due(eye)).map(|(place, eye)| (place, due(eye)));
        let Some((place, scan_due)) = next else { break };
        let at = speed_due.min(scan_due);
        if at > end.0 {
            break;
        }
        if speed_due <= scan_due {
            let motion = tractor.motion(SimTime(at));
            // As the bus has it: millimetres a second.
            controller.on_speed(Some((motion.speed_m_s * 1e3).round() / 1e3));
            controller.on_course(motion.place.heading_rad);
            speed_due += SPEED_NS;
        } else if let Some((offline, _, turn)) = eyes.get_mut(place) {
            *turn += 1;
            if offline.scan_into(&mut scan)? {
                controller.on_scan(place, &scan);
                scans += 1;
            }
        }
        let duties = controller.duties();
        let at = SimTime(at + (late_s * 1e9) as u64);
        let news = numbers.iter().zip(&duties).zip(&told).filter(|((_, duty), told)| duty != told);
        said.extend(news.map(|((number, duty), _)| Command {
            at,
            target: Target::Section(*number),
            duty: *duty,
        }));
        told = duties;
    }
    // The first word of a controller, which says that it is there.
    said.push(Command { at: SimTime::ZERO, target: Target::All, duty: 0.0 });
    let mut boom = boom;
    // Where the first scans meet the row's axis, on either side.
    for side in [Side::Left, Side::Right] {
        let mounts = stage.rig.scanners.iter().filter(|mount| Side::from(mount.row) == side);
        let first_m = stage.rig.start_m + mounts.map(Mount::meets_axis_m).fold(f64::INFINITY, f64::min);
        if first_m.is_finite() {
            boom.no_spray.push(Zone { y_from_m: first_m - FAR_M, y_to_m: first_m, side: Some(side) });
        }
    }
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, end);
    let pass = Pass::new(boom, &stage.orchard, drive, stage.scene.seed);
    Ok(Sprayed { pass, log: said.into_iter().collect(), scans })
}

/// The scanners of a stage, each with its turns a second and the number of its next turn.
fn eyes(stage: &Stage, tractor: &Tractor) -> Result<Vec<(Offline, f64, u64)>, SprayingError> {
    let mut eyes = Vec::new();
    for (number, mount) in stage.rig.scanners.iter().enumerate() {
        let model = match AnyModel::by_name(&mount.model) {
            Some(AnyModel::Cola(model)) => model,
            Some(other) => return Err(SprayingError::Line(other.name())),
            None => return Err(SprayingError::Line("scanner that is not known")),
        };
        let (device, view) = stage.scanner_on(tractor, number, model)?;
        let hertz = f64::from(device.mirror().frequency_centihz) / 100.0;
        let mut offline = Offline::new(device, view);
        offline.set_up(ColaConfig::default())?;
        eyes.push((offline, hertz, 1));
    }
    Ok(eyes)
}
