//! What was heard of a signal in a run, and when.

use rowscan_bus::transport::Assembly;
use rowscan_protocol::time::SimTime;

use super::Source;
use crate::frames::Carried;
use crate::runner::RunRecord;

/// What was heard at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub(crate) at: SimTime,
    /// None where it was said that there is no value.
    pub(crate) value: Option<f64>,
}

impl Source {
    /// What was heard in `run`, in its order, of the rig's own machines from `rig_from` on; expectation number `number` tells the pattern of a log.
    pub(crate) fn samples(
        &self,
        number: usize,
        run: &RunRecord,
        rig_from: SimTime,
    ) -> Result<Vec<Sample>, String> {
        let counts = |carried: &&Carried| carried.from_others || carried.at >= rig_from;
        match self {
            Self::Field { bus, field } => {
                let mut assembly = Assembly::default();
                let messages = carried(bus, run)?
                    .iter()
                    .filter(counts)
                    .filter_map(|carried| Some((carried.at, assembly.take(&carried.frame)?)));
                let fitting =
                    messages.filter(|(_, (id, bytes))| field.address.fits(*id) && field.is_in(bytes));
                Ok(fitting.map(|(at, (_, bytes))| Sample { at, value: field.value(&bytes) }).collect())
            }
            Self::Messages { bus, address } => {
                let mut assembly = Assembly::default();
                let messages = carried(bus, run)?.iter().filter(counts).filter_map(|carried| {
                    let (id, bytes) = assembly.take(&carried.frame)?;
                    let is_meant = address.map_or(carried.from_others, |address| address.fits(id));
                    is_meant
                        .then_some(Sample { at: carried.at, value: bytes.first().copied().map(f64::from) })
                });
                Ok(messages.collect())
            }
            Self::Sentence { kind, field } => {
                let sentences = run.sentences.iter().filter(|(at, _)| *at >= rig_from);
                let fitting = sentences.filter_map(|(at, sentence)| {
                    let text = sentence.trim().split('*').next()?;
                    let mut fields = text.split(',');
                    let head = fields.clone().next()?.trim_start_matches(['$', '!']);
                    if !head.ends_with(kind.as_str()) {
                        return None;
                    }
                    Some(Sample { at: *at, value: fields.nth(*field)?.parse().ok() })
                });
                Ok(fitting.collect())
            }
            Self::Log { child } => {
                let matches = run.children.get(child).and_then(|child| child.matches.get(&number));
                Ok(matches
                    .into_iter()
                    .flatten()
                    .map(|found| Sample { at: found.at, value: found.value })
                    .collect())
            }
        }
    }
}

/// All that a bus has carried; an error where not all was kept.
pub(super) fn carried<'a>(bus: &str, run: &'a RunRecord) -> Result<&'a [Carried], String> {
    match run.frames.get(bus) {
        Some(frames) if frames.lost == 0 => Ok(&frames.all),
        Some(frames) => {
            Err(format!("{bus} carried {} frames more than are kept; shorten the run", frames.lost))
        }
        None => Err(format!("nothing is known of {bus}")),
    }
}

/// The largest share of a bus at 250 kbit/s that its frames took in any second, each with as many stuff bits as it can have; none without a frame.
pub(super) fn load(frames: &[Carried]) -> Option<(f64, SimTime)> {
    const SECOND: u64 = 1_000_000_000;
    let (mut first, mut bits) = (0, 0_u64);
    let mut most: Option<(u64, SimTime)> = None;
    for carried in frames {
        bits += u64::from(carried.frame.bits_at_most());
        while let Some(before) = frames.get(first).filter(|before| before.at.0 + SECOND <= carried.at.0) {
            bits -= u64::from(before.frame.bits_at_most());
            first += 1;
        }
        if most.is_none_or(|(known, _)| bits > known) {
            most = Some((bits, carried.at));
        }
    }
    most.map(|(bits, at)| (bits as f64 / 250_000.0, at))
}
