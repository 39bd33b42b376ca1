//! All regions of an image.

use range_image::{Cancelled, Monitor, RangeImage, RegionMap};
use rayon::prelude::*;
use shapes::{Fit, decide, swept};

use crate::compete::{NONE, Pieces};
use crate::field::{Field, Set, places};
use crate::join::join;
use crate::observations::Observations;
use crate::profile::{Kept, split_profile};
use crate::split::split;
use crate::strain::is_strained;

/// Samples by which a region is told to be of one shape.
const SAMPLES: usize = 4000;
/// Samples by which regions are told where only their borders are at stake.
const SOME: usize = 1000;
/// Samples by which a region is told to be swept.
const SWEPT: usize = 6000;
/// Fewest pieces that may be shards of what is swept, how many times as many numbers they have, and
/// how many a piece of no shape counts for.
const FEWEST_SHARDS: usize = 3;
const SHARDS: usize = 2;
const FREE: usize = 10;

/// What becomes of the regions of an image.
#[derive(Debug, Clone)]
pub struct Divided {
    /// The regions, of one surface each as far as they are of shapes.
    pub regions: RegionMap,
    /// Regions of several surfaces that stay whole, since no labels are left.
    pub unlabelled: usize,
}

/// Takes regions apart into those of one surface each, and joins those that are of one.
///
/// # Errors
/// Cancelled.
pub fn divide(
    image: &RangeImage,
    regions: &RegionMap,
    observations: &Observations,
    monitor: &dyn Monitor,
) -> Result<Divided, Cancelled> {
    let mut nodes: Vec<Vec<usize>> = vec![Vec::new(); usize::from(regions.regions())];
    for (node, label) in regions.raw_labels().iter().enumerate() {
        if let Some(own) = usize::from(*label).checked_sub(1) {
            nodes[own].push(node);
        }
    }
    let split = nodes.par_iter().map(|nodes| {
        monitor.check()?;
        let Some(field) = Field::new(image, observations, nodes) else {
            return Ok(Apart::default());
        };
        if is_one(&field) {
            return Ok(Apart::default());
        }
        let (pieces, swept) = match split_profile(&field, monitor)? {
            Some(parted) => (parted.pieces, parted.swept),
            None => {
                let pieces = split(&field, monitor)?;
                let pieces = pieces.filter(|pieces| !are_shards(&field, pieces));
                (pieces.unwrap_or_default(), 0)
            }
        };
        let of_image = |set: &Set| {
            let nodes = places(set)
                .into_iter()
                .filter_map(|place| field.node(place));
            nodes.map(|node| node.index).collect::<Vec<_>>()
        };
        Ok(Apart {
            pieces: pieces.iter().map(of_image).collect(),
            swept,
        })
    });
    let split: Vec<Result<Apart, Cancelled>> = split.collect();
    let split = split.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut labels = regions.raw_labels().to_vec();
    let (unlabelled, mut kept) = relabel(&mut labels, regions.regions(), &split);
    join(image, &mut labels, &mut kept, observations, monitor)?;
    let changed = changed(regions.raw_labels(), &labels);
    let borders = Borders {
        changed: &changed,
        kept: &kept,
    };
    place_borders(image, &mut labels, &borders, observations, monitor)?;
    Ok(Divided {
        regions: RegionMap::new(image, labels),
        unlabelled,
    })
}

/// The pieces of a region, as nodes of the image; none where it stays whole.
#[derive(Debug, Clone, Default)]
struct Apart {
    pieces: Vec<Vec<usize>>,
    /// How many of them, the first, are of one swept profile.
    swept: usize,
}

/// Labels the pieces of each region, the first of which keeps the label. Gives how many regions
/// stay whole since there are no labels left for their pieces, and the borders that are kept.
fn relabel(labels: &mut [u16], regions: u16, split: &[Apart]) -> (usize, Kept) {
    let mut next = regions;
    let mut whole = 0;
    let mut kept = Kept::default();
    for (region, Apart { pieces, swept }) in split.iter().enumerate() {
        let more = pieces.len().saturating_sub(1);
        let Some(last) = u16::try_from(more).ok().and_then(|m| next.checked_add(m)) else {
            whole += 1;
            continue;
        };
        for (piece, label) in pieces[1.min(pieces.len())..].iter().zip(next + 1..=last) {
            piece.iter().for_each(|node| labels[*node] = label);
        }
        next = last;
        let of_profile = pieces.iter().take(*swept);
        for node in of_profile.filter_map(|piece| piece.first()) {
            kept.add(labels[*node], region);
        }
    }
    (whole, kept)
}

/// Which labels, as indices, have lost or gained nodes.
fn changed(before: &[u16], after: &[u16]) -> Vec<bool> {
    let most = before.iter().chain(after).copied().max().unwrap_or(0);
    let mut changed = vec![false; usize::from(most) + 1];
    for (old, new) in before.iter().zip(after).filter(|(old, new)| old != new) {
        changed[usize::from(*old)] = true;
        changed[usize::from(*new)] = true;
    }
    changed
}

/// Which borders may move.
struct Borders<'a> {
    /// Labels, as indices, that have lost or gained nodes. Other borders are where the nodes on
    /// either side have them, at steps, too.
    changed: &'a [bool],
    kept: &'a Kept,
}

impl Borders<'_> {
    fn may_pass(&self, old: u16, new: u16) -> bool {
        let is_changed = self.changed[usize::from(old)] || self.changed[usize::from(new)];
        is_changed && !self.kept.are_apart(old, new)
    }
}

/// Gives nodes at borders that may move to those whose shape explains them best, and rounds off edges
/// that are round.
fn place_borders(
    image: &RangeImage,
    labels: &mut [u16],
    borders: &Borders<'_>,
    observations: &Observations,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let labelled: Vec<usize> = (0..labels.len())
        .filter(|node| labels[*node] != 0)
        .collect();
    let Some(field) = Field::new(image, observations, &labelled) else {
        return Ok(());
    };
    let label = |place| {
        let node = field.node(place)?;
        usize::from(labels[node.index]).checked_sub(1)
    };
    let of_field: Vec<usize> = (0..field.len()).map(|p| label(p).unwrap_or(NONE)).collect();
    let most = labels.iter().copied().max().unwrap_or(0);
    let mut sets = vec![Vec::new(); usize::from(most)];
    for (place, label) in of_field.iter().enumerate().filter(|(_, l)| **l != NONE) {
        sets[*label].push(place);
    }
    let fits = sets.par_iter().map(|places| {
        monitor.check()?;
        let samples = field.samples_of(places, SOME);
        Ok(decide(&samples, observations.area()).into_fit())
    });
    let fits: Vec<Result<Option<Fit>, Cancelled>> = fits.collect();
    let mut pieces = Pieces {
        field: &field,
        labels: of_field.clone(),
        fits: fits.into_iter().collect::<Result<_, _>>()?,
    };
    if borders.changed.contains(&true) {
        pieces.compete(monitor)?;
        for (new, old) in pieces.labels.iter_mut().zip(&of_field) {
            if new != old && !borders.may_pass(label_of(*old), label_of(*new)) {
                *new = *old;
            }
        }
    }
    let are_apart = |a: usize, b: usize| borders.kept.are_apart(label_of(a), label_of(b));
    pieces.blend(&are_apart, monitor)?;
    for (place, label) in pieces.labels.iter().enumerate() {
        if let Some(node) = field.node(place)
            && let Some(label) = label.checked_add(1).and_then(|l| u16::try_from(l).ok())
        {
            labels[node.index] = label;
        }
    }
    Ok(())
}

/// The label of a piece; 0 for none.
fn label_of(piece: usize) -> u16 {
    piece.checked_add(1).map_or(0, |label| label as u16)
}

/// Whether a region is of one shape, all of it: nowhere do neighbouring samples lie to one side
/// of it.
fn is_one(field: &Field<'_>) -> bool {
    let all = field.all();
    let fit = field.fit(&all, 2, SAMPLES);
    fit.is_some_and(|fit| !is_strained(field, &fit, &all))
}

/// Whether shapes are many that one profile explains, as smooth as a spline, when it is swept: they
/// have far more numbers than that.
fn are_shards(field: &Field<'_>, pieces: &[Set]) -> bool {
    if pieces.len() < FEWEST_SHARDS {
        return false;
    }
    let Some(one) = swept(&field.samples(&field.all(), 2, SWEPT), field.area()) else {
        return false;
    };
    let freedom = |piece: &Set| {
        let fit = field.fit(piece, 1, SOME);
        fit.map_or(FREE, |fit| fit.shape.family().freedom())
    };
    pieces.iter().map(freedom).sum::<usize>() >= SHARDS * one.freedom
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Scan;

    /// Whether a strip of 6 by 150 nodes is of one shape, with z by row.
    fn is_one_strip(z_mm: impl Fn(f64) -> f64) -> bool {
        let scan = Scan::of((6, 150), 0.15, 0.01, |_, y| z_mm(y));
        let all: Vec<usize> = (0..900).collect();
        is_one(&Field::new(&scan.image, &scan.observations, &all).unwrap())
    }

    #[test]
    fn a_shape_that_nothing_lies_on_does_not_make_a_region_one() {
        assert!(is_one_strip(|y| 0.4 * y));
        // Some shape is nearest to waves, too.
        assert!(!is_one_strip(|y| libm::sin(1.5 * y)));
    }

    #[test]
    fn a_region_gets_labels_for_all_of_its_pieces_or_none() {
        let mut labels = vec![1, 1, 2, 2, 2, 3, 3];
        let split = [
            vec![vec![0], vec![1]],
            vec![vec![2], vec![3], vec![4]],
            vec![vec![5], vec![6]],
        ];
        let split = split.map(|pieces| Apart {
            swept: pieces.len() - 2 * usize::from(pieces.len() == 3),
            pieces,
        });
        let (whole, kept) = relabel(&mut labels, u16::MAX - 2, &split);
        assert_eq!(whole, 1);
        assert_eq!(labels, [1, u16::MAX - 1, 2, 2, 2, 3, u16::MAX]);
        assert!(kept.are_apart(1, u16::MAX - 1) && kept.are_apart(3, u16::MAX));
        assert!(!kept.are_apart(1, 3));
        let one = Apart {
            pieces: vec![vec![2]],
            swept: 0,
        };
        assert_eq!(relabel(&mut labels, 3, &[Apart::default(), one]).0, 0);
        assert_eq!(labels[2], 2);
    }
}
