//! A floor that is part of a sphere or a cylinder, as ball-nosed and form cutters leave it.
//!
//! Maximum likelihood, as the paper asks for it after Bolle and Cooper 1986 (section 6.5): samples
//! stray along their rays, normally but for those too far off to be noise, and what they speak for
//! is weighed against planes, cones, tori and polynomials, by what each leaves over and how many
//! numbers it needs ([`shapes::decide`]).

use nalgebra::Vector3;
use shapes::{Sample, Shape, decide, spread};

use super::samples;
use crate::candidate::Candidate;
use crate::feature::Dimension;
use crate::ray::{passes, ray};
use crate::sight::Sight;

/// Most samples that are asked: more would tell the radius no better than the scanner is true.
const MOST_SAMPLES: usize = 4000;
/// A radius that is known no better than this share of it is none.
const VAGUE: f64 = 0.1;

/// A floor of one radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// What it is part of.
    pub kind: CurveKind,
    /// Its radius, under the name `radius`.
    pub radius: Dimension,
    /// Whether it is seen from within, as a groove is.
    pub is_hollow: bool,
}

/// What a floor may be part of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CurveKind {
    /// A sphere.
    Sphere,
    /// A cylinder, with the unit direction of its axis.
    Cylinder(Vector3<f64>),
}

impl CurveKind {
    /// Its name.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Cylinder(_) => "cylinder",
        }
    }
}

/// The sphere or cylinder that the samples of a floor speak for, if they do for one.
pub(crate) fn curve(sight: &Sight<'_>, candidate: &Candidate) -> Option<Curve> {
    let places = samples(sight, candidate);
    let own: Vec<Sample> = spread(places.len(), MOST_SAMPLES)
        .map(|index| sample(sight, places[index]))
        .collect();
    let fit = decide(&own, 1.0).into_fit()?;
    let (kind, is_hollow) = match fit.shape {
        Shape::Sphere(sphere) => (CurveKind::Sphere, sphere.is_hollow),
        Shape::Cylinder(cylinder) => {
            // Either way along it is as good; the one towards positive x or y is told.
            let axis = cylinder.axis;
            let [x, y, z] = [axis.x, axis.y, axis.z].map(|part| (part * 1e9).round());
            let is_forward = (x, y, z) > (0.0, 0.0, 0.0);
            let axis = if is_forward { axis } else { -axis };
            (CurveKind::Cylinder(axis), cylinder.is_hollow)
        }
        _ => return None,
    };
    let radius = fit.numbers.radius_mm?;
    (radius.deviation < VAGUE * radius.value).then_some(Curve {
        kind,
        radius: Dimension {
            name: "radius",
            value_mm: radius.value,
            sigma_mm: radius.deviation,
        },
        is_hollow,
    })
}

/// A place of the plan as measured, in the frame of the scan.
fn sample(sight: &Sight<'_>, local: [f64; 3]) -> Sample {
    let point_mm = sight.frame.world(local);
    let own = ray(sight.camera_mm, point_mm.y, point_mm.z);
    let higher_mm = point_mm.z + 1.0;
    let aside_mm = passes(sight.camera_mm, own, higher_mm) - point_mm.y;
    Sample {
        point_mm,
        ray: Vector3::new(0.0, aside_mm, 1.0).normalize(),
        sigma_mm: sight.sigma_mm(),
    }
}
