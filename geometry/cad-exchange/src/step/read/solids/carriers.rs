//! Curves and surfaces that carry edges and faces.

use ::solids::{Curve, Frame, Knots, Point, SplineCurve, SplineSurface, Surface};

use super::super::ReadError;
use super::super::exchange::Fields;
use super::super::shapes::{Shapes, repeated};

const CURVES: [&str; 9] = [
    "B_SPLINE_CURVE_WITH_KNOTS",
    "CIRCLE",
    "ELLIPSE",
    "INTERSECTION_CURVE",
    "LINE",
    "POLYLINE",
    "SEAM_CURVE",
    "SURFACE_CURVE",
    "TRIMMED_CURVE",
];
const SURFACES: [&str; 9] = [
    "B_SPLINE_SURFACE_WITH_KNOTS",
    "CONICAL_SURFACE",
    "CYLINDRICAL_SURFACE",
    "PLANE",
    "RECTANGULAR_TRIMMED_SURFACE",
    "SPHERICAL_SURFACE",
    "SURFACE_OF_LINEAR_EXTRUSION",
    "SURFACE_OF_REVOLUTION",
    "TOROIDAL_SURFACE",
];

const NO_SPLINE: &str =
    "its knots do not ascend, or its weights are not above zero and one for each point";

/// Reads them, angles in so many radians.
pub(super) struct Carriers<'a, 'b> {
    pub(super) shapes: &'b Shapes<'a, 'b>,
    pub(super) angle_rad: f64,
}

impl<'a, 'b> Carriers<'a, 'b> {
    pub(super) fn point(&self, id: u64) -> Result<Point, ReadError> {
        self.shapes.point(id).map(Point::from)
    }

    fn points(&self, ids: &[u64]) -> Result<Vec<Point>, ReadError> {
        ids.iter().map(|&id| self.point(id)).collect()
    }

    /// A unit vector.
    fn direction(&self, id: u64) -> Result<Point, ReadError> {
        let direction = Point::from(self.shapes.triple(id, "DIRECTION", 1.0)?);
        direction
            .try_normalize(0.0)
            .ok_or_else(|| self.defect(id, "DIRECTION", "it has no direction"))
    }

    fn defect(&self, id: u64, keyword: &'static str, reason: &str) -> ReadError {
        match self.shapes.exchange.fields(id, &[keyword]) {
            Ok(fields) => fields.defect(reason),
            Err(error) => error,
        }
    }

    fn fields(&self, id: u64, expected: &[&'static str]) -> Result<Fields<'a, 'b>, ReadError> {
        let mut fields = self.shapes.exchange.fields(id, expected)?;
        fields.skip("its name")?;
        Ok(fields)
    }

    fn frame(&self, id: u64) -> Result<Frame, ReadError> {
        let mut fields = self.fields(id, &["AXIS2_PLACEMENT_3D"])?;
        let origin_mm = self.point(fields.id("its location")?)?;
        let mut axis = |what, default| match fields.id_or_none(what)? {
            Some(id) => self.direction(id),
            None => Ok(default),
        };
        let (z, x) = (axis("its axis", Point::z())?, axis("its x", Point::x())?);
        Frame::new(origin_mm, &z, &x).ok_or_else(|| fields.defect("its axes are parallel"))
    }

    /// A direction with a length.
    fn vector(&self, id: u64) -> Result<Point, ReadError> {
        let mut fields = self.fields(id, &["VECTOR"])?;
        self.direction(fields.id("its direction")?)
    }

    pub(super) fn curve(&self, id: u64, left: usize) -> Result<Curve, ReadError> {
        if self.is(id, "RATIONAL_B_SPLINE_CURVE") {
            return self.rational_curve(id);
        }
        let mut fields = self.fields(id, &CURVES)?;
        match fields.keyword() {
            "LINE" => Ok(Curve::Line {
                point_mm: self.point(fields.id("its point")?)?,
                along: self.vector(fields.id("its direction")?)?,
            }),
            "CIRCLE" => {
                let frame = self.frame(fields.id("its placement")?)?;
                let radius_mm = self.shapes.length_mm(&mut fields, "its radius")?;
                Ok(Curve::Ellipse {
                    frame,
                    radii_mm: [radius_mm; 2],
                })
            }
            "ELLIPSE" => {
                let frame = self.frame(fields.id("its placement")?)?;
                let a_mm = self.shapes.length_mm(&mut fields, "its first half axis")?;
                let b_mm = self.shapes.length_mm(&mut fields, "its second half axis")?;
                Ok(Curve::Ellipse {
                    frame,
                    radii_mm: [a_mm, b_mm],
                })
            }
            "POLYLINE" => {
                let points = self.points(&fields.ids("its points")?)?;
                let last = points.len().saturating_sub(1);
                let ends = core::iter::once(0).chain(0..=last).chain([last]);
                let knots = Knots {
                    degree: 1,
                    values: ends.map(|k| k as f64).collect(),
                };
                spline_curve(&fields, &knots, &points, &vec![1.0; points.len()])
            }
            "B_SPLINE_CURVE_WITH_KNOTS" => {
                let degree = fields.count("its degree")?;
                let points = self.points(&fields.ids("its control points")?)?;
                skip(&mut fields, &["its form", "closed", "self-intersecting"])?;
                let knots = knots_of(&mut fields, degree, points.len())?;
                spline_curve(&fields, &knots, &points, &vec![1.0; points.len()])
            }
            _ if left == 0 => Err(fields.defect("curves refer to curves too often")),
            // Of what carries other curves besides, the one in space.
            _ => self.curve(fields.id("its curve")?, left - 1),
        }
    }

    fn is(&self, id: u64, keyword: &'static str) -> bool {
        self.shapes.exchange.fields(id, &[keyword]).is_ok()
    }

    /// An instance of several parts, none of which has a name.
    fn rational_curve(&self, id: u64) -> Result<Curve, ReadError> {
        let part = |keyword| self.shapes.exchange.fields(id, &[keyword]);
        let mut base = part("B_SPLINE_CURVE")?;
        let degree = base.count("its degree")?;
        let points = self.points(&base.ids("its control points")?)?;
        let mut fields = part("B_SPLINE_CURVE_WITH_KNOTS")?;
        let knots = knots_of(&mut fields, degree, points.len())?;
        let weights = part("RATIONAL_B_SPLINE_CURVE")?.reals("its weights")?;
        spline_curve(&fields, &knots, &points, &weights)
    }

    pub(super) fn surface(&self, id: u64, left: usize) -> Result<Surface, ReadError> {
        if self.is(id, "RATIONAL_B_SPLINE_SURFACE") {
            return self.rational_surface(id);
        }
        let mut fields = self.fields(id, &SURFACES)?;
        let keyword = fields.keyword();
        match keyword {
            "SURFACE_OF_LINEAR_EXTRUSION" => Ok(Surface::Swept {
                curve: self.curve(fields.id("its curve")?, left)?,
                along: self.vector(fields.id("its direction")?)?,
            }),
            "SURFACE_OF_REVOLUTION" => {
                let curve = self.curve(fields.id("its curve")?, left)?;
                let mut axis = self.fields(fields.id("its axis")?, &["AXIS1_PLACEMENT"])?;
                let origin_mm = self.point(axis.id("its location")?)?;
                let z = match axis.id_or_none("its direction")? {
                    Some(id) => self.direction(id)?,
                    None => Point::z(),
                };
                let aside = if z.x.abs() < 0.5 {
                    Point::x()
                } else {
                    Point::y()
                };
                let frame = Frame::new(origin_mm, &z, &aside);
                let frame = frame.ok_or_else(|| axis.defect("it has no direction"))?;
                Ok(Surface::Turned { frame, curve })
            }
            "B_SPLINE_SURFACE_WITH_KNOTS" => {
                let degrees = [
                    fields.count("its degree in u")?,
                    fields.count("its degree in v")?,
                ];
                let rows = fields.rows("its control points")?;
                skip(
                    &mut fields,
                    &[
                        "its form",
                        "closed in u",
                        "closed in v",
                        "self-intersecting",
                    ],
                )?;
                let weights = rows.iter().map(|row| vec![1.0; row.len()]).collect();
                self.spline_surface(&mut fields, degrees, &rows, weights)
            }
            "RECTANGULAR_TRIMMED_SURFACE" if left == 0 => {
                Err(fields.defect("surfaces refer to surfaces too often"))
            }
            "RECTANGULAR_TRIMMED_SURFACE" => self.surface(fields.id("its surface")?, left - 1),
            _ => {
                let frame = self.frame(fields.id("its placement")?)?;
                self.elementary(fields, frame)
            }
        }
    }

    /// A surface by its placement and numbers.
    fn elementary(&self, mut fields: Fields<'a, 'b>, frame: Frame) -> Result<Surface, ReadError> {
        let keyword = fields.keyword();
        if keyword == "PLANE" {
            return Ok(Surface::Plane(frame));
        }
        if keyword == "CONICAL_SURFACE" {
            let radius_mm = fields.real("its radius")? * self.shapes.unit_mm;
            let slope = libm::tan(fields.real("its half angle")? * self.angle_rad);
            // A cone may be given at its tip.
            let is_sound =
                radius_mm >= 0.0 && radius_mm.is_finite() && slope != 0.0 && slope.abs() < 1e6;
            return if is_sound {
                Ok(Surface::Cone {
                    frame,
                    radius_mm,
                    slope,
                })
            } else {
                Err(fields.defect("its radius and half angle make no cone"))
            };
        }
        let radius_mm = self.shapes.length_mm(&mut fields, "its radius")?;
        match keyword {
            "CYLINDRICAL_SURFACE" => Ok(Surface::Cylinder { frame, radius_mm }),
            "SPHERICAL_SURFACE" => Ok(Surface::Sphere { frame, radius_mm }),
            _ => {
                let tube_mm = self.shapes.length_mm(&mut fields, "its minor radius")?;
                if tube_mm > radius_mm {
                    return Err(fields.defect("a torus that crosses its axis is not read"));
                }
                Ok(Surface::Torus {
                    frame,
                    radius_mm,
                    tube_mm,
                })
            }
        }
    }

    fn rational_surface(&self, id: u64) -> Result<Surface, ReadError> {
        let part = |keyword| self.shapes.exchange.fields(id, &[keyword]);
        let mut base = part("B_SPLINE_SURFACE")?;
        let degrees = [
            base.count("its degree in u")?,
            base.count("its degree in v")?,
        ];
        let rows = base.rows("its control points")?;
        let weights = part("RATIONAL_B_SPLINE_SURFACE")?.rows_of_reals("its weights")?;
        let mut fields = part("B_SPLINE_SURFACE_WITH_KNOTS")?;
        self.spline_surface(&mut fields, degrees, &rows, weights)
    }

    /// The rest of a spline's values, from its multiplicities on.
    fn spline_surface(
        &self,
        fields: &mut Fields<'a, 'b>,
        degrees: [usize; 2],
        rows: &[Vec<u64>],
        weights: Vec<Vec<f64>>,
    ) -> Result<Surface, ReadError> {
        let width = rows.first().map_or(0, Vec::len);
        if rows.iter().any(|row| row.len() != width) {
            return Err(fields.defect("its rows of control points differ in length"));
        }
        let counts = [rows.len(), width];
        let multiplicities = [
            fields.counts("its multiplicities in u")?,
            fields.counts("its multiplicities in v")?,
        ];
        let breaks = [
            fields.reals("its knots in u")?,
            fields.reals("its knots in v")?,
        ];
        let of = |axis: usize| -> Result<Knots, ReadError> {
            let (count, degree) = (counts[axis], degrees[axis]);
            let values = repeated(fields, degree, count, &multiplicities[axis], &breaks[axis])?;
            Ok(Knots { degree, values })
        };
        let knots = [of(0)?, of(1)?];
        let points = self.points(&rows.concat())?;
        SplineSurface::new(&knots, &points, &weights.concat())
            .map(Surface::Spline)
            .ok_or_else(|| fields.defect(NO_SPLINE))
    }
}

fn skip(fields: &mut Fields<'_, '_>, what: &[&str]) -> Result<(), ReadError> {
    what.iter().try_for_each(|what| fields.skip(what))
}

fn knots_of(fields: &mut Fields<'_, '_>, degree: usize, points: usize) -> Result<Knots, ReadError> {
    let multiplicities = fields.counts("its multiplicities")?;
    let breaks = fields.reals("its knots")?;
    let values = repeated(fields, degree, points, &multiplicities, &breaks)?;
    Ok(Knots { degree, values })
}

fn spline_curve(
    fields: &Fields<'_, '_>,
    knots: &Knots,
    points: &[Point],
    weights: &[f64],
) -> Result<Curve, ReadError> {
    SplineCurve::new(knots, points, weights)
        .map(Curve::Spline)
        .ok_or_else(|| fields.defect(NO_SPLINE))
}
