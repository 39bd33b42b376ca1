//! Holes of known surfaces closed, and what is no hole.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;

use std::collections::HashSet;

use common::{Shape, compacted, cut, grid, is_watertight, noisy, with_hole};
use fill::{
    FillError, Filled, HoleKind, Kernel, Method, Outcome, Precision, Settings, TriangleMesh, fill,
    survey,
};
use glam::DVec3;
use range_image::Unmonitored;

fn filled(mesh: &TriangleMesh, settings: &Settings) -> Filled {
    fill(mesh.clone(), settings, &Unmonitored).unwrap()
}

/// New vertices.
fn new_places(own: &Filled) -> Vec<DVec3> {
    let old: HashSet<u32> = own.mesh.triangles[..own.old_triangles]
        .iter()
        .flatten()
        .copied()
        .collect();
    let mut new: Vec<u32> = own.mesh.triangles[own.old_triangles..]
        .iter()
        .flatten()
        .copied()
        .filter(|v| !old.contains(v))
        .collect();
    new.sort_unstable();
    new.dedup();
    new.into_iter()
        .map(|v| DVec3::from_array(own.mesh.vertices_mm[v as usize]))
        .collect()
}

/// Root mean square of how far new vertices lie off.
fn rms(own: &Filled, shape: Shape) -> f64 {
    let offs: Vec<f64> = new_places(own).iter().map(|&p| shape.off(p).0).collect();
    assert!(!offs.is_empty());
    (offs.iter().map(|o| o * o).sum::<f64>() / offs.len() as f64).sqrt()
}

/// Largest angle of new triangles on the border to the surface, degrees.
fn border_angle(own: &Filled, shape: Shape) -> f64 {
    let old: HashSet<u32> = own.mesh.triangles[..own.old_triangles]
        .iter()
        .flatten()
        .copied()
        .collect();
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| DVec3::from_array(own.mesh.vertices_mm[v as usize]));
        let normal = (b - a).cross(c - a).normalize();
        libm::acos(normal.dot(shape.off((a + b + c) / 3.0).1).clamp(-1.0, 1.0)).to_degrees()
    };
    own.mesh.triangles[own.old_triangles..]
        .iter()
        .filter(|t| t.iter().filter(|v| old.contains(v)).count() >= 2)
        .map(angle)
        .fold(0.0, f64::max)
}

fn is_unmoved(before: &TriangleMesh, after: &Filled) {
    let corners = |mesh: &TriangleMesh, t: [u32; 3]| t.map(|v| mesh.vertices_mm[v as usize]);
    assert_eq!(after.old_triangles, before.triangles.len());
    for (own, old) in after.mesh.triangles.iter().zip(&before.triangles) {
        assert_eq!(corners(&after.mesh, *own), corners(before, *old));
    }
}

#[test]
fn holes_of_known_surfaces() {
    for (shape, most) in [
        (Shape::Sphere, 1e-5),
        (Shape::Torus, 1e-3),
        (Shape::Saddle, 1e-4),
        (Shape::Ellipsoid, 1e-3),
        (Shape::Wavy, 2e-3),
        (Shape::Cylinder, 1e-5),
    ] {
        for share in [0.05, 0.3] {
            let (mesh, across) = with_hole(shape, (share * 5.0_f64).clamp(0.8, 2.0), share);
            let own = filled(&mesh, &Settings::default());
            assert!(own.open().is_empty(), "{shape:?} {share}");
            let off = rms(&own, shape) / across;
            assert!(off < most, "{shape:?} {share}: {off}");
            let angle = border_angle(&own, shape);
            assert!(angle < 3.0, "{shape:?} {share}: {angle}");
            let is_closed = matches!(shape, Shape::Sphere | Shape::Torus | Shape::Ellipsoid);
            assert_eq!(is_watertight(&own.mesh), is_closed, "{shape:?} {share}");
            is_unmoved(&mesh, &own);
        }
    }
}

#[test]
fn noise_is_told_and_not_made_worse() {
    for (shape, seed) in [
        (Shape::Sphere, 11),
        (Shape::Saddle, 12),
        (Shape::Cylinder, 13),
    ] {
        let (mut mesh, _) = with_hole(shape, 1.5, 0.2);
        noisy(&mut mesh, shape, 0.05, seed);
        let own = filled(&mesh, &Settings::default());
        assert!(rms(&own, shape) < 0.05, "{shape:?}: {}", rms(&own, shape));
        let noise = own.holes.iter().find_map(|hole| match hole.outcome {
            Outcome::Filled { noise_mm, .. } => Some(noise_mm),
            _ => None,
        });
        assert!(
            (0.035..0.06).contains(&noise.unwrap()),
            "{shape:?}: {noise:?}"
        );
    }
}

#[test]
fn the_papers_way_and_its_trimmed_surface() {
    let (mesh, across) = with_hole(Shape::Sphere, 2.0, 0.25);
    let settings = Settings {
        method: Method::Yoo,
        patches: true,
        ..Settings::default()
    };
    let own = filled(&mesh, &settings);
    assert!(is_watertight(&own.mesh));
    let off = rms(&own, Shape::Sphere) / across;
    assert!((1e-5..1e-2).contains(&off), "{off}");
    let Outcome::Filled { kernel, .. } = own.holes[0].outcome else {
        panic!("{:?}", own.holes[0].outcome);
    };
    assert_eq!(kernel, Some(Kernel::ThinPlate));
    let [patch] = &own.holes[0].patch.as_ref().unwrap().as_ref().unwrap()[..] else {
        panic!("several");
    };
    // Curves in space and in the parameter plane run along each other.
    let (flat, spatial) = (&patch.parameter_curves[0], &patch.space_curves[0]);
    assert_eq!(flat.knots().domain(), spatial.knots().domain());
    let (first, last) = flat.knots().domain();
    for k in 0..=500 {
        let t = first + (last - first) * f64::from(k) / 500.0;
        let [u, v] = flat.evaluate(t);
        let on = DVec3::from_array(patch.surface.evaluate(u, v));
        assert!(on.distance(DVec3::from_array(spatial.evaluate(t))) < 1e-4);
    }
    assert_eq!(flat.points().first(), flat.points().last());
    assert!(patch.off_mm < 0.05, "{}", patch.off_mm);
}

#[test]
fn a_window_around_a_pipe_is_parted_into_trimmed_surfaces() {
    let (mesh, _) = with_hole(Shape::Cylinder, 1.5, 0.3);
    let settings = Settings {
        patches: true,
        ..Settings::default()
    };
    let own = filled(&mesh, &settings);
    let window = own.holes.iter().find(|own| own.patch.is_some()).unwrap();
    let parts = window.patch.as_ref().unwrap().as_ref().unwrap();
    assert!((2..=4).contains(&parts.len()), "{}", parts.len());
    // Every curve runs on its own surface and on the pipe, and along a neighbour or the window.
    let at = |p: [f64; 3]| DVec3::from_array(p);
    let window: Vec<DVec3> = window
        .hole
        .vertices
        .iter()
        .map(|&v| at(own.mesh.vertices_mm[v as usize]))
        .collect();
    for (number, part) in parts.iter().enumerate() {
        assert_eq!(
            part.hole,
            own.holes.iter().position(|h| h.patch.is_some()).unwrap() + 1
        );
        for (flat, spatial) in part.parameter_curves.iter().zip(&part.space_curves) {
            let (first, last) = flat.knots().domain();
            for k in 0..400 {
                let t = first + (last - first) * f64::from(k) / 400.0;
                let place = at(spatial.evaluate(t));
                let [u, v] = flat.evaluate(t);
                assert!(at(part.surface.evaluate(u, v)).distance(place) < 1e-4);
                assert!(Shape::Cylinder.off(place).0.abs() < 1e-3);
                let others = parts.iter().enumerate().filter(|(k, _)| *k != number);
                let near = others
                    .flat_map(|(_, other)| &other.space_curves)
                    .map(|other| other.closest(place.to_array()).distance)
                    .fold(f64::INFINITY, f64::min);
                let to_window = (0..window.len())
                    .map(|k| {
                        let (a, b) = (window[k], window[(k + 1) % window.len()]);
                        let share =
                            ((place - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                        place.distance(a.lerp(b, share))
                    })
                    .fold(f64::INFINITY, f64::min);
                assert!(near < 1e-3 || to_window < 0.03, "{near} {to_window}");
            }
        }
    }
}

#[test]
fn the_border_of_a_sheet_stays_open() {
    let (mesh, _) = with_hole(Shape::Saddle, 4.0, 0.3);
    let found = survey(mesh.clone(), &Settings::default()).unwrap();
    let kinds: Vec<HoleKind> = found.holes.iter().map(|hole| hole.kind).collect();
    assert_eq!(kinds, [HoleKind::Border, HoleKind::Hole]);
    let own = filled(&mesh, &Settings::default());
    assert_eq!(own.holes[0].outcome, Outcome::Border);
    // Straight across it there is the sheet itself.
    let forced = Settings {
        force: [1].into(),
        ..Settings::default()
    };
    assert_eq!(filled(&mesh, &forced).open(), [1].into());
    let kept = Settings {
        keep: [2].into(),
        ..Settings::default()
    };
    let kept = filled(&mesh, &kept);
    assert_eq!(kept.holes[1].outcome, Outcome::Kept);
    assert_eq!(kept.mesh.triangles, mesh.triangles);
}

#[test]
fn the_ends_of_a_pipe_are_closed_on_demand() {
    let (mesh, _) = with_hole(Shape::Cylinder, 4.0, 0.15);
    let found = survey(mesh.clone(), &Settings::default()).unwrap();
    let numbers = |kind: HoleKind| {
        let own = found.holes.iter().filter(move |hole| hole.kind == kind);
        own.map(|hole| hole.number).collect::<Vec<_>>()
    };
    assert_eq!(numbers(HoleKind::Hole).len(), 1);
    let ends = numbers(HoleKind::Border);
    assert_eq!(ends.len(), 2);
    let forced = Settings {
        force: ends.into_iter().collect(),
        ..Settings::default()
    };
    let own = filled(&mesh, &forced);
    assert!(is_watertight(&own.mesh), "{:?}", own.holes);
    // Flat ones: nothing is beyond them.
    let heights = new_places(&own).into_iter().map(|p| p.z);
    assert!(
        heights
            .into_iter()
            .all(|z| (-1e-9..=100.0 + 1e-9).contains(&z))
    );
}

#[test]
fn an_island_is_joined_to_what_is_around_it() {
    let (mesh, centre) = Shape::Sphere.mesh(2.0);
    let holed = cut(&mesh, |p| (6.0..16.0).contains(&p.distance(centre)));
    let found = survey(holed.clone(), &Settings::default()).unwrap();
    let islands = found
        .holes
        .iter()
        .filter(|hole| matches!(hole.kind, HoleKind::Island(_)));
    assert_eq!(islands.count(), 1);
    let own = filled(&holed, &Settings::default());
    assert!(own.open().is_empty(), "{:?}", own.holes);
    assert!(is_watertight(&own.mesh));
    assert!(rms(&own, Shape::Sphere) < 1e-3);
    let settings = Settings {
        method: Method::Yoo,
        ..Settings::default()
    };
    assert!(is_watertight(&filled(&holed, &settings).mesh));
}

#[test]
fn an_island_in_a_hole_that_no_plane_sees_whole() {
    // Around more than half of the tube, and an island where nothing is above it.
    let (mesh, _) = Shape::Torus.mesh(2.0);
    let turn = |p: DVec3| {
        let out = libm::hypot(p.x, p.y) - 35.0;
        (libm::atan2(p.z, out), 35.0 * libm::atan2(p.y, p.x))
    };
    let holed = cut(&mesh, |p| {
        let (around, along) = turn(p);
        let is_island = around.abs() < 0.4 && along.abs() < 6.0;
        around.abs() < 2.0 && along.abs() < 14.0 && !is_island
    });
    let own = filled(&holed, &Settings::default());
    let kinds: Vec<HoleKind> = own.holes.iter().map(|own| own.hole.kind).collect();
    let islands = kinds
        .iter()
        .filter(|own| matches!(own, HoleKind::Island(_)));
    assert_eq!((kinds.len(), islands.count()), (2, 1), "{kinds:?}");
    assert!(own.open().is_empty(), "{:?}", own.holes);
    assert!(is_watertight(&own.mesh));
}

#[test]
fn vertices_that_no_triangle_has_are_left_out() {
    let (mut mesh, _) = with_hole(Shape::Sphere, 6.0, 0.3);
    let before = filled(&mesh, &Settings::default());
    // First and last.
    mesh.vertices_mm.insert(0, [1.0, 2.0, 3.0]);
    mesh.vertices_mm.push([3.0, 2.0, 1.0]);
    for corner in mesh.triangles.as_flattened_mut() {
        *corner += 1;
    }
    let own = filled(&mesh, &Settings::default());
    assert_eq!(own.mended.unused_vertices, 2);
    assert_eq!(own.mesh, before.mesh);
}

/// A window far around a pipe, every third triangle at its border left as a tooth.
#[test]
fn a_ragged_window_in_a_pipe_lies_on_the_pipe() {
    let (mesh, _) = Shape::Cylinder.mesh(1.5);
    let is_out = |p: DVec3| libm::atan2(p.y, p.x).abs() < 1.3 && (p.z - 50.0).abs() < 9.0;
    let at = |v: u32| DVec3::from_array(mesh.vertices_mm[v as usize]);
    let kept = mesh.triangles.iter().enumerate().filter(|(k, t)| {
        let count = t.iter().filter(|&&v| is_out(at(v))).count();
        count == 0 || (count == 1 && k % 3 == 0)
    });
    let holed = compacted(&mesh, kept.map(|(_, t)| *t).collect());
    let own = filled(&holed, &Settings::default());
    let is_on_surface = |own: &fill::HoleReport| match &own.outcome {
        Outcome::Filled { kernel, .. } => kernel.is_some(),
        outcome => *outcome == Outcome::Border,
    };
    assert!(own.holes.iter().all(is_on_surface), "{:?}", own.holes);
    assert_eq!(own.mended.cleared, 0);
    assert!(rms(&own, Shape::Cylinder) < 1e-3);
    assert!(border_angle(&own, Shape::Cylinder) < 5.0);
}

#[test]
fn holes_that_touch_in_a_vertex() {
    let mesh = grid(20, 20, [false, false], |u, v| {
        DVec3::new(10.0 * u, 10.0 * v, libm::sin(3.0 * u) * v)
    });
    // Two squares that share a corner.
    let squares = [(8, 8), (9, 9)];
    let is_out = |k: usize| squares.contains(&(k / 2 % 20, k / 2 / 20));
    let kept = (0..mesh.triangles.len()).filter(|&k| !is_out(k));
    let holed = compacted(&mesh, kept.map(|k| mesh.triangles[k]).collect());
    let own = filled(&holed, &Settings::default());
    let closed = own
        .holes
        .iter()
        .filter(|h| matches!(h.outcome, Outcome::Filled { .. }));
    assert_eq!(closed.count(), 2);
    assert_eq!(own.mended.split_vertices, 0);
    let again = survey(own.mesh, &Settings::default()).unwrap();
    assert_eq!(again.holes.len(), 1);
}

#[test]
fn what_is_wrong_with_a_mesh_is_mended() {
    let (mut mesh, _) = with_hole(Shape::Sphere, 6.0, 0.3);
    let count = mesh.triangles.len();
    mesh.triangles[3].swap(0, 1);
    mesh.triangles[count - 5].swap(1, 2);
    let again = mesh.triangles[7];
    mesh.triangles.push(again);
    mesh.triangles.push([again[0], again[0], again[1]]);
    // A fin on an edge that has two triangles.
    mesh.vertices_mm.push([0.0, 0.0, 90.0]);
    mesh.triangles
        .push([again[0], again[1], mesh.vertices_mm.len() as u32 - 1]);
    let own = filled(&mesh, &Settings::default());
    assert!(is_watertight(&own.mesh));
    let mended = own.mended;
    assert_eq!(
        (mended.turned, mended.duplicate, mended.degenerate),
        (2, 1, 1)
    );
    assert_eq!((mended.non_manifold_edges, mended.left_out), (1, 1));
}

#[test]
fn soups_are_welded_and_a_moebius_strip_is_told() {
    let (mesh, _) = with_hole(Shape::Torus, 4.0, 0.2);
    let mut soup = TriangleMesh::default();
    for t in &mesh.triangles {
        let first = soup.vertices_mm.len() as u32;
        soup.vertices_mm
            .extend(t.map(|v| mesh.vertices_mm[v as usize]));
        soup.triangles.push([first, first + 1, first + 2]);
    }
    let (own, shared) = (
        filled(&soup, &Settings::default()),
        filled(&mesh, &Settings::default()),
    );
    assert!(is_watertight(&own.mesh));
    assert_eq!(own.mesh.triangles.len(), shared.mesh.triangles.len());
    let strip = grid(24, 2, [false, false], |u, v| {
        let (s, c) = libm::sincos(u * std::f64::consts::TAU);
        let (hs, hc) = libm::sincos(u * std::f64::consts::PI);
        let r = 10.0 + (v - 0.5) * hc;
        DVec3::new(r * c, r * s, (v - 0.5) * hs)
    });
    let found = survey(
        strip,
        &Settings {
            weld_mm: Some(1e-6),
            ..Settings::default()
        },
    )
    .unwrap();
    assert!(found.mended.one_sided_edges > 0, "{:?}", found.mended);
}

#[test]
fn far_away_and_in_single_precision() {
    let (mut mesh, across) = with_hole(Shape::Sphere, 4.0, 0.3);
    let away = DVec3::new(1e6, -1e6, 5e5);
    for place in &mut mesh.vertices_mm {
        *place = (DVec3::from_array(*place) + away)
            .to_array()
            .map(|c| f64::from(c as f32));
    }
    let settings = Settings {
        precision: Precision::Single,
        ..Settings::default()
    };
    let own = filled(&mesh, &settings);
    assert!(own.open().is_empty() && is_watertight(&own.mesh));
    let offs = new_places(&own)
        .into_iter()
        .map(|p| Shape::Sphere.off(p - away).0.abs());
    // The coordinates themselves have but a sixteenth of a millimetre.
    assert!(offs.fold(0.0, f64::max) < 0.01 * across);
    let is_single = |c: &f64| f64::from(*c as f32) == *c;
    assert!(own.mesh.vertices_mm.as_flattened().iter().all(is_single));
}

#[test]
fn edges_are_as_long_as_those_around_or_shorter() {
    let (mesh, _) = with_hole(Shape::Sphere, 4.0, 0.3);
    let longest = |own: &Filled| {
        let new = &own.mesh.triangles[own.old_triangles..];
        let at = |v: u32| DVec3::from_array(own.mesh.vertices_mm[v as usize]);
        let old: HashSet<u32> = own.mesh.triangles[..own.old_triangles]
            .iter()
            .flatten()
            .copied()
            .collect();
        let sides = new.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        sides
            .filter(|(a, b)| !(old.contains(a) && old.contains(b)))
            .map(|(a, b)| at(a).distance(at(b)))
            .fold(0.0, f64::max)
    };
    let own = longest(&filled(&mesh, &Settings::default()));
    assert!((3.0..7.0).contains(&own), "{own}");
    let settings = Settings {
        max_edge_mm: Some(1.5),
        ..Settings::default()
    };
    let finer = longest(&filled(&mesh, &settings));
    // Beside the border triangles have the border's own edges as sides.
    assert!(finer < 3.0, "{finer}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (mesh, _) = with_hole(Shape::Torus, 1.5, 0.3);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| filled(&mesh, &Settings::default()))
    };
    let (one, many) = (with(1), with(5));
    assert!(one == many);
}

#[test]
fn clear_answers() {
    let told = |mesh: TriangleMesh, settings: &Settings| {
        fill(mesh, settings, &Unmonitored).unwrap_err().to_string()
    };
    let triangle = TriangleMesh {
        vertices_mm: vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 0, 1]],
    };
    let none = Settings::default();
    assert_eq!(
        told(triangle.clone(), &none),
        "none of its 2 triangles has an area"
    );
    let mut endless = triangle.clone();
    endless.vertices_mm[1][2] = f64::NAN;
    assert!(told(endless, &none).starts_with("vertex 2 has a coordinate"));
    let mut outside = triangle;
    outside.triangles[1][0] = 9;
    assert_eq!(
        told(outside, &none),
        "triangle 2 names vertex 10, and there are 3"
    );
    let (mesh, _) = with_hole(Shape::Sphere, 8.0, 0.3);
    let keep = Settings {
        keep: [2].into(),
        ..Settings::default()
    };
    assert_eq!(told(mesh.clone(), &keep), "there is no loop 2; there are 1");
    let edge = Settings {
        max_edge_mm: Some(0.0),
        ..Settings::default()
    };
    assert!(told(mesh.clone(), &edge).contains("must be a length above 0"));
    struct Stopped;
    impl range_image::Monitor for Stopped {
        fn is_cancelled(&self) -> bool {
            true
        }
        fn progress(&self, _: f64) {}
    }
    let stopped = fill(mesh, &none, &Stopped).unwrap_err();
    assert!(matches!(stopped, FillError::Cancelled(_)));
}
