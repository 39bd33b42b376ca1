//! Surfaces whose area and distance are known in closed form.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

mod common;

use std::f64::consts::{PI, TAU};

use common::{Builder, Point, arc, line, places, sound, surface};
use range_image::Unmonitored;
use reconstruct::{EdgeKind, Model};
use tessellate::{Mesh, TessellateError, TessellateSettings, tessellate};

fn at(tolerance_mm: f64) -> TessellateSettings {
    TessellateSettings {
        tolerance_mm,
        ..TessellateSettings::default()
    }
}

fn triangles(model: &Model, tolerance_mm: f64) -> Mesh {
    tessellate(model, &at(tolerance_mm), &Unmonitored).unwrap()
}

const SQUARE: [Point; 4] = [[-20.0, -20.0], [20.0, -20.0], [20.0, 20.0], [-20.0, 20.0]];

#[test]
fn a_sloping_plane_with_a_hole_has_its_exact_area() {
    let mut builder = Builder::default();
    let outer = builder.polygon(&SQUARE);
    let hole = builder.polygon(&[[-5.0, 0.0], [0.0, 7.0], [6.0, 1.0]]);
    builder.face(
        &surface(21.0, |x, y| 0.75 * x - 0.5 * y + 3.0),
        &[outer, hole],
    );
    let mesh = triangles(&builder.model, 0.01);
    // Twice the hole: 5 * -6 - 7 * 11 by the cross product of its sides.
    let flat = 1600.0 - (77.0 - 5.0) / 2.0;
    let slope = (1.0_f64 + 0.75 * 0.75 + 0.5 * 0.5).sqrt();
    assert!(
        (mesh.area_mm2() - flat * slope).abs() < 1e-9,
        "{}",
        mesh.area_mm2()
    );
    let found = sound(&mesh);
    assert_eq!(found.free_edges, 7);
    assert!(mesh.accuracy.surface_mm < 1e-12 && mesh.accuracy.seam_mm == 0.0);
    // Straight sides need no point but their ends.
    let on_border = |k: usize| mesh.vertices_mm[k][0].abs() > 19.9 || k < 7;
    assert!((0..7).all(on_border) && mesh.faces[0].corners.len() < 60);
    assert!(found.least_angle_rad > 0.2, "{found:?}");
}

#[test]
fn a_round_hole_leaves_few_slim_triangles() {
    let mut builder = Builder::default();
    let outer = builder.polygon(&SQUARE);
    let hole = builder.edge(EdgeKind::Silhouette, arc([3.0, -2.0], 8.0, 0.0, -TAU));
    builder.face(
        &surface(21.0, |x, _| 0.2 * x),
        &[outer, vec![(hole, false)]],
    );
    let mesh = triangles(&builder.model, 0.01);
    let found = sound(&mesh);
    // Sides of the hole are at most 2 acos(1 - 0.01 / 8) wide, so the area is off by less than
    // tolerance times circumference.
    let exact = (1600.0 - PI * 64.0) * 1.04_f64.sqrt();
    let off = mesh.area_mm2() - exact;
    assert!(off > 0.0 && off < 0.01 * TAU * 8.0, "{off}");
    // Those on the long straight sides alone; a fan from the hole to the corners has hundreds of
    // less than 2 degrees.
    assert!(found.least_angle_rad > 0.06 && found.slim < 30, "{found:?}");
    assert!(mesh.triangle_count() < 1000, "{}", mesh.triangle_count());
}

/// The middle of each triangle and of its sides against a true distance, and the sides of the
/// border against the tolerance.
fn keeps(mesh: &Mesh, tolerance_mm: f64, off_mm: impl Fn([f64; 3]) -> f64) {
    for face in &mesh.faces {
        for triangle in face.triangles() {
            for place in places(mesh.corners_mm(triangle)) {
                let off = off_mm(place).abs();
                assert!(off <= tolerance_mm, "{off} mm off at {place:?}");
            }
        }
    }
    assert!(mesh.accuracy.surface_mm <= tolerance_mm);
}

#[test]
fn a_cylinder_is_kept_to_the_tolerance_on_its_steep_flanks_too() {
    // About an axis that is turned in the plane; up to 75 degrees from its top.
    let (radius, (sin, cos)) = (12.0_f64, libm::sincos(0.4));
    let out = move |x: f64, y: f64| cos * x + sin * y;
    let (most_sin, most_cos) = libm::sincos(75.0_f64.to_radians());
    let steepest = radius * most_sin;
    // Beyond the border it goes on as a parabola.
    let z = move |x: f64, y: f64| {
        let from = out(x, y).abs() - steepest;
        if from <= 0.0 {
            return (radius * radius - out(x, y).powi(2)).sqrt();
        }
        let second = -1.0 / (radius * most_cos.powi(3));
        radius * most_cos - most_sin / most_cos * from + second / 2.0 * from * from
    };
    let corner = |s: f64, t: f64| [cos * s - sin * t, sin * s + cos * t];
    let mut builder = Builder::default();
    let outer = builder.polygon(&[
        corner(-steepest, -6.0),
        corner(steepest, -6.0),
        corner(steepest, 6.0),
        corner(-steepest, 6.0),
    ]);
    builder.face(&surface(15.0, z), &[outer]);
    let exact = radius * 150.0_f64.to_radians() * 12.0;
    let mut counts = Vec::new();
    for tolerance_mm in [0.1, 0.02, 0.005] {
        let mesh = triangles(&builder.model, tolerance_mm);
        let found = sound(&mesh);
        // The patches are off the cylinder by less than 0.002 mm.
        keeps(&mesh, tolerance_mm + 0.002, |[x, y, z]| {
            libm::hypot(out(x, y), z) - radius
        });
        let lost = exact - mesh.area_mm2();
        assert!(
            lost > -0.01 && lost < exact * 2.0 * tolerance_mm / radius,
            "{lost}"
        );
        let most_slim = mesh.triangle_count() / 10;
        assert!(
            found.least_angle_rad > 0.02 && found.slim <= most_slim,
            "{found:?}"
        );
        counts.push(mesh.triangle_count());
    }
    // Four times the triangles for a quarter of the distance.
    assert!(
        counts[1] > counts[0] && counts[2] > 2 * counts[1],
        "{counts:?}"
    );
    assert!(counts[2] < 10 * counts[1], "{counts:?}");
}

#[test]
fn a_bowl_in_a_sphere_has_the_area_of_its_cap() {
    let radius = 15.0_f64;
    let mut builder = Builder::default();
    let rim = builder.edge(EdgeKind::Silhouette, arc([1.0, 2.0], 9.0, 0.0, TAU));
    let hollow = move |x: f64, y: f64| {
        20.0 - (radius * radius - (x - 1.0).powi(2) - (y - 2.0).powi(2))
            .max(0.0)
            .sqrt()
    };
    builder.face(&surface(14.0, hollow), &[vec![(rim, false)]]);
    let mesh = triangles(&builder.model, 0.01);
    let found = sound(&mesh);
    keeps(&mesh, 0.01 + 1e-4, |[x, y, z]| {
        libm::hypot(libm::hypot(x - 1.0, y - 2.0), z - 20.0) - radius
    });
    let cap = TAU * radius * (radius - (radius * radius - 81.0).sqrt());
    let lost = cap - mesh.area_mm2();
    assert!(
        lost > 0.0 && lost < cap * 0.01 / radius * 3.0,
        "{lost} of {cap}"
    );
    assert!(found.least_angle_rad > 0.2, "{found:?}");
    let rim = mesh.free_edges();
    assert!(rim == found.free_edges && rim > 40 && rim < 160);
    // Normals are the surface's own, not those of the triangles.
    for corner in &mesh.faces[0].corners {
        let [x, y, z] = mesh.vertices_mm[corner.vertex as usize];
        let towards = [1.0 - x, 2.0 - y, 20.0 - z].map(|d| d / radius);
        let dot: f64 = towards.iter().zip(corner.normal).map(|(a, b)| a * b).sum();
        assert!(dot > 0.999_99, "{dot}");
    }
}

/// A plane and a half cylinder lying on it that meet in two lines and two arcs; raised by `lift`.
fn plane_and_cylinder(lift: f64, kind: EdgeKind) -> Model {
    let mut builder = Builder::default();
    let outer = builder.polygon(&SQUARE);
    let (low, high): (Point, Point) = ([-8.0, -10.0], [8.0, 10.0]);
    let crease = |a, b| (kind, line(a, b));
    let inner: Vec<usize> = [
        crease(low, [high[0], low[1]]),
        crease([high[0], low[1]], high),
        crease(high, [low[0], high[1]]),
        crease([low[0], high[1]], low),
    ]
    .into_iter()
    .map(|(kind, path)| builder.edge(kind, path))
    .collect();
    let hole = inner.iter().rev().map(|&edge| (edge, true)).collect();
    let border = inner.iter().map(|&edge| (edge, false)).collect();
    // The plane bends along y, so that all of the crease does, too.
    let bend = |y: f64| 0.01 * y * y;
    builder.face(&surface(21.0, move |_, y| bend(y)), &[outer, hole]);
    let arch = move |x: f64, y: f64| bend(y) + lift + (1.0 - (x / 8.0).powi(2)) * 4.0;
    builder.face(&surface(21.0, arch), &[border]);
    builder.model
}

#[test]
fn a_shared_crease_has_no_free_edges() {
    let model = plane_and_cylinder(0.0, EdgeKind::Crease);
    let mesh = triangles(&model, 0.01);
    sound(&mesh);
    // Along x = -8 and x = 8 the faces meet; along y they part but for the corners.
    let is_on =
        |v: u32, d: usize, at: f64| (mesh.vertices_mm[v as usize][d].abs() - at).abs() < 1e-9;
    let mut shared = 0;
    for (side, uses) in mesh.edge_uses() {
        let both = |d, at| side.iter().all(|&v| is_on(v, d, at));
        if both(0, 8.0) {
            assert_eq!(uses, 2, "{side:?}");
            shared += 1;
        } else if uses == 1 {
            assert!(both(1, 10.0) || both(0, 20.0) || both(1, 20.0), "{side:?}");
        }
    }
    assert!(shared >= 2 * 8, "{shared}");
    assert!(mesh.accuracy.seam_mm < 1e-9);
}

#[test]
fn faces_a_little_apart_meet_half_way_and_others_do_not() {
    let at_side = |mesh: &Mesh| {
        let uses = mesh.edge_uses().into_iter();
        let on = |v: &u32| (mesh.vertices_mm[*v as usize][0].abs() - 8.0).abs() < 1e-9;
        let along = uses.filter(|(side, _)| side.iter().all(on));
        along.map(|(_, uses)| uses).collect::<Vec<_>>()
    };
    let near = triangles(&plane_and_cylinder(0.04, EdgeKind::Crease), 0.01);
    sound(&near);
    assert!(at_side(&near).iter().all(|&uses| uses == 2));
    assert!((near.accuracy.seam_mm - 0.02).abs() < 1e-9);
    // The triangles beside a seam are judged by how far they are off between its points.
    assert!(near.accuracy.surface_mm <= 0.01);
    let far = triangles(&plane_and_cylinder(0.06, EdgeKind::Crease), 0.01);
    sound(&far);
    assert!(at_side(&far).iter().all(|&uses| uses == 1));
    assert_eq!(far.accuracy.seam_mm, 0.0);
    // A step is none, however low.
    let step = triangles(&plane_and_cylinder(0.0, EdgeKind::Step), 0.01);
    sound(&step);
    assert!(at_side(&step).iter().all(|&uses| uses == 1));
    // Both sides have the same points all the same, seen from the camera.
    assert_eq!(at_side(&step).len(), 2 * at_side(&near).len());
}

#[test]
fn a_strip_thinner_than_the_tolerance_is_filled() {
    // Between two arcs that are 0.004 mm apart in the middle and meet at their ends.
    let mut builder = Builder::default();
    let half = 5.0_f64;
    let bow = |sagitta: f64| {
        let at = |third: f64| {
            let x = half * (2.0 * third / 3.0 - 1.0);
            [x, sagitta * (1.0 - (x / half).powi(2))]
        };
        let points = [at(0.0), at(1.0), at(2.0), at(3.0)];
        nurbs::PiecewiseCubic::through_thirds(0.0, 2.0 * half, &points).unwrap()
    };
    let lower = builder.edge(EdgeKind::Silhouette, bow(0.0));
    let upper = builder.edge(EdgeKind::Silhouette, bow(0.004));
    builder.face(
        &surface(6.0, |_, _| 0.0),
        &[vec![(lower, false), (upper, true)]],
    );
    let mesh = triangles(&builder.model, 0.1);
    sound(&mesh);
    let exact = 0.004 * 2.0 * half * 2.0 / 3.0;
    assert!(mesh.area_mm2() > 0.7 * exact && mesh.area_mm2() <= exact + 1e-12);
}

#[test]
fn what_cannot_be_is_told() {
    let error = |model: &Model, settings| tessellate(model, &settings, &Unmonitored).unwrap_err();
    assert_eq!(error(&Model::default(), at(0.01)), TessellateError::NoFaces);
    let model = plane_and_cylinder(0.0, EdgeKind::Crease);
    assert!(
        matches!(error(&model, at(-1.0)), TessellateError::Settings(e) if e.name == "tolerance_mm")
    );

    let mut dangling = model.clone();
    dangling.faces[0].outer.coedges[0].edge.0 = 99;
    let told = error(&dangling, at(0.01)).to_string();
    assert!(
        told.contains("face-1") && told.contains("an edge that the model lacks"),
        "{told}"
    );

    // A hole that crosses the border, however finely both are divided.
    let mut builder = Builder::default();
    let outer = builder.polygon(&SQUARE);
    let hole = builder.polygon(&[[15.0, 0.0], [15.0, 5.0], [25.0, 5.0], [25.0, 0.0]]);
    builder.face(&surface(26.0, |_, _| 0.0), &[outer, hole]);
    let crossing = error(&builder.model, at(0.01));
    assert!(
        matches!(&crossing, TessellateError::Crossing { at_mm, .. } if at_mm[0] > 14.9),
        "{crossing}"
    );

    struct Impatient;
    impl range_image::Monitor for Impatient {
        fn is_cancelled(&self) -> bool {
            true
        }
        fn progress(&self, _: f64) {}
    }
    let cancelled = tessellate(&model, &at(0.01), &Impatient);
    assert!(matches!(cancelled, Err(TessellateError::Cancelled(_))));
}
