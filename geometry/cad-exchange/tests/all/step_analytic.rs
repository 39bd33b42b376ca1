//! Cylinders, cones, spheres and tori are written by their numbers.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::step::{self, LengthUnit, StepFace, StepFrame, StepSurface, WriteOptions};
use nalgebra::Vector3;
use shapes::{Cone, Cylinder, Shape, Sphere, Torus};

/// A rectangle of a shape, `off_mm` before it, as it is read back, and the uncertainty told.
fn written(shape: Shape, y_mm: [f64; 2], off_mm: f64, unit: LengthUnit) -> (StepFace, f64) {
    let near_mm = if is_hollow(&shape) { -20.0 } else { 20.0 };
    let z_mm = |x, y| shape.z_mm(x, y, near_mm).expect("the shape is seen there") + off_mm;
    let model = sample::rectangle([-3.0, 5.0], y_mm, shape, z_mm);
    let options = WriteOptions {
        unit,
        ..WriteOptions::new("part", "2026-11-21T09:30:00")
    };
    let mut file = Vec::new();
    step::write(&model, &options, &mut file).unwrap();
    let read = step::read_model(&file[..]).unwrap();
    let points = read.edges.iter().flat_map(|edge| edge.curve.points());
    let frame = match read.faces[0].surface {
        StepSurface::Cylinder { frame, .. }
        | StepSurface::Cone { frame, .. }
        | StepSurface::Sphere { frame, .. }
        | StepSurface::Torus { frame, .. } => frame,
        _ => return (read.faces[0].clone(), read.uncertainty_mm),
    };
    let [origin, axis, x] = [frame.origin_mm, frame.axis, frame.x].map(Vector3::from);
    assert!((axis.norm() - 1.0).abs() < 1e-12 && (x.norm() - 1.0).abs() < 1e-12);
    assert!(axis.dot(&x).abs() < 1e-12);
    for edge in &read.edges {
        let (first, last) = edge.curve.knots().domain();
        for k in 0..=50 {
            let at = edge
                .curve
                .evaluate(first + (last - first) * f64::from(k) / 50.0);
            let off_mm = shape.distance_mm(&Vector3::from(at));
            assert!(off_mm.abs() <= read.uncertainty_mm, "{off_mm}");
        }
    }
    for point in points {
        // Nothing of the face lies where angles begin anew.
        let from = Vector3::from(*point) - origin;
        let out = from - axis * from.dot(&axis);
        assert!(out.normalize().dot(&x) < 0.5, "{point:?}");
    }
    (read.faces[0].clone(), read.uncertainty_mm)
}

fn is_hollow(shape: &Shape) -> bool {
    match shape {
        Shape::Plane(_) => false,
        Shape::Sphere(s) => s.is_hollow,
        Shape::Cylinder(s) => s.is_hollow,
        Shape::Cone(s) => s.is_hollow,
        Shape::Torus(s) => s.is_hollow,
    }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

fn is_at(frame: &StepFrame, origin_mm: &Vector3<f64>, axis: &Vector3<f64>) -> bool {
    let off = Vector3::from(frame.origin_mm) - origin_mm;
    near(off.norm(), 0.0) && near((Vector3::from(frame.axis) - axis).norm(), 0.0)
}

const Y_MM: [f64; 2] = [-4.0, 4.0];

#[test]
fn a_cylinder() {
    for (is_hollow, unit) in [(false, LengthUnit::Millimetre), (true, LengthUnit::Inch)] {
        let axis = Vector3::new(0.2, 1.0, 0.1).normalize();
        let point_mm = Vector3::new(1.0, 0.0, 0.5);
        let shape = Shape::Cylinder(Cylinder {
            point_mm,
            axis,
            radius_mm: 12.0,
            is_hollow,
        });
        let (face, uncertainty_mm) = written(shape, Y_MM, 0.0, unit);
        let StepSurface::Cylinder { frame, radius_mm } = &face.surface else {
            panic!("{:?}", face.surface);
        };
        assert!(is_at(frame, &point_mm, &axis) && near(*radius_mm, 12.0));
        // The face looks to +z, and the surface away from its axis.
        assert_eq!(face.same_sense, !is_hollow);
        assert!(uncertainty_mm < 1e-3, "{uncertainty_mm}");
    }
}

#[test]
fn a_cone() {
    for is_hollow in [false, true] {
        let axis = Vector3::new(0.1, 1.0, -0.2).normalize();
        let apex_mm = Vector3::new(0.5, -30.0, 0.0);
        let shape = Shape::Cone(Cone {
            apex_mm,
            axis,
            half_angle_rad: 0.4,
            is_hollow,
        });
        let (face, _) = written(shape, Y_MM, 0.0, LengthUnit::Inch);
        let StepSurface::Cone {
            frame,
            radius_mm,
            half_angle_rad,
        } = &face.surface
        else {
            panic!("{:?}", face.surface);
        };
        let up_mm = (Vector3::from(frame.origin_mm) - apex_mm).dot(&axis);
        assert!(is_at(frame, &(apex_mm + axis * up_mm), &axis) && up_mm > 0.0);
        assert!(near(*radius_mm, up_mm * libm::tan(0.4)) && near(*half_angle_rad, 0.4));
        assert_eq!(face.same_sense, !is_hollow);
    }
}

#[test]
fn a_sphere() {
    for is_hollow in [false, true] {
        let centre_mm = Vector3::new(1.0, 2.0, -3.0);
        let shape = Shape::Sphere(Sphere {
            centre_mm,
            radius_mm: 15.0,
            is_hollow,
        });
        let (face, _) = written(shape, Y_MM, 0.0, LengthUnit::Millimetre);
        let StepSurface::Sphere { frame, radius_mm } = &face.surface else {
            panic!("{:?}", face.surface);
        };
        let axis = Vector3::from(frame.axis);
        assert!(is_at(frame, &centre_mm, &axis) && near(*radius_mm, 15.0));
        assert_eq!(face.same_sense, !is_hollow);
    }
}

#[test]
fn a_torus_also_across_the_seam_of_its_tube() {
    let torus = |axis: Vector3<f64>, centre_mm| {
        let shape = Torus {
            centre_mm,
            axis,
            radius_mm: 25.0,
            tube_mm: 8.0,
            is_hollow: false,
        };
        Shape::Torus(shape)
    };
    // Lying flat, seen from above: the seam is the outermost circle.
    let centre_mm = Vector3::new(-24.0, 0.0, 1.0);
    let (face, _) = written(
        torus(Vector3::z(), centre_mm),
        Y_MM,
        0.0,
        LengthUnit::Millimetre,
    );
    let StepSurface::Torus {
        frame,
        radius_mm,
        tube_mm,
    } = &face.surface
    else {
        panic!("{:?}", face.surface);
    };
    assert!(is_at(frame, &centre_mm, &Vector3::z()));
    assert!(near(*radius_mm, 25.0) && near(*tube_mm, 8.0) && face.same_sense);
    // Standing, its outermost circle is amid the face.
    let standing = torus(Vector3::x(), Vector3::new(1.0, 0.0, -30.0));
    let (face, _) = written(standing, Y_MM, 0.0, LengthUnit::Millimetre);
    assert!(matches!(face.surface, StepSurface::Torus { .. }));
}

/// Its underside, which no camera sees: so edges lie that were put there from far away.
#[test]
fn a_face_with_edges_on_the_back_of_its_shape_stays_a_spline() {
    let sphere = Shape::Sphere(Sphere {
        centre_mm: Vector3::new(1.0, 0.0, 15.0),
        radius_mm: 15.0,
        is_hollow: false,
    });
    let under = |x: f64, y: f64| 15.0 - (225.0 - (x - 1.0) * (x - 1.0) - y * y).sqrt();
    let model = sample::rectangle([-3.0, 5.0], [-4.0, 4.0], sphere, under);
    let mut file = Vec::new();
    let options = WriteOptions::new("part", "2026-11-21T09:30:00");
    step::write(&model, &options, &mut file).unwrap();
    let read = step::read_model(&file[..]).unwrap();
    assert!(matches!(read.faces[0].surface, StepSurface::BSpline(_)));
}

/// They are cut open from one loop to the other.
#[test]
fn rings_are_written_by_their_numbers() {
    for name in [
        "ring-cone",
        "hollow-ring-cone",
        "ring-torus",
        "hollow-ring-torus",
    ] {
        let model = sample::of_shape(name).unwrap();
        let options = WriteOptions::new("part", "2026-11-21T09:30:00");
        let mut file = Vec::new();
        let summary = step::write(&model, &options, &mut file).unwrap();
        assert!(summary.uncertainty_mm < 1e-3, "{name}: {summary:?}");
        let read = step::read_model(&file[..]).unwrap();
        let face = &read.faces[0];
        let is_it = match face.surface {
            StepSurface::Cone { .. } => name.ends_with("cone"),
            StepSurface::Torus { .. } => name.ends_with("torus"),
            _ => false,
        };
        assert!(is_it, "{name}: {:?}", face.surface);
        assert_eq!(face.same_sense, !name.starts_with("hollow"));
        // One loop: the outer circle, the seam, the inner circle, and back. Where that has no vertex
        // opposite to the outer one's, it gets one.
        let parts = if name.ends_with("torus") { 2 } else { 1 };
        let uses: Vec<_> = face
            .outer
            .iter()
            .map(|of| (of.edge, !of.reversed))
            .collect();
        assert!(face.inner.is_empty() && uses.len() == 3 + parts, "{uses:?}");
        let (there, back) = (uses[1], uses[2 + parts]);
        assert_eq!((there, back), ((there.0, true), (there.0, false)));
        assert_eq!(summary.edges, 2 + parts);
    }
}

#[test]
fn a_face_with_the_apex_of_its_cone_stays_a_spline() {
    let apex_mm = Vector3::new(1.0, 0.5, 4.0);
    let hill = Shape::Cone(Cone {
        apex_mm,
        axis: -Vector3::z(),
        half_angle_rad: 1.2,
        is_hollow: false,
    });
    let slope = 1.0 / libm::tan(1.2);
    let model = sample::rectangle([-3.0, 5.0], Y_MM, hill, |x, y| {
        4.0 - slope * libm::hypot(x - 1.0, y - 0.5)
    });
    let mut file = Vec::new();
    let options = WriteOptions::new("part", "2026-11-21T09:30:00");
    step::write(&model, &options, &mut file).unwrap();
    let read = step::read_model(&file[..]).unwrap();
    assert!(matches!(read.faces[0].surface, StepSurface::BSpline(_)));
}

#[test]
fn edges_are_put_on_the_surface_unless_they_are_too_far_off() {
    let sphere = Shape::Sphere(Sphere {
        centre_mm: Vector3::new(1.0, 2.0, -3.0),
        radius_mm: 15.0,
        is_hollow: false,
    });
    let (face, uncertainty_mm) = written(sphere, Y_MM, 0.02, LengthUnit::Millimetre);
    assert!(matches!(face.surface, StepSurface::Sphere { .. }));
    assert!(uncertainty_mm < 2e-4, "{uncertainty_mm}");
    let (face, uncertainty_mm) = written(sphere, Y_MM, 0.9, LengthUnit::Millimetre);
    assert!(matches!(face.surface, StepSurface::Sphere { .. }));
    assert!(uncertainty_mm < 2e-4, "{uncertainty_mm}");
    let (face, _) = written(sphere, Y_MM, 1.3, LengthUnit::Millimetre);
    assert!(matches!(face.surface, StepSurface::BSpline(_)));
}
