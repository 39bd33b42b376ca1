//! A region of several surfaces taken apart.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;
use shapes::{Family, Fit, Shape, fit, is_smooth, spread};

use crate::compete::{NONE, Pieces};
use crate::field::{Field, Set, count, places};
use crate::fillet::is_fillet;
use crate::grow::{FEWEST, Piece, grow, grow_left};
use crate::strain::is_strained;
use crate::unite::Known;

/// Half-widths of the windows that pieces are grown from, in nodes, one after the other.
const WINDOWS: [usize; 3] = [8, 5, 3];
/// Share of a window that must be open.
const OPEN: f64 = 0.9;
/// A piece that has lost more than this share of its nodes to greater ones was no other surface.
const LOST: f64 = 0.4;
/// How far into a piece from its border nodes may be of the next surface, in nodes.
const JOINED: usize = 5;
/// Least share of a region that must be of shapes, once it is taken apart.
const EXPLAINED: f64 = 0.5;
/// How far to either side of a border between pieces samples tell whether it is one, in nodes.
pub(crate) const BESIDE: usize = 8;
/// Nodes of a piece beside another that make them neighbours.
const CONTACT: usize = 3;
/// How much more variance a plane may leave of a piece than its shape does for the piece to be flat,
/// samples that tell, and deviations up to which they count as off.
const FLAT: f64 = 2.0;
const SAMPLES: usize = 500;
pub(crate) const STRAY: f64 = 4.0;
/// Cosine of the turn (0.1 rad) up to which flat pieces of one region meet in no crease.
pub(crate) const NO_CREASE: f64 = 0.995;
/// Windows of a size that are looked at in a region, at most, and how many at once.
const MOST_SEEDS: usize = 60;
const AT_ONCE: usize = 8;
/// Pairs of pieces with a smooth surface in common that make a region a free form, where they are
/// more than half of all pairs.
const FEW_PAIRS: usize = 3;
/// Of the greatest piece, the share that one must have to tell: scraps at the borders of others go on
/// into these, whatever they are.
const LEAST_TELLING: f64 = 0.05;
/// Nodes of what is of no shape that make it a face: of fewer, the nearest pieces get them.
const FREE: usize = 50;
/// How far from its border such a face must reach, in nodes.
const FREE_DEPTH: usize = 2;

/// The pieces of a region, each of one surface; `None` where it is not made of shapes.
pub(crate) fn split(
    field: &Field<'_>,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<Set>>, Cancelled> {
    let all = field.all();
    let mut open = all.clone();
    let mut pieces: Vec<Piece> = Vec::new();
    let mut known = Known::default();
    for window in WINDOWS.into_iter().map(Some).chain([None]) {
        let mut found = match window {
            Some(half) => candidates(field, &open, half, monitor)?,
            // What is left may be one surface, too small for windows.
            None => {
                let left = field.parts(&field.opened(&open)).into_iter();
                let left = left.filter(|part| count(part) >= FEWEST);
                left.filter_map(|part| grow_left(field, &open, &places(&part)))
                    .collect()
            }
        };
        found.retain(|piece| is_of_one(field, piece));
        found.sort_by_key(|piece| core::cmp::Reverse(count(&piece.nodes)));
        for mut piece in found {
            let before = count(&piece.nodes);
            for (is_in, open) in piece.nodes.iter_mut().zip(&open) {
                *is_in &= open;
            }
            piece.nodes = field.opened(&piece.nodes);
            let greatest = field
                .parts(&piece.nodes)
                .into_iter()
                .max_by_key(|p| count(p));
            let Some(nodes) = greatest else { continue };
            let now = count(&nodes);
            if now < FEWEST || (now as f64) < (1.0 - LOST) * before as f64 {
                continue;
            }
            for (open, is_in) in open.iter_mut().zip(&nodes) {
                *open &= !is_in;
            }
            pieces.push(Piece { nodes, ..piece });
        }
        known.unite(field, &mut open, &mut pieces, monitor)?;
        if is_free_form(field, &pieces) {
            return Ok(None);
        }
    }
    let explained = count(&all) - count(&open);
    if (explained as f64) < EXPLAINED * count(&all) as f64 {
        return Ok(None);
    }
    let free = free_parts(field, &open).into_iter();
    pieces.extend(free.map(|nodes| Piece { fit: None, nodes }));
    if pieces.len() < 2 {
        return Ok(None);
    }
    let pieces = settled(field, pieces, monitor)?;
    let apart = apart(field, &pieces, monitor)?;
    Ok((apart.len() > 1).then_some(apart))
}

/// Whether what has grown is of one surface, and not of several that some shape is near to. What
/// joins it smoothly may be of it as far as noise tells, so nodes near its border are not asked.
pub(crate) fn is_of_one(field: &Field<'_>, piece: &Piece) -> bool {
    let inner = field.within(&piece.nodes, JOINED);
    let fit = piece.fit.as_ref();
    fit.is_none_or(|fit| !is_strained(field, fit, &inner))
}

/// The pieces with every node of the field.
fn settled(
    field: &Field<'_>,
    pieces: Vec<Piece>,
    monitor: &dyn Monitor,
) -> Result<Vec<Piece>, Cancelled> {
    let mut labels = vec![NONE; field.len()];
    for (label, piece) in pieces.iter().enumerate() {
        for place in places(&piece.nodes) {
            labels[place] = label;
        }
    }
    let mut pieces = Pieces {
        field,
        labels,
        fits: pieces.into_iter().map(|piece| piece.fit).collect(),
    };
    pieces.reclaim();
    pieces.fill();
    pieces.compete(monitor)?;
    let Pieces { labels, fits, .. } = pieces;
    let piece = |(label, fit)| Piece {
        fit,
        nodes: labels.iter().map(|l| *l == label).collect(),
    };
    let pieces = fits.into_iter().enumerate().map(piece);
    Ok(pieces.filter(|piece| count(&piece.nodes) > 0).collect())
}

/// Sets of pieces with no border between them that the samples bear out, made one.
fn apart(
    field: &Field<'_>,
    pieces: &[Piece],
    monitor: &dyn Monitor,
) -> Result<Vec<Set>, Cancelled> {
    let mut group: Vec<usize> = (0..pieces.len()).collect();
    let mut unite = |a: usize, b: usize| {
        let (low, high) = (group[a].min(group[b]), group[a].max(group[b]));
        group
            .iter_mut()
            .filter(|g| **g == high)
            .for_each(|g| *g = low);
    };
    let touching = touching(field, pieces);
    let mut is_free: Vec<bool> = pieces.iter().map(|piece| piece.fit.is_none()).collect();
    let is_smooth = touching.par_iter().map(|pair| {
        monitor.check()?;
        Ok(is_smooth_between(field, pieces, &touching, *pair))
    });
    let is_smooth: Vec<Result<bool, Cancelled>> = is_smooth.collect();
    for (&(a, b), is_smooth) in touching.iter().zip(is_smooth) {
        if is_smooth? {
            (is_free[a], is_free[b]) = (true, true);
            unite(a, b);
        }
    }
    // What is of no shape is one free form as far as it hangs together.
    for &(a, b) in touching.iter().filter(|(a, b)| is_free[*a] && is_free[*b]) {
        unite(a, b);
    }
    let mut sets = Vec::new();
    for first in 0..pieces.len() {
        let mut set = vec![false; field.len()];
        for (piece, _) in pieces.iter().zip(&group).filter(|(_, g)| **g == first) {
            set.iter_mut()
                .zip(&piece.nodes)
                .for_each(|(all, is_in)| *all |= is_in);
        }
        if group[first] == first {
            sets.push(set);
        }
    }
    Ok(sets)
}

/// Pairs of pieces that touch each other.
pub(crate) fn touching(field: &Field<'_>, pieces: &[Piece]) -> Vec<(usize, usize)> {
    let touch = |a: &Piece, b: &Piece| count(&field.near(&a.nodes, &b.nodes, 1)) >= CONTACT;
    let pairs = (0..pieces.len()).flat_map(|a| (a + 1..pieces.len()).map(move |b| (a, b)));
    let pairs: Vec<_> = pairs.collect();
    pairs
        .into_par_iter()
        .filter(|(a, b)| touch(&pieces[*a], &pieces[*b]))
        .collect()
}

/// Whether two pieces that touch are parts of one smooth surface as well, and neither rounds off an
/// edge of the other.
fn is_smooth_between(
    field: &Field<'_>,
    pieces: &[Piece],
    touching: &[(usize, usize)],
    pair: (usize, usize),
) -> bool {
    let rounds_off = |fillet: usize, plane: usize| {
        let beside = touching.iter().filter_map(|&(a, b)| match fillet {
            f if f == a => Some(b),
            f if f == b => Some(a),
            _ => None,
        });
        let mut others = beside.filter(|other| *other != plane);
        others.any(|other| {
            is_fillet(
                field,
                &pieces[fillet].nodes,
                [&pieces[plane], &pieces[other]],
            )
        })
    };
    are_of_one(field, &pieces[pair.0], &pieces[pair.1])
        && !rounds_off(pair.0, pair.1)
        && !rounds_off(pair.1, pair.0)
}

/// Whether two pieces are parts of one smooth surface as well.
fn are_of_one(field: &Field<'_>, a: &Piece, b: &Piece) -> bool {
    let (Some(fit_a), Some(fit_b)) = (&a.fit, &b.fit) else {
        return false;
    };
    let beside = |own: &Set, other: &Set| {
        field.samples_at(places(&field.near(own, other, BESIDE)).into_iter())
    };
    if meet_gently(field, (fit_a, &a.nodes), (fit_b, &b.nodes)) {
        return true;
    }
    is_smooth(&[
        (fit_a, beside(&a.nodes, &b.nodes)),
        (fit_b, beside(&b.nodes, &a.nodes)),
    ])
}

/// Whether two pieces are flat and meet in no crease. Faces join smoothly where their curvature
/// changes, and flat ones have none: these are parts of a surface that is wavy, as a plate is to
/// a scanner that is not quite straight.
fn meet_gently(field: &Field<'_>, a: (&Fit, &Set), b: (&Fit, &Set)) -> bool {
    let flat = |(own, nodes): (&Fit, &Set)| {
        if let Shape::Plane(_) = own.shape {
            return Some(own.clone());
        }
        let samples = field.samples(nodes, 0, SAMPLES);
        let plane = fit(Family::Plane, &samples, field.area())?;
        let left = |fit: &Fit| {
            fit.offs(&samples)
                .map(|o| o.abs().min(STRAY).powi(2))
                .sum::<f64>()
        };
        (left(&plane) <= FLAT * left(own)).then_some(plane)
    };
    let (Some(plane_a), Some(plane_b)) = (flat(a), flat(b)) else {
        return false;
    };
    // Planes have the same normal everywhere.
    let normal = |plane: &Fit| plane.shape.normal(&nalgebra::Vector3::zeros());
    normal(&plane_a).dot(&normal(&plane_b)).abs() > NO_CREASE
}

/// What is grown from windows of a size all over what is open.
fn candidates(
    field: &Field<'_>,
    open: &[bool],
    half: usize,
    monitor: &dyn Monitor,
) -> Result<Vec<Piece>, Cancelled> {
    let whole = (2 * half + 1).pow(2) as f64;
    let window =
        |place: usize| -> Vec<usize> { field.around(place, half).filter(|p| open[*p]).collect() };
    let columns = (0..field.columns()).step_by(half);
    let lattice = columns.flat_map(|c| {
        let rows = (0..field.rows()).step_by(half);
        rows.map(move |r| c * field.rows() + r)
    });
    let seeds: Vec<usize> = lattice
        .filter(|place| open[*place] && window(*place).len() as f64 >= OPEN * whole)
        .collect();
    let mut seeds: Vec<usize> = spread(seeds.len(), MOST_SEEDS).map(|k| seeds[k]).collect();
    let mut found: Vec<Piece> = Vec::new();
    while !seeds.is_empty() {
        monitor.check()?;
        let some: Vec<usize> = seeds.drain(..AT_ONCE.min(seeds.len())).collect();
        let grown = some
            .par_iter()
            .map(|place| grow(field, open, &window(*place)));
        found.extend(grown.collect::<Vec<_>>().into_iter().flatten());
        seeds.retain(|place| !found.iter().any(|piece| piece.nodes[*place]));
    }
    Ok(found)
}

/// Whether pieces are for the most part of one smooth surface. A region that is mostly flat is none.
fn is_free_form(field: &Field<'_>, pieces: &[Piece]) -> bool {
    let Some(greatest) = pieces.iter().max_by_key(|piece| count(&piece.nodes)) else {
        return false;
    };
    let is_plane = |fit: &Fit| matches!(fit.shape, Shape::Plane(_));
    if greatest.fit.as_ref().is_some_and(is_plane)
        && 2 * count(&greatest.nodes) > count(&field.all())
    {
        return false;
    }
    let least = LEAST_TELLING * count(&greatest.nodes) as f64;
    let tells = |piece: usize| count(&pieces[piece].nodes) as f64 >= least;
    let touching = touching(field, pieces);
    let pairs = touching.iter().filter(|(a, b)| tells(*a) && tells(*b));
    let pairs: Vec<_> = pairs.collect();
    let smooth = pairs
        .par_iter()
        .filter(|pair| is_smooth_between(field, pieces, &touching, ***pair));
    let smooth = smooth.count();
    smooth >= FEW_PAIRS && 2 * smooth > pairs.len()
}

/// The parts of what is of no shape that are large enough to be faces.
fn free_parts(field: &Field<'_>, open: &[bool]) -> Vec<Set> {
    let is_face =
        |part: &Set| count(part) >= FREE && !places(&field.within(part, FREE_DEPTH)).is_empty();
    let parts = field.parts(&field.opened(open)).into_iter();
    parts.filter(is_face).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Scan;

    /// A plane of so many columns that goes over into a bend of 40, which was cut in four.
    fn is_free(flat: usize) -> bool {
        let edge_mm = 0.4 * flat as f64;
        let scan = Scan::of((flat + 40, 40), 0.4, 0.05, |x, _| {
            -0.03 * (x - edge_mm).max(0.0).powi(2)
        });
        let nodes: Vec<usize> = (0..scan.image.raw_z_mm().len()).collect();
        let field = Field::new(&scan.image, &scan.observations, &nodes).unwrap();
        let piece = |columns: core::ops::Range<usize>, family: Family| {
            let is_in = |place: usize| columns.contains(&(place / field.rows()));
            let nodes: Set = (0..field.len()).map(is_in).collect();
            let fit = fit(family, &field.samples(&nodes, 0, 2000), 1.0);
            assert!(fit.is_some(), "{columns:?}");
            Piece { fit, nodes }
        };
        let bend = (0..4).map(|k| flat + 10 * k..flat + 10 * (k + 1));
        let bend = bend.map(|columns| piece(columns, Family::Cylinder));
        let plane = (flat > 0).then(|| piece(0..flat, Family::Plane));
        let pieces: Vec<Piece> = plane.into_iter().chain(bend).collect();
        is_free_form(&field, &pieces)
    }

    #[test]
    fn a_region_that_is_mostly_flat_is_no_free_form() {
        assert!(is_free(0));
        assert!(!is_free(60));
    }

    /// Slopes of 0.2 up and down, and between them an edge of this radius.
    #[test]
    fn a_fillet_is_not_one_smooth_surface_with_its_planes() {
        let mut told = 0;
        for radius_mm in [4.0, 6.0, 8.0, 12.0, 16.0] {
            let edge_mm = radius_mm * 0.2 / libm::sqrt(1.04);
            let roof = |x: f64| {
                let top_mm = radius_mm * libm::sqrt(1.04);
                if x.abs() > edge_mm {
                    -0.2 * x.abs()
                } else {
                    libm::sqrt(radius_mm * radius_mm - x * x) - top_mm
                }
            };
            let scan = Scan::of((60, 8), 0.4, 0.1, |x, _| roof(x - 12.0));
            let nodes: Vec<usize> = (0..scan.image.raw_z_mm().len()).collect();
            let field = Field::new(&scan.image, &scan.observations, &nodes).unwrap();
            let piece = |is_in: &dyn Fn(f64) -> bool, family: Family| {
                let x_mm = |place: usize| scan.image.x_mm(place / field.rows()) - 12.0;
                let nodes: Set = (0..field.len()).map(|p| is_in(x_mm(p))).collect();
                let fit = fit(family, &field.samples(&nodes, 0, 2000), 1.0);
                Piece { fit, nodes }
            };
            let pieces = [
                piece(&|x| x < -edge_mm, Family::Plane),
                piece(&|x| x.abs() <= edge_mm, Family::Cylinder),
                piece(&|x| x > edge_mm, Family::Plane),
            ];
            let touching = touching(&field, &pieces);
            assert_eq!(touching, [(0, 1), (1, 2)]);
            for &(a, b) in &touching {
                told += usize::from(are_of_one(&field, &pieces[a], &pieces[b]));
                assert!(!is_smooth_between(&field, &pieces, &touching, (a, b)));
            }
        }
        // Without the other plane beside them most would be.
        assert!(told >= 8, "{told} of 10");
    }
}
