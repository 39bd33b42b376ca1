//! A closed solid in STEP: the entities that make one, read back by our own reader.

#![allow(clippy::unwrap_used)]

use cad_exchange::step::{LengthUnit, Schema, WriteError, WriteOptions, read_body, write_solid};
use terraces::{Floor, Operation, Outline, Part, Solid, Treatment};

fn solid() -> Solid {
    let block = Outline::rectangle([0.0; 2], 60.0, 40.0, 0.0, 0.0).unwrap();
    let mut part = Part::new(block, 15.0, 0.0);
    let mut hole = Operation::cut(
        "hole",
        Outline::circle([10.0, 0.0], 4.0).unwrap(),
        Floor::Through,
    );
    hole.upper = Some(Treatment::countersink(
        8.0,
        12.0,
        std::f64::consts::FRAC_PI_2,
    ));
    let mut pocket = Operation::cut(
        "pocket",
        Outline::rectangle([-12.0, 0.0], 20.0, 16.0, 0.0, 3.0).unwrap(),
        Floor::Level { z_mm: 9.0 },
    );
    pocket.lower = Some(Treatment::Round { radius_mm: 1.0 });
    part.operations = vec![hole, pocket];
    part.build().unwrap().solid
}

fn written(options: &WriteOptions) -> String {
    let mut out = Vec::new();
    let summary = write_solid(&solid(), options, &mut out).unwrap();
    assert_eq!(summary.bytes, out.len());
    String::from_utf8(out).unwrap()
}

fn options() -> WriteOptions {
    WriteOptions::new("part", "2026-11-21T09:30:00")
}

#[test]
fn one_solid_of_analytic_faces_with_each_edge_used_twice() {
    let (solid, text) = (solid(), written(&options()).replace('\n', ""));
    let count = |keyword: &str| text.matches(&format!("={keyword}(")).count();
    assert_eq!(count("MANIFOLD_SOLID_BREP"), 1);
    assert_eq!(count("CLOSED_SHELL"), 1);
    assert_eq!(count("ADVANCED_BREP_SHAPE_REPRESENTATION"), 1);
    assert_eq!(count("ADVANCED_FACE"), solid.faces.len());
    assert_eq!(count("EDGE_CURVE"), solid.edges.len());
    assert_eq!(count("ORIENTED_EDGE"), 2 * solid.edges.len());
    assert_eq!(count("VERTEX_POINT"), solid.vertices.len());
    // The hole and its countersink; four corners and four fillets' sides, four of their corners.
    assert_eq!(count("CONICAL_SURFACE"), 1);
    assert_eq!(count("CYLINDRICAL_SURFACE"), 1 + 4 + 4);
    assert_eq!(count("TOROIDAL_SURFACE"), 4);
    // Each operation has one colour, defined once.
    assert_eq!(count("COLOUR_RGB"), 3);
    assert_eq!(count("STYLED_ITEM"), solid.faces.len());
    for face in &solid.faces {
        assert_eq!(
            text.matches(&format!("ADVANCED_FACE('{}'", face.name))
                .count(),
            1
        );
    }
}

#[test]
fn volume_and_schema_are_as_asked_for() {
    let millimetres = written(&options());
    assert!(millimetres.contains("AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF"));
    let inches = written(&WriteOptions {
        unit: LengthUnit::Inch,
        schema: Schema::Ap214,
        ..options()
    });
    assert!(inches.contains("AUTOMOTIVE_DESIGN"));
    let volume = |text: &str| -> f64 {
        let rest = text.split("VOLUME_MEASURE(").nth(1).unwrap();
        rest.split(')').next().unwrap().parse().unwrap()
    };
    let ratio = volume(&millimetres) / volume(&inches);
    assert!((ratio / 25.4_f64.powi(3) - 1.0).abs() < 1e-12);
    assert!((volume(&millimetres) - solid().volume_mm3).abs() < 1e-9);
}

#[test]
fn our_own_reader_takes_every_face() {
    let body = read_body(&mut written(&options()).as_bytes()).unwrap();
    assert_eq!(body.faces.len(), solid().faces.len());
}

#[test]
fn what_is_not_closed_is_not_written() {
    let mut open = solid();
    open.faces.pop();
    let error = write_solid(&open, &options(), &mut std::io::sink()).unwrap_err();
    assert!(matches!(error, WriteError::Solid(_)), "{error}");
    open.faces.clear();
    let error = write_solid(&open, &options(), &mut std::io::sink()).unwrap_err();
    assert!(matches!(error, WriteError::NoFaces), "{error}");
}
