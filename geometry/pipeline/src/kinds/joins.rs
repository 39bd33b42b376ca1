//! Which samples are whose where surfaces go over into each other smoothly.
//!
//! Beside a fillet no sample tells by its distance which of both surfaces it is of, and the nodes
//! part the two regions to a pitch or two. A fillet is hardly wider than that: what is taken from
//! the plane beside it moves its axis by many times its uncertainty. But two surfaces that touch
//! have equal normals on one line alone, and to its two sides normals differ in two senses. Where a
//! sample lies along the surface is known well, so it tells by that.

use std::collections::BTreeSet;

use nalgebra::Vector2;
use shapes::{Fit, Sample, Shape};

use super::bearing::Bearing;

/// A region must hold this share of its samples near a join, and this share of those that it is
/// fitted to, for the two surfaces to touch there at all.
const LEAST_KEPT: f64 = 0.4;
/// Samples that regions must have near each other to touch along a line, or to be told apart there.
pub(super) const LEAST_JOINING: usize = 20;
/// By how much samples may lie farther from a surface that is fitted to others.
const LOOSER: f64 = 1.1;

/// A sample near another region.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Joining {
    pub(crate) sample: Sample,
    /// The other region.
    pub(crate) neighbour: u16,
    /// The way there, in x and y.
    pub(crate) across: Vector2<f64>,
    /// The region is decided by it.
    pub(crate) is_within: bool,
}

/// The shape of a region by the samples on its own side of the lines in which it touches its
/// `smooth` neighbours, whatever region they are in. `None` where it touches none of them.
pub(super) fn refine(
    label: u16,
    fit: &Fit,
    (bearings, shapes): (&[Bearing], &[Option<Shape>]),
    smooth: &[u16],
    besides: &[Sample],
) -> Option<Fit> {
    let of = |label: u16| bearings.get(usize::from(label).checked_sub(1)?);
    let own = of(label)?;
    let mut samples = Vec::new();
    let mut touched = Vec::new();
    for &neighbour in smooth {
        let shape = shapes.get(usize::from(neighbour).checked_sub(1)?);
        let (Some(shape), Some(other)) = (shape.and_then(Option::as_ref), of(neighbour)) else {
            continue;
        };
        let sides = [(own, label, neighbour), (other, neighbour, label)];
        let [ours, theirs] = sides.map(|(bearing, _, towards)| joining(bearing, towards));
        if let Some(kept) = on_side([&ours, &theirs], &fit.shape, shape) {
            samples.extend(kept);
            touched.push(neighbour);
        }
    }
    if touched.is_empty() {
        return None;
    }
    samples.extend(apart(besides, &own.joining, &touched));
    samples.extend(&own.far);
    let others = own.joining.iter().filter(|joining| joining.is_within);
    let others = others.filter(|joining| !touched.contains(&joining.neighbour));
    samples.extend(others.map(|joining| joining.sample));
    if (samples.len() as f64) < LEAST_KEPT * own.samples.len() as f64 {
        return None;
    }
    let refined = fit.again(&samples, own.area)?;
    (refined.deviation() <= LOOSER * fit.deviation()).then_some(refined)
}

/// Labels of the regions that touch along a line which runs between them.
pub(super) fn touching(bearings: &[Bearing], shapes: &[Option<Shape>]) -> Vec<[u16; 2]> {
    let mut found = Vec::new();
    for (label, (own, shape)) in (1..).zip(bearings.iter().zip(shapes)) {
        let neighbours: BTreeSet<u16> = own.joining.iter().map(|j| j.neighbour).collect();
        for neighbour in neighbours
            .into_iter()
            .filter(|neighbour| *neighbour > label)
        {
            let index = usize::from(neighbour) - 1;
            let Some((other, Some(theirs))) = bearings.get(index).zip(shapes.get(index)) else {
                continue;
            };
            let Some(shape) = shape else {
                continue;
            };
            let samples = [joining(own, neighbour), joining(other, label)];
            let are_enough = samples.iter().all(|near| near.len() >= LEAST_JOINING);
            if are_enough && on_side([&samples[0], &samples[1]], shape, theirs).is_some() {
                found.push([label, neighbour]);
            }
        }
    }
    found
}

/// Of the samples beside a region's borders, those that are not near a neighbour which it touches:
/// these are parted already.
fn apart<'a>(
    besides: &'a [Sample],
    joining: &[Joining],
    touched: &[u16],
) -> impl Iterator<Item = &'a Sample> {
    let key = |sample: &Sample| [0, 1, 2].map(|d| sample.point_mm[d].to_bits());
    let parted = joining.iter().filter(|j| touched.contains(&j.neighbour));
    let parted: BTreeSet<_> = parted.map(|j| key(&j.sample)).collect();
    besides
        .iter()
        .filter(move |sample| !parted.contains(&key(sample)))
}

fn joining(bearing: &Bearing, towards: u16) -> Vec<Joining> {
    let all = bearing.joining.iter();
    all.filter(|j| j.neighbour == towards).copied().collect()
}

/// Of the samples of two regions near each other, in this order, those on the first one's side of
/// the line where their shapes touch. `None` where it does not run between them.
fn on_side([ours, theirs]: [&[Joining]; 2], own: &Shape, other: &Shape) -> Option<Vec<Sample>> {
    // How much the normals part along the way from the first region to the second.
    let turn = |joining: &Joining, sense: f64| {
        let point_mm = &joining.sample.point_mm;
        let turn = own.normal(point_mm) - other.normal(point_mm);
        sense * turn.xy().dot(&joining.across)
    };
    let ours: Vec<(f64, Sample)> = ours.iter().map(|j| (turn(j, 1.0), j.sample)).collect();
    let theirs: Vec<(f64, Sample)> = theirs.iter().map(|j| (turn(j, -1.0), j.sample)).collect();
    let sum = |all: &[(f64, Sample)]| all.iter().map(|(turn, _)| turn).sum::<f64>();
    // It grows on the way, or falls.
    let sense = sum(&theirs) - sum(&ours);
    let is_own = |(turn, _): &&(f64, Sample)| turn * sense < 0.0;
    let kept = |all: &[(f64, Sample)], own: bool| {
        all.iter().filter(|one| is_own(one) == own).count() as f64
    };
    let is_between = kept(&ours, true) >= LEAST_KEPT * ours.len() as f64
        && kept(&theirs, false) >= LEAST_KEPT * theirs.len() as f64;
    let both = || ours.iter().chain(&theirs).filter(is_own);
    is_between.then(|| both().map(|(_, sample)| *sample).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use shapes::{Cylinder, Plane};

    use super::*;

    const RADIUS_MM: f64 = 3.0;

    fn plane(slope: f64) -> Shape {
        Shape::Plane(Plane {
            point_mm: Vector3::zeros(),
            normal: Vector3::new(-slope, 0.0, 1.0).normalize(),
        })
    }

    /// It touches the level plane along x = 0, but for so much.
    fn fillet(off_mm: f64) -> Shape {
        Shape::Cylinder(Cylinder {
            point_mm: Vector3::new(0.0, 0.0, RADIUS_MM + off_mm),
            axis: Vector3::y(),
            radius_mm: RADIUS_MM,
            is_hollow: true,
        })
    }

    /// Samples about the surface, on both sides of a border at this x.
    fn parted(at_mm: f64) -> [Vec<Joining>; 2] {
        let mut sides = [Vec::new(), Vec::new()];
        for k in -40_i32..40 {
            let x = 0.05 * f64::from(k) + 0.02;
            let bent = x.max(0.0);
            let z = RADIUS_MM - (RADIUS_MM * RADIUS_MM - bent * bent).sqrt();
            let noise = 0.05 * f64::from((k * 7).rem_euclid(11) - 5) / 5.0;
            let is_beyond = x > at_mm;
            sides[usize::from(is_beyond)].push(Joining {
                sample: Sample {
                    point_mm: Vector3::new(x, 0.3 * f64::from(k % 5), z + noise),
                    ray: Vector3::z(),
                    sigma_mm: 0.05,
                },
                neighbour: 1,
                across: Vector2::new(if is_beyond { -1.0 } else { 1.0 }, 0.0),
                is_within: true,
            });
        }
        sides
    }

    #[test]
    fn samples_are_parted_where_surfaces_touch_and_not_where_regions_end() {
        for (border_mm, off_mm) in [(0.0, 0.0), (0.7, 0.03), (-0.7, -0.03)] {
            let [ours, theirs] = parted(border_mm);
            let (plane, fillet) = (plane(0.0), fillet(off_mm));
            let flat = on_side([&ours, &theirs], &plane, &fillet).expect("they touch");
            assert_eq!(flat.len(), 40);
            assert!(flat.iter().all(|sample| sample.point_mm.x < 0.0));
            let bent = on_side([&theirs, &ours], &fillet, &plane).expect("they touch");
            assert_eq!(bent.len(), 40);
            assert!(bent.iter().all(|sample| sample.point_mm.x > 0.0));
        }
    }

    #[test]
    fn samples_that_are_parted_do_not_count_again() {
        let [ours, _] = parted(0.0);
        let samples: Vec<Sample> = ours.iter().map(|j| j.sample).collect();
        assert_eq!(apart(&samples, &ours, &[1]).count(), 0);
        assert_eq!(apart(&samples, &ours[..10], &[1, 3]).count(), 30);
        assert_eq!(apart(&samples, &ours, &[2]).count(), 40, "not touched");
    }

    #[test]
    fn surfaces_that_meet_in_a_crease_part_no_samples() {
        let [ours, theirs] = parted(0.0);
        assert!(on_side([&ours, &theirs], &plane(0.0), &plane(0.4)).is_none());
        // Their normals are equal far beyond.
        assert!(on_side([&ours, &theirs], &plane(0.8), &fillet(0.0)).is_none());
    }
}
