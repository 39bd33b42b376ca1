//! Points, curves and surfaces, in millimetres.

use nurbs::{BSplineCurve, BSplineSurface, KnotVector, MAX_DEGREE};

use super::exchange::{Exchange, Fields};
use super::{ReadError, StepFrame, StepSurface};

/// Surfaces that are read.
pub(super) const SURFACES: [&str; 8] = [
    "B_SPLINE_SURFACE_WITH_KNOTS",
    "CONICAL_SURFACE",
    "CYLINDRICAL_SURFACE",
    "PLANE",
    "SPHERICAL_SURFACE",
    "SURFACE_OF_LINEAR_EXTRUSION",
    "SURFACE_OF_REVOLUTION",
    "TOROIDAL_SURFACE",
];

/// Reads shapes of a file whose unit is so many millimetres.
pub(super) struct Shapes<'a, 'b> {
    pub(super) exchange: &'b Exchange<'a>,
    pub(super) unit_mm: f64,
}

impl Shapes<'_, '_> {
    pub(super) fn point(&self, id: u64) -> Result<[f64; 3], ReadError> {
        self.triple(id, "CARTESIAN_POINT", self.unit_mm)
    }

    pub(super) fn triple(
        &self,
        id: u64,
        keyword: &'static str,
        unit: f64,
    ) -> Result<[f64; 3], ReadError> {
        let mut fields = self.exchange.fields(id, &[keyword])?;
        fields.skip("its name")?;
        let numbers = fields.reals("its coordinates")?;
        match <[f64; 3]>::try_from(numbers) {
            Ok(triple) => {
                let triple = triple.map(|c| c * unit);
                if triple.iter().all(|c| c.is_finite()) {
                    Ok(triple)
                } else {
                    Err(fields.defect("a coordinate is beyond all numbers"))
                }
            }
            Err(_) => Err(fields.defect("it does not have three coordinates")),
        }
    }

    pub(super) fn curve(&self, id: u64) -> Result<BSplineCurve<3>, ReadError> {
        let mut fields = self.exchange.fields(id, &["B_SPLINE_CURVE_WITH_KNOTS"])?;
        fields.skip("its name")?;
        let degree = fields.count("its degree")?;
        let points = self.points(&fields.ids("its control points")?)?;
        for what in ["its form", "closed", "self-intersecting"] {
            fields.skip(what)?;
        }
        let multiplicities = fields.counts("its multiplicities")?;
        let breaks = fields.reals("its knots")?;
        let knots = knots(&fields, degree, points.len(), &multiplicities, &breaks)?;
        BSplineCurve::new(knots, points).map_err(|defect| fields.defect(defect.to_string()))
    }

    fn points(&self, ids: &[u64]) -> Result<Vec<[f64; 3]>, ReadError> {
        ids.iter().map(|&id| self.point(id)).collect()
    }

    pub(super) fn surface(&self, id: u64) -> Result<StepSurface, ReadError> {
        let mut fields = self.exchange.fields(id, &SURFACES)?;
        let keyword = fields.keyword();
        if keyword == "B_SPLINE_SURFACE_WITH_KNOTS" {
            return self.spline(fields).map(StepSurface::BSpline);
        }
        fields.skip("its name")?;
        if keyword == "SURFACE_OF_LINEAR_EXTRUSION" {
            return Ok(StepSurface::Extrusion {
                profile: self.curve(fields.id("its curve")?)?,
                along_mm: self.vector(fields.id("its direction")?)?,
            });
        }
        if keyword == "SURFACE_OF_REVOLUTION" {
            let profile = self.curve(fields.id("its curve")?)?;
            let axis = fields.id("its axis")?;
            let mut axis = self.exchange.fields(axis, &["AXIS1_PLACEMENT"])?;
            axis.skip("its name")?;
            return Ok(StepSurface::Revolution {
                profile,
                origin_mm: self.point(axis.id("its location")?)?,
                axis: self.triple(axis.id("its direction")?, "DIRECTION", 1.0)?,
            });
        }
        let frame = self.frame(fields.id("its placement")?)?;
        let mut radius_mm = |what| self.length_mm(&mut fields, what);
        Ok(match keyword {
            "CYLINDRICAL_SURFACE" => StepSurface::Cylinder {
                frame,
                radius_mm: radius_mm("its radius")?,
            },
            "SPHERICAL_SURFACE" => StepSurface::Sphere {
                frame,
                radius_mm: radius_mm("its radius")?,
            },
            "TOROIDAL_SURFACE" => StepSurface::Torus {
                frame,
                radius_mm: radius_mm("its major radius")?,
                tube_mm: radius_mm("its minor radius")?,
            },
            "CONICAL_SURFACE" => StepSurface::Cone {
                frame,
                radius_mm: radius_mm("its radius")?,
                half_angle_rad: half_angle_rad(&mut fields)?,
            },
            _ => StepSurface::Plane {
                origin_mm: frame.origin_mm,
                normal: frame.axis,
                x: frame.x,
            },
        })
    }

    fn vector(&self, id: u64) -> Result<[f64; 3], ReadError> {
        let mut fields = self.exchange.fields(id, &["VECTOR"])?;
        fields.skip("its name")?;
        let direction = self.triple(fields.id("its direction")?, "DIRECTION", 1.0)?;
        let length_mm = self.length_mm(&mut fields, "its length")?;
        Ok(direction.map(|c| c * length_mm))
    }

    fn frame(&self, placement: u64) -> Result<StepFrame, ReadError> {
        let mut placement = self.exchange.fields(placement, &["AXIS2_PLACEMENT_3D"])?;
        placement.skip("its name")?;
        Ok(StepFrame {
            origin_mm: self.point(placement.id("its location")?)?,
            axis: self.triple(placement.id("its axis")?, "DIRECTION", 1.0)?,
            x: self.triple(placement.id("its x")?, "DIRECTION", 1.0)?,
        })
    }

    /// A length above zero.
    pub(super) fn length_mm(
        &self,
        fields: &mut Fields<'_, '_>,
        what: &'static str,
    ) -> Result<f64, ReadError> {
        let length_mm = fields.real(what)? * self.unit_mm;
        if length_mm > 0.0 && length_mm.is_finite() {
            Ok(length_mm)
        } else {
            Err(fields.defect(format!("{what} is no length above zero")))
        }
    }

    fn spline(&self, mut fields: Fields<'_, '_>) -> Result<BSplineSurface, ReadError> {
        fields.skip("its name")?;
        let u_degree = fields.count("its degree in u")?;
        let v_degree = fields.count("its degree in v")?;
        let rows = fields.rows("its control points")?;
        let (columns, width) = (rows.len(), rows.first().map_or(0, Vec::len));
        if rows.iter().any(|row| row.len() != width) {
            return Err(fields.defect("its rows of control points differ in length"));
        }
        for what in [
            "its form",
            "closed in u",
            "closed in v",
            "self-intersecting",
        ] {
            fields.skip(what)?;
        }
        let u_multiplicities = fields.counts("its multiplicities in u")?;
        let v_multiplicities = fields.counts("its multiplicities in v")?;
        let u_breaks = fields.reals("its knots in u")?;
        let v_breaks = fields.reals("its knots in v")?;
        let u = knots(&fields, u_degree, columns, &u_multiplicities, &u_breaks)?;
        let v = knots(&fields, v_degree, width, &v_multiplicities, &v_breaks)?;
        let points = self.points(&rows.concat())?;
        BSplineSurface::new(u, v, points).map_err(|defect| fields.defect(defect.to_string()))
    }
}

/// The half angle of a cone, which is acute.
fn half_angle_rad(fields: &mut Fields<'_, '_>) -> Result<f64, ReadError> {
    let angle_rad = fields.real("its half angle")?;
    if angle_rad > 0.0 && angle_rad < core::f64::consts::FRAC_PI_2 {
        Ok(angle_rad)
    } else {
        Err(fields.defect("its half angle is not acute"))
    }
}

/// A knot vector for so many control points.
fn knots(
    fields: &Fields<'_, '_>,
    degree: usize,
    points: usize,
    multiplicities: &[usize],
    breaks: &[f64],
) -> Result<KnotVector, ReadError> {
    let repeated = repeated(fields, degree, points, multiplicities, breaks)?;
    KnotVector::new(degree, repeated).map_err(|defect| fields.defect(defect.to_string()))
}

/// Knots for so many control points, each as often as it counts. Multiplicities are held against
/// that number before any knot is repeated.
pub(super) fn repeated(
    fields: &Fields<'_, '_>,
    degree: usize,
    points: usize,
    multiplicities: &[usize],
    breaks: &[f64],
) -> Result<Vec<f64>, ReadError> {
    if degree > MAX_DEGREE {
        return Err(fields.defect(format!("a degree of {degree} is not read")));
    }
    if multiplicities.len() != breaks.len() {
        return Err(fields.defect(format!(
            "it has {} multiplicities, but {} knots",
            multiplicities.len(),
            breaks.len()
        )));
    }
    let sum = multiplicities
        .iter()
        .try_fold(0_usize, |sum, &m| sum.checked_add(m));
    if sum != Some(points + degree + 1) || multiplicities.contains(&0) {
        return Err(fields.defect(format!(
            "its multiplicities do not suit {points} control points of degree {degree}"
        )));
    }
    let knots = breaks.iter().zip(multiplicities);
    Ok(knots
        .flat_map(|(&b, &m)| std::iter::repeat_n(b, m))
        .collect())
}
