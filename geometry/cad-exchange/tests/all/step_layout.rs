//! The text of written STEP files: references, lines, and two files to the letter.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use std::collections::BTreeMap;

use cad_exchange::step::{self, LengthUnit, Schema, WriteOptions};
use reconstruct::Model;

fn options(schema: Schema, unit: LengthUnit) -> WriteOptions {
    WriteOptions {
        schema,
        unit,
        author: "A. Author".to_owned(),
        organization: "Relief".to_owned(),
        system: "Relief".to_owned(),
        ..WriteOptions::new("sample", "2026-11-21T09:30:00")
    }
}

fn written(model: &Model, options: &WriteOptions) -> String {
    let mut out = Vec::new();
    let summary = step::write(model, options, &mut out).unwrap();
    assert_eq!(summary.bytes, out.len());
    let text = String::from_utf8(out).unwrap();
    assert_eq!(summary.instances, instances(&text).len());
    text
}

/// The sample's two faces, one with a name that must be encoded.
fn part() -> Model {
    let mut model = sample::model();
    model.faces[1].name = "Ramp 'B', \u{fc}; \\1".to_owned();
    model
}

/// Fixed files: a difference means that files change for everybody who reads them. Run
/// with `UPDATE_GOLDEN=1` once the change is wanted, and judge the new files.
#[test]
fn golden_files() {
    for (schema, unit, name) in [
        (Schema::Ap242, LengthUnit::Millimetre, "sample_ap242.step"),
        (Schema::Ap214, LengthUnit::Inch, "sample_ap214_inch.step"),
    ] {
        let path = format!("{}/tests/golden/{name}", env!("CARGO_MANIFEST_DIR"));
        let text = written(&part(), &options(schema, unit));
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let golden = std::fs::read_to_string(&path).unwrap();
        for (number, (line, expected)) in text.lines().zip(golden.lines()).enumerate() {
            assert_eq!(line, expected, "{name}, line {}", number + 1);
        }
        assert_eq!(text, golden);
    }
}

/// Instances by number, without their line breaks.
fn instances(text: &str) -> BTreeMap<usize, String> {
    let data = text.split("DATA;\n").nth(1).unwrap();
    let data = data.split("ENDSEC;").next().unwrap();
    let joined = data.replace(";\n", "\u{0}").replace('\n', "");
    joined
        .split_terminator('\u{0}')
        .map(|instance| {
            let (id, rest) = instance.strip_prefix('#').unwrap().split_once('=').unwrap();
            (id.parse().unwrap(), rest.to_owned())
        })
        .collect()
}

/// Numbers behind `#` outside of strings.
fn references(instance: &str) -> Vec<usize> {
    instance
        .split('\'')
        .step_by(2)
        .flat_map(|outside| outside.split('#').skip(1))
        .map(|rest| {
            let end = rest
                .find(|c: char| !c.is_ascii_digit())
                .unwrap_or(rest.len());
            rest[..end].parse().unwrap()
        })
        .collect()
}

#[test]
fn every_reference_points_back_and_everything_is_used() {
    // What stands at the top; the rest hangs below.
    let tops = [
        "APPLICATION_PROTOCOL_DEFINITION",
        "PRODUCT_RELATED_PRODUCT_CATEGORY",
        "SHAPE_DEFINITION_REPRESENTATION",
        "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION",
        "PROPERTY_DEFINITION_REPRESENTATION",
    ];
    for unit in [LengthUnit::Millimetre, LengthUnit::Inch] {
        let text = written(&part(), &options(Schema::Ap242, unit));
        assert!(text.is_ascii());
        assert!(text.lines().all(|line| line.len() <= 110), "long lines");
        let instances = instances(&text);
        let mut used = vec![false; instances.len() + 1];
        for (index, (&id, instance)) in instances.iter().enumerate() {
            assert_eq!(id, index + 1);
            for reference in references(instance) {
                assert!(reference < id, "#{id} points to #{reference}");
                used[reference] = true;
            }
        }
        for (id, instance) in instances {
            let top = tops
                .iter()
                .any(|top| instance.starts_with(&format!("{top}(")));
            assert_eq!(used[id], !top, "#{id}={instance}");
        }
    }
}

/// Names of the schemas are those that readers choose by.
#[test]
fn header_and_units() {
    let text = written(&part(), &options(Schema::Ap214, LengthUnit::Inch));
    for expected in [
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('trimmed faces from a range scan'),'2;1');\n",
        "FILE_NAME('sample.step','2026-11-21T09:30:00',('A. Author'),\n('Relief'),'Relief','Relief','');\n",
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 }'));\nENDSEC;\nDATA;\n#1=",
        "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),",
        "(CONVERSION_BASED_UNIT('INCH',",
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(3.937007874015748E-6)",
        "'Ramp ''B\\X2\\0027\\X0\\, \\X2\\00FC\\X0\\; \\\\1'",
        "ENDSEC;\nEND-ISO-10303-21;\n",
    ] {
        assert!(text.contains(expected), "{expected}");
    }
    let text = written(&part(), &options(Schema::Ap242, LengthUnit::Millimetre));
    assert!(!text.contains("INCH") && text.contains("'managed model based 3d engineering'"));
}

#[test]
fn the_same_bytes_every_time() {
    let options = options(Schema::Ap242, LengthUnit::Millimetre);
    assert_eq!(written(&part(), &options), written(&part(), &options));
}
