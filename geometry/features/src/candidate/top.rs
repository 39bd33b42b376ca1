//! The top face of the part.

use crate::levels::{AROUND, Levels};
use crate::plane::Plane;
use crate::regions::Regions;

/// The top face: all levels that lie in its plane and end where the part ends.
#[derive(Debug, Clone)]
pub struct Top {
    /// Its levels, the largest first.
    pub levels: Vec<u16>,
    /// Its plane.
    pub plane: Plane,
}

/// Of the border of the part the top face has this share at least.
const LEAST_SHARE: f64 = 0.04;
/// Faces that are steeper against each other than this are of two kinds, radians: 5 degrees.
const PARALLEL_RAD: f64 = 0.09;

/// The highest of the levels that end where the part does, if they do so for long enough; else
/// the largest. `None` where no level has a floor.
#[must_use]
pub fn top(regions: &Regions, levels: &Levels, step_mm: f64) -> Option<Top> {
    let mut contact = vec![0_usize; levels.levels.len()];
    for node in 0..levels.labels.len() {
        let own = levels.labels[node];
        if own == AROUND {
            continue;
        }
        let ends =
            regions.at_frame(node) || regions.neighbours(node).any(|o| levels.labels[o] == AROUND);
        contact[usize::from(own)] += usize::from(ends);
    }
    let all: usize = contact.iter().sum();
    let table = levels.levels.first().and_then(|level| level.plane);
    // The table as it is seen through holes, or between the parts of one, is no top.
    let is_table = |index: usize| match (table, levels.levels[index].plane) {
        (Some(table), Some(own)) => {
            let [x, y] = own.middle_mm;
            (own.z_mm(x, y) - table.z_mm(x, y)).abs() <= step_mm
        }
        _ => false,
    };
    let seen = |index: &usize| {
        *index != usize::from(AROUND) && levels.levels[*index].is_seen() && !is_table(*index)
    };
    let height = |index: usize| {
        let plane = levels.levels[index].plane.as_ref();
        plane.map_or(f64::NEG_INFINITY, |p| {
            p.z_mm(p.middle_mm[0], p.middle_mm[1])
        })
    };
    let ending = |index: &usize| contact[*index] as f64 >= LEAST_SHARE * all.max(1) as f64;
    let large = |index: &usize| levels.levels[*index].nodes >= 25;
    let candidates = (0..levels.levels.len()).filter(seen);
    let best = candidates
        .clone()
        .filter(ending)
        .filter(large)
        .max_by(|a, b| height(*a).total_cmp(&height(*b)))
        .or_else(|| candidates.clone().max_by_key(|k| levels.levels[*k].nodes))?;
    let plane = levels.levels[best].plane?;
    let mut own: Vec<u16> = candidates
        .filter(|&index| {
            let Some(other) = levels.levels[index].plane else {
                return false;
            };
            let [x, y] = other.middle_mm;
            let off = (other.z_mm(x, y) - plane.z_mm(x, y)).abs();
            let near = off <= 0.3 * step_mm + 3.0 * plane.sigma_mm(x, y);
            index == best
                || (contact[index] > 0 && near && other.tilt_rad(&plane.normal()) < PARALLEL_RAD)
        })
        .filter_map(|index| u16::try_from(index).ok())
        .collect();
    own.sort_by_key(|l| (std::cmp::Reverse(levels.levels[usize::from(*l)].nodes), *l));
    Some(Top { levels: own, plane })
}
