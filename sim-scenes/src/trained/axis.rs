//! Axes of a trained tree: chains of short straight pieces that extend at their end, year after year.

use glam::DVec3;

/// What an axis is to the one who trains the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The trunk and the leader above it.
    Leader,
    /// A scaffold limb of a vase: grows like a leader.
    Scaffold,
    /// An arm tied along a wire.
    Arm,
    /// A fruiting branch on a leader, a scaffold or an arm.
    Lateral,
    /// A shoot on a lateral.
    Side,
}

impl Role {
    /// Bears laterals, and is not renewed.
    pub(super) fn is_frame(self) -> bool {
        matches!(self, Self::Leader | Self::Scaffold | Self::Arm)
    }
}

/// A straight piece of an axis; an annual shoot is a few of them, so that it can bend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) direction: DVec3,
    pub(super) length_m: f64,
    pub(super) radius_m: f64,
    /// Season that made it, from 1.
    pub(super) season: u32,
}

/// A short shoot that ends in a rosette every season; it stands on wood older than itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spur {
    /// Metres of its axis below it.
    pub(super) along_m: f64,
    /// Bearing about the axis.
    pub(super) azimuth_deg: f64,
    /// Season in which its bud broke.
    pub(super) season: u32,
}

/// An axis.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) role: Role,
    /// Axis that bears it, by number (always smaller), and metres of that axis below it.
    pub(super) bearer: Option<(usize, f64)>,
    /// Season of its first shoot.
    pub(super) born: u32,
    /// Length of its annual shoots over those of its role.
    pub(super) vigour: f64,
    /// Shoots end at this; a shoot cut back starts again behind the cut.
    pub(super) pieces: Vec<Piece>,
    pub(super) spurs: Vec<Spur>,
    /// Cut off or dead.
    pub(super) is_gone: bool,
    /// Its end was cut in the last winter.
    pub(super) was_headed: bool,
}

impl Axis {
    /// An axis without wood yet.
    pub(super) fn new(role: Role, bearer: Option<(usize, f64)>, born: u32, vigour: f64) -> Self {
        Self {
            role,
            bearer,
            born,
            vigour,
            pieces: Vec::new(),
            spurs: Vec::new(),
            is_gone: false,
            was_headed: false,
        }
    }

    pub(super) fn length_m(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.length_m).sum()
    }

    /// Piece at a length along the axis, and how far up that piece.
    pub(super) fn at(&self, along_m: f64) -> Option<(usize, f64)> {
        let mut below_m = 0.0;
        for (number, piece) in self.pieces.iter().enumerate() {
            if along_m <= below_m + piece.length_m || number + 1 == self.pieces.len() {
                return Some((number, (along_m - below_m).clamp(0.0, piece.length_m)));
            }
            below_m += piece.length_m;
        }
        None
    }

    /// Point at a length along the axis, from its foot.
    pub(super) fn point(&self, foot: DVec3, along_m: f64) -> DVec3 {
        let mut left_m = along_m;
        let mut point = foot;
        for piece in &self.pieces {
            let step_m = piece.length_m.min(left_m);
            point += piece.direction * step_m;
            left_m -= step_m;
            if left_m <= 0.0 {
                break;
            }
        }
        point
    }

    /// Lengths along the axis from which to which a season's wood reaches; None where there is none.
    pub(super) fn wood_of(&self, season: u32) -> Option<(f64, f64)> {
        let mut along_m = 0.0;
        let mut span: Option<(f64, f64)> = None;
        for piece in &self.pieces {
            let end_m = along_m + piece.length_m;
            if piece.season == season {
                span = Some((span.map_or(along_m, |(from, _)| from), end_m));
            }
            along_m = end_m;
        }
        span
    }

    /// Direction at its end; up for an axis without wood.
    pub(super) fn heading(&self) -> DVec3 {
        self.pieces.last().map_or(DVec3::Z, |piece| piece.direction)
    }

    /// Shortens the axis. What stood beyond is the caller's to remove.
    pub(super) fn shorten(&mut self, to_m: f64) {
        let mut below_m = 0.0;
        self.pieces.retain_mut(|piece| {
            let room_m = to_m - below_m;
            below_m += piece.length_m;
            piece.length_m = piece.length_m.min(room_m);
            piece.length_m > 1e-3
        });
        self.spurs.retain(|spur| spur.along_m <= to_m);
        self.was_headed = true;
    }
}

/// A tree while it is trained.
#[derive(Clone, Debug, Default)]
pub(super) struct Plant {
    pub(super) axes: Vec<Axis>,
    /// Where laterals were cut to stubs last winter: bearer and metres of it below.
    pub(super) stubs: Vec<(usize, f64)>,
}

impl Plant {
    /// Feet of all axes, in the frame of the tree.
    pub(super) fn feet(&self) -> Vec<DVec3> {
        let mut feet: Vec<DVec3> = Vec::with_capacity(self.axes.len());
        for axis in &self.axes {
            let foot = axis.bearer.and_then(|(bearer, along_m)| {
                Some(self.axes.get(bearer)?.point(*feet.get(bearer)?, along_m))
            });
            feet.push(foot.unwrap_or(DVec3::ZERO));
        }
        feet
    }

    /// Takes away all axes whose bearer is gone or no longer reaches them.
    pub(super) fn drop_orphans(&mut self) {
        let mut reach_m: Vec<f64> = Vec::with_capacity(self.axes.len());
        for axis in &mut self.axes {
            let stands = axis
                .bearer
                .is_none_or(|(bearer, along_m)| reach_m.get(bearer).is_some_and(|reach| along_m <= *reach));
            axis.is_gone |= !stands || axis.pieces.is_empty();
            reach_m.push(if axis.is_gone { -1.0 } else { axis.length_m() });
        }
    }

    /// Metamers of all living wood.
    pub(super) fn metamers(&self, internode_m: f64) -> f64 {
        let living = self.axes.iter().filter(|axis| !axis.is_gone);
        living.map(|axis| axis.length_m() / internode_m + axis.spurs.len() as f64).sum()
    }
}
