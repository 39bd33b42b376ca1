//! Text files in, columns out.

use crate::common;

use common::{gzip, read_text, shuffled};
use scan_files::{ReadOptions, ScanFileError, Units, from_points_mm, read_from};

/// Columns 0.5 mm apart with samples 1.25 mm apart.
fn regular(columns: i32, samples: i32) -> Vec<String> {
    let mut lines = Vec::new();
    for i in 0..columns {
        for j in 0..samples {
            let (x, y) = (f64::from(i) * 0.5 - 3.0, f64::from(j) * 1.25);
            lines.push(format!("{x} {y} {}", 0.1 * x - 0.2 * y));
        }
    }
    lines
}

#[test]
fn columns_and_both_spacings_are_found() {
    let scan = read_text(&regular(7, 5).join("\n")).unwrap();
    assert_eq!((scan.columns.len(), scan.points()), (7, 35));
    assert!((scan.column_pitch_mm - 0.5).abs() < 1e-12);
    assert!((scan.sample_spacing_mm - 1.25).abs() < 1e-12);
    assert!((scan.columns[0].x_mm + 3.0).abs() < 1e-12);
    assert_eq!(scan.columns[6].samples[4].intensity, 255);
    assert!(scan.notes.is_empty(), "{:?}", scan.notes);
    assert_eq!(scan.recommended_pitch_mm(), 0.79);
}

#[test]
fn order_line_ends_compression_and_comments_make_no_difference() {
    let lines = regular(7, 5);
    let plain = read_text(&lines.join("\n")).unwrap();
    for seed in 1..5 {
        let mixed = shuffled(&lines, seed);
        assert_eq!(read_text(&mixed.join("\r\n")).unwrap(), plain);
        assert_eq!(read_text(&mixed.join("\r")).unwrap(), plain);
        let commented = format!(
            "\u{feff}# made by hand\nX,Y,Z\n\n{}\n",
            mixed.join(" # n\n")
        );
        assert_eq!(read_text(&commented).unwrap(), plain);
        let packed = gzip(mixed.join("\n").as_bytes());
        assert_eq!(
            read_from(&packed[..], "t", &ReadOptions::default()).unwrap(),
            plain
        );
    }
}

#[test]
fn jitter_below_a_tenth_of_the_pitch_leaves_a_column_whole() {
    let mut lines = Vec::new();
    for i in 0..20 {
        for j in 0..10 {
            let wobble = f64::from((i * 7 + j * 3) % 5) * 0.008;
            lines.push(format!("{} {j} 0", f64::from(i) * 0.4 + wobble));
        }
    }
    let scan = read_text(&lines.join("\n")).unwrap();
    assert_eq!(scan.columns.len(), 20);
    assert!((scan.column_pitch_mm - 0.4).abs() < 1e-9);
}

#[test]
fn a_cloud_is_binned_by_its_density() {
    // An R2 low-discrepancy sequence: even density, no two points with one x. 4 points/mm2.
    let lines: Vec<String> = (0..10_000)
        .map(|k| {
            let u = (0.754_877_666 * f64::from(k)).fract() * 50.0;
            let v = (0.569_840_291 * f64::from(k)).fract() * 50.0;
            format!("{u:.6} {v:.6} {:.6}", 0.3 * u)
        })
        .collect();
    let scan = read_text(&lines.join("\n")).unwrap();
    assert_eq!(scan.points(), 10_000);
    assert!(
        (0.11..0.14).contains(&scan.column_pitch_mm),
        "a quarter of 0.5 mm expected: {}",
        scan.column_pitch_mm
    );
    assert!((0.3..0.8).contains(&scan.recommended_pitch_mm()));
    assert!(scan.notes.iter().any(|n| n.contains("not in columns")));
    for column in &scan.columns {
        for sample in &column.samples {
            let own_x = sample.z_mm / 0.3;
            assert!((own_x - column.x_mm).abs() < 0.51 * scan.column_pitch_mm);
        }
    }
    assert_eq!(read_text(&shuffled(&lines, 3).join("\n")).unwrap(), scan);
}

#[test]
fn a_given_pitch_bins_whatever_there_is() {
    let options = ReadOptions {
        column_pitch_mm: Some(1.0),
        ..ReadOptions::default()
    };
    let points = (0..40).map(|k| [0.25 * f64::from(k), f64::from(k % 7), 1.0]);
    let scan = from_points_mm(points, "points", &options).unwrap();
    assert_eq!(scan.column_pitch_mm, 1.0);
    let xs: Vec<f64> = scan.columns.iter().map(|c| c.x_mm.round()).collect();
    assert_eq!(xs, (0..=10).map(f64::from).collect::<Vec<_>>());
}

#[test]
fn units_scale_and_tiny_parts_are_remarked_on() {
    let text = "0 0 0\n0 0.001 0\n0.001 0 0\n0.001 0.001 0.5\n";
    let scan = read_text(text).unwrap();
    assert!(scan.notes.iter().any(|n| n.contains("metres")));
    for (units, factor) in [(Units::Metre, 1000.0), (Units::Inch, 25.4)] {
        let options = ReadOptions {
            units: Some(units),
            ..ReadOptions::default()
        };
        let scan = read_from(text.as_bytes(), "t", &options).unwrap();
        assert!((scan.column_pitch_mm - 0.001 * factor).abs() < 1e-9);
        let top = scan.columns[1].samples[1];
        assert!((top.z_mm - 0.5 * factor).abs() < 1e-5);
        assert!(scan.notes.is_empty());
    }
    assert_eq!("inch".parse(), Ok(Units::Inch));
    assert!("feet".parse::<Units>().unwrap_err().contains("feet"));
}

#[test]
fn intensities_of_any_scale_become_bytes() {
    let intensities = |values: [&str; 3]| -> Vec<u8> {
        let text = format!(
            "0 0 0 {}\n0 1 0 {}\n1 0 0 {}\n1 1 0 0\n",
            values[0], values[1], values[2]
        );
        let scan = read_text(&text).unwrap();
        scan.columns
            .iter()
            .flat_map(|c| c.samples.iter().map(|s| s.intensity))
            .collect()
    };
    assert_eq!(intensities(["0", "17", "255"]), [0, 17, 255, 0]);
    assert_eq!(intensities(["0", "0.5", "1.0"]), [0, 128, 255, 0]);
    assert_eq!(intensities(["0", "1023", "4095"]), [0, 64, 255, 0]);
}

#[test]
fn further_values_are_ignored_with_a_note() {
    let scan = read_text("0 0 0 0.0 0.0 0.0 \n0 1 0 0.0 0.0 0.0 \n1 1 0 9 9 9 \n").unwrap();
    assert_eq!(scan.points(), 3);
    assert!(scan.notes.iter().any(|n| n.contains("3 further value(s)")));
}

#[test]
fn errors_name_file_place_and_cause() {
    let message = |text: &str| read_text(text).unwrap_err().to_string();
    for (text, parts) in [
        ("", &["is empty"][..]),
        ("# only a comment\n", &["holds no points"]),
        ("1 2 3\n4 5\n", &["line 2", "2 value(s)"]),
        ("1 2 3\n4 5", &["line 2", "in the middle of this line"]),
        ("1 2 3\n\n4 x 6\n", &["line 3", "`x`"]),
        (
            "1 2 3\n4 nan 6\n7 8 inf\n",
            &["2 of 3 points", "not a finite number", "first at line 2"],
        ),
        ("1 2 1e300\n", &["line 1", "a coordinate of 1e300 mm"]),
        ("1,5 2,0 3,1\n", &["line 1", "decimal commas", "semicolons"]),
        ("1 2 30000\n", &["line 1", "30000", "units"]),
        ("1 2 3\n1 2 4\n1 2 5\n", &["one x and y (3 different)"]),
        ("1 2 3\n\u{0}\u{1}", &["byte 6", "0x00"]),
    ] {
        let message = message(text);
        assert!(message.starts_with("test.xyz"), "{message}");
        for part in parts {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }
    let long = "1".repeat(100_000);
    assert!(matches!(
        read_text(&long),
        Err(ScanFileError::LongLine { line: 1, .. })
    ));
    let cut = &gzip(regular(30, 30).join("\n").as_bytes())[..600];
    let cut = read_from(cut, "cut.gz", &ReadOptions::default());
    assert!(matches!(cut, Err(ScanFileError::Read { .. })), "{cut:?}");
    let options = ReadOptions {
        max_points: 2,
        ..ReadOptions::default()
    };
    let many = read_from(&b"0 0 0\n1 1 1\n2 2 2\n"[..], "t", &options);
    assert!(matches!(
        many,
        Err(ScanFileError::TooManyPoints { limit: 2, .. })
    ));
}

#[test]
fn points_without_a_measurement_are_left_out_with_a_note() {
    let scan = read_text("0 0 0\r\n1 nan 0\r\n0 1 inf\r\n0 2 0\r\n1 0 0\r\n1 2 0\r\n").unwrap();
    assert_eq!(scan.points(), 4);
    assert!(
        scan.notes
            .iter()
            .any(|note| note.starts_with("2 point(s) without a measurement")
                && note.ends_with("the first at line 2")),
        "{:?}",
        scan.notes
    );
    let half = read_text("0 0 0\nnan nan nan\n1 1 0\nnan nan nan\n").unwrap();
    assert_eq!(half.points(), 2);
}

#[test]
fn no_damage_to_a_file_panics() {
    let text = "X;Y;Z\n1,5;2,0;3,1\n# c\n2.5 1 7 9\n3,4,5\n-1e3;0;2\n";
    for end in 0..text.len() {
        let _ = read_text(&text[..end]);
    }
    for at in 0..text.len() {
        for damage in 1..=255 {
            let mut bytes = text.as_bytes().to_vec();
            bytes[at] ^= damage;
            let _ = read_from(&bytes[..], "t", &ReadOptions::default());
        }
    }
}

fn tar() -> Vec<u8> {
    let mut head = vec![0; 1024];
    head[..8].copy_from_slice(b"scan.xyz");
    head[257..262].copy_from_slice(b"ustar");
    head
}

#[test]
fn damaged_compression_is_told_from_damaged_content() {
    let plain = regular(60, 60).join("\n") + "\n";
    let packed = gzip(plain.as_bytes());
    let read = |bytes: &[u8]| read_from(bytes, "scan.gz", &ReadOptions::default());
    let told = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    let whole = read(&packed).unwrap();
    assert_eq!(
        read(&[&packed[..], &packed[..]].concat()).unwrap().columns,
        whole.columns
    );
    for end in [
        2,
        9,
        15,
        packed.len() / 2,
        packed.len() - 8,
        packed.len() - 1,
    ] {
        let told = told(&packed[..end]);
        assert!(
            told.contains("compressed data (gzip) end too early"),
            "{end}: {told}"
        );
    }
    for at in [40, packed.len() / 3, packed.len() / 2, packed.len() - 6] {
        let mut damaged = packed.clone();
        damaged[at] ^= 0x11;
        let told = told(&damaged);
        assert!(told.contains("compressed data (gzip)"), "{at}: {told}");
        assert!(told.starts_with("scan.gz: "), "{told}");
    }
    let joined = told(&[&packed[..], b"no gzip at all"].concat());
    assert!(
        joined.contains("something that is not gzip follows"),
        "{joined}"
    );
    // Sound compression around content that makes no sense: the content is to blame.
    let content = told(&gzip(b"1 2 3\n4 x 6\n"));
    assert!(content.contains("line 2: `x` is not a number"), "{content}");
    let nothing = told(&gzip(b""));
    assert!(nothing.contains("is empty when unpacked"), "{nothing}");
}

#[test]
fn what_was_packed_twice_by_mistake_is_read_and_more_is_refused() {
    let once = gzip(regular(8, 8).join("\n").as_bytes());
    let read = |bytes: &[u8]| read_from(bytes, "scan.gz", &ReadOptions::default());
    let twice = gzip(&once);
    let scan = read(&twice).unwrap();
    assert_eq!(scan.columns, read(&once).unwrap().columns);
    assert!(
        scan.notes
            .iter()
            .any(|n| n.contains("gzip-compressed 2 times"))
    );
    let told = read(&gzip(&twice)).unwrap_err().to_string();
    assert!(
        told.contains("more than 2 times over; unpack it first"),
        "{told}"
    );
}

#[test]
fn a_point_far_away_does_not_make_one_column_of_the_part() {
    let part = regular(30, 30);
    let alone = read_text(&part.join("\n")).unwrap();
    let scan = read_text(&(part.join("\n") + "\n20000 1 1\n")).unwrap();
    assert_eq!(scan.column_pitch_mm, alone.column_pitch_mm);
    assert_eq!(scan.columns.len(), alone.columns.len() + 1);
    let suspicion = scan.units_suspected.unwrap();
    assert!(
        suspicion.contains("20.0 m") && suspicion.contains("--roi-x-mm"),
        "{suspicion}"
    );
    assert!(alone.units_suspected.is_none());
}

#[test]
fn files_of_other_formats_are_called_by_their_name() {
    let read = |bytes: &[u8]| read_from(bytes, "scan", &ReadOptions::default());
    for (head, format) in [
        (&b"P5\n2560 2500\n65535\n\0\0"[..], "a PGM picture"),
        (b"{\"width\": 2560}", "a JSON file"),
        (b"solid part\nfacet normal 0 0 1\n", "an STL mesh"),
        (b"PK\x03\x04\x14\0", "a ZIP archive"),
        (b"BZh91AY&SY", "compressed with bzip2"),
        (b"\xff\xfe1\x00 \x002\x00", "text in UTF-16, not UTF-8"),
        (b"<!DOCTYPE html>", "an HTML file"),
        (&tar(), "a tar archive"),
    ] {
        for bytes in [head.to_vec(), gzip(head)] {
            let told = read(&bytes).unwrap_err().to_string();
            assert!(told.starts_with(&format!("scan: is {format},")), "{told}");
        }
    }
    // A header line may begin with anything else.
    assert!(read(b"P5 y z\n0 0 1\n0 1 1\n1 0 1\n1 1 1\n").is_ok());
}

#[test]
fn points_without_a_measurement_count_against_the_limit() {
    let options = ReadOptions {
        max_points: 3,
        ..ReadOptions::default()
    };
    let text = "0 0 0\n1 1 1\nnan 0 0\nnan 0 0\n";
    let told = read_from(text.as_bytes(), "test.xyz", &options).unwrap_err();
    assert!(
        matches!(told, ScanFileError::TooManyPoints { limit: 3, .. }),
        "{told}"
    );
}
