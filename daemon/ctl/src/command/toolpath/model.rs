//! The model from its file: triangles.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use cad_exchange::iges::{
    self, AnalyticSurface, SplineCurve, SurfaceFrame, TrimmedCurve, TrimmedFace, TrimmedSurface,
};
use nurbs::{BSplineCurve, BSplineSurface, KnotVector};
use solids::{Body, Curve, Edge, EdgeUse, Face, Frame, Knots, Point, Surface};

use crate::command::compare::nominal::{self, Indexed};
use crate::failure::Failure;

/// How exactly pieces of splines are joined where they are.
const JOIN_MM: f64 = 1e-9;

/// Reads a STEP or STL file, or an IGES file as `relief convert`, `relief surface` or `relief skin`
/// write it.
pub(super) fn read(path: &Path) -> Result<Indexed, Failure> {
    if !nominal::is_iges(path) {
        let role = ("a model to be milled", "STEP, IGES and STL");
        return nominal::triangles(path, None, role);
    }
    let name = path.display();
    let file =
        File::open(path).map_err(|error| Failure::at(format!("cannot read {name}"), &error))?;
    let failed = |why: String| Failure::Failed(format!("{name}: {why}"));
    let mut body = Body::default();
    let model = match iges::read_model(BufReader::new(file)) {
        Ok(model) => model,
        // As `relief surface` and `relief skin` write them.
        Err(iges::ReadError::Nothing { .. }) => {
            let file = File::open(path)
                .map_err(|error| Failure::at(format!("cannot read {name}"), &error))?;
            let surfaces = iges::read_surfaces(BufReader::new(file))
                .map_err(|error| failed(error.to_string()))?;
            for (number, own) in (1..).zip(&surfaces) {
                let label = format!("surface {number}");
                add_whole(&mut body, &own.surface, &label).ok_or_else(|| {
                    failed(format!("{label}: its control points cannot be made out"))
                })?;
            }
            return nominal::of_body(&body).map_err(failed);
        }
        Err(error) => return Err(failed(error.to_string())),
    };
    for (number, face) in (1..).zip(&model.faces) {
        let label = face
            .name
            .clone()
            .unwrap_or_else(|| format!("face {number}"));
        add(&mut body, face, &label)
            .ok_or_else(|| failed(format!("{label}: its surface or border cannot be made out")))?;
    }
    nominal::of_body(&body).map_err(failed)
}

/// Adds a face with edges of its own: neighbours lie on each other as exactly as the file has them.
fn add(body: &mut Body, face: &TrimmedFace, name: &str) -> Option<()> {
    let mut loops = Vec::new();
    for border in std::iter::once(&face.outer).chain(&face.inner) {
        loops.push(ring(body, border)?);
    }
    body.faces.push(Face {
        name: name.to_owned(),
        surface: surface(&face.surface)?,
        same_sense: true,
        loops,
    });
    Some(())
}

/// Adds a surface over its whole domain, between the curves of its four sides.
fn add_whole(body: &mut Body, of: &BSplineSurface, name: &str) -> Option<()> {
    let (columns, rows) = (of.u_knots().control_count(), of.v_knots().control_count());
    let along_u = |j: usize| -> Option<BSplineCurve<3>> {
        let points: Option<Vec<[f64; 3]>> = (0..columns).map(|i| of.point(i, j)).collect();
        BSplineCurve::new(of.u_knots().clone(), points?).ok()
    };
    let along_v = |i: usize| -> Option<BSplineCurve<3>> {
        let points: Option<Vec<[f64; 3]>> = (0..rows).map(|j| of.point(i, j)).collect();
        BSplineCurve::new(of.v_knots().clone(), points?).ok()
    };
    // Counter-clockwise in the parameter plane.
    let sides = [
        along_u(0)?,
        along_v(columns - 1)?,
        along_u(rows - 1)?.reversed(),
        along_v(0)?.reversed(),
    ];
    let first = body.vertices_mm.len();
    let mut uses = Vec::new();
    for (k, side) in sides.iter().enumerate() {
        body.vertices_mm.push(Point::from(*side.points().first()?));
        body.edges.push(Edge {
            vertices: [first + k, first + (k + 1) % sides.len()],
            curve: Curve::Spline(spline(side)?),
            same_sense: true,
        });
        uses.push(EdgeUse {
            edge: body.edges.len() - 1,
            is_reversed: false,
        });
    }
    body.faces.push(Face {
        name: name.to_owned(),
        surface: patches(of)?,
        same_sense: true,
        loops: vec![uses],
    });
    Some(())
}

fn ring(body: &mut Body, border: &[TrimmedCurve]) -> Option<Vec<EdgeUse>> {
    let first = body.vertices_mm.len();
    let mut uses = Vec::new();
    for (k, part) in border.iter().enumerate() {
        let curve = bspline(&part.space_curve);
        let start = curve.points().first()?;
        body.vertices_mm.push(Point::from(*start));
        let next = first + (k + 1) % border.len();
        body.edges.push(Edge {
            vertices: [first + k, next],
            curve: Curve::Spline(spline(&curve)?),
            same_sense: true,
        });
        uses.push(EdgeUse {
            edge: body.edges.len() - 1,
            is_reversed: false,
        });
    }
    Some(uses)
}

fn bspline(curve: &SplineCurve<3>) -> BSplineCurve<3> {
    match curve {
        SplineCurve::Cubic(cubic) => cubic.to_bspline(JOIN_MM),
        SplineCurve::BSpline(curve) => curve.clone(),
    }
}

fn knots(of: &KnotVector) -> Knots {
    Knots {
        degree: of.degree(),
        values: of.knots().to_vec(),
    }
}

fn spline(curve: &BSplineCurve<3>) -> Option<solids::SplineCurve> {
    let points: Vec<Point> = curve.points().iter().copied().map(Point::from).collect();
    solids::SplineCurve::new(&knots(curve.knots()), &points, &vec![1.0; points.len()])
}

fn patches(surface: &BSplineSurface) -> Option<Surface> {
    let points: Vec<Point> = surface.points().iter().copied().map(Point::from).collect();
    let both = [knots(surface.u_knots()), knots(surface.v_knots())];
    let weights = vec![1.0; points.len()];
    solids::SplineSurface::new(&both, &points, &weights).map(Surface::Spline)
}

fn surface(of: &TrimmedSurface) -> Option<Surface> {
    let frame = |at: &SurfaceFrame| {
        Frame::new(
            Point::from(at.origin_mm),
            &Point::from(at.axis),
            &Point::from(at.reference),
        )
    };
    Some(match of {
        TrimmedSurface::Patches(cubic) => patches(&cubic.to_bspline(JOIN_MM))?,
        TrimmedSurface::BSpline(surface) => patches(surface)?,
        TrimmedSurface::Analytic(analytic) => match analytic {
            AnalyticSurface::Plane { frame: at } => Surface::Plane(frame(at)?),
            AnalyticSurface::Cylinder {
                frame: at,
                radius_mm,
            } => Surface::Cylinder {
                frame: frame(at)?,
                radius_mm: *radius_mm,
            },
            AnalyticSurface::Cone {
                frame: at,
                radius_mm,
                half_angle_rad,
            } => Surface::Cone {
                frame: frame(at)?,
                radius_mm: *radius_mm,
                slope: half_angle_rad.tan(),
            },
            AnalyticSurface::Sphere {
                frame: at,
                radius_mm,
            } => Surface::Sphere {
                frame: frame(at)?,
                radius_mm: *radius_mm,
            },
            AnalyticSurface::Torus {
                frame: at,
                radius_mm,
                tube_mm,
            } => Surface::Torus {
                frame: frame(at)?,
                radius_mm: *radius_mm,
                tube_mm: *tube_mm,
            },
            AnalyticSurface::Extrusion { profile, end_mm } => {
                let curve = bspline(profile);
                let along = Point::from(*end_mm) - Point::from(*curve.points().first()?);
                Surface::Swept {
                    curve: Curve::Spline(spline(&curve)?),
                    along: along.try_normalize(0.0)?,
                }
            }
            AnalyticSurface::Revolution {
                profile, axis_mm, ..
            } => {
                let curve = bspline(profile);
                let [from, to] = axis_mm.map(Point::from);
                let towards = Point::from(*curve.points().first()?) - from;
                Surface::Turned {
                    frame: Frame::new(from, &(to - from), &towards)?,
                    curve: Curve::Spline(spline(&curve)?),
                }
            }
        },
    })
}
