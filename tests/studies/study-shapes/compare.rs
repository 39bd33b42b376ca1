//! True faces beside the regions found, and the numbers of both.

use nalgebra::Vector3;
use pipeline::Outcome;
use range_image::RangeImage;
use relief_tests::scenes::Drawn;
use relief_tests::score::Overlaps;
use shapes::{Family, Fit, Shape, Verdict};
use sim_scanner::Vec3;
use sim_scanner::scanner::Scanner;
use sim_scanner::scene::Surface;

use crate::truth::Real;

/// Share of its nodes that a true face and a region have in common, of either, to be the same.
const SAME: f64 = 0.8;

/// A true face of enough nodes, and what was found there.
pub(crate) struct Face {
    pub(crate) scene: String,
    pub(crate) label: u16,
    pub(crate) nodes: usize,
    pub(crate) real: Real,
    /// `None` where no region is this face.
    pub(crate) found: Option<Found>,
}

/// What a region speaks for.
pub(crate) struct Found {
    /// `None` for a free form.
    pub(crate) family: Option<Family>,
    pub(crate) is_unknown: bool,
    /// Samples that the shape rests on, and the root mean square of their distances.
    pub(crate) rests_on: Option<(usize, f64)>,
    /// Where the family is right.
    pub(crate) numbers: Vec<Number>,
}

/// A number found, beside the true one.
pub(crate) struct Number {
    pub(crate) name: &'static str,
    pub(crate) error: f64,
    /// Its stated standard uncertainty.
    pub(crate) stated: f64,
}

/// The faces of a scene that count.
pub(crate) fn compare(
    drawn: &Drawn,
    scanner: &Scanner,
    image: &RangeImage,
    outcome: &Outcome,
) -> Vec<Face> {
    let truth = &drawn.truth;
    let labels = truth.gather(image, outcome.regions.raw_labels(), (1, 1), 0);
    let overlaps = Overlaps::new(&truth.labels, &labels);
    let counted = truth.regions.iter().filter(|region| region.counts());
    counted
        .map(|region| {
            let real = Real::of(drawn, scanner, region);
            let same = overlaps.pairs().find(|&(own, other, common)| {
                own == region.label
                    && common as f64 >= SAME * overlaps.truth_nodes(own) as f64
                    && common as f64 >= SAME * overlaps.machine_nodes(other) as f64
            });
            let kind = same.and_then(|(_, other, _)| {
                let mut kinds = outcome.kinds.iter();
                kinds.find(|kind| kind.label.get() == other)
            });
            Face {
                scene: format!("{} {}", drawn.set.name(), drawn.seed),
                label: region.label,
                nodes: region.nodes,
                real,
                found: kind.map(|kind| found(&kind.evidence.verdict, &real)),
            }
        })
        .collect()
}

fn found(verdict: &Verdict, real: &Real) -> Found {
    let (family, numbers) = match (verdict, real) {
        (Verdict::Shape(fit), Real::Surface(surface)) => {
            (Some(fit.shape.family()), numbers(fit, surface))
        }
        (Verdict::Shape(fit), _) => (Some(fit.shape.family()), Vec::new()),
        _ => (None, Vec::new()),
    };
    let rests_on = match verdict {
        Verdict::Shape(fit) => Some((fit.held, fit.rms_mm)),
        _ => None,
    };
    Found {
        family,
        rests_on,
        is_unknown: matches!(verdict, Verdict::Unknown),
        numbers,
    }
}

fn vector(v: Vec3) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

/// How far a direction tilts off the true one, degrees, in one way that was fixed beforehand.
fn tilt(fit: &Fit, found: &Vector3<f64>, real: Vec3) -> Option<Number> {
    let real = vector(real);
    let found = found * found.dot(&real).signum();
    let aside = if real.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let way = real.cross(&aside).normalize();
    Some(Number {
        name: "direction, degrees",
        error: found.dot(&way).to_degrees(),
        stated: fit.numbers.direction_rad?.along(&way).to_degrees(),
    })
}

fn numbers(fit: &Fit, surface: &Surface) -> Vec<Number> {
    let told = &fit.numbers;
    let number = |name, error, stated: Option<f64>| {
        stated.map(|stated| Number {
            name,
            error,
            stated,
        })
    };
    let radius = |real: f64| {
        let found = told.radius_mm?;
        number("radius, mm", found.value - real, Some(found.deviation))
    };
    let each = match (&fit.shape, *surface) {
        (Shape::Plane(plane), Surface::Plane { normal, offset_mm }) => vec![
            tilt(fit, &plane.normal, normal),
            number(
                "offset, mm",
                vector(normal).dot(&plane.point_mm) - offset_mm,
                Some(told.place_mm.along(&vector(normal))),
            ),
        ],
        (Shape::Sphere(_), Surface::Sphere { radius_mm, .. }) => vec![radius(radius_mm)],
        (
            Shape::Cylinder(cylinder),
            Surface::Cylinder {
                axis, radius_mm, ..
            },
        ) => vec![radius(radius_mm), tilt(fit, &cylinder.axis, axis)],
        (
            Shape::Cone(cone),
            Surface::Cone {
                axis,
                half_angle_rad,
                ..
            },
        ) => vec![
            told.half_angle_rad.and_then(|found| {
                number(
                    "half angle, degrees",
                    (found.value - half_angle_rad).to_degrees(),
                    Some(found.deviation.to_degrees()),
                )
            }),
            tilt(fit, &cone.axis, axis),
        ],
        _ => Vec::new(),
    };
    each.into_iter().flatten().collect()
}
