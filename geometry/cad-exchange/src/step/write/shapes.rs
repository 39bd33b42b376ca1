//! Points, curves and surfaces (ISO 10303-42, clause 4).

use nurbs::{BSplineCurve, BSplineSurface, KnotVector, PatchSurface, PiecewiseCubic};
use reconstruct::Surface;
use shapes::Family;

use super::data::{Data, Id, Values};
use super::options::LengthUnit;
use crate::brep::{Analytic, By, Carrier, Generated, Strand};
use crate::common::SMOOTH_MM;

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

    /// What a face lies on: an `elementary_surface`, a `swept_surface`, or
    /// `B_SPLINE_SURFACE_WITH_KNOTS`.
    pub(super) fn surface(&self, data: &mut Data, carrier: &Carrier, surface: &Surface) -> Id {
        let Surface::Patches(patches) = surface;
        match carrier {
            Carrier::Plane(flat) => {
                let placement = self.placement(data, flat.origin_mm, flat.normal, flat.x);
                self.elementary(data, "PLANE", placement, &[], None)
            }
            Carrier::Round(analytic) => self.analytic(data, analytic),
            Carrier::Swept(generated) => self.swept(data, generated),
            Carrier::Spline => self.patches(data, patches),
        }
    }

    /// A surface by its numbers.
    fn analytic(&self, data: &mut Data, carrier: &Analytic) -> Id {
        let placement = self.placement(data, carrier.origin_mm, carrier.axis, carrier.x);
        let keyword = match carrier.shape.family() {
            Family::Plane => "PLANE",
            Family::Cylinder => "CYLINDRICAL_SURFACE",
            Family::Cone => "CONICAL_SURFACE",
            Family::Sphere => "SPHERICAL_SURFACE",
            Family::Torus => "TOROIDAL_SURFACE",
        };
        let (lengths, angle) = (&carrier.lengths_mm[..], carrier.angle_rad);
        self.elementary(data, keyword, placement, lengths, angle)
    }

    /// A surface or a curve of a placement and numbers.
    pub(super) fn elementary(
        &self,
        data: &mut Data,
        keyword: &str,
        placement: Id,
        lengths_mm: &[f64],
        angle_rad: Option<f64>,
    ) -> Id {
        data.add(keyword, |v| {
            v.text("");
            v.id(placement);
            for &length_mm in lengths_mm {
                v.real(length_mm / self.unit.mm());
            }
            angle_rad.into_iter().for_each(|angle| v.real(angle));
        })
    }

    /// `VECTOR` of a direction and a length.
    pub(super) fn vector(&self, data: &mut Data, direction: [f64; 3], length_mm: f64) -> Id {
        let direction = data.add("DIRECTION", |v| {
            v.text("");
            v.reals(&direction);
        });
        data.add("VECTOR", |v| {
            v.text("");
            v.id(direction);
            v.real(length_mm / self.unit.mm());
        })
    }

    /// A surface by its profile.
    fn swept(&self, data: &mut Data, carrier: &Generated) -> Id {
        let curve = carrier.curve();
        let profile = self.spline(data, &curve, [curve.start(), curve.end()]);
        let direction = |data: &mut Data, along: [f64; 3]| {
            data.add("DIRECTION", |v| {
                v.text("");
                v.reals(&along);
            })
        };
        match &carrier.by {
            By::Shift { along_mm, .. } => {
                let length_mm = along_mm.norm();
                let vector = self.vector(data, (along_mm / length_mm).into(), length_mm);
                data.add("SURFACE_OF_LINEAR_EXTRUSION", |v| {
                    v.text("");
                    v.id(profile);
                    v.id(vector);
                })
            }
            By::Turn { .. } => {
                let sweep = &carrier.swept.sweep;
                let origin = self.point(data, "", sweep.origin_mm.into());
                let axis = direction(data, sweep.axis.into());
                let axis = data.add("AXIS1_PLACEMENT", |v| {
                    v.text("");
                    v.id(origin);
                    v.id(axis);
                });
                data.add("SURFACE_OF_REVOLUTION", |v| {
                    v.text("");
                    v.id(profile);
                    v.id(axis);
                })
            }
        }
    }

    fn patches(&self, data: &mut Data, patches: &PatchSurface) -> Id {
        self.spline_surface(data, &patches.to_bspline(SMOOTH_MM))
    }

    /// `B_SPLINE_SURFACE_WITH_KNOTS`, not closed.
    pub(super) fn spline_surface(&self, data: &mut Data, spline: &BSplineSurface) -> Id {
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
        self.spline(data, &strand.curve, ends_mm)
    }

    fn spline(&self, data: &mut Data, curve: &PiecewiseCubic<3>, ends_mm: [[f64; 3]; 2]) -> Id {
        self.spline_curve(data, &curve.to_bspline(SMOOTH_MM), ends_mm)
    }

    /// `B_SPLINE_CURVE_WITH_KNOTS` of a spline, from vertex to vertex.
    pub(super) fn spline_curve(
        &self,
        data: &mut Data,
        spline: &BSplineCurve<3>,
        ends_mm: [[f64; 3]; 2],
    ) -> Id {
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
