//! What a face lies on, as formats know it.

use nalgebra::Vector3;
use nurbs::BSplineSurface;
use reconstruct::{Face, Surface};
use shapes::{Form, Plane, Shape};

use super::analytic::Analytic;
use super::support::Support;
use super::swept::{By, Generated};
use crate::common::SMOOTH_MM;

/// A surface whose control points are this near to one plane is that plane.
const FLAT_MM: f64 = 1e-6;

/// The surface of a face.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Carrier {
    /// A plane.
    Plane(Flat),
    /// A cylinder, cone, sphere or torus.
    Round(Analytic),
    /// What is extruded or turned.
    Swept(Generated),
    /// Any other: the face's own patches.
    Spline,
}

/// A plane with its normal on the side of +z, and a unit vector in it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Flat {
    pub(crate) origin_mm: [f64; 3],
    pub(crate) normal: [f64; 3],
    pub(crate) x: [f64; 3],
}

impl Carrier {
    /// By its numbers, if it has some.
    pub(crate) fn of(face: &Face) -> Self {
        let Surface::Patches(patches) = &face.surface;
        if let Some(flat) = plane(&patches.to_bspline(SMOOTH_MM)) {
            return Self::Plane(flat);
        }
        let known = match &face.form {
            Some(Form::Swept(swept)) => Generated::of(face, swept).map(Self::Swept),
            _ => Analytic::of(face).map(Self::Round),
        };
        known.unwrap_or(Self::Spline)
    }

    /// What edges of the face are put on.
    pub(super) fn support<'a>(&'a self, face: &'a Face) -> Support<'a> {
        match self {
            Self::Plane(flat) => Support::Shape(Shape::Plane(Plane {
                point_mm: flat.origin_mm.into(),
                normal: flat.normal.into(),
            })),
            Self::Round(analytic) => Support::Shape(analytic.shape),
            Self::Swept(generated) => Support::Swept(&generated.swept),
            Self::Spline => {
                let Surface::Patches(patches) = &face.surface;
                Support::Patches(patches)
            }
        }
    }

    /// A point of the axis that the face is a ring about, and the axis; `None` where it is no ring.
    pub(super) fn ring(&self) -> Option<[Vector3<f64>; 2]> {
        match self {
            Self::Round(round) if round.is_ring => {
                Some([round.origin_mm.into(), round.axis.into()])
            }
            Self::Swept(generated) => match &generated.by {
                By::Turn { is_ring: true, .. } => {
                    let sweep = &generated.swept.sweep;
                    Some([sweep.origin_mm, sweep.axis])
                }
                _ => None,
            },
            _ => None,
        }
    }

    /// Puts the seam of a ring elsewhere: towards a unit vector square to its axis.
    pub(super) fn turn(&mut self, towards: Vector3<f64>) {
        match self {
            Self::Round(round) => round.x = towards.into(),
            Self::Swept(generated) => {
                if let By::Turn { x, .. } = &mut generated.by {
                    *x = towards;
                }
            }
            Self::Plane(_) | Self::Spline => {}
        }
    }

    /// The surface's own normal is that of the face, which is on the side of +z.
    pub(crate) fn same_sense(&self) -> bool {
        match self {
            Self::Round(analytic) => analytic.same_sense,
            Self::Plane(_) | Self::Swept(_) | Self::Spline => true,
        }
    }
}

/// The plane that holds all control points, if there is one. Shapes between control points are no
/// further from it than these are.
fn plane(spline: &BSplineSurface) -> Option<Flat> {
    let (columns, rows) = (
        spline.u_knots().control_count(),
        spline.v_knots().control_count(),
    );
    let origin = spline.point(0, 0)?;
    let [along_x, along_y] = [spline.point(columns - 1, 0)?, spline.point(0, rows - 1)?];
    let slope_x = (along_x[2] - origin[2]) / (along_x[0] - origin[0]);
    let slope_y = (along_y[2] - origin[2]) / (along_y[1] - origin[1]);
    let flat = spline.points().iter().all(|point| {
        let z = origin[2] + slope_x * (point[0] - origin[0]) + slope_y * (point[1] - origin[1]);
        (point[2] - z).abs() <= FLAT_MM
    });
    let unit = |vector: [f64; 3]| {
        let length = vector.iter().map(|c| c * c).sum::<f64>().sqrt();
        vector.map(|c| c / length)
    };
    flat.then(|| Flat {
        origin_mm: origin,
        normal: unit([-slope_x, -slope_y, 1.0]),
        x: unit([1.0, 0.0, slope_x]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nurbs::PatchSurface;

    #[test]
    fn a_plane_is_known_by_its_control_points() {
        let graph = |bump: f64| {
            let z = move |i: usize, j: usize| {
                let middle = if (i, j) == (4, 4) { bump } else { 0.0 };
                0.75 * i as f64 + middle
            };
            PatchSurface::through_thirds(vec![0.0, 3.0, 6.0], vec![0.0, 3.0, 6.0], z)
                .unwrap()
                .to_bspline(SMOOTH_MM)
        };
        let Flat {
            origin_mm,
            normal,
            x,
        } = plane(&graph(0.0)).unwrap();
        assert_eq!(origin_mm, [0.0; 3]);
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(normal, [-0.6, 0.0, 0.8]) && near(x, [0.8, 0.0, 0.6]));
        assert_eq!(plane(&graph(1e-3)), None);
    }
}
