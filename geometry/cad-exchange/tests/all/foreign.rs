//! Files from other programs: points are read, everything else is refused with a reason.

#![allow(clippy::unwrap_used, clippy::panic)]

use cad_exchange::iges::{self, ReadError};

/// A file of some entities: type, form, status, matrix pointer, parameters.
fn file(units: &str, entities: &[(u32, u32, &str, usize, &str)]) -> String {
    let global = format!("1H,,1H;,1Hp,1Hf,1Hs,1H1,32,38,6,308,15,1Hp,{units},1,0.,,0.,1.;");
    let mut text = format!("{:<72}S{:7}\n{global:<72}G{:7}\n", "points", 1, 1);
    let mut data = String::new();
    let mut line = 0;
    for (index, (entity, form, status, matrix, parameters)) in entities.iter().enumerate() {
        let own = 2 * index + 1;
        let chunks: Vec<&str> = parameters.lines().collect();
        text += &format!(
            "{entity:8}{:8}{:8}{:8}{:8}{:8}{matrix:8}{:8}{status}D{own:7}\n",
            line + 1,
            0,
            0,
            0,
            0,
            0
        );
        text += &format!(
            "{entity:8}{:8}{:8}{:8}{form:8}{:32}D{:7}\n",
            0,
            0,
            chunks.len(),
            "",
            own + 1
        );
        for chunk in chunks {
            line += 1;
            data += &format!("{chunk:<64} {own:7}P{line:7}\n");
        }
    }
    text + &data + &format!("{:<72}T{:7}\n", "S      1G      1", 1)
}

const MM: &str = "1.,2,2HMM";

fn points(text: &str) -> Vec<[f64; 3]> {
    iges::read_points(text.as_bytes()).unwrap()
}

fn refusal(text: &str, expected: &str) {
    let error = iges::read_points(text.as_bytes()).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn kinds_of_points() {
    let text = file(
        MM,
        &[
            (116, 0, "00000000", 0, "116,1.,2.,3.5D0,0;"),
            (106, 1, "00000000", 0, "106,1,2,\n9.,\n1.,2.,3.,4.; points"),
            (106, 2, "00000000", 0, "106,2,1,1.,,-1E1;"),
            (
                106,
                3,
                "00000000",
                0,
                "106,3,2,1.,2.,3.,0.,0.,1.,4.,5.,6.,0.,0.,\n1.;",
            ),
            (106, 12, "00000000", 0, "106,2,1,7,8,9;"),
            (106, 63, "00000000", 0, "106,1,1,0.,.5,-.5;"),
        ],
    );
    let expected = [
        [1.0, 2.0, 3.5],
        [1.0, 2.0, 9.0],
        [3.0, 4.0, 9.0],
        [1.0, 0.0, -10.0],
        [1.0, 2.0, 3.0],
        [4.0, 5.0, 6.0],
        [7.0, 8.0, 9.0],
        [0.5, -0.5, 0.0],
    ];
    assert_eq!(points(&text), expected);
    assert_eq!(points(&text.replace('\n', "\r\n")), expected);
    assert_eq!(points(&text.replace('\n', "")), expected);
}

#[test]
fn points_that_were_not_measured() {
    let kept = (116, 0, "01020000", 0, "116,1.,2.,3.;");
    let text = file(
        MM,
        &[
            (116, 0, "00010000", 0, "116,4.,2.,3.;"),
            (116, 0, "00030000", 0, "116,5.,2.,3.;"),
            (106, 31, "00000100", 0, "106,1,1,6.,2.,3.;"),
            (116, 0, "00000200", 0, "116,7.,2.,3.;"),
            (116, 0, "00000500", 0, "116,8.,2.,3.;"),
            kept,
        ],
    );
    assert_eq!(points(&text), [[1.0, 2.0, 3.0]]);
}

#[test]
fn units_and_matrices() {
    let text = file(
        "1.,1,2HIN",
        &[
            // A quarter turn about z and a shift, then a shift.
            (
                124,
                0,
                "00000000",
                3,
                "124,0.,-1.,0.,1.,1.,0.,0.,0.,0.,0.,1.,0.;",
            ),
            (
                124,
                0,
                "00000000",
                0,
                "124,1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,5.;",
            ),
            (116, 0, "00000000", 1, "116,1.,2.,3.;"),
            (106, 2, "00000000", 3, "106,2,1,1.,2.,3.;"),
        ],
    );
    let inch = 25.4;
    assert_eq!(
        points(&text),
        [[-inch, inch, 8.0 * inch], [inch, 2.0 * inch, 8.0 * inch]]
    );
}

#[test]
fn other_delimiters() {
    let text = file(MM, &[(106, 2, "00000000", 0, "106/2/1/1./2./3.#")]);
    let text = text.replace(
        "1H,,1H;,1Hp,1Hf,1Hs,1H1,32,38,6,308,15,1Hp,1.,2,2HMM,1,0.,,0.,1.;",
        "1H//1H#/1Hp/1Hf/1Hs/1H1/32/38/6/308/15/1Hp/1./2/2HMM/1/0.//0./1.#",
    );
    assert_eq!(points(&text), [[1.0, 2.0, 3.0]]);
}

#[test]
fn what_is_wrong_is_named() {
    let one = |parameters: &str| file(MM, &[(106, 2, "00000000", 0, parameters)]);
    refusal(
        &one("106,4,1,1.,2.,3.;"),
        "line 5, entity 106 (D1): tuples of kind 4",
    );
    refusal(
        &one("106,2,2,1.,2.,3.;"),
        "the record ends before a coordinate",
    );
    refusal(&one("106,2,1,1.,2.,3."), "does not end with its delimiter");
    refusal(
        &one("106,2,1,1.,x2,3.;"),
        "a coordinate is \"x2\", not a number",
    );
    refusal(
        &one("106,2,1,1.,1Hx,3.;"),
        "a coordinate is the string \"x\"",
    );
    refusal(&one("106,2,-1;"), "the number of tuples is -1");
    refusal(&one("106,2,9999999999;"), "no room for");
    refusal(
        &one("116,2,1;"),
        "its parameters are those of an entity 116",
    );
    refusal(
        &one("106,2,1,1e308,0.,0.;").replace("1.,2,2HMM", "1.,7,2HKM"),
        "too large",
    );
    refusal(
        &file(MM, &[(116, 0, "00000000", 7, "116,0.,0.,0.;")]),
        "D7 is not a transformation",
    );
    let circle = [
        (
            124,
            0,
            "00000000",
            3,
            "124,1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.;",
        ),
        (
            124,
            0,
            "00000000",
            1,
            "124,1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.;",
        ),
        (116, 0, "00000000", 1, "116,1.,2.,3.;"),
    ];
    refusal(&file(MM, &circle), "in a circle");
    refusal(
        &file(MM, &[(110, 0, "00000000", 0, "110,0;")]),
        "holds no measured points (entities 106 or 116), but 1 of type 110; it is a CAD model, not a scan",
    );
    refusal(&file(MM, &[]), "and no other entities");
    refusal(
        &file(MM, &[(116, 0, "00010000", 0, "116,4.,2.,3.;")]),
        "only such as other entities are made of, among 1 of type 116",
    );
    let text = one("106,2,1,1.,2.,3.;");
    refusal(
        &text.replace("     106       1", "     106      x1"),
        "line 3, directory entry D1",
    );
    refusal(
        &text.replace("     106       1", "     106       9"),
        "should begin on line 9",
    );
    let lost: Vec<&str> = text
        .lines()
        .enumerate()
        .filter(|(k, _)| *k != 3)
        .map(|l| l.1)
        .collect();
    refusal(&lost.join("\n"), "takes two: a line is missing");
}

/// The samples that other programs wrote: each is read or refused with a reason.
#[test]
fn real_files() {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/iges");
    let Ok(entries) = std::fs::read_dir(directory) else {
        println!("skipped: no {directory}");
        return;
    };
    let mut read = Vec::new();
    let mut empty = 0;
    let mut refused = Vec::new();
    for entry in entries {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        match iges::read_points(&std::fs::read(&path).unwrap()[..]) {
            Ok(points) => read.push((name, points.len())),
            Err(ReadError::Nothing { .. }) => empty += 1,
            Err(error) => refused.push((name, error.to_string())),
        }
    }
    read.sort();
    refused.sort();
    println!("read {read:?}\nwithout points: {empty}\nrefused {refused:#?}");
    let read: Vec<_> = read
        .iter()
        .map(|(name, count)| (name.as_str(), *count))
        .collect();
    assert_eq!(
        read,
        [
            ("igesio_sample_curves.igs", 10),
            ("occt_bug27069_points-with-comments.igs", 3),
            ("pyiges_sample.igs", 4)
        ]
    );
    let wrong_on_purpose: Vec<_> = refused.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        wrong_on_purpose,
        [
            "igesio_first_line_82_cols.iges",
            "igesio_first_line_without_80_cols.iges",
            "igesio_up_to_line_7_of_DE_section.iges",
            "occt_bad_header.igs"
        ]
    );
    assert_eq!(empty, 21);
}

#[test]
fn chains_of_points_and_curves_that_lie_by_themselves() {
    let text = file(
        "1.,1,2HIN",
        &[
            (106, 12, "00000000", 0, "106,2,2,0.,0.,1.,1.,0.,1.;"),
            // Part of something else, and a single point: neither is a section.
            (106, 12, "00010000", 0, "106,2,2,0.,0.,1.,1.,0.,1.;"),
            (116, 0, "00000000", 0, "116,1.,2.,3.;"),
            // A straight line from (0, 0, 2) to (2, 0, 2).
            (
                126,
                0,
                "00000000",
                0,
                "126,1,1,0,0,1,0,0.,0.,1.,1.,1.,1.,\n0.,0.,2.,2.,0.,2.,0.,1.,0.,0.,1.;",
            ),
        ],
    );
    let chains = iges::read_chains(text.as_bytes()).unwrap();
    let found: Vec<(u32, usize)> = chains.iter().map(|own| (own.entity, own.line)).collect();
    assert_eq!(found, [(106, 1), (126, 7)]);
    // Inches become millimetres.
    assert_eq!(chains[0].points, [[0.0, 0.0, 25.4], [25.4, 0.0, 25.4]]);
    assert_eq!(chains[1].points.len(), 9);
    for (k, point) in chains[1].points.iter().enumerate() {
        assert!((point[0] - 25.4 * 0.25 * k as f64).abs() < 1e-12 && point[2] == 50.8);
    }
    let error = iges::read_surfaces(text.as_bytes())
        .unwrap_err()
        .to_string();
    assert!(error.contains("128"), "{error}");
}
