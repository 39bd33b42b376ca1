//! Points, curves and surfaces (ISO 10303-42, clause 4).

use nurbs::{BSplineSurface, KnotVector, PatchSurface};
use reconstruct::Surface;

use super::data::{Data, Id, Values};
use super::options::LengthUnit;
use super::topology::Strand;
use crate::common::SMOOTH_MM;

/// A surface whose control points are this near to one plane is that plane.
const FLAT_MM: f64 = 1e-6;

/// Writes shapes in the unit of the file.
pub(super) struct Shapes {
    pub(super) unit: LengthUnit,
}

impl Shapes {
    fn scaled(&self, point_mm: [f64; 3]) -> [f64; 3] {
        match self.unit {
            LengthUnit::Millimetre => point_mm,
            LengthUnit::Inch => point_mm.map(|c| c / self.unit.mm()),
        }
    }

    /// `CARTESIAN_POINT`.
    pub(super) fn point(&self, data: &mut Data, name: &str, point_mm: [f64; 3]) -> Id {
        let point = self.scaled(point_mm);
        data.add("CARTESIAN_POINT", |v| {
            v.text(name);
            v.reals(&point);
        })
    }

    /// `AXIS2_PLACEMENT_3D`, of unit vectors that are square to each other.
    pub(super) fn placement(
        &self,
        data: &mut Data,
        origin_mm: [f64; 3],
        z: [f64; 3],
        x: [f64; 3],
    ) -> Id {
        let origin = self.point(data, "", origin_mm);
        let [z, x] = [z, x].map(|direction| {
            data.add("DIRECTION", |v| {
                v.text("");
                v.reals(&direction);
            })
        });
        data.add("AXIS2_PLACEMENT_3D", |v| {
            v.text("");
            v.id(origin);
            v.id(z);
            v.id(x);
        })
    }

    /// The carrier of a face, its normal on the side of +z: `PLANE` where it is one, else
    /// `B_SPLINE_SURFACE_WITH_KNOTS`.
    pub(super) fn surface(&self, data: &mut Data, surface: &Surface) -> Id {
        match surface {
            Surface::Patches(patches) => self.patches(data, patches),
        }
    }

    fn patches(&self, data: &mut Data, patches: &PatchSurface) -> Id {
        let spline = patches.to_bspline(SMOOTH_MM);
        if let Some((origin_mm, normal, x)) = plane(&spline) {
            let placement = self.placement(data, origin_mm, normal, x);
            return data.add("PLANE", |v| {
                v.text("");
                v.id(placement);
            });
        }
        let points: Vec<Id> = spline
            .points()
            .iter()
            .map(|&point| self.point(data, "", point))
            .collect();
        let rows = spline.v_knots().control_count();
        data.add("B_SPLINE_SURFACE_WITH_KNOTS", |v| {
            v.text("");
            v.integer(spline.u_knots().degree());
            v.integer(spline.v_knots().degree());
            v.list(|list| points.chunks(rows).for_each(|row| list.ids(row)));
            v.word(".UNSPECIFIED.");
            // Not closed in u nor in v; a graph over the plane does not meet itself.
            (0..3).for_each(|_| v.word(".F."));
            multiplicities(v, spline.u_knots());
            multiplicities(v, spline.v_knots());
            v.reals(&spline.u_knots().breaks());
            v.reals(&spline.v_knots().breaks());
            v.word(".UNSPECIFIED.");
        })
    }

    /// `B_SPLINE_CURVE_WITH_KNOTS`, from vertex to vertex.
    pub(super) fn curve(&self, data: &mut Data, strand: &Strand, ends_mm: [[f64; 3]; 2]) -> Id {
        let spline = strand.curve.to_bspline(SMOOTH_MM);
        let last = spline.points().len().saturating_sub(1);
        let points: Vec<Id> = spline
            .points()
            .iter()
            .enumerate()
            .map(|(k, &point)| {
                // Ends agree with their vertices to the last digit.
                let point = match k {
                    0 => ends_mm[0],
                    _ if k == last => ends_mm[1],
                    _ => point,
                };
                self.point(data, "", point)
            })
            .collect();
        data.add("B_SPLINE_CURVE_WITH_KNOTS", |v| {
            v.text("");
            v.integer(spline.knots().degree());
            v.ids(&points);
            v.word(".UNSPECIFIED.");
            v.word(if ends_mm[0] == ends_mm[1] {
                ".T."
            } else {
                ".F."
            });
            v.word(".F.");
            multiplicities(v, spline.knots());
            v.reals(&spline.knots().breaks());
            v.word(".UNSPECIFIED.");
        })
    }
}

/// How often each break stands among the knots.
fn multiplicities(values: &mut Values<'_>, knots: &KnotVector) {
    let runs: Vec<usize> = knots
        .knots()
        .chunk_by(|a, b| a == b)
        .map(<[f64]>::len)
        .collect();
    values.integers(&runs);
}

/// A point, the unit normal on the side of +z and a unit vector in it of the plane that
/// holds all control points, if there is one. Shapes between control points are no
/// further from it than these are.
fn plane(spline: &BSplineSurface) -> Option<([f64; 3], [f64; 3], [f64; 3])> {
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
    flat.then(|| {
        (
            origin,
            unit([-slope_x, -slope_y, 1.0]),
            unit([1.0, 0.0, slope_x]),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let (origin, normal, x) = plane(&graph(0.0)).unwrap();
        assert_eq!(origin, [0.0; 3]);
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(normal, [-0.6, 0.0, 0.8]) && near(x, [0.8, 0.0, 0.6]));
        assert_eq!(plane(&graph(1e-3)), None);
    }
}
