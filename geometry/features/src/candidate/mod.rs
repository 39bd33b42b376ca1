//! What may be features: levels with their outlines, before anything says what they are.

mod border_sides;
mod bowed;
mod merge;
mod outlined;
mod tip;
mod top;

use std::collections::VecDeque;

use range_image::{Cancelled, Monitor};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::border::{Border, border};
use crate::frame::Frame;
use crate::levels::{AROUND, Levels, Sense};
use crate::outline::{Outline, Shape};
use crate::sight::Sight;

pub(crate) use border_sides::side_of;
pub use bowed::Bowed;
pub use tip::Tip;
pub use top::{Top, top};

/// How a level lies in what is around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lie {
    /// The body that all others are cut into and stand on.
    Body,
    /// Lower than what is around it, where there is something.
    Hollow,
    /// Higher than what is around it.
    Raised,
}

/// A level that may be a feature.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Its levels: one, or the pieces of one that another cuts apart.
    pub levels: Vec<u16>,
    /// How it lies.
    pub lie: Lie,
    /// Its outline in the plan.
    pub outline: Outline,
    /// The level that it goes into or stands on.
    pub host: u16,
    /// Whether the scan ends in it.
    pub is_cut: bool,
    /// The cone that its floor is, of a drilled hole.
    pub tip: Option<Tip>,
    /// How deep or high it is, of what meets its face without a wall.
    pub bowed: Option<Bowed>,
}

/// No candidate is narrower than so many sample distances, nor of fewer nodes.
const LEAST_PITCHES: f64 = 3.0;
const FEWEST: usize = 9;
/// Outermost pairs of which at least this share rises are a hollow's.
const HOLLOW: f64 = 0.2;
/// Or this share, if it rises to larger planes: slots wider than they are long have short walls.
const WALLED: f64 = 0.12;
/// Of which at least this share falls, what stands out.
const RAISED: f64 = 0.6;
/// A hollow goes into what at least this share of its walls rise to.
const HOST: f64 = 0.12;
/// Where more than this share of the border lies at the frame of the scan, that cuts it.
const CUT: f64 = 0.06;

/// Candidates of all levels; the body first. Those that are narrower than so many sample distances are
/// left out.
///
/// # Errors
/// Cancelled.
pub fn candidates(
    sight: &Sight<'_>,
    top: &Top,
    step_mm: f64,
    seed: u64,
    least_pitches: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<Candidate>, Cancelled> {
    let image = &sight.field.image;
    let own_border =
        |is_own: &dyn Fn(u16) -> bool| border(image, sight.regions, sight.levels, step_mm, is_own);
    let body = || {
        let body = own_border(&|level| level != AROUND);
        let outline = outlined::outlined(sight, &body, Lie::Body, seed)?;
        Some(Candidate {
            levels: top.levels.clone(),
            lie: Lie::Body,
            outline,
            host: AROUND,
            is_cut: body.at_frame as f64 > CUT * (body.pairs.len() + body.at_frame) as f64,
            tip: None,
            bowed: None,
        })
    };
    let least_mm = least_pitches.max(LEAST_PITCHES) * sight.field.pitch_mm();
    let of_set = |set: Vec<u16>| candidate(sight, set, step_mm, seed, least_mm);
    // None depends on another until two are one.
    let each = || -> Vec<Option<Candidate>> {
        let sets = merge::sets(sight, top, step_mm).into_par_iter();
        sets.map(|set| monitor.check().ok().and_then(|()| of_set(set)))
            .collect()
    };
    let (body, each) = rayon::join(body, each);
    monitor.check()?;
    let mut found: Vec<Candidate> = body.into_iter().collect();
    let mut open = VecDeque::from(each);
    let mut others: Vec<Candidate> = Vec::new();
    while let Some(own) = open.pop_front() {
        monitor.check()?;
        let Some(own) = own else {
            continue;
        };
        // Pieces of one floor, of which the rest is hidden, have one outline.
        match others.iter().position(|other| are_one(sight, other, &own)) {
            Some(index) => {
                let mut both = others.remove(index).levels;
                both.extend(own.levels);
                merge::largest_first(sight, &mut both);
                open.push_front(of_set(both));
            }
            None => others.push(own),
        }
    }
    found.extend(others);
    Ok(found)
}

/// A piece is part of another whose outline holds this share of its nodes.
const HELD: f64 = 0.95;

/// Whether two hollows go into the same, and one lies within the outline of the other.
fn are_one(sight: &Sight<'_>, one: &Candidate, other: &Candidate) -> bool {
    let image = &sight.field.image;
    let rows = sight.levels.rows;
    let holds = |outer: &Candidate, inner: &Candidate| {
        let (mut inside, mut all) = (0, 0);
        for (node, level) in sight.levels.labels.iter().enumerate() {
            if inner.levels.contains(level) {
                let (x, y) = (image.x_mm(node / rows), image.y_mm(node % rows));
                let [u, v, _] = sight.frame.local(nalgebra::Vector3::new(x, y, 0.0));
                let off = outer.outline.shape.distance_mm([u, v]);
                inside += usize::from(off < 0.5 * image.pitch_mm());
                all += 1;
            }
        }
        f64::from(all) * HELD <= inside as f64
    };
    let both = one.lie == Lie::Hollow && other.lie == Lie::Hollow && one.host == other.host;
    both && (holds(one, other) || holds(other, one))
}

/// Of the area within its outline a level takes at least this share; less is a rest of an edge.
const FILLED: f64 = 0.12;

/// Whether an outline is narrower than features are, or hardly filled: the rest of a slanting edge.
fn is_scrap(sight: &Sight<'_>, outline: &Outline, nodes: usize, least_mm: f64) -> bool {
    let pitch = sight.field.image.pitch_mm();
    let [a, b] = match outline.shape {
        Shape::Circle(circle) => [2.0 * circle.radius_mm; 2],
        Shape::Rectangle(rectangle) => rectangle.sizes_mm(),
    };
    a.min(b) < least_mm || (nodes as f64) * pitch * pitch < FILLED * a * b
}

/// The candidate of a set of levels, if they are one.
fn candidate(
    sight: &Sight<'_>,
    set: Vec<u16>,
    step_mm: f64,
    seed: u64,
    least_mm: f64,
) -> Option<Candidate> {
    let mut own = border(
        &sight.field.image,
        sight.regions,
        sight.levels,
        step_mm,
        &|level| set.contains(&level),
    );
    let bow = sight.levels.levels[usize::from(*set.first()?)].bow;
    let face = bow.and_then(|bow| bowed::as_walls(sight, bow, &mut own));
    // Half of a square of the least width.
    let across = least_mm / sight.field.image.pitch_mm();
    if own.nodes < ((0.5 * across * across) as usize).max(FEWEST) {
        return None;
    }
    let [rises, falls, level] =
        [Sense::Rises, Sense::Falls, Sense::Level].map(|sense| own.outermost(sense) as f64);
    let all = (rises + falls + level + own.at_frame as f64).max(1.0);
    let lie = if rises >= HOLLOW * all || walled(sight, &own, &set) as f64 >= WALLED * all {
        Lie::Hollow
    } else if falls >= RAISED * all {
        Lie::Raised
    } else {
        return None;
    };
    let host = host(sight.levels, &own, lie)?;
    let seed = seed ^ (u64::from(*set.first()?) << 32);
    let mut outline = outlined::outlined(sight, &own, lie, seed)?;
    let bowed = bow
        .zip(face)
        .and_then(|(bow, face)| bowed::settled(sight, &set, bow, (&face, &own), &mut outline));
    if is_scrap(sight, &outline, own.nodes, least_mm) {
        return None;
    }
    let tip = (lie == Lie::Hollow && bowed.is_none())
        .then(|| tip::tip(sight, *set.first()?, &outline.shape))
        .flatten();
    Some(Candidate {
        tip,
        bowed,
        levels: set,
        lie,
        outline,
        host,
        is_cut: own.at_frame as f64 > CUT * all,
    })
}

/// How many of the outermost pairs rise to a larger plane: walls of what is cut into that, however
/// short they are, and no rests of edges.
fn walled(sight: &Sight<'_>, own: &Border, set: &[u16]) -> usize {
    let of = |level: u16| &sight.levels.levels[usize::from(level)];
    let is_plane = set.iter().all(|level| of(*level).is_plane);
    let is_wall = |level: u16| of(level).is_plane && of(level).nodes > own.nodes;
    let pairs = own.pairs.iter().filter(|pair| pair.outermost && is_plane);
    pairs
        .filter(|pair| pair.sense == Sense::Rises && is_wall(pair.beyond))
        .count()
}

/// Of a hollow the highest of the levels that enough of the border rises to: what is cut across
/// several floors is cut from the highest. Of what stands out, the level that most of it falls to.
fn host(levels: &Levels, own: &Border, lie: Lie) -> Option<u16> {
    let wanted = match lie {
        Lie::Hollow => Sense::Rises,
        Lie::Raised | Lie::Body => Sense::Falls,
    };
    let mut counts = vec![0_usize; levels.levels.len()];
    for pair in &own.pairs {
        if pair.outermost && pair.sense == wanted && pair.beyond != AROUND {
            counts[usize::from(pair.beyond)] += 1;
        }
    }
    let all: usize = counts.iter().sum();
    let height = |index: usize| {
        let plane = levels.levels[index].plane.as_ref();
        plane.map_or(f64::NEG_INFINITY, |p| {
            p.z_mm(p.middle_mm[0], p.middle_mm[1])
        })
    };
    let found = (0..counts.len()).filter(|k| counts[*k] > 0);
    let index = match lie {
        Lie::Hollow => found
            .filter(|k| counts[*k] as f64 >= HOST * all as f64)
            .max_by(|a, b| height(*a).total_cmp(&height(*b))),
        Lie::Raised | Lie::Body => found.max_by_key(|k| (counts[*k], std::cmp::Reverse(*k))),
    }?;
    u16::try_from(index).ok()
}

/// The plan of the part: its top face's.
#[must_use]
pub fn frame_of(top: &Top) -> Frame {
    let [x, y] = top.plane.middle_mm;
    let origin = nalgebra::Vector3::new(x, y, top.plane.z_mm(x, y));
    Frame::upon(origin, top.plane.normal())
}
