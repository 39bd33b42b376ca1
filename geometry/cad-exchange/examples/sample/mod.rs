//! A part made by hand whose areas are known in closed form: a parabolic cylinder with a
//! round hole, and an inclined plane with a curved side, meeting at a crease.
//!
//! ```text
//!   y
//!  30 +-----------+---------\        Barrel: z = x^2 / 40
//!     |    ___    |          \       Ramp:   z = 10 - (x - 20) / 2
//!     |   /   \   |  Ramp     |
//!     |   \___/   |           |      crease at x = 20
//!     |  Barrel   |            \
//!   0 +-----------+-------------+  x
//!     0           20          40..45
//! ```

use nalgebra::Vector3;
use nurbs::{PatchSurface, PiecewiseCubic};
use reconstruct::{
    Coedge, Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Model, Surface, Vertex, VertexId,
};
use shapes::{Cone, Cylinder, Form, Motion, Shape, Sphere, Sweep, Swept, Torus};

/// Centre and radius of the hole; its border is four cubics, round to 3e-4 of the radius.
const HOLE: ([f64; 2], f64) = ([10.0, 15.0], 5.0);
/// Parts into which a path is cut before it is lifted onto a curved surface.
const LIFT_PARTS: usize = 16;

/// The part.
pub(crate) fn model() -> Model {
    let vertices = [
        [0.0, 0.0],
        [20.0, 0.0],
        [20.0, 30.0],
        [0.0, 30.0],
        [15.0, 15.0],
        [45.0, 0.0],
        [40.0, 30.0],
    ];
    let straight = |a: usize, b: usize, kind| {
        let (p, q): ([f64; 2], [f64; 2]) = (vertices[a], vertices[b]);
        let length = ((q[0] - p[0]).powi(2) + (q[1] - p[1]).powi(2)).sqrt();
        edge(a, b, kind, PiecewiseCubic::line(p, q, length).unwrap())
    };
    let edges = vec![
        straight(0, 1, EdgeKind::Silhouette),
        straight(1, 2, EdgeKind::Crease),
        straight(2, 3, EdgeKind::Silhouette),
        straight(3, 0, EdgeKind::Silhouette),
        edge(4, 4, EdgeKind::Silhouette, circle(HOLE, 0)),
        straight(1, 5, EdgeKind::Silhouette),
        edge(5, 6, EdgeKind::Step, side()),
        straight(6, 2, EdgeKind::Silhouette),
    ];
    let barrel = patches(&[0.0, 10.0, 20.0], &[0.0, 8.0, 20.0, 30.0], |x, _| {
        x * x / 40.0
    });
    let ramp = patches(&[20.0, 33.0, 46.0], &[0.0, 15.0, 30.0], |x, _| {
        10.0 - (x - 20.0) / 2.0
    });
    let border = |surface: &PatchSurface, uses: &[(usize, bool)]| Loop {
        coedges: uses
            .iter()
            .map(|&(id, reversed)| coedge(surface, &edges, id, reversed, 0.0))
            .collect(),
    };
    let faces = vec![
        Face {
            name: "Barrel".to_owned(),
            region: 1,
            outer: border(&barrel, &[(0, false), (1, false), (2, false), (3, false)]),
            inner: vec![border(&barrel, &[(4, true)])],
            surface: Surface::Patches(barrel),
            form: None,
        },
        Face {
            name: "Ramp".to_owned(),
            region: 2,
            outer: border(&ramp, &[(5, false), (6, false), (7, false), (1, true)]),
            inner: Vec::new(),
            surface: Surface::Patches(ramp),
            form: None,
        },
    ];
    let vertices = vertices
        .iter()
        .map(|&[x_mm, y_mm]| Vertex { x_mm, y_mm })
        .collect();
    Model {
        vertices,
        edges,
        faces,
    }
}

/// A rectangle of a graph over the x-y plane, said to be of a shape.
pub(crate) fn rectangle(
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    form: impl Into<Form>,
    z_mm: impl Fn(f64, f64) -> f64,
) -> Model {
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| [x_mm[i], y_mm[j]]);
    let edges: Vec<Edge> = (0..4)
        .map(|k| {
            let (p, q) = (corners[k], corners[(k + 1) % 4]);
            let length = (q[0] - p[0]).abs() + (q[1] - p[1]).abs();
            let line = PiecewiseCubic::line(p, q, length).unwrap();
            edge(k, (k + 1) % 4, EdgeKind::Silhouette, line)
        })
        .collect();
    let breaks = |[low, high]: [f64; 2]| -> Vec<f64> {
        let share = |k: u32| f64::from(k) / 64.0;
        (0..=64).map(|k| low + (high - low) * share(k)).collect()
    };
    let surface = patches(&breaks(x_mm), &breaks(y_mm), z_mm);
    let coedges = (0..4).map(|id| coedge(&surface, &edges, id, false, 0.0));
    let face = Face {
        name: "Rectangle".to_owned(),
        region: 1,
        outer: Loop {
            coedges: coedges.collect(),
        },
        inner: Vec::new(),
        surface: Surface::Patches(surface),
        form: Some(form.into()),
    };
    Model {
        vertices: corners.map(|[x_mm, y_mm]| Vertex { x_mm, y_mm }).to_vec(),
        edges,
        faces: vec![face],
    }
}

/// What lies between two circles about the z axis of a graph over the x-y plane, said to be of a
/// shape; the inner one begins so many quarters on.
pub(crate) fn ring(
    [inner, outer]: [f64; 2],
    from: usize,
    form: impl Into<Form>,
    z_mm: impl Fn(f64, f64) -> f64,
) -> Model {
    let paths = [
        circle(([0.0; 2], outer), 0),
        circle(([0.0; 2], inner), from),
    ];
    let begin = |path: &PiecewiseCubic<2>| {
        let [x_mm, y_mm] = path.start();
        Vertex { x_mm, y_mm }
    };
    let vertices: Vec<Vertex> = paths.iter().map(begin).collect();
    let edges: Vec<Edge> = paths
        .into_iter()
        .enumerate()
        .map(|(k, path)| edge(k, k, EdgeKind::Silhouette, path))
        .collect();
    let breaks: Vec<f64> = (0..=128)
        .map(|k| outer * (f64::from(k) / 64.0 - 1.0))
        .collect();
    // Within and without, where no border runs, it need not be the shape.
    let z_mm = |x: f64, y: f64| {
        let out = libm::hypot(x, y);
        let kept = out.clamp(0.95 * inner, 1.05 * outer);
        if out > 0.0 {
            z_mm(x / out * kept, y / out * kept)
        } else {
            z_mm(kept, 0.0)
        }
    };
    let surface = patches(&breaks, &breaks, z_mm);
    let border = |id: usize, reversed: bool| Loop {
        coedges: vec![coedge(&surface, &edges, id, reversed, 0.0)],
    };
    let face = Face {
        name: "Ring".to_owned(),
        region: 1,
        outer: border(0, false),
        inner: vec![border(1, true)],
        surface: Surface::Patches(surface),
        form: Some(form.into()),
    };
    Model {
        vertices,
        edges,
        faces: vec![face],
    }
}

/// A rectangle of a cylinder, cone, sphere or torus, the outside of a tube that stands
/// (`standing-torus`), or a ring of a cone or torus (`ring-cone`); `hollow-` of these are seen from
/// within. An `extrusion`, a `revolution`, hollow or not, and a ring of one (`ring-revolution`).
pub(crate) fn of_shape(name: &str) -> Option<Model> {
    let (family, is_hollow) = match name.strip_prefix("hollow-") {
        Some(family) => (family, true),
        None => (name, false),
    };
    let torus = |centre_mm: [f64; 3], axis: Vector3<f64>, [radius_mm, tube_mm]: [f64; 2]| {
        Shape::Torus(Torus {
            centre_mm: centre_mm.into(),
            axis,
            radius_mm,
            tube_mm,
            is_hollow,
        })
    };
    let axis = Vector3::new(0.2, 1.0, 0.1).normalize();
    match family {
        "ring-cone" => {
            // A frustum, or a countersink.
            let up = if is_hollow { 1.0 } else { -1.0 };
            let shape = Shape::Cone(Cone {
                apex_mm: Vector3::new(0.0, 0.0, -3.0 * up),
                axis: up * Vector3::z(),
                half_angle_rad: 0.9,
                is_hollow,
            });
            let slope = up / libm::tan(0.9);
            let z_mm = |x, y| -3.0 * up + slope * libm::hypot(x, y);
            return Some(ring([2.0, 9.0], 0, shape, z_mm));
        }
        "ring-torus" => {
            // A round at the top of a boss, or a fillet at its foot.
            let (up, of_tubes_mm, radii_mm) = if is_hollow {
                (-1.0, 10.0, [6.8, 9.7])
            } else {
                (1.0, 6.0, [6.2, 9.0])
            };
            let shape = torus([0.0, 0.0, -4.0 * up], Vector3::z(), [of_tubes_mm, 4.0]);
            let z_mm = |x, y| {
                let out = libm::hypot(x, y) - of_tubes_mm;
                up * ((16.0 - out * out).sqrt() - 4.0)
            };
            return Some(ring(radii_mm, 2, shape, z_mm));
        }
        _ => {}
    }
    let shape = match family {
        "cylinder" => Shape::Cylinder(Cylinder {
            point_mm: Vector3::new(1.0, 0.0, 0.5),
            axis,
            radius_mm: 12.0,
            is_hollow,
        }),
        "cone" => Shape::Cone(Cone {
            apex_mm: Vector3::new(0.5, -30.0, 0.0),
            axis,
            half_angle_rad: 0.4,
            is_hollow,
        }),
        "sphere" => Shape::Sphere(Sphere {
            centre_mm: Vector3::new(1.0, 2.0, -3.0),
            radius_mm: 15.0,
            is_hollow,
        }),
        // Lying flat, the top of its tube or the bottom of a groove.
        "torus" => torus([-24.0, 0.0, 1.0], Vector3::z(), [25.0, 8.0]),
        "standing-torus" => torus([1.0, 0.0, -30.0], Vector3::x(), [25.0, 8.0]),
        _ => return of_profile(family, is_hollow),
    };
    let near_mm = if is_hollow { -20.0 } else { 20.0 };
    let z_mm = |x, y| shape.z_mm(x, y, near_mm).unwrap();
    Some(rectangle([-3.0, 5.0], [-4.0, 4.0], shape, z_mm))
}

/// Two cubics that bend alike where they meet, raised by so much, from -8 to 8 mm or beside the axis
/// from 1 mm on.
fn profile(raised_mm: f64, is_radial: bool) -> PiecewiseCubic<1> {
    let breaks = if is_radial {
        vec![1.0, 5.0, 11.0]
    } else {
        vec![-8.0, 0.0, 8.0]
    };
    let width = breaks[1] - breaks[0];
    let second = [
        raised_mm + 0.2 * width + 0.03 * width * width,
        0.2 + 0.06 * width,
        0.03,
        -0.003,
    ];
    let pieces = vec![[[raised_mm, 0.2, 0.03, 0.0]], [second]];
    PiecewiseCubic::new(breaks, pieces).unwrap()
}

/// What is extruded or turned, seen from within where it is hollow.
fn of_profile(name: &str, is_hollow: bool) -> Option<Model> {
    let (motion, axis) = match name {
        "extrusion" => (Motion::Extrusion, Vector3::new(0.3, 1.0, 0.2)),
        "revolution" => (Motion::Revolution, Vector3::new(0.2, 1.0, 0.1)),
        "ring-revolution" => (Motion::Revolution, Vector3::z()),
        _ => return None,
    };
    let is_ring = name.starts_with("ring");
    let raised_mm = if name == "revolution" { 12.0 } else { -1.0 };
    let swept = Swept {
        sweep: Sweep::new(motion, Vector3::new(0.0, 0.5, 0.0), axis)?,
        profile: profile(raised_mm, is_ring),
        is_hollow: is_hollow && name == "revolution",
    };
    if is_ring {
        // An axis in the middle of the rings.
        let sweep = Sweep::new(motion, Vector3::zeros(), axis)?;
        let swept = Swept { sweep, ..swept };
        let graph = swept.clone();
        return Some(ring([2.0, 9.0], 1, swept, move |x, y| {
            graph.z_mm(x, y, 0.0).unwrap()
        }));
    }
    let near_mm = if swept.is_hollow { -20.0 } else { 20.0 };
    let graph = swept.clone();
    Some(rectangle([-3.0, 5.0], [-4.0, 4.0], swept, move |x, y| {
        graph.z_mm(x, y, near_mm).unwrap()
    }))
}

/// Areas of the faces in the order of [`model`], square millimetres: by Green's theorem,
/// over the antiderivative in x of the surface element.
pub(crate) fn areas_mm2() -> [f64; 2] {
    let element = |x: f64| {
        let slope = x / 20.0;
        0.5 * (x * (1.0 + slope * slope).sqrt() + 20.0 * slope.asinh())
    };
    let border = circle(HOLE, 0);
    let steps = 4000;
    let (_, length) = border.domain();
    let hole_area: f64 = (0..steps)
        .map(|k| {
            let t = length * (f64::from(k) + 0.5) / f64::from(steps);
            element(border.evaluate(t)[0]) * border.derivative(t, 1)[1] * length / f64::from(steps)
        })
        .sum();
    // Between x = 20 and 45 - 5 (3 t^2 - 2 t^3), t = y / 30.
    let ramp_plan = 30.0 * 25.0 - 5.0 * 30.0 * 0.5;
    [
        30.0 * element(20.0) - hole_area,
        ramp_plan * 1.25_f64.sqrt(),
    ]
}

fn edge(start: usize, end: usize, kind: EdgeKind, path: PiecewiseCubic<2>) -> Edge {
    Edge {
        start: VertexId(start),
        end: VertexId(end),
        kind,
        origin: EdgeOrigin::Assumed,
        path,
    }
}

/// A circle, counter-clockwise from its right-most point, or so many quarters on.
fn circle(([x, y], r): ([f64; 2], f64), from: usize) -> PiecewiseCubic<2> {
    let kappa = 4.0 / 3.0 * (2.0_f64.sqrt() - 1.0) * r;
    let width = r * std::f64::consts::FRAC_PI_2;
    let mut breaks = vec![0.0];
    let mut pieces = Vec::new();
    let quarters = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    for quarter in quarters.into_iter().cycle().skip(from).take(4) {
        let [c, s]: [f64; 2] = quarter;
        let turned = |a: f64, b: f64| [x + c * a - s * b, y + s * a + c * b];
        let p = [
            turned(r, 0.0),
            turned(r, kappa),
            turned(kappa, r),
            turned(0.0, r),
        ];
        pieces.push([0, 1].map(|d| {
            [
                p[0][d],
                3.0 * (p[1][d] - p[0][d]) / width,
                3.0 * (p[0][d] - 2.0 * p[1][d] + p[2][d]) / (width * width),
                (p[3][d] - 3.0 * p[2][d] + 3.0 * p[1][d] - p[0][d]) / (width * width * width),
            ]
        }));
        breaks.push(width * pieces.len() as f64);
    }
    PiecewiseCubic::new(breaks, pieces).unwrap()
}

/// The right side of the ramp, in two pieces of one cubic.
fn side() -> PiecewiseCubic<2> {
    let whole = PiecewiseCubic::new(
        vec![0.0, 30.0],
        vec![[
            [45.0, 0.0, -15.0 / 900.0, 10.0 / 27_000.0],
            [0.0, 1.0, 0.0, 0.0],
        ]],
    )
    .unwrap();
    let (lower, upper) = whole.split(12.0).unwrap();
    PiecewiseCubic::new(vec![0.0, 12.0, 30.0], [lower.pieces, upper.pieces].concat()).unwrap()
}

fn patches(u: &[f64], v: &[f64], z: impl Fn(f64, f64) -> f64) -> PatchSurface {
    let third = |breaks: &[f64], k: usize| {
        let piece = (k / 3).min(breaks.len() - 2);
        let part = (k - 3 * piece) as f64 / 3.0;
        breaks[piece] + part * (breaks[piece + 1] - breaks[piece])
    };
    PatchSurface::through_thirds(u.to_vec(), v.to_vec(), |i, j| z(third(u, i), third(v, j)))
        .unwrap()
}

fn coedge(surface: &PatchSurface, edges: &[Edge], id: usize, reversed: bool, nudge: f64) -> Coedge {
    let path = &edges[id].path;
    let parameter_curve = if reversed {
        path.reversed()
    } else {
        path.clone()
    };
    let space_curve = lifted(surface, &parameter_curve, nudge);
    Coedge {
        edge: EdgeId(id),
        reversed,
        parameter_curve,
        space_curve,
    }
}

/// The path on the surface: x and y as they are, z by Hermite cubics, whose slopes are taken this
/// share of their length inside.
fn lifted(surface: &PatchSurface, path: &PiecewiseCubic<2>, nudge: f64) -> PiecewiseCubic<3> {
    let mut breaks = vec![path.breaks[0]];
    let mut pieces = Vec::new();
    for piece in path.breaks.windows(2) {
        for part in 0..LIFT_PARTS {
            let at = |k: usize| match k {
                0 => piece[0],
                LIFT_PARTS => piece[1],
                _ => piece[0] + (piece[1] - piece[0]) * k as f64 / LIFT_PARTS as f64,
            };
            let (from, to) = (at(part), at(part + 1));
            let flat = path.restricted(from, to).unwrap();
            let [x, y] = flat.pieces[0];
            let h = to - from;
            let height = |s: f64| {
                let [px, py] = flat.piece_value(0, s, 0);
                // The slope on this side of a kink.
                let within = s.clamp(nudge * h, (1.0 - nudge) * h);
                let [ix, iy] = flat.piece_value(0, within, 0);
                let [dx, dy] = flat.piece_value(0, within, 1);
                let slope =
                    surface.z_partial(ix, iy, 1, 0) * dx + surface.z_partial(ix, iy, 0, 1) * dy;
                (surface.z(px, py), slope)
            };
            let ((z0, d0), (z1, d1)) = (height(0.0), height(h));
            let rise = (z1 - z0) / h;
            let z = [
                z0,
                d0,
                (3.0 * rise - 2.0 * d0 - d1) / h,
                (d0 + d1 - 2.0 * rise) / (h * h),
            ];
            pieces.push([x, y, z]);
            breaks.push(to);
        }
    }
    PiecewiseCubic::new(breaks, pieces).unwrap()
}

/// A face of the model lifted anew onto its surface, which rises by `slope` along y from
/// `at` on, which must be where curves are cut to be lifted: 0 or 18.75.
pub(crate) fn raised(face: &Face, model: &Model, at: f64, slope: f64) -> Face {
    let Surface::Patches(old) = &face.surface;
    let mut v = vec![0.0, at.max(1.0), 30.0];
    v.dedup();
    let surface = patches(&old.u_breaks, &v, |x, y| {
        old.z(x, y) + slope * (y - at).max(0.0)
    });
    let border = |border: &Loop| Loop {
        coedges: border
            .coedges
            .iter()
            .map(|c| coedge(&surface, &model.edges, c.edge.0, c.reversed, 1e-9))
            .collect(),
    };
    Face {
        outer: border(&face.outer),
        inner: face.inner.iter().map(border).collect(),
        surface: Surface::Patches(surface.clone()),
        ..face.clone()
    }
}
