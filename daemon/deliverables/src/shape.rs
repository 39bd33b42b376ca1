//! The shape of a region, for the report.

use pipeline::RegionKind;
use shapes::{Shape, Verdict};

use crate::report::ShapeReport;

/// `None` where a region has too few nodes to tell.
pub(crate) fn shape(kind: &RegionKind) -> Option<ShapeReport> {
    let told = |family: &str, hollow| ShapeReport {
        family: family.into(),
        hollow,
    };
    match &kind.evidence.verdict {
        Verdict::Unknown => None,
        Verdict::FreeForm => Some(told("free-form", None)),
        Verdict::Shape(fit) => {
            let hollow = match &fit.shape {
                Shape::Plane(_) => None,
                Shape::Sphere(sphere) => Some(sphere.is_hollow),
                Shape::Cylinder(cylinder) => Some(cylinder.is_hollow),
                Shape::Cone(cone) => Some(cone.is_hollow),
                Shape::Torus(torus) => Some(torus.is_hollow),
            };
            Some(told(fit.shape.family().as_str(), hollow))
        }
    }
}
