//! Bodies that close around a part, whatever their faces' parameters do.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use core::f64::consts::{PI, TAU};
use std::collections::BTreeMap;

use solids::{
    Body, Curve, Edge, EdgeUse, Face, FacetSettings, Facets, Frame, Point, Surface, facets,
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
    let few = FacetSettings {
        most: 10,
        ..settings
    };
    let told = facets(&drum(false), &few).unwrap_err().to_string();
    assert!(told.contains("more than 10 triangles"), "{told}");
}
