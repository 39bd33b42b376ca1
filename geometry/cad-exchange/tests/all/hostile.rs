//! Damaged files end in an error or in numbers, never in a panic.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::iges::{self, Entities, ReadError, WriteOptions};

fn samples() -> Vec<Vec<u8>> {
    let mut model = sample::model();
    // The smaller face alone keeps the test short.
    model.faces.remove(0);
    let mut files: Vec<Vec<u8>> = [
        Entities::Parametric114,
        Entities::Rational128,
        Entities::Analytic,
        Entities::Boundary,
    ]
    .into_iter()
    .map(|entities| {
        let options = WriteOptions {
            entities,
            ..WriteOptions::new("sample", "20261121.093000")
        };
        let mut file = Vec::new();
        iges::write(&model, &options, &mut file).unwrap();
        file
    })
    .collect();
    let options = WriteOptions {
        entities: Entities::Analytic,
        ..WriteOptions::new("sample", "20261121.093000")
    };
    let mut cone = Vec::new();
    let model = sample::of_shape("hollow-cone").unwrap();
    iges::write(&model, &options, &mut cone).unwrap();
    files.push(cone);
    files.push(points());
    files
}

/// Points of both kinds under a matrix.
fn points() -> Vec<u8> {
    let mut text = format!("{:<72}S{:7}\n", "points", 1);
    text += &format!(
        "{:<72}G{:7}\n",
        ",,1Hp,1Hf,1Hs,1H1,32,38,6,308,15,1Hp,1.,2,2HMM;", 1
    );
    let records = [
        (124, "124,0.,-1.,0.,1.,1.,0.,0.,0.,0.,0.,1.,0.;", 0),
        (106, "106,2,3,1.,2.,3.,4.,5.,6.,7.,8.,9.;", 1),
        (116, "116,1.,2.D0,3.E1,0;", 1),
        (106, "106,1,2,1.5,2.,3.,4.,5.;", 0),
    ];
    let mut data = String::new();
    for (index, (entity, parameters, matrix)) in records.iter().enumerate() {
        let own = 2 * index + 1;
        let line = index + 1;
        text += &format!(
            "{entity:8}{line:8}{:8}{:8}{:8}{:8}{matrix:8}{:8}{:8}D{own:7}\n",
            0, 0, 0, 0, 0, "00000000"
        );
        text += &format!(
            "{entity:8}{:8}{:8}{:8}{:8}{:32}D{:7}\n",
            0,
            0,
            1,
            2,
            "",
            own + 1
        );
        data += &format!("{parameters:<64} {own:7}P{line:7}\n");
    }
    text += &data;
    text += &format!("{:<72}T{:7}\n", "S      1G      1D      8P      4", 1);
    text.into_bytes()
}

fn read(bytes: &[u8]) -> [Result<usize, ReadError>; 2] {
    [
        iges::read_points(bytes).map(|points| points.len()),
        iges::read_model(bytes).map(|model| model.faces.len()),
    ]
}

#[test]
fn the_samples_themselves_are_sound() {
    let counts: Vec<_> = samples()
        .iter()
        .map(|file| read(file).map(Result::ok))
        .collect();
    let model = [None, Some(1)];
    assert_eq!(counts, [model, model, model, model, model, [Some(6), None]]);
}

#[test]
fn cut_off_anywhere() {
    for file in samples() {
        let last_line = file.len() - 81;
        for length in 0..file.len() {
            let results = read(&file[..length]);
            // Without its last line a file is known to be incomplete, whatever it holds.
            if length <= last_line {
                assert!(results.iter().all(Result::is_err), "cut at byte {length}");
            }
        }
    }
}

#[test]
fn bytes_changed_lost_and_added() {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as usize % below
    };
    let alphabet = b"0123456789+-.,;HDESGPT \n\r#\x00\xff";
    let mut survived = 0;
    for file in samples() {
        for _ in 0..1500 {
            let mut bytes = file.clone();
            for _ in 0..=random(4) {
                let at = random(bytes.len());
                let byte = alphabet[random(alphabet.len())];
                match random(4) {
                    0 => {
                        bytes.remove(at);
                    }
                    1 => bytes.insert(at, byte),
                    _ => bytes[at] = byte,
                }
            }
            survived += read(&bytes).iter().filter(|result| result.is_ok()).count();
        }
    }
    assert!(
        survived > 100,
        "the changes should not all be fatal: {survived}"
    );
}

/// Whole values replaced, so that damage reaches the layers above the lines.
#[test]
fn values_replaced() {
    let mut state = 7_u64;
    let mut random = move |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let values = [
        "0",
        "1",
        "-1",
        "2",
        "3",
        "99",
        "99999999",
        "-7",
        "9223372036854775807",
        "1.",
        "1e308",
        "-1.D300",
        "5Hhello",
        "99999H",
        "",
        "x",
        "1.D",
        "17",
    ];
    let mut refused = 0;
    for file in samples() {
        let text = String::from_utf8(file).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        for _ in 0..1500 {
            let number = random(lines.len());
            let line = lines[number];
            let value = values[random(values.len())];
            let changed = match &line[72..73] {
                "P" | "G" => {
                    let width = if &line[72..73] == "P" { 64 } else { 72 };
                    let mut parts: Vec<&str> = line[..width].trim_end().split(',').collect();
                    let at = random(parts.len());
                    let keep_end = parts[at].ends_with(';');
                    let with_end = format!("{value};");
                    parts[at] = if keep_end { &with_end } else { value };
                    let body = parts.join(",");
                    if body.len() > width {
                        continue;
                    }
                    format!("{body:<width$}{}", &line[width..])
                }
                "D" => {
                    let field = random(9) * 8;
                    let short = &value[..value.len().min(8)];
                    format!("{}{short:>8}{}", &line[..field], &line[field + 8..])
                }
                _ => continue,
            };
            let mut damaged = lines.clone();
            damaged[number] = &changed;
            refused += read(damaged.join("\n").as_bytes())
                .iter()
                .filter(|r| r.is_err())
                .count();
        }
    }
    assert!(refused > 1000, "{refused}");
}

/// Points that all point to the same parameters, or are all moved by the same matrix, behind
/// so many lines of blanks.
fn shared(entities: usize, blank_lines: usize, matrix: bool) -> Vec<u8> {
    let mut text = format!("{:<72}S{:7}\n", "points", 1);
    text += &format!(
        "{:<72}G{:7}\n",
        ",,1Hp,1Hf,1Hs,1H1,32,38,6,308,15,1Hp,1.,2,2HMM;", 1
    );
    let mut entity = |number: usize, line: usize, matrix: usize, own: usize| {
        text += &format!(
            "{number:8}{line:8}{:8}{:8}{:8}{:8}{matrix:8}{:8}{:8}D{own:7}\n",
            0, 0, 0, 0, 0, "00000000"
        );
        text += &format!("{number:8}{:32}{:32}D{:7}\n", "", "", own + 1);
    };
    entity(124, 1, 0, 1);
    for index in 1..=entities {
        let (line, moved) = if matrix {
            (blank_lines + 3, 1)
        } else {
            (blank_lines + 2, 0)
        };
        entity(116, line, moved, 2 * index + 1);
    }
    let mut data = vec!["124,".to_owned()];
    data.extend(vec![String::new(); blank_lines]);
    if matrix {
        data.push("1.,0.,0.,5.,0.,1.,0.,0.,0.,0.,1.,0.;".into());
    } else {
        data.push("116,".into());
        data.extend(vec![String::new(); blank_lines]);
    }
    data.push(if matrix { "116,1.,2.,3.;" } else { "1.,2.,3.;" }.into());
    for (index, line) in data.iter().enumerate() {
        text += &format!("{line:<64} {:7}P{:7}\n", 1, index + 1);
    }
    let counts = format!("S      1G      1D{:7}P{:7}", 2 * entities + 2, data.len());
    text += &format!("{counts:<72}T{:7}\n", 1);
    text.into_bytes()
}

/// What entities share is read once, or not without end.
#[test]
fn shared_parameters_are_not_read_without_end() {
    // A matrix that moves everything is read once.
    let moved = iges::read_points(&*shared(1000, 300, true)).unwrap();
    assert_eq!(moved, vec![[6.0, 2.0, 3.0]; 1000]);
    // A few entities may share what they like.
    let few = iges::read_points(&*shared(10, 300, false)).unwrap();
    assert_eq!(few, vec![[1.0, 2.0, 3.0]; 10]);
    let error = iges::read_points(&*shared(1000, 300, false)).unwrap_err();
    assert!(matches!(error, ReadError::Entity { .. }), "{error}");
    assert!(error.to_string().contains("8 times over"), "{error}");
}

/// Counts that promise more than the file has must not be believed.
#[test]
fn huge_counts_cost_nothing() {
    let text = String::from_utf8(points()).unwrap();
    for count in ["4000000000", "9223372036854775807", "65", "-1"] {
        let right = format!("{:<64}", "106,2,3,1.,2.,3.,4.,5.,6.,7.,8.,9.;");
        let wrong = format!("{:<64}", format!("106,2,{count},1.;"));
        let damaged = text.replace(&right, &wrong);
        assert_ne!(damaged, text);
        let error = iges::read_points(damaged.as_bytes()).unwrap_err();
        assert!(matches!(error, ReadError::Entity { .. }), "{error}");
        assert!(error.to_string().contains("no room for"), "{error}");
    }
    let few = text.replace("106,2,3,1.", "106,2,4,1.");
    let error = iges::read_points(few.as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("the record ends before a coordinate"),
        "{error}"
    );
}
