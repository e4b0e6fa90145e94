//! A scanner's way along the row: advance, odometry and the row's sums, one line behind.

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::counting::Link;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Mount, Rig};

use crate::advance::{Advance, Step, Weighted};
use crate::air_witness::InAir;
use crate::beam_line::KeptBeams;
use crate::beam_witness::{BeamWitness, OtherBeams};
use crate::beside::Beside;
use crate::deskew::Deskew;
use crate::encoder_witness::EncoderWitness;
use crate::error::PipelineError;
use crate::odometry::{AdvanceSource, EncoderChoice, Odometry};
use crate::parameters::Parameters;
use crate::row::Row;
use crate::shares::Shares;
use crate::warning::Warning;

/// Ticks that neighbouring lines may be apart, however slowly it goes.
const TICKS_APART: f64 = 2.0;

/// What the latest telegram states.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LatestScan {
    pub(crate) beams: BeamGrid,
    pub(crate) frequency_hz: f64,
}

/// One scanner's way along the row: the part of a pipeline that needs a rig.
#[derive(Clone, Debug)]
pub(crate) struct RowPass {
    pub(crate) rig: Rig,
    pub(crate) mount: Mount,
    /// The echo that the rig says, where the scans tell another.
    pub(crate) other_echo: Option<EchoChoice>,
    pub(crate) advance: Advance,
    pub(crate) odometry: Odometry,
    /// What speaks against the encoder.
    pub(crate) witness: EncoderWitness,
    /// What a speed that was measured beside it says of its way.
    pub(crate) beside: Beside,
    /// What its scans say of the beams' width.
    beams: BeamWitness,
    /// Turns from one line of the layer that is used to the next.
    pub(crate) turns_a_line: f64,
    pub(crate) row: Row,
    pub(crate) open: OpenLine,
    /// What remission says of shares; `None` where it is not read.
    shares: Option<Shares>,
    /// Where the scan plane is believed to lean.
    deskew: Option<Deskew>,
    /// Y of the mirror at the latest line, metres.
    mirror_y_m: f64,
}

/// The line whose weight is not known yet.
#[derive(Clone, Debug, Default)]
pub(crate) struct OpenLine {
    pub(crate) grid: BeamGrid,
    pub(crate) beams: KeptBeams,
    /// Way a telegram by the frequency its scan states.
    pub(crate) nominal_step_m: f64,
}

impl RowPass {
    pub(crate) fn new(rig: &Rig, mount_index: usize, parameters: Parameters) -> Result<Self, PipelineError> {
        let mount = rig
            .scanners
            .get(mount_index)
            .ok_or(PipelineError::NoSuchMount { index: mount_index, mounts: rig.scanners.len() })?;
        let turns_a_line = f64::from(AnyModel::by_name(&mount.model).map_or(1, AnyModel::turns_a_line));
        // Without an encoder no tick ever comes.
        let tick_m = rig.encoder_ticks_per_m.map_or(f64::INFINITY, |ticks_per_m| 1.0 / ticks_per_m.abs());
        Ok(Self {
            rig: rig.clone(),
            mount: mount.clone(),
            other_echo: None,
            advance: Advance::new(parameters.max_gap_steps * turns_a_line),
            odometry: Odometry::default(),
            witness: EncoderWitness::new(tick_m, rig.speed_m_s),
            beside: Beside::default(),
            beams: BeamWitness::of(mount),
            turns_a_line,
            row: Row::new(rig, mount, parameters)?,
            open: OpenLine::default(),
            shares: Shares::new(&parameters),
            deskew: mount
                .attitude()
                .leans()
                .then(|| Deskew::new(mount.ahead_m(mount.distance_m, 0.0).unwrap_or(0.0))),
            mirror_y_m: 0.0,
        })
    }

    /// The scans, of which none has come yet, tell that they hold this echo: whatever the rig says, they do.
    pub(crate) fn tell_echo(&mut self, echo: EchoChoice) {
        if self.row.tell_echo(echo) {
            self.shares = Shares::new(self.row.parameters());
            self.other_echo = self.mount.echo.replace(echo).filter(|given| *given != echo);
        }
    }

    /// Its source is settled: ticks of an encoder are no gaps.
    pub(crate) fn settle_source(&mut self) {
        if self.odometry.source() == Some(AdvanceSource::Encoder) {
            self.advance.resolve(TICKS_APART * self.witness.tick_m());
        }
    }

    /// What scans, and the rig's speed, say against the encoder, if the advance is taken from it; of so many valid scans.
    pub(crate) fn doubts_of_encoder(&self, valid: u64) -> impl Iterator<Item = Warning> {
        let by_encoder = self.odometry.source() == Some(AdvanceSource::Encoder);
        let doubts = by_encoder.then(|| self.witness.doubts(valid));
        doubts.into_iter().flatten().flatten()
    }

    /// What a speed that was measured beside the way says against it.
    pub(crate) fn doubt_of_way(&self) -> Option<Warning> {
        self.beside.doubt(self.odometry.source()?)
    }

    /// The beams that the scans are of, where the rig says others.
    pub(crate) fn other_beams(&self) -> Option<OtherBeams> {
        self.beams.against(self.rig.optics)
    }

    /// What is in the air before the row. Rays meet nothing there.
    pub(crate) fn in_air(&self) -> Option<InAir> {
        self.row.in_air().filter(|_| self.rig.optics == Some(BeamWidth::Device))
    }

    /// Y of the mirror at the latest line that stands for some of the row, metres: where the plane leans, the row's latest lines lie elsewhere.
    pub(crate) fn mirror_y_m(&self) -> f64 {
        self.mirror_y_m
    }

    /// The same pass by the rig's speed; before the first line.
    pub(crate) fn without_encoder(&self) -> Self {
        let odometry = Odometry::default().with_encoder(EncoderChoice::Never);
        Self { odometry, ..self.clone() }
    }

    /// Opens a line at `y_m`, and weighs the one before.
    pub(crate) fn open(
        &mut self,
        y_m: f64,
        link: Link,
        nominal_step_m: f64,
        grid: BeamGrid,
        range_m: &[f64],
        remission: &[u16],
    ) {
        self.beams.add(&self.mount, grid, range_m);
        let Step::Opened(closed) = self.advance.next(y_m, link, nominal_step_m) else { return };
        self.add_open_line(closed);
        self.open.grid = grid;
        self.open.beams.clear();
        self.open.beams.range_m.extend_from_slice(range_m);
        if let Some(shares) = &self.shares {
            let beams = range_m.iter().zip(remission);
            self.open.beams.share.extend(beams.map(|(range_m, remission)| shares.of(*range_m, *remission)));
        }
        self.open.nominal_step_m = nominal_step_m;
    }

    /// Ends the stream: weighs the last line and closes the slice.
    pub(crate) fn close(&mut self) {
        let closed = self.advance.close(self.open.nominal_step_m);
        self.add_open_line(closed);
        let Self { row, deskew, .. } = self;
        if let Some(deskew) = deskew {
            deskew.flush(&mut |line, at| row.add(line, at));
        }
        self.row.close();
    }

    fn add_open_line(&mut self, weighted: Option<Weighted>) {
        let Some(Weighted { y_m, weight_m }) = weighted else { return };
        let Self { row, deskew, open, mirror_y_m, .. } = self;
        let at = Weighted { y_m: y_m + row.frame().offset_y_m, weight_m };
        if weight_m > 0.0 && at.y_m.is_finite() {
            *mirror_y_m = at.y_m;
        }
        match deskew {
            None => row.add(&open.beams.line(open.grid), at),
            Some(deskew) => {
                let frame = *row.frame();
                deskew.push(&frame, &open.beams.line(open.grid), at, &mut |line, at| row.add(line, at));
            }
        }
    }
}
