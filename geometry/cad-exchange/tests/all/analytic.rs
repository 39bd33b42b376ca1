//! IGES: planes, cylinders, cones, spheres and tori by their numbers, on shared edges.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::iges::{
    self, AnalyticSurface, Entities, TrimmedCurve, TrimmedModel, TrimmedSurface, WriteOptions,
};
use nalgebra::Vector3;
use reconstruct::Model;
use shapes::{Cone, Cylinder, Shape, Sphere, Torus};

fn round_trip(model: &Model) -> TrimmedModel {
    let options = WriteOptions {
        entities: Entities::Analytic,
        ..WriteOptions::new("part", "20261121.093000")
    };
    let mut file = Vec::new();
    let summary = iges::write(model, &options, &mut file).unwrap();
    let read = iges::read_model(&file[..]).unwrap();
    assert_eq!(read.resolution_mm, summary.resolution_mm);
    read
}

/// What a rectangle of a shape is written as.
fn surface(shape: Shape) -> AnalyticSurface {
    let model = sample::rectangle([-3.0, 5.0], [-4.0, 4.0], shape, |x, y| {
        shape.z_mm(x, y, 20.0).expect("the shape is seen there")
    });
    let read = round_trip(&model);
    for curve in &read.faces[0].outer {
        assert_eq!(curve.parameter_curve, None);
        let (first, last) = curve.space_curve.domain();
        for k in 0..=50 {
            let at = first + (last - first) * f64::from(k) / 50.0;
            let off_mm = shape.distance_mm(&curve.space_curve.evaluate(at).into());
            assert!(off_mm.abs() <= read.resolution_mm, "{off_mm}");
        }
    }
    match &read.faces[0].surface {
        TrimmedSurface::Analytic(surface) => surface.clone(),
        other => panic!("{other:?}"),
    }
}

fn near(a: [f64; 3], b: Vector3<f64>) -> bool {
    (Vector3::from(a) - b).norm() < 1e-9
}

#[test]
fn shapes_keep_their_numbers() {
    let axis = Vector3::new(0.2, 1.0, 0.1).normalize();
    let point_mm = Vector3::new(1.0, 0.0, 0.5);
    let cylinder = Shape::Cylinder(Cylinder {
        point_mm,
        axis,
        radius_mm: 12.0,
        is_hollow: false,
    });
    let AnalyticSurface::Cylinder { frame, radius_mm } = surface(cylinder) else {
        panic!("no cylinder");
    };
    assert!(near(frame.origin_mm, point_mm) && near(frame.axis, axis));
    assert!((radius_mm - 12.0).abs() < 1e-9);
    // The seam is behind.
    assert!(frame.reference[2] < -0.9, "{frame:?}");

    let apex_mm = Vector3::new(0.5, -30.0, 0.0);
    let cone = Shape::Cone(Cone {
        apex_mm,
        axis,
        half_angle_rad: 0.4,
        is_hollow: false,
    });
    let AnalyticSurface::Cone {
        frame,
        radius_mm,
        half_angle_rad,
    } = surface(cone)
    else {
        panic!("no cone");
    };
    let up_mm = (Vector3::from(frame.origin_mm) - apex_mm).dot(&axis);
    assert!((radius_mm - up_mm * libm::tan(0.4)).abs() < 1e-9);
    assert!((half_angle_rad - 0.4).abs() < 1e-12);

    let centre_mm = Vector3::new(1.0, 2.0, -3.0);
    let sphere = Shape::Sphere(Sphere {
        centre_mm,
        radius_mm: 15.0,
        is_hollow: false,
    });
    let AnalyticSurface::Sphere { frame, radius_mm } = surface(sphere) else {
        panic!("no sphere");
    };
    assert!(near(frame.origin_mm, centre_mm) && (radius_mm - 15.0).abs() < 1e-9);

    let centre_mm = Vector3::new(-24.0, 0.0, 1.0);
    let torus = Shape::Torus(Torus {
        centre_mm,
        axis: Vector3::z(),
        radius_mm: 25.0,
        tube_mm: 8.0,
        is_hollow: false,
    });
    let AnalyticSurface::Torus {
        frame,
        radius_mm,
        tube_mm,
    } = surface(torus)
    else {
        panic!("no torus");
    };
    assert!(near(frame.origin_mm, centre_mm) && near(frame.axis, Vector3::z()));
    assert!((radius_mm - 25.0).abs() < 1e-9 && (tube_mm - 8.0).abs() < 1e-9);
}

/// The outer loop is counter-clockwise as the surface's own normal, outwards, sees it: as the camera
/// does from outside, the other way round from within.
#[test]
fn loops_run_as_their_surfaces_see_them() {
    for family in ["cylinder", "cone", "sphere", "torus"] {
        for (prefix, sense) in [("", 1.0), ("hollow-", -1.0)] {
            let name = format!("{prefix}{family}");
            let read = round_trip(&sample::of_shape(&name).unwrap());
            let mut twice = 0.0;
            for curve in &read.faces[0].outer {
                let (first, last) = curve.space_curve.domain();
                let at = |k: i32| first + (last - first) * f64::from(k) / 50.0;
                for k in 0..50 {
                    let [p, q] = [at(k), at(k + 1)].map(|t| curve.space_curve.evaluate(t));
                    twice += p[0] * q[1] - q[0] * p[1];
                }
            }
            // 8 mm by 8 mm.
            assert!((twice / 2.0 - 64.0 * sense).abs() < 0.1, "{name}: {twice}");
        }
    }
}

/// The barrel is free-form, the ramp a plane; their crease is one curve.
#[test]
fn neighbours_have_one_curve() {
    let read = round_trip(&sample::model());
    let TrimmedSurface::Analytic(AnalyticSurface::Plane { frame }) = &read.faces[1].surface else {
        panic!("{:?}", read.faces[1].surface);
    };
    let length = 1.25_f64.sqrt();
    assert!(near(frame.axis, Vector3::new(0.5, 0.0, 1.0) / length));
    assert!(matches!(read.faces[0].surface, TrimmedSurface::BSpline(_)));
    // On the B-spline x and y are the parameters.
    for curve in read.faces[0].outer.iter().chain(&read.faces[0].inner[0]) {
        let flat = curve.parameter_curve.as_ref().unwrap();
        let (first, last) = flat.domain();
        for k in 0..=20 {
            let at = first + (last - first) * f64::from(k) / 20.0;
            let ([u, v], [x, y, _]) = (flat.evaluate(at), curve.space_curve.evaluate(at));
            assert!((u - x).abs() < 1e-9 && (v - y).abs() < 1e-9);
        }
    }
    let ends = |curve: &TrimmedCurve| {
        let (first, last) = curve.space_curve.domain();
        [first, (first + last) / 2.0, last].map(|at| curve.space_curve.evaluate(at))
    };
    let shared = read.faces[0].outer.iter().filter(|of| {
        let [a, middle, b] = ends(of);
        read.faces[1].outer.iter().any(|other| {
            let mut places = ends(other);
            places.reverse();
            let same = |p: &[f64; 3], q: &[f64; 3]| (0..3).all(|d| (p[d] - q[d]).abs() < 1e-9);
            [a, middle, b].iter().zip(&places).all(|(p, q)| same(p, q))
        })
    });
    assert_eq!(shared.count(), 1);
}
