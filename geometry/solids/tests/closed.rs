//! Bodies that close around a part, whatever their faces' parameters do.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use core::f64::consts::{PI, TAU};
use std::collections::BTreeMap;

use solids::{
    Body, Curve, Edge, EdgeUse, Face, FacetSettings, Facets, Frame, Knots, Point, SplineCurve,
    Surface, facets,
};

const TOLERANCE_MM: f64 = 0.002;

fn frame() -> Frame {
    Frame::new(
        Point::new(3.0, -2.0, 7.0),
        &Point::new(0.2, 0.5, 0.8),
        &Point::x(),
    )
    .unwrap()
}

/// A point by its coordinates along the axes of the frame.
fn at(x: f64, y: f64, z: f64) -> Point {
    let frame = frame();
    frame.origin_mm + frame.x * x + frame.y * y + frame.z * z
}

fn lifted(z: f64) -> Frame {
    Frame {
        origin_mm: at(0.0, 0.0, z),
        ..frame()
    }
}

fn circle(z: f64, radius_mm: f64) -> Curve {
    Curve::Ellipse {
        frame: lifted(z),
        radii_mm: [radius_mm; 2],
    }
}

fn line(from: Point, to: Point) -> Curve {
    Curve::Line {
        point_mm: from,
        along: (to - from).normalize(),
    }
}

fn edge(vertices: [usize; 2], curve: Curve) -> Edge {
    Edge {
        vertices,
        curve,
        same_sense: true,
    }
}

fn ahead(edge: usize) -> EdgeUse {
    EdgeUse {
        edge,
        is_reversed: false,
    }
}

fn back(edge: usize) -> EdgeUse {
    EdgeUse {
        edge,
        is_reversed: true,
    }
}

fn face(surface: Surface, same_sense: bool, loops: Vec<Vec<EdgeUse>>) -> Face {
    Face {
        name: "face".into(),
        surface,
        same_sense,
        loops,
    }
}

fn made(body: &Body) -> Facets {
    facets(
        body,
        &FacetSettings {
            tolerance_mm: TOLERANCE_MM,
            most: 1_000_000,
        },
    )
    .unwrap()
}

/// Area and volume; every side of a triangle must be that of another, run back.
fn measured(facets: &Facets) -> (f64, f64) {
    let mut sides: BTreeMap<[usize; 2], i32> = BTreeMap::new();
    let (mut area, mut volume) = (0.0, 0.0);
    for t in &facets.triangles {
        let [a, b, c] = t.map(|k| facets.points_mm[k]);
        area += (b - a).cross(&(c - a)).norm() / 2.0;
        volume += a.dot(&b.cross(&c)) / 6.0;
        for k in 0..3 {
            let (from, to) = (t[k], t[(k + 1) % 3]);
            *sides.entry([from.min(to), from.max(to)]).or_insert(0) +=
                if from < to { 1 } else { -1 };
        }
    }
    let open = sides.values().filter(|net| **net != 0).count();
    assert_eq!(open, 0, "sides of one triangle");
    (area, volume)
}

fn near(found: f64, expected: f64) -> bool {
    (found / expected - 1.0).abs() < 2e-3
}

/// A cylinder of radius 5 and height 8 between two planes; with a seam or without.
fn drum(has_seam: bool) -> Body {
    let (low, high) = (at(5.0, 0.0, 0.0), at(5.0, 0.0, 8.0));
    let mut edges = vec![
        edge([0, 0], circle(0.0, 5.0)),
        edge([1, 1], circle(8.0, 5.0)),
    ];
    let around = if has_seam {
        edges.push(edge([0, 1], line(low, high)));
        vec![vec![ahead(0), ahead(2), back(1), back(2)]]
    } else {
        vec![vec![ahead(0)], vec![back(1)]]
    };
    Body {
        vertices_mm: vec![low, high],
        edges,
        faces: vec![
            face(
                Surface::Cylinder {
                    frame: frame(),
                    radius_mm: 5.0,
                },
                true,
                around,
            ),
            face(Surface::Plane(frame()), false, vec![vec![back(0)]]),
            face(Surface::Plane(lifted(8.0)), true, vec![vec![ahead(1)]]),
        ],
    }
}

#[test]
fn a_cylinder_closes_with_a_seam_and_without() {
    for has_seam in [true, false] {
        let (area, volume) = measured(&made(&drum(has_seam)));
        assert!(near(volume, PI * 25.0 * 8.0), "{volume}");
        assert!(near(area, PI * 50.0 + TAU * 5.0 * 8.0), "{area}");
    }
}

#[test]
fn what_is_inside_out_is_turned_by_its_senses() {
    let mut body = drum(true);
    for face in &mut body.faces {
        face.same_sense = !face.same_sense;
        for border in &mut face.loops {
            border.reverse();
            border
                .iter_mut()
                .for_each(|use_| use_.is_reversed = !use_.is_reversed);
        }
    }
    let (_, volume) = measured(&made(&body));
    assert!(near(volume, -PI * 25.0 * 8.0), "{volume}");
}

#[test]
fn a_face_that_runs_the_wrong_way_round_is_turned_by_its_neighbours() {
    for wrong in [0, 1] {
        let mut body = drum(true);
        for border in &mut body.faces[wrong].loops {
            border.reverse();
            border
                .iter_mut()
                .for_each(|use_| use_.is_reversed = !use_.is_reversed);
        }
        if wrong == 1 {
            body.faces[wrong].same_sense = true;
        }
        let (_, volume) = measured(&made(&body));
        assert!(near(volume, PI * 25.0 * 8.0), "{wrong}: {volume}");
    }
}

/// A face between two circles around an axis, each of which begins at an angle of its own.
fn ring(surface: Surface, circles: [Curve; 2], tolerance_mm: f64) -> Facets {
    let body = Body {
        vertices_mm: vec![circles[0].at(0.0).0, circles[1].at(1.0).0],
        edges: vec![
            edge([0, 0], circles[0].clone()),
            edge([1, 1], circles[1].clone()),
        ],
        faces: vec![face(surface, true, vec![vec![ahead(0)], vec![back(1)]])],
    };
    let settings = FacetSettings {
        tolerance_mm,
        most: 1_000_000,
    };
    facets(&body, &settings).unwrap()
}

fn area(facets: &Facets) -> f64 {
    let area = |t: &[usize; 3]| {
        let [a, b, c] = t.map(|k| facets.points_mm[k]);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    facets.triangles.iter().map(area).sum()
}

/// Sides of triangles that are those of one alone, and their length.
fn rim(facets: &Facets) -> f64 {
    let mut sides: BTreeMap<[usize; 2], i32> = BTreeMap::new();
    for t in &facets.triangles {
        for k in 0..3 {
            let (from, to) = (t[k], t[(k + 1) % 3]);
            let way = if from < to { 1 } else { -1 };
            *sides.entry([from.min(to), from.max(to)]).or_insert(0) += way;
        }
    }
    let open = sides.iter().filter(|(_, net)| **net != 0);
    open.map(|([a, b], _)| (facets.points_mm[*a] - facets.points_mm[*b]).norm())
        .sum()
}

#[test]
fn a_cut_meets_every_loop_in_a_point_of_its_own() {
    let cylinder = Surface::Cylinder {
        frame: frame(),
        radius_mm: 5.0,
    };
    let facets = ring(cylinder, [circle(0.0, 5.0), circle(8.0, 5.0)], TOLERANCE_MM);
    assert!(near(area(&facets), TAU * 5.0 * 8.0), "{}", area(&facets));
    assert!(near(rim(&facets), 2.0 * TAU * 5.0), "{}", rim(&facets));
}

#[test]
fn a_chord_of_more_than_half_a_period_goes_the_way_its_edge_goes() {
    // A triangle, one side of which takes three fifths of the parameter, pushed along the axis.
    let triangle = |z: f64| {
        let corners = [[0.0, 0.0], [9.0, 0.0], [0.0, 5.0], [0.0, 0.0]];
        let points = corners.map(|[x, y]| at(x, y, z));
        let values = vec![0.0, 0.0, 0.6, 0.8, 1.0, 1.0];
        let knots = Knots { degree: 1, values };
        Curve::Spline(SplineCurve::new(&knots, &points, &[1.0; 4]).unwrap())
    };
    let ends = [at(0.0, 0.0, 0.0), at(0.0, 0.0, 8.0)];
    let prism = Surface::Swept {
        curve: triangle(0.0),
        along: frame().z,
    };
    let body = Body {
        vertices_mm: ends.to_vec(),
        edges: vec![edge([0, 0], triangle(0.0)), edge([1, 1], triangle(8.0))],
        faces: vec![
            face(prism, true, vec![vec![ahead(0)], vec![back(1)]]),
            face(Surface::Plane(frame()), false, vec![vec![back(0)]]),
            face(Surface::Plane(lifted(8.0)), true, vec![vec![ahead(1)]]),
        ],
    };
    let facets = made(&body);
    let (_, volume) = measured(&facets);
    assert!((volume - 180.0).abs() < 1e-6, "{volume}");
    assert!(facets.triangles.len() < 100, "{}", facets.triangles.len());
}

#[test]
fn a_ring_narrower_than_its_chords_rise_is_filled() {
    let plane = Surface::Plane(frame());
    let facets = ring(plane, [circle(0.0, 5.003), circle(0.0, 5.0)], 0.02);
    let found = area(&facets);
    assert!(
        (found / (PI * (5.003 * 5.003 - 25.0)) - 1.0).abs() < 0.1,
        "{found}"
    );
}

/// What a plane beside the pole leaves of a sphere: of a loop the angle turns by half a circle within
/// a hair's breadth.
#[test]
fn a_loop_beside_a_pole_is_followed_around_it() {
    for beside_mm in [0.01, -0.01, 0.0005, -0.0005] {
        let (radius_mm, off_mm) = (6.0_f64, 5.0);
        let rim_mm = (radius_mm * radius_mm - off_mm * off_mm).sqrt();
        // The normal of the plane, so that the pole is so far from the loop.
        let angle = libm::asin(rim_mm / radius_mm) + beside_mm / radius_mm;
        let normal = frame().z * libm::cos(angle) + frame().x * libm::sin(angle);
        // No chord begins beside the pole.
        let aside = frame().y + frame().x * 0.03;
        let around = Frame::new(frame().origin_mm + normal * off_mm, &normal, &aside).unwrap();
        let curve = Curve::Ellipse {
            frame: around,
            radii_mm: [rim_mm; 2],
        };
        let body = Body {
            vertices_mm: vec![curve.at(0.0).0],
            edges: vec![edge([0, 0], curve)],
            faces: vec![
                face(
                    Surface::Sphere {
                        frame: frame(),
                        radius_mm,
                    },
                    true,
                    vec![vec![ahead(0)]],
                ),
                face(Surface::Plane(around), false, vec![vec![back(0)]]),
            ],
        };
        let (area, volume) = measured(&made(&body));
        let height_mm = radius_mm - off_mm;
        assert!(
            near(area, TAU * radius_mm * height_mm + PI * rim_mm * rim_mm),
            "{area}"
        );
        let cap = PI * height_mm * height_mm * (radius_mm - height_mm / 3.0);
        assert!(near(volume, cap), "{beside_mm}: {volume}");
    }
}

/// Numbers of files are rounded, so that a corner at a pole is not quite there.
#[test]
fn an_eighth_of_a_sphere_closes_though_its_corner_at_the_pole_is_rounded() {
    let rounded = |p: Point| p.map(|c| (c * 1e9).round() / 1e9);
    let (o, r) = (at(0.0, 0.0, 0.0), 6.0);
    let ends = [at(r, 0.0, 0.0), at(0.0, r, 0.0), at(0.0, 0.0, r)].map(rounded);
    let axes = [frame().x, frame().y, frame().z];
    let arc = |k: usize| {
        let frame = Frame::new(o, &axes[(k + 2) % 3], &axes[k]).unwrap();
        edge(
            [k, (k + 1) % 3],
            Curve::Ellipse {
                frame,
                radii_mm: [r; 2],
            },
        )
    };
    let mut edges: Vec<Edge> = (0..3).map(arc).collect();
    edges.extend((0..3).map(|k| edge([3, k], line(o, ends[k]))));
    let quarter = |k: usize| {
        let frame = Frame::new(o, &axes[(k + 2) % 3], &axes[k]).unwrap();
        let border = vec![ahead(3 + (k + 1) % 3), back(k), back(3 + k)];
        face(Surface::Plane(frame), false, vec![border])
    };
    let sphere = Surface::Sphere {
        frame: frame(),
        radius_mm: r,
    };
    let mut faces = vec![face(sphere, true, vec![vec![ahead(0), ahead(1), ahead(2)]])];
    faces.extend((0..3).map(quarter));
    let body = Body {
        vertices_mm: ends.into_iter().chain([o]).collect(),
        edges,
        faces,
    };
    let (_, volume) = measured(&made(&body));
    assert!(near(volume, PI / 6.0 * 216.0), "{volume}");
}

#[test]
fn whole_spheres_and_tori_need_no_loop() {
    let sphere = Surface::Sphere {
        frame: frame(),
        radius_mm: 6.0,
    };
    let torus = Surface::Torus {
        frame: frame(),
        radius_mm: 9.0,
        tube_mm: 2.0,
    };
    let whole = |surface| Body {
        faces: vec![face(surface, true, vec![])],
        ..Body::default()
    };
    let (area, volume) = measured(&made(&whole(sphere)));
    assert!(near(area, 4.0 * PI * 36.0), "{area}");
    assert!(near(volume, 4.0 / 3.0 * PI * 216.0), "{volume}");
    let (area, volume) = measured(&made(&whole(torus)));
    assert!(near(area, 4.0 * PI * PI * 18.0), "{area}");
    assert!(near(volume, TAU * PI * 9.0 * 4.0), "{volume}");
}

#[test]
fn a_cap_has_its_pole_and_a_cone_its_tip() {
    // A half sphere on a cone that stands on its tip.
    let rim = at(4.0, 0.0, 0.0);
    let body = Body {
        vertices_mm: vec![rim],
        edges: vec![edge([0, 0], circle(0.0, 4.0))],
        faces: vec![
            face(
                Surface::Sphere {
                    frame: frame(),
                    radius_mm: 4.0,
                },
                true,
                vec![vec![ahead(0)]],
            ),
            face(
                Surface::Cone {
                    frame: frame(),
                    radius_mm: 4.0,
                    slope: 0.5,
                },
                true,
                vec![vec![back(0)]],
            ),
        ],
    };
    let (area, volume) = measured(&made(&body));
    let slant = (16.0_f64 + 64.0).sqrt();
    assert!(near(area, TAU * 16.0 + PI * 4.0 * slant), "{area}");
    assert!(
        near(volume, TAU / 3.0 * 64.0 + PI * 16.0 * 8.0 / 3.0),
        "{volume}"
    );
}

#[test]
fn triangles_stay_as_near_as_asked() {
    let sphere = Surface::Sphere {
        frame: frame(),
        radius_mm: 6.0,
    };
    let body = Body {
        faces: vec![face(sphere, true, vec![])],
        ..Body::default()
    };
    let facets = made(&body);
    for t in &facets.triangles {
        let [a, b, c] = t.map(|k| facets.points_mm[k] - frame().origin_mm);
        for [p, q, r] in [
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
        ] {
            let inside = (a * p + b * q + c * r) / (p + q + r);
            let off_mm = 6.0 - inside.norm();
            assert!((-1e-9..1.01 * TOLERANCE_MM).contains(&off_mm), "{off_mm}");
        }
    }
}

#[test]
fn what_is_wrong_names_the_face() {
    let mut body = drum(true);
    body.faces[2].name = "lid".into();
    body.faces[2].surface = Surface::Plane(lifted(9.0));
    let settings = FacetSettings {
        tolerance_mm: TOLERANCE_MM,
        most: 1_000_000,
    };
    let told = facets(&body, &settings).unwrap_err().to_string();
    assert!(
        told.starts_with("lid: an edge leaves the surface by 1.0000 mm near"),
        "{told}"
    );
    let mut body = drum(true);
    body.faces[1].loops[0].clear();
    let told = facets(&body, &settings).unwrap_err().to_string();
    assert!(told.contains("its loops enclose nothing"), "{told}");
    // Of a limit the first face takes a part.
    let few = FacetSettings {
        most: 300,
        ..settings
    };
    let told = facets(&drum(false), &few).unwrap_err().to_string();
    assert!(told.contains("more than 300 triangles"), "{told}");
}
