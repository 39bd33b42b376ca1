//! Models of synthetic scenes against the scenes' own outlines and heights.

use crate::common;

use common::{
    Part, Point, contains, hausdorff, loop_points, one_way, outline, part_of, run, scene, surface_z,
};
use reconstruct::polygon::signed_area;
use reconstruct::{EdgeKind, EdgeOrigin, Method, Model};

/// A house in oblique view: two walls and two roof planes that meet in four
/// creases; eight corners, one of them inside.
fn house(angle: f64) -> Vec<Part> {
    let (sin, cos) = libm::sincos(angle);
    let turn = |points: &[Point]| -> Vec<Point> {
        points
            .iter()
            .map(|p| [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]])
            .collect()
    };
    let (a, b, c, d) = ([-45.0, -40.0], [5.0, -44.0], [45.0, -36.0], [-45.0, 10.0]);
    let (e, f, g, h, i) = (
        [5.0, 6.0],
        [45.0, 14.0],
        [-24.0, 42.0],
        [26.0, 38.0],
        [30.0, 40.0],
    );
    let _ = i;
    let plane = move |p: f64, q: f64, r: f64| {
        move |x: f64, y: f64| {
            let (x, y) = (cos * x + sin * y, -sin * x + cos * y);
            p + q * (x - 5.0) + r * (y - 6.0)
        }
    };
    vec![
        Part::new(&turn(&[a, b, e, d]), plane(20.0, 0.3, 0.05)),
        Part::new(&turn(&[b, c, f, e]), plane(20.0, -0.8, 0.05)),
        Part::new(&turn(&[d, e, h, g]), plane(20.0, 0.224, -0.9)),
        Part::new(&turn(&[e, f, h]), plane(20.0, -818.432 / 1112.0, -0.27)),
    ]
}

/// Distinct corners of a scene.
fn corners(parts: &[Part]) -> usize {
    let mut all: Vec<Point> = Vec::new();
    for p in parts.iter().flat_map(|p| &p.outline) {
        let known = |q: &Point| (p[0] - q[0]).abs() + (p[1] - q[1]).abs() < 1e-6;
        if !all.iter().any(known) {
            all.push(*p);
        }
    }
    all.len()
}

#[test]
fn the_house_keeps_its_corners_outlines_and_areas() {
    for method in [Method::Relief, Method::ShimLee] {
        for (k, noise_mm) in [(0, 0.0), (1, 0.05), (2, 0.05), (3, 0.05), (4, 0.05)] {
            let parts = house(0.13 * f64::from(k));
            let pitch = 0.45;
            let (image, map) = scene(&parts, pitch, (264, 256), noise_mm);
            let done = run(&image, &map, method);
            assert_eq!(done.model.faces.len(), 4);
            let (found, truth) = (done.model.vertices.len(), corners(&parts));
            println!(
                "{method:?} {k}: {found} vertices, {truth} corners, {:?}",
                done.metrics
            );
            assert!(found >= truth && found <= truth + 4, "{found} of {truth}");
            assert!(done.warnings.is_empty(), "{:?}", done.warnings);
            for face in &done.model.faces {
                let part = part_of(face, &parts, &image, &map);
                let drawn = outline(face);
                let off = hausdorff(&drawn, &part.outline);
                let (area, true_area) = (signed_area(&drawn), signed_area(&part.outline));
                println!(
                    "  off {:.3} pitches, area {:.4}",
                    off / pitch,
                    area / true_area
                );
                let (limit, share) = match (method, k) {
                    // Outlines along the lattice are known to half a pitch only.
                    (_, 0) => (0.6, 0.02),
                    (Method::Relief, _) => (0.3, 0.01),
                    (Method::ShimLee, _) => (0.8, 0.01),
                };
                assert!(off < limit * pitch, "{} {}", face.name, off / pitch);
                assert!((area / true_area - 1.0).abs() < share);
            }
            let creases = done
                .model
                .edges
                .iter()
                .filter(|e| e.kind == EdgeKind::Crease)
                .count();
            assert_eq!(creases, 4);
            let met = done.model.edges.iter();
            let met = met.filter(|e| e.origin == EdgeOrigin::Intersected).count();
            if method == Method::Relief {
                assert_eq!(met, 4);
                // Its four planes meet in one corner, but for the noise; creases are led there over
                // six pitches.
                let (sin, cos) = libm::sincos(0.13 * f64::from(k));
                let corner = [cos * 5.0 - sin * 6.0, sin * 5.0 + cos * 6.0];
                let apart_mm = creases_apart_mm(&done.model, corner, 7.0 * pitch);
                assert!(apart_mm < 3e-4, "{apart_mm}");
                assert!(creases_apart_mm(&done.model, corner, 0.0) < 0.02);
            } else {
                assert_eq!(met, 0);
            }
        }
    }
}

/// How far the two curves of a crease are apart at most, of all whose surfaces intersect there,
/// farther than so far from a place.
fn creases_apart_mm(model: &Model, from: Point, beyond_mm: f64) -> f64 {
    let mut greatest = 0.0_f64;
    for (id, edge) in model.edges.iter().enumerate() {
        assert!(edge.origin != EdgeOrigin::Intersected || edge.kind == EdgeKind::Crease);
        if edge.origin != EdgeOrigin::Intersected {
            continue;
        }
        let loops = model
            .faces
            .iter()
            .flat_map(|f| core::iter::once(&f.outer).chain(&f.inner));
        let uses = loops.flat_map(|l| &l.coedges).filter(|c| c.edge.0 == id);
        let curves: Vec<_> = uses
            .map(|c| {
                if c.reversed {
                    c.space_curve.reversed()
                } else {
                    c.space_curve.clone()
                }
            })
            .collect();
        assert_eq!(curves.len(), 2);
        let (first, last) = curves[0].domain();
        for k in 0..=200 {
            let at = first + (last - first) * f64::from(k) / 200.0;
            let [p, q] = [&curves[0], &curves[1]].map(|curve| curve.evaluate(at));
            if libm::hypot(p[0] - from[0], p[1] - from[1]) >= beyond_mm {
                greatest = greatest.max((p[2] - q[2]).abs());
            }
            assert!((p[0] - q[0]).abs() < 1e-9 && (p[1] - q[1]).abs() < 1e-9);
        }
    }
    greatest
}

/// A corner of a cube, seen along its diagonal: three planes that meet in the origin.
#[test]
fn three_faces_meet_in_one_corner() {
    for turn in [0.1, 0.37, 0.8] {
        let ray = move |k: usize| {
            let (sin, cos) = libm::sincos(turn + k as f64 * core::f64::consts::TAU / 6.0);
            [cos, sin]
        };
        let at = |k: usize| ray(k).map(|c| 40.0 * c);
        let parts: Vec<Part> = (0..3)
            .map(|k| {
                let down = ray(2 * k);
                let outline = [[0.0; 2], at((2 * k + 5) % 6), at(2 * k), at(2 * k + 1)];
                Part::new(&outline, move |x, y| {
                    20.0 - 0.7 * (x * down[0] + y * down[1])
                })
            })
            .collect();
        let (image, map) = scene(&parts, 0.5, (170, 170), 0.05);
        let done = run(&image, &map, Method::Relief);
        let model = &done.model;
        let met = model
            .edges
            .iter()
            .filter(|e| e.origin == EdgeOrigin::Intersected);
        assert_eq!(met.clone().count(), 3, "{turn}");
        let apart_mm = creases_apart_mm(model, [0.0; 2], 0.0);
        assert!(apart_mm < 3e-4, "{turn}: {apart_mm}");
        let ends = met.clone().flat_map(|e| [e.start.0, e.end.0]);
        let corner = ends
            .clone()
            .find(|v| ends.clone().filter(|w| w == v).count() == 3);
        let corner = model.vertices[corner.expect("the three have a common end")];
        let off_mm = libm::hypot(corner.x_mm, corner.y_mm);
        assert!(off_mm < 0.02, "{turn}: {off_mm}");
        // Each lies where the true one does, the last pitch before the outline apart.
        for edge in met {
            let (first, last) = edge.path.domain();
            for k in 0..=100 {
                let p = edge
                    .path
                    .evaluate(first + (last - first) * f64::from(k) / 100.0);
                let across = (0..3).map(|k| ray(2 * k + 1));
                let across = across.map(|ray| (p[0] * ray[1] - p[1] * ray[0]).abs());
                let off_mm = across.fold(f64::INFINITY, f64::min);
                assert!(off_mm < 0.02, "{turn}: {off_mm}");
            }
        }
    }
}

#[test]
fn planes_without_noise_are_met_exactly() {
    let parts = house(0.2);
    let (image, map) = scene(&parts, 0.5, (220, 220), 0.0);
    let done = run(&image, &map, Method::Relief);
    for face in &done.model.faces {
        let part = part_of(face, &parts, &image, &map);
        for column in 0..220 {
            for row in 0..220 {
                let (x, y) = (image.x_mm(column), image.y_mm(row));
                if contains(&part.outline, [x, y]) {
                    let off = surface_z(face, x, y) - (part.height)(x, y);
                    assert!(off.abs() < 1e-9, "{off}");
                }
            }
        }
    }
    assert!(
        done.regions
            .iter()
            .all(|r| r.patches == 1 && r.psnr_db > 150.0)
    );
}

fn circle(centre: Point, radius: f64) -> Vec<Point> {
    (0..720)
        .map(|k| {
            let angle = f64::from(k) * core::f64::consts::TAU / 720.0;
            [
                centre[0] + radius * libm::cos(angle),
                centre[1] + radius * libm::sin(angle),
            ]
        })
        .collect()
}

#[test]
fn a_disc_in_a_ring_shares_its_border_with_the_hole() {
    let parts = [
        Part::new(&circle([1.3, -2.2], 12.0), |x, y| {
            10.0 - 0.01 * (x * x + y * y)
        }),
        Part::new(&circle([0.0, 0.0], 30.0), |x, _| 0.1 * x),
    ];
    for method in [Method::Relief, Method::ShimLee] {
        let (image, map) = scene(&parts, 0.5, (160, 160), 0.02);
        let done = run(&image, &map, method);
        let model = &done.model;
        assert_eq!((model.faces.len(), model.faces[0].inner.len()), (2, 1));
        let (ring, disc) = (&model.faces[0], &model.faces[1]);
        let limit = if method == Method::Relief { 0.3 } else { 0.6 };
        assert!(hausdorff(&outline(disc), &parts[0].outline) < limit);
        assert!(hausdorff(&outline(ring), &parts[1].outline) < limit);
        let hole = loop_points(&ring.inner[0]);
        assert!((signed_area(&hole) + signed_area(&outline(disc))).abs() < 1e-6);
        let shared = ring.inner[0].coedges[0].edge;
        assert!(disc.outer.coedges.iter().any(|c| c.edge == shared));
        assert_eq!(model.edges[shared.0].kind, EdgeKind::Step);
        assert!(model.vertices.len() <= 4, "{}", model.vertices.len());
    }
}

#[test]
fn a_cylinder_seen_from_above_has_two_smooth_faces() {
    // Upright cylinder of radius 30 seen 35 degrees from above.
    let tilt = 35.0_f64.to_radians();
    let (radius, height) = (30.0, 60.0);
    let (sin, cos) = libm::sincos(tilt);
    let ellipse: Vec<Point> = circle([0.0, 0.0], radius)
        .iter()
        .map(|p| [p[0], p[1] * sin + height / 2.0 * cos])
        .collect();
    let mut side: Vec<Point> = Vec::new();
    for k in 0..=360 {
        let angle = core::f64::consts::PI * (1.0 + f64::from(k) / 360.0);
        let at = [
            radius * libm::cos(angle),
            radius * libm::sin(angle) * sin - height / 2.0 * cos,
        ];
        side.push(at);
    }
    for k in (0..=360).rev() {
        let angle = core::f64::consts::PI * (1.0 + f64::from(k) / 360.0);
        side.push([
            radius * libm::cos(angle),
            radius * libm::sin(angle) * sin + height / 2.0 * cos,
        ]);
    }
    let mantle = move |x: f64, y: f64| {
        let depth = (radius * radius - x * x).max(0.0).sqrt();
        (depth - y * sin) / cos
    };
    let top = move |_: f64, y: f64| {
        // The lid's plane: y = h/2 cos - d sin, z = h/2 sin + d cos.
        let d = (height / 2.0 * cos - y) / sin;
        height / 2.0 * sin + d * cos
    };
    let parts = [Part::new(&ellipse, top), Part::new(&side, mantle)];
    let (image, map) = scene(&parts, 0.45, (240, 256), 0.05);
    let done = run(&image, &map, Method::Relief);
    assert_eq!(done.model.faces.len(), 2);
    println!(
        "{} vertices, {:?}, {:?}",
        done.model.vertices.len(),
        done.metrics,
        done.regions
    );
    assert!(
        done.model.vertices.len() <= 8,
        "{}",
        done.model.vertices.len()
    );
    for face in &done.model.faces {
        let part = part_of(face, &parts, &image, &map);
        // The mantle tapers to nothing beside the lid, thinner than a node over the last
        // five pitches: there the truth reaches farther than any grid can show.
        let drawn = outline(face);
        let (beyond, short) = (
            one_way(&drawn, &part.outline) / 0.45,
            one_way(&part.outline, &drawn) / 0.45,
        );
        println!(
            "{}: {beyond} and {short} pitches, {:?}",
            face.name, done.warnings
        );
        assert!(beyond < 0.9 && short < 6.0, "{beyond} {short}");
        let ratio = signed_area(&drawn) / signed_area(&part.outline);
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    }
    assert!(done.metrics.snr_db > 25.0);
}

#[test]
fn ragged_labels_keep_the_house_plain() {
    // Each node is classified where it is displaced to, by a third of a pitch in each
    // direction: what noise does to segmentation along outlines and creases.
    for k in 1..4 {
        let (parts, pitch) = (house(0.17 * f64::from(k)), 0.45);
        let (image, map) = common::ragged_scene(&parts, pitch, (264, 256), 0.05, 0.33 * pitch);
        let done = run(&image, &map, Method::Relief);
        assert_eq!(done.model.faces.len(), 4);
        let found = done.model.vertices.len();
        println!("{found} vertices, {:?}, {:?}", done.metrics, done.warnings);
        assert!(found <= corners(&parts) + 4, "{found}");
        for face in &done.model.faces {
            let part = part_of(face, &parts, &image, &map);
            let off = hausdorff(&outline(face), &part.outline) / pitch;
            println!("  {off}");
            assert!(off < 0.5, "{off}");
        }
    }
}
