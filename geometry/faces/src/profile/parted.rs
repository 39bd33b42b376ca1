//! The nodes of a region by the pieces of its profile.

use super::swept::Swept;
use crate::compete::{NONE, Pieces};
use crate::field::{Field, Set, count, places};
use crate::grow::{FEWEST, Piece, grow_left};
use crate::split::is_of_one;

/// What a region comes apart into.
pub(crate) struct Parted {
    /// Connected sets of nodes, the pieces of the profile first.
    pub(crate) pieces: Vec<Set>,
    /// How many of them are pieces of the profile.
    pub(crate) swept: usize,
}

impl Parted {
    /// The nodes of each curve, of those that the sweep explains, and what else there is: `None`
    /// where that is not of single shapes. Nodes of parts that are too small go to neighbours.
    pub(super) fn of(field: &Field<'_>, swept: &Swept, explained: &[bool]) -> Option<Self> {
        let curves = swept.chain.curves.len();
        let others = others(field, explained)?;
        let label = |place: usize| {
            let point_mm = field.point_mm(place)?;
            if explained[place] {
                return Some(swept.chain.at(swept.sweep.place(&point_mm).s_mm));
            }
            let of = others.iter().position(|other| other.nodes[place]);
            of.map(|other| curves + other)
        };
        let mut labels: Vec<usize> = (0..field.len()).map(|p| label(p).unwrap_or(NONE)).collect();
        for part in field.alike(&labels) {
            if part.len() < FEWEST {
                part.iter().for_each(|place| labels[*place] = NONE);
            }
        }
        let mut fits = vec![None; curves];
        fits.extend(others.into_iter().map(|other| other.fit));
        let mut pieces = Pieces {
            field,
            labels,
            fits,
        };
        pieces.fill();
        let labels = pieces.labels;
        let mut parts = field.alike(&labels);
        parts.retain(|part| labels[part[0]] != NONE);
        parts.sort_by_key(|part| labels[part[0]] >= curves);
        let of_profile = parts.iter().filter(|part| labels[part[0]] < curves).count();
        let set = |part: &Vec<usize>| {
            let mut set = vec![false; field.len()];
            part.iter().for_each(|place| set[*place] = true);
            set
        };
        (parts.len() > 1).then(|| Self {
            pieces: parts.iter().map(set).collect(),
            swept: of_profile,
        })
    }
}

/// What is not explained, each part of one shape; `None` where some part is of none.
fn others(field: &Field<'_>, explained: &[bool]) -> Option<Vec<Piece>> {
    let left: Set = (0..field.len())
        .map(|place| field.has(place) && !explained[place])
        .collect();
    let parts = field.parts(&field.opened(&left)).into_iter();
    let parts = parts.filter(|part| count(part) >= FEWEST);
    parts
        .map(|part| {
            let piece = grow_left(field, &left, &places(&part));
            piece.filter(|piece| is_of_one(field, piece))
        })
        .collect()
}
