//! PLY files in, columns out.

use crate::common;

use common::gzip;
use scan_files::{PointScan, ReadOptions, ScanFileError, read_from};

const POINTS: [[f32; 3]; 6] = [
    [0.5, 0.0, 1.0],
    [0.5, 2.0, 1.25],
    [1.0, 0.5, -1.0],
    [1.0, 2.5, 0.0],
    [1.5, 0.0, 3.0],
    [1.5, 2.0, 4.0],
];

fn read(bytes: &[u8]) -> Result<PointScan, ScanFileError> {
    read_from(bytes, "test.ply", &ReadOptions::default())
}

fn header(format: &str, vertices: &str, x: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex {vertices}\n\
         property {x} x\nproperty float y\nproperty uchar extra\nproperty float z\n\
         element range_grid 3\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

fn ascii() -> String {
    let mut text = header("ascii", "6", "float");
    for [x, y, z] in POINTS {
        text += &format!("{x} {y} 7 {z} \n");
    }
    text + "1 0\n0 \n1 5\n"
}

fn binary(big_endian: bool, wide_x: bool) -> Vec<u8> {
    let format = if big_endian {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let mut bytes = header(format, "6", if wide_x { "double" } else { "float32" }).into_bytes();
    let mut put = |little: &[u8]| {
        let mut value = little.to_vec();
        if big_endian {
            value.reverse();
        }
        bytes.extend(value);
    };
    for [x, y, z] in POINTS {
        if wide_x {
            put(&f64::from(x).to_le_bytes());
        } else {
            put(&x.to_le_bytes());
        }
        put(&y.to_le_bytes());
        put(&[7]);
        put(&z.to_le_bytes());
    }
    put(&[1]);
    put(&0_i32.to_le_bytes());
    put(&[0]);
    put(&[1]);
    put(&5_i32.to_le_bytes());
    bytes
}

#[test]
fn all_encodings_give_the_same_columns() {
    let expected = read(ascii().as_bytes()).unwrap();
    assert_eq!((expected.columns.len(), expected.points()), (3, 6));
    assert_eq!(expected.column_pitch_mm, 0.5);
    assert_eq!(expected.sample_spacing_mm, 2.0);
    let second = &expected.columns[1];
    assert_eq!((second.x_mm, second.samples[0].z_mm), (1.0, -1.0));
    for bytes in [
        binary(false, false),
        binary(true, false),
        binary(false, true),
        binary(true, true),
        ascii().replace('\n', "\r\n").into_bytes(),
        gzip(ascii().as_bytes()),
        gzip(&binary(true, false)),
    ] {
        assert_eq!(read(&bytes).unwrap(), expected);
    }
}

#[test]
fn cyberware_headers_mean_metres_and_stray_lines_are_passed_over() {
    let plain = read(ascii().as_bytes()).unwrap();
    let text = ascii().replace(
        "comment made by hand\n",
        "obj_info is_cyberware_data 1\nobj_info num_cols 3\nbye\nbye\nbye\n",
    );
    let scan = read(text.as_bytes()).unwrap();
    assert!(scan.notes.iter().any(|n| n.contains("metres")));
    assert!(
        scan.notes
            .iter()
            .any(|n| n.contains("3 header line(s)") && n.contains("bye"))
    );
    assert!((scan.columns[0].x_mm - 1000.0 * plain.columns[0].x_mm).abs() < 1e-9);
    let options = ReadOptions {
        units: Some(scan_files::Units::Millimetre),
        ..ReadOptions::default()
    };
    let forced = read_from(text.as_bytes(), "test.ply", &options).unwrap();
    assert_eq!(forced.columns, plain.columns);
}

#[test]
fn decimal_text_is_not_rounded_to_single_precision() {
    let mut text = header("ascii", "4", "float");
    for y in 0..4 {
        text += &format!("1234.56789 {y} 0 98.76543\n");
    }
    let scan = read(text.as_bytes()).unwrap();
    assert!((scan.columns[0].x_mm - 1_234.567_89).abs() < 1e-9);
    assert!((scan.columns[0].samples[3].z_mm - 98.765_43).abs() < 1e-9);
}

#[test]
fn vertices_after_other_elements_are_found() {
    let text = "ply\nformat ascii 1.0\nelement camera 2\nproperty list uchar float pose\n\
                element vertex 4\nproperty int z\nproperty int y\nproperty int x\n\
                property float intensity\nend_header\n\
                2 0.5 0.5\n0\n9 0 0 0.5\n8 1 0 0.25\n7 0 1 1\n6 1 1 1\n";
    let scan = read(text.as_bytes()).unwrap();
    assert_eq!(scan.columns.len(), 2);
    let first = scan.columns[0].samples[0];
    assert_eq!((first.z_mm, first.intensity), (9.0, 128));
}

#[test]
fn headers_that_promise_too_much_are_errors_not_memory() {
    for format in ["ascii", "binary_little_endian"] {
        let text = header(format, "4000000000", "float");
        let error = read(text.as_bytes()).unwrap_err();
        assert!(
            matches!(error, ScanFileError::PlyTruncated { .. }),
            "{error}"
        );
        assert!(error.to_string().contains("4000000000"));
        for count in ["18446744073709551615", "-5", "many", "1e6", ""] {
            let told = read(header(format, count, "float").as_bytes()).unwrap_err();
            let told = told.to_string();
            assert!(
                told.contains("line 4: `element vertex") && told.contains("as a whole number"),
                "{told}"
            );
        }
    }
    let empty = "ply\nformat ascii 1.0\nelement nothing 4000000000\nelement vertex 1\n\
                 property float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    let error = read(empty.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("`nothing` has no properties"), "{error}");
    let list = "ply\nformat binary_little_endian 1.0\nelement face 1\n\
                property list uint float v\nelement vertex 1\nproperty float x\n\
                property float y\nproperty float z\nend_header\n\u{7f}\u{7f}\u{7f}\u{7f}abcd";
    let told = read(list.as_bytes()).unwrap_err().to_string();
    assert!(told.contains("a list of more than 65536 values"), "{told}");
}

#[test]
fn headers_that_promise_too_little_lose_no_points_in_silence() {
    let bare = |text: String| {
        text.replace("element range_grid 3\n", "")
            .replace("property list uchar int vertex_indices\n", "")
    };
    let row = |k: i32| format!("{k} {} 7 1\n", k % 2);
    let rows: String = (0..6).map(row).collect();
    let ascii = bare(header("ascii", "6", "float")) + &rows;
    assert_eq!(read(ascii.as_bytes()).unwrap().points(), 6);
    assert_eq!(
        read((ascii.clone() + "\n \n").as_bytes()).unwrap().points(),
        6
    );
    let told = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    let fewer = ascii.replace("vertex 6", "vertex 5");
    assert!(told(fewer.as_bytes()).contains("more data follow the 5 vertex entries"));

    let mut binary = bare(header("binary_little_endian", "6", "float")).into_bytes();
    let fewer = bare(header("binary_little_endian", "5", "float"));
    let mut rows = Vec::new();
    for point in POINTS {
        rows.extend_from_slice(&point[0].to_le_bytes());
        rows.extend_from_slice(&point[1].to_le_bytes());
        rows.push(7);
        rows.extend_from_slice(&point[2].to_le_bytes());
    }
    binary.extend_from_slice(&rows);
    assert_eq!(read(&binary).unwrap().points(), 6);
    binary.extend_from_slice(b"\r\n");
    assert_eq!(read(&binary).unwrap().points(), 6);
    let fewer = [fewer.as_bytes(), &rows].concat();
    assert!(told(&fewer).contains("more data follow the 5 vertex entries"));
    // Text under a header that says binary, and the other way round.
    let text = ascii.replace("ascii", "binary_little_endian") + &"0 0 0 0\n".repeat(20);
    assert!(told(text.as_bytes()).contains("more data follow"));
    let bytes = [bare(header("ascii", "6", "float")).as_bytes(), &rows[..]].concat();
    assert!(told(&bytes).contains("the data are not text, though the header says"));
    // What follows the vertices is of no use, but shows that the count may be wrong.
    let mesh = self::ascii().replace("1 0\n0 \n1 5\n", "1 0\n0 \n");
    let scan = read(mesh.as_bytes()).unwrap();
    assert_eq!(scan.points(), 6);
    assert!(scan.notes[0].starts_with("the range_grid data after the vertices do not fit"));
}

#[test]
fn faults_are_named_with_their_place() {
    let good = ascii();
    for (text, parts) in [
        (
            "ply\nformat ascii 1.0\n".to_owned(),
            &["line 3", "end_header"][..],
        ),
        (good.replace("ascii 1.0", "ascii one"), &["line 2"]),
        (good.replace("format ascii 1.0", "comment"), &["format"]),
        (
            good.replace("element vertex", "element point"),
            &["element vertex"],
        ),
        (good.replace("float z", "float depth"), &["no property `z`"]),
        (
            good.replace("float z", "list uchar float z"),
            &["`z`", "list"],
        ),
        (good.replace("1 2.5 7", "1 two 7"), &["line 15", "two"]),
        (good.replace("1 2.5 7 0", "1 2.5"), &["line 15"]),
        (
            good.lines().take(15).collect::<Vec<_>>().join("\n"),
            &["6 vertex", "cut off"],
        ),
        (
            format!("ply\n{}", "comment long\n".repeat(30_000)),
            &["256 KiB"],
        ),
        // Lines that become longer while the header is cleaned.
        (format!("ply\n{}", "\n".repeat(40_000)), &["256 KiB"]),
    ] {
        let message = read(text.as_bytes()).unwrap_err().to_string();
        assert!(message.starts_with("test.ply"), "{message}");
        for part in parts {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }
    let mut not_finite = binary(false, false);
    // The last vertex's z, before the 11 bytes of the range grid.
    let at = not_finite.len() - 15;
    not_finite[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let scan = read(&not_finite).unwrap();
    assert_eq!(scan.points(), 5);
    assert!(
        scan.notes
            .iter()
            .any(|note| note.starts_with("1 point(s) without a measurement")
                && note.ends_with("vertex 6")),
        "{:?}",
        scan.notes
    );
}

#[test]
fn no_cut_of_a_file_panics() {
    for bytes in [
        ascii().into_bytes(),
        binary(true, true),
        gzip(ascii().as_bytes()),
    ] {
        for end in 0..bytes.len() {
            let _ = read(&bytes[..end]);
        }
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at] ^= 0x55;
            let _ = read(&flipped);
        }
    }
}

#[test]
fn header_errors_quote_the_line_and_spare_the_grammar() {
    let told = read(header("ascii", "-4", "float").as_bytes())
        .unwrap_err()
        .to_string();
    assert!(told.contains("element vertex -4"), "{told}");
    assert!(
        !told.contains("ExpectedSet") && !told.contains('{'),
        "{told}"
    );
}
