//! IGES as boundary representation: shells of faces on edges and vertices that are listed once.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::iges::{
    self, Entities, Shell, TrimmedCurve, TrimmedFace, TrimmedModel, WriteOptions,
};
use reconstruct::Model;

fn file(model: &Model, entities: Entities) -> String {
    let options = WriteOptions {
        entities,
        ..WriteOptions::new("part", "20261121.093000")
    };
    let mut file = Vec::new();
    iges::write(model, &options, &mut file).unwrap();
    String::from_utf8(file).unwrap()
}

fn read(text: &str) -> TrimmedModel {
    iges::read_model(text.as_bytes()).unwrap()
}

/// Points of a curve at the same parts of its domain.
fn places(curve: &TrimmedCurve, backwards: bool) -> Vec<[f64; 3]> {
    let (first, last) = curve.space_curve.domain();
    let mut places: Vec<_> = (0..=20)
        .map(|k| {
            curve
                .space_curve
                .evaluate(first + (last - first) * f64::from(k) / 20.0)
        })
        .collect();
    if backwards {
        places.reverse();
    }
    places
}

fn borders(face: &TrimmedFace) -> impl Iterator<Item = &TrimmedCurve> {
    face.outer.iter().chain(face.inner.iter().flatten())
}

fn near(a: &[[f64; 3]], b: &[[f64; 3]], most: f64) -> bool {
    let off = |p: &[f64; 3], q: &[f64; 3]| (0..3).all(|d| (p[d] - q[d]).abs() <= most);
    a.len() == b.len() && a.iter().zip(b).all(|(p, q)| off(p, q))
}

/// How often entities of a type stand in the directory.
fn count(text: &str, entity: u16) -> usize {
    let lines = text.lines().filter(|line| line.as_bytes()[72] == b'D');
    let first = lines.step_by(2);
    first
        .filter(|line| line[..8].trim() == entity.to_string())
        .count()
}

/// Barrel and ramp meet in a crease.
#[test]
fn one_shell_lists_each_edge_once() {
    let text = file(&sample::model(), Entities::Boundary);
    let read = read(&text);
    let shell = Shell {
        faces: vec![0, 1],
        is_closed: false,
    };
    assert_eq!(read.shells, [shell]);
    assert_eq!(
        [502, 504, 510, 514].map(|entity| count(&text, entity)),
        [1, 1, 2, 1]
    );
    assert_eq!(
        [142, 144, 186].map(|entity| count(&text, entity)),
        [0, 0, 0]
    );
    // Eight edges in all, each a curve in space; five of them bound the barrel, a B-spline, each
    // with a curve in its parameter plane.
    let uses: Vec<usize> = read
        .faces
        .iter()
        .map(|face| borders(face).count())
        .collect();
    assert_eq!(uses, [5, 4]);
    assert_eq!(count(&text, 126), 8 + 5);
    let names: Vec<_> = read.faces.iter().map(|face| face.name.as_deref()).collect();
    assert_eq!(names, [Some("Barrel"), Some("Ramp")]);
    assert!(
        read.faces
            .iter()
            .all(|face| face.colour.is_some() && face.level > 0)
    );
    // To the last bit the same curve, run the other way.
    let shared = borders(&read.faces[0]).filter(|of| {
        borders(&read.faces[1]).any(|other| near(&places(of, false), &places(other, true), 1e-12))
    });
    assert_eq!(shared.count(), 1);
}

/// The same faces on the same curves as by numbers alone, from outside and from within.
#[test]
fn shells_are_what_trimmed_surfaces_are() {
    let mut models = vec![sample::model(), sample::model()];
    // The B-spline's use of the crease is then the second one, against its sense.
    models[1].faces.swap(0, 1);
    models.extend(
        [
            "cylinder",
            "hollow-cylinder",
            "hollow-cone",
            "sphere",
            "hollow-torus",
        ]
        .map(|name| sample::of_shape(name).unwrap()),
    );
    for model in &models {
        let [shells, trimmed] =
            [Entities::Boundary, Entities::Analytic].map(|entities| read(&file(model, entities)));
        assert!(trimmed.shells.is_empty());
        assert_eq!(shells.resolution_mm, trimmed.resolution_mm);
        for (face, other) in shells.faces.iter().zip(&trimmed.faces) {
            assert_eq!(face.surface, other.surface);
            assert_eq!(
                (face.name.as_ref(), face.colour),
                (other.name.as_ref(), other.colour)
            );
            assert_eq!(borders(face).count(), borders(other).count());
            for (curve, other) in borders(face).zip(borders(other)) {
                assert!(near(&places(curve, false), &places(other, false), 1e-9));
                let [flat, other] = [curve, other].map(|of| of.parameter_curve.as_ref());
                assert_eq!(flat.is_some(), other.is_some());
                let (Some(flat), Some(other)) = (flat, other) else {
                    continue;
                };
                let (first, last) = flat.domain();
                for t in [first, (2.0 * first + last) / 3.0, last] {
                    let [[u, v], [x, y]] = [flat, other].map(|of| of.evaluate(t));
                    assert!((u - x).abs() < 1e-9 && (v - y).abs() < 1e-9);
                }
            }
        }
    }
}

/// Numbers of edges and vertices may be far greater than what is left of the record they stand in.
#[test]
fn lists_may_be_long() {
    let mut model = Model::default();
    for number in 0..200 {
        let one = sample::of_shape("cylinder").unwrap();
        let (vertices, edges) = (model.vertices.len(), model.edges.len());
        model.vertices.extend(one.vertices);
        model.edges.extend(one.edges.into_iter().map(|mut edge| {
            edge.start.0 += vertices;
            edge.end.0 += vertices;
            edge
        }));
        model.faces.extend(one.faces.into_iter().map(|mut face| {
            for coedge in &mut face.outer.coedges {
                coedge.edge.0 += edges;
            }
            face.name = format!("Rectangle {number}");
            face
        }));
    }
    let read = read(&file(&model, Entities::Boundary));
    assert_eq!((read.faces.len(), read.shells.len()), (200, 200));
}

/// An edge that ends elsewhere than at its vertex is told, with its number and how far.
#[test]
fn edges_end_at_their_vertices() {
    let text = file(&sample::of_shape("cylinder").unwrap(), Entities::Boundary);
    let line = text
        .lines()
        .find(|line| line.as_bytes()[72] == b'P' && line.starts_with("502,"))
        .unwrap();
    let mut values: Vec<&str> = line[..64].trim_end().split(',').collect();
    assert_eq!(values[1], "4", "{line}");
    // x of the first vertex.
    values[2] = "77.";
    let moved = format!("{:<64}{}", values.join(","), &line[64..]);
    let error = iges::read_model(text.replace(line, &moved).as_bytes()).unwrap_err();
    let told = error.to_string();
    assert!(
        told.contains("edge 1 ends ") && told.contains("vertex 1"),
        "{told}"
    );
}
