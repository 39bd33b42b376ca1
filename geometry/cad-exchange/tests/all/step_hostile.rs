//! Damaged STEP files end in an error or in a model, never in a panic.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::step::{self, LengthUnit, ReadError, StepModel, WriteOptions};

fn file(unit: LengthUnit) -> String {
    let mut model = sample::model();
    // The smaller face alone keeps the tests short.
    model.faces.remove(0);
    let options = WriteOptions {
        unit,
        ..WriteOptions::new("sample", "2026-11-21T09:30:00")
    };
    let mut out = Vec::new();
    step::write(&model, &options, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn read(text: &str) -> Result<StepModel, ReadError> {
    step::read_model(text.as_bytes())
}

/// The message of a refusal, which must have one that a person can read.
fn refusal(text: &str) -> String {
    let error = read(text).expect_err("the file is damaged").to_string();
    assert!(!error.is_empty() && error.len() < 1000, "{error}");
    error
}

/// The file with something in it replaced, which must be there.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

/// Number of the first instance of an entity.
fn number(text: &str, keyword: &str) -> usize {
    let at = text.find(&format!("={keyword}(")).unwrap();
    let from = text[..at].rfind('#').unwrap();
    text[from + 1..at].parse().unwrap()
}

#[test]
fn cut_off_anywhere() {
    let whole = file(LengthUnit::Inch);
    assert!(read(&whole).is_ok());
    let needed = whole.trim_end().len();
    for length in 0..needed {
        let error = step::read_model(&whole.as_bytes()[..length]).expect_err("cut");
        let told = matches!(error, ReadError::Form | ReadError::Syntax { .. });
        assert!(told, "cut at byte {length}: {error}");
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
    let alphabet = b"0123456789+-.,;()#$*'/\"EABT= \n\\\x00\xff";
    let whole = file(LengthUnit::Inch).into_bytes();
    let (mut survived, mut refused) = (0, 0);
    for _ in 0..4000 {
        let mut bytes = whole.clone();
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
        match step::read_model(&bytes[..]) {
            Ok(_) => survived += 1,
            Err(error) => {
                assert!(error.to_string().len() < 1000, "{error}");
                refused += 1;
            }
        }
    }
    assert!(survived > 100 && refused > 1000, "{survived} {refused}");
}

/// Whole values replaced, so that damage reaches the layers above the text.
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
        "3",
        "99999999",
        "9223372036854775807",
        "1.",
        "1.E308",
        "-1.E300",
        "'x'",
        "$",
        "*",
        ".T.",
        ".F.",
        ".X.",
        "()",
        "(1)",
        "((1.))",
        "#1",
        "#14",
        "#99999999",
        "LENGTH_MEASURE(2.)",
    ];
    let whole = file(LengthUnit::Millimetre);
    let data = whole.find("DATA;").unwrap();
    let ends: Vec<usize> = whole
        .char_indices()
        .filter(|&(at, c)| at > data && (c == ',' || c == ')'))
        .map(|(at, _)| at)
        .collect();
    let mut refused = 0;
    for _ in 0..4000 {
        let end = ends[random(ends.len())];
        let from = whole[..end].rfind([',', '(']).unwrap() + 1;
        let value = values[random(values.len())];
        let damaged = format!("{}{value}{}", &whole[..from], &whole[end..]);
        refused += usize::from(read(&damaged).is_err());
    }
    assert!(refused > 2000, "{refused}");
}

#[test]
fn other_files_are_told_what_they_are() {
    for text in ["", "S      1", "solid cube", "ISO-10303-28;"] {
        assert!(matches!(read(text), Err(ReadError::Form)), "{text}");
    }
    let whole = file(LengthUnit::Millimetre);
    let other = whole.replace("MANIFOLD_SURFACE_SHAPE_", "ADVANCED_BREP_SHAPE_");
    let told = refusal(&other);
    assert!(
        told.contains("no single shape of shells") && told.contains("CARTESIAN_POINT"),
        "{told}"
    );
    assert!(refusal(&changed(&whole, "OPEN_SHELL", "CLOSED_SHELL")).contains("CLOSED_SHELL (#"));
    let told = refusal(&changed(&whole, "PLANE(", "OFFSET_SURFACE("));
    assert!(
        told.contains("expected B_SPLINE_SURFACE_WITH_KNOTS") && told.contains("TOROIDAL_SURFACE"),
        "{told}"
    );
    let told = refusal(&changed(&whole, "PLANE(", "CYLINDRICAL_SURFACE("));
    assert!(told.contains("it ends before its radius"), "{told}");
    let kept = changed(
        &whole,
        "ENDSEC;\nEND",
        "#9999=OFFSET_SURFACE('',#1,#2);\nENDSEC;\nEND",
    );
    let unknown = read(&kept).unwrap().unknown;
    assert_eq!(
        unknown.into_iter().collect::<Vec<_>>(),
        [("OFFSET_SURFACE".to_owned(), 1)]
    );
}

#[test]
fn places_are_told() {
    let whole = file(LengthUnit::Millimetre);
    let told = refusal(&changed(
        &whole,
        "PRODUCT_CONTEXT('',#1",
        "PRODUCT_CONTEXT('',#x",
    ));
    assert!(
        told.starts_with("line 12, column 24: `#` is not followed"),
        "{told}"
    );
    let told = refusal(&changed(&whole, "'',3,(", "'',$,("));
    assert!(
        told.contains("B_SPLINE_CURVE_WITH_KNOTS (#") && told.contains("its degree"),
        "{told}"
    );
    let told = refusal(&changed(&whole, "#2=", "#1="));
    assert!(told.contains("two instances #1"), "{told}");
    let gone = format!("#{}=PLANE", number(&whole, "PLANE"));
    let told = refusal(&changed(&whole, &gone, "#99999=PLANE"));
    assert!(told.contains("the file does not have it"), "{told}");
}

/// Counts and multiplicities that promise more than the file has must not be believed.
#[test]
fn huge_numbers_cost_nothing() {
    let whole = file(LengthUnit::Millimetre);
    for (from, to, told) in [
        ("(4,1,1,", "(4,9223372036854775807,1,", "multiplicities"),
        (
            "(4,1,1,",
            "(9223372036854775807,9223372036854775807,1,",
            "multiplicities",
        ),
        ("(4,1,1,", "(4,0,2,", "multiplicities"),
        ("'',3,(", "'',4000000000,(", "degree"),
        ("#1=", "#18446744073709551616=", "number of an instance"),
        ("(0.,0.,0.)", "(1.E999,0.,0.)", "no number"),
        (
            "COLOUR_RGB('#59A14F',0.",
            "COLOUR_RGB('#59A14F',7.",
            "within 0 and 1",
        ),
    ] {
        let error = refusal(&changed(&whole, from, to));
        assert!(error.contains(told), "{to}: {error}");
    }
    // The largest number that an instance can have is no length of anything.
    let largest = whole
        .replace("#1=", "#18446744073709551615=")
        .replace("#1,", "#18446744073709551615,")
        .replace("#1)", "#18446744073709551615)");
    assert!(read(&largest).is_ok());
}

#[test]
fn nesting_is_bounded() {
    let whole = file(LengthUnit::Millimetre);
    for deep in ["(".repeat(3_000_000), "A(".repeat(1_500_000)] {
        let told = refusal(&changed(
            &whole,
            "#1=APPLICATION_CONTEXT(",
            &format!("#1=A({deep}"),
        ));
        assert!(told.contains("deep in each other"), "{told}");
    }
}

/// What belongs to one thing is not converted for a second, however often it is named.
#[test]
fn shared_instances_are_not_converted_without_end() {
    let whole = file(LengthUnit::Millimetre);
    let face = number(&whole, "ADVANCED_FACE");
    let many = vec![format!("#{face}"); 100_000].join(",");
    let told = refusal(&changed(
        &whole,
        &format!("OPEN_SHELL('',(#{face})"),
        &format!("OPEN_SHELL('',({many})"),
    ));
    assert!(told.contains("belongs to two things"), "{told}");
    let bound = number(&whole, "FACE_OUTER_BOUND");
    let many = vec![format!("#{bound}"); 100_000].join(",");
    let told = refusal(&changed(
        &whole,
        &format!("'Ramp',(#{bound})"),
        &format!("'Ramp',({many})"),
    ));
    assert!(told.contains("belongs to two things"), "{told}");
}

#[test]
fn a_loop_that_does_not_close() {
    let whole = file(LengthUnit::Millimetre);
    let told = refusal(&changed(&whole, ",.T.);\n#", ",.F.);\n#"));
    assert!(told.contains("sense"), "an edge against its curve: {told}");
    let at = whole.find("ORIENTED_EDGE").unwrap();
    let (before, after) = whole.split_at(at);
    let told = refusal(&format!("{before}{}", after.replacen(".T.", ".F.", 1)));
    assert!(
        told.contains("does not begin where the one before it ends"),
        "{told}"
    );
}
