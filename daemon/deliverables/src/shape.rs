//! The shape of a region, for the report.

use pipeline::{Basis, RegionKind};
use shapes::{Fit, Measured, Motion, Numbers, Shape, SweptFit, Verdict};

use crate::report::{ProfileReport, Quantity, ShapeNumbers, ShapeReport};

/// `None` where a region has too little to tell by.
pub(crate) fn shape(kind: &RegionKind) -> Option<ShapeReport> {
    match &kind.evidence.verdict {
        Verdict::Unknown => None,
        Verdict::FreeForm => Some(ShapeReport {
            family: "free-form".into(),
            hollow: None,
            numbers: None,
        }),
        Verdict::Swept(fit) => Some(ShapeReport {
            family: fit.swept.as_str().into(),
            hollow: (fit.swept.sweep.motion == Motion::Revolution).then_some(fit.swept.is_hollow),
            numbers: match kind.basis {
                Basis::Samples => Some(swept_numbers(fit)),
                Basis::Nodes => None,
            },
        }),
        Verdict::Shape(fit) => kind.told().map(|(shape, told)| ShapeReport {
            family: shape.family().as_str().into(),
            hollow: match &shape {
                Shape::Plane(_) => None,
                Shape::Sphere(sphere) => Some(sphere.is_hollow),
                Shape::Cylinder(cylinder) => Some(cylinder.is_hollow),
                Shape::Cone(cone) => Some(cone.is_hollow),
                Shape::Torus(torus) => Some(torus.is_hollow),
            },
            numbers: match kind.basis {
                Basis::Samples => Some(numbers(fit, &shape, &told)),
                Basis::Nodes => None,
            },
        }),
    }
}

fn numbers(fit: &Fit, shape: &Shape, told: &Numbers) -> ShapeNumbers {
    let (point, direction) = match shape {
        Shape::Plane(plane) => (plane.point_mm, Some(plane.normal)),
        Shape::Sphere(sphere) => (sphere.centre_mm, None),
        Shape::Cylinder(cylinder) => (cylinder.point_mm, Some(cylinder.axis)),
        Shape::Cone(cone) => (cone.apex_mm, Some(cone.axis)),
        Shape::Torus(torus) => (torus.centre_mm, Some(torus.axis)),
    };
    let quantity = |measured: Measured, per_unit: f64| Quantity {
        value: measured.value * per_unit,
        uncertainty: measured.deviation * per_unit,
    };
    let mm = |measured| quantity(measured, 1.0);
    let deg = |measured| quantity(measured, 1.0_f64.to_degrees());
    ShapeNumbers {
        samples: fit.held,
        rms_mm: fit.rms_mm,
        point_mm: point.into(),
        point_uncertainty_mm: told.place_mm.most(),
        direction: direction.map(Into::into),
        direction_uncertainty_deg: told.direction_rad.map(|spread| spread.most().to_degrees()),
        radius_mm: told.radius_mm.map(mm),
        tube_radius_mm: told.tube_mm.map(mm),
        half_angle_deg: told.half_angle_rad.map(deg),
        profile: None,
    }
}

fn swept_numbers(fit: &SweptFit) -> ShapeNumbers {
    let sweep = &fit.swept.sweep;
    let (point, uncertainty_mm) = match &fit.place_mm {
        Some(place) => (sweep.origin_mm, place.most()),
        None => (fit.swept.point_mm(), fit.profile_deviation_mm),
    };
    ShapeNumbers {
        samples: fit.held,
        rms_mm: fit.rms_mm,
        point_mm: point.into(),
        point_uncertainty_mm: uncertainty_mm,
        direction: Some(sweep.axis.into()),
        direction_uncertainty_deg: Some(fit.direction_rad.most().to_degrees()),
        radius_mm: None,
        tube_radius_mm: None,
        half_angle_deg: None,
        profile: Some(ProfileReport {
            coefficients: fit.freedom - sweep.freedom(),
            uncertainty_mm: fit.profile_deviation_mm,
        }),
    }
}
