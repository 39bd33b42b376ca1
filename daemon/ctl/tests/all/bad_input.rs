//! Every kind of bad scan file: one line says what is wrong, where, and what to do; what is
//! odd but usable is converted with a remark.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::common;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use common::{relief, roof, text};
use serde_json::Value;

/// A folder of bad files.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.0.path().join(name), content).unwrap();
    }

    /// Converting this file fails with one line in which all of this stands, and leaves
    /// nothing behind.
    fn refuses(&self, name: &str, content: impl AsRef<[u8]>, because: &[&str]) {
        self.write(name, content);
        self.refuses_file(name, because);
    }

    fn refuses_file(&self, name: &str, because: &[&str]) {
        let before = self.files();
        let output = relief(self.0.path(), &["convert", name, "-o", "part.igs"]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {told}");
        let last = told.lines().last().unwrap();
        assert!(last.starts_with("relief: "), "{name}: {told}");
        assert_eq!(told.matches("relief: ").count(), 1, "{name}: {told}");
        let file = Path::new(name).file_name().unwrap().to_string_lossy();
        for part in because.iter().copied().chain([&*file]) {
            assert!(last.contains(part), "{name} lacks {part}: {last}");
        }
        assert!(output.stdout.is_empty(), "{name}");
        assert_eq!(self.files(), before, "{name} left something behind");
    }

    /// Converting this file succeeds, and remarks on this in the report and on standard
    /// error.
    fn remarks(&self, name: &str, content: impl AsRef<[u8]>, on: &str) -> Value {
        self.write(name, content);
        let output = relief(
            self.0.path(),
            &["convert", name, "-o", "part.igs", "--json"],
        );
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{name}: {said}");
        let report: Value =
            serde_json::from_slice::<Value>(&output.stdout).unwrap()["report"].take();
        let warnings = report["warnings"].as_array().unwrap();
        assert!(
            warnings.iter().any(|w| w.as_str().unwrap().contains(on)),
            "{name}: {warnings:?}"
        );
        is_remarked(&said, name, on);
        report
    }

    fn files(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    }
}

/// Among what was said is a note about the file.
fn is_remarked(said: &str, name: &str, on: &str) {
    let remark = said.lines().find(|line| line.contains(on));
    let remark = remark.unwrap_or_else(|| panic!("{name}: {said}"));
    assert!(remark.starts_with("relief: note: "), "{remark}");
    assert!(remark.contains(name), "{remark}");
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn ply(format: &str, announced: &str, points: &[[f64; 3]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex {announced}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n"
    )
    .into_bytes();
    if format == "ascii" {
        bytes.extend_from_slice(text(points).as_bytes());
    } else {
        for value in points.iter().flatten() {
            bytes.extend_from_slice(&(*value as f32).to_le_bytes());
        }
    }
    bytes
}

/// Points as one entity 106 of form 2.
fn iges(points: &[[f64; 3]]) -> String {
    let mut values = vec!["106".to_owned(), "2".to_owned(), points.len().to_string()];
    values.extend(points.iter().flatten().map(|value| format!("{value:?}")));
    let mut data = vec![String::new()];
    for (index, value) in values.iter().enumerate() {
        let ending = if index + 1 == values.len() { ';' } else { ',' };
        if data.last().unwrap().len() + value.len() + 1 > 64 {
            data.push(String::new());
        }
        let line = data.last_mut().unwrap();
        line.push_str(value);
        line.push(ending);
    }
    let mut file = format!("{:<72}S{:7}\n", "points", 1);
    let global = "1H,,1H;,1Hp,1Hf,1Hs,1H1,32,38,6,308,15,1Hp,1.,2,2HMM,1,0.,,0.,1.;";
    file += &format!("{global:<72}G{:7}\n", 1);
    file += &format!("{:8}{:8}{:48}00000000D{:7}\n", 106, 1, "", 1);
    file += &format!(
        "{:8}{:16}{:8}{:8}{:32}D{:7}\n",
        106,
        "",
        data.len(),
        2,
        "",
        2
    );
    for (index, line) in data.iter().enumerate() {
        file += &format!("{line:<64} {:7}P{:7}\n", 1, index + 1);
    }
    let counts = format!("S{:7}G{:7}D{:7}P{:7}", 1, 1, 2, data.len());
    file + &format!("{counts:<72}T{:7}\n", 1)
}

fn grid(columns: i32, rows: i32, point: impl Fn(f64, f64) -> [f64; 3]) -> Vec<[f64; 3]> {
    (0..columns)
        .flat_map(|i| (0..rows).map(move |j| (f64::from(i), f64::from(j))))
        .map(|(i, j)| point(i, j))
        .collect()
}

#[test]
fn files_without_points() {
    let bench = Bench::new();
    for name in ["empty.xyz", "empty.ply", "empty.igs", "empty.scan"] {
        bench.refuses(name, "", &["is empty"]);
    }
    bench.refuses("empty.xyz.gz", gzip(b""), &["is empty when unpacked"]);
    for (name, content) in [
        ("blank.xyz", "\n  \n\n"),
        ("comments.xyz", "# a\n"),
        ("header.csv", "x,y,z\n"),
    ] {
        bench.refuses(name, content, &["holds no points"]);
    }
    bench.refuses("none.ply", ply("ascii", "0", &[]), &["holds no points"]);
    fs::create_dir(bench.0.path().join("folder")).unwrap();
    bench.refuses_file("folder", &["is a directory"]);
}

#[test]
fn samples_that_no_surface_can_lie_between() {
    let bench = Bench::new();
    let refuses = |name: &str, points: &[[f64; 3]], because: &[&str]| {
        bench.refuses(name, text(points), because);
    };
    refuses("one.xyz", &[[1.0, 2.0, 3.0]], &["a single point"]);
    refuses(
        "same.xyz",
        &[[1.0, 2.0, 3.0]; 500],
        &["a single point, perhaps repeated"],
    );
    refuses(
        "few.xyz",
        &grid(3, 5, |i, j| [i, j, 0.0]),
        &["holds 15 samples only"],
    );
    let column = grid(1, 400, |_, j| [1.0, j, j]);
    refuses("column.xyz", &column, &["at one x, a single column"]);
    refuses("row.xyz", &grid(400, 1, |i, _| [i, 3.0, i]), &["at one y"]);
    refuses(
        "slanted.xyz",
        &grid(400, 1, |i, _| [i, 2.0 * i, 5.0]),
        &["on one slanted line"],
    );
    refuses(
        "sight.xyz",
        &grid(1, 400, |_, j| [1.0, 2.0, j]),
        &["at one x and y (400 different)"],
    );
}

#[test]
fn a_million_points_in_one_column() {
    let bench = Bench::new();
    let mut content = String::new();
    for k in 0..1_000_000 {
        content += &format!("0 {:.5} 20\n", -12.0 + f64::from(k) * 2.4e-5);
    }
    bench.refuses("column.xyz", &content, &["at one x, a single column"]);
    content += &text(&roof());
    let report = bench.remarks("crowded.xyz", &content, "repeated");
    assert_eq!(report["scan"]["samples"], 1_000_000 + 49 * 49 - 1);
    assert_eq!(report["model"]["faces"], 2);
}

#[test]
fn numbers_that_are_none_or_too_large() {
    let bench = Bench::new();
    let part = text(&roof());
    bench.refuses(
        "nan.xyz",
        "nan nan nan\n".repeat(60),
        &["60 of 60 points", "first at line 1"],
    );
    let some = part.clone() + "nan 1 2\n1 inf 2\n1 2 1e999\n";
    bench.remarks("some.xyz", some, "3 point(s) without a measurement");
    let far = |shift: f64| text(&roof().map_x(shift));
    bench.refuses(
        "far.xyz",
        far(1e9),
        &["line 1", "limit of 21474 mm", "check the units"],
    );
    bench.refuses(
        "stray.xyz",
        part.clone() + "1 2 -1e9\n",
        &["line 2402", "-1e9 mm"],
    );
    let stray = part.clone() + "20000 1 1\n";
    let report = bench.remarks("stray20m.xyz", stray, "spread over 20.0 m");
    assert_eq!(report["model"]["faces"], 2);
    let corners = part + &text(&roof().map(|[x, y, z]| [x + 9000.0, y + 9000.0, z]));
    bench.refuses(
        "apart.xyz",
        &corners,
        &["spread over 9024.0 x 9024.0 mm", "--roi-x-mm"],
    );
    let cut = [
        "convert",
        "apart.xyz",
        "-o",
        "cut.igs",
        "--roi-x-mm=,100",
        "--roi-y-mm=,100",
    ];
    let output = relief(bench.0.path(), &cut);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

trait MapX {
    fn map_x(self, shift: f64) -> Vec<[f64; 3]>;
    fn map(self, change: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[f64; 3]>;
}

impl MapX for Vec<[f64; 3]> {
    fn map_x(self, shift: f64) -> Vec<[f64; 3]> {
        MapX::map(self, |[x, y, z]| [x + shift, y, z])
    }

    fn map(self, change: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[f64; 3]> {
        self.into_iter().map(change).collect()
    }
}

#[test]
fn units_that_are_probably_others() {
    let bench = Bench::new();
    let scaled = |factor: f64| {
        let points = MapX::map(roof(), |point| point.map(|value| value * factor));
        points
            .iter()
            .map(|[x, y, z]| format!("{x:.6} {y:.6} {z:.6}\n"))
            .collect::<String>()
    };
    let report = bench.remarks("inches.xyz", scaled(1.0 / 25.4), "only 0.945 mm across");
    assert_eq!(report["model"]["faces"], 2);
    bench.refuses("metres.xyz", scaled(1e-3), &["finer than any", "--units"]);
    let report = bench.remarks("micrometres.xyz", scaled(500.0), "spread over 12.0 m");
    assert_eq!(report["model"]["faces"], 2);
    // Who says which unit it is is not asked again.
    let said = ["convert", "metres.xyz", "-o", "part.igs", "--units", "m"];
    let output = relief(bench.0.path(), &said);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !told.contains("note:"), "{told}");
}

#[test]
fn duplicates_and_background() {
    let bench = Bench::new();
    let part = text(&roof());
    let report = bench.remarks(
        "twice.xyz",
        part.repeat(2),
        "2401 of 4802 points were repeated",
    );
    assert_eq!(report["scan"]["samples"], 2401);
    // The same is said to whoever reads no JSON.
    let told = relief(bench.0.path(), &["convert", "twice.xyz", "-o", "part.igs"]);
    assert!(told.status.success());
    let said = String::from_utf8_lossy(&told.stderr);
    is_remarked(&said, "twice.xyz", "points were repeated");
    bench.write(
        "table.xyz",
        text(&grid(60, 60, |i, j| [0.5 * i, 0.5 * j, 0.0])),
    );
    let output = relief(bench.0.path(), &["convert", "table.xyz", "-o", "part.igs"]);
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}");
    assert!(
        told.contains("one plane fills the view and nothing stands before it"),
        "{told}"
    );
}

#[test]
fn text_that_is_cut_off_or_in_another_language() {
    let bench = Bench::new();
    let part = text(&roof());
    bench.refuses(
        "cut.xyz",
        "1 2 3\n4 5 6\n7 8",
        &["line 3", "in the middle of this line"],
    );
    bench.refuses("short.xyz", "1 2 3\n4 5\n", &["line 2", "2 value(s)"]);
    bench.refuses(
        "word.xyz",
        "1 2 3\n4 five 6\n",
        &["line 2", "`five` is not a number"],
    );
    let commas = part.replace('.', ",");
    for (name, content) in [
        ("blanks.xyz", commas.clone()),
        ("tabs.txt", commas.replace(' ', "\t")),
        ("commas.csv", "1,5,2,5,3,5\n".repeat(9)),
        ("thousands.csv", "1.234,5;2.345,6;3.456,7\n".into()),
    ] {
        bench.refuses(name, content, &["decimal commas", "line "]);
    }
    // Where semicolons separate, a decimal comma is no riddle.
    bench.write("semicolons.csv", commas.replace(' ', ";"));
    let output = relief(bench.0.path(), &["convert", "semicolons.csv"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn ply_files_that_lie() {
    let bench = Bench::new();
    let points = roof();
    for format in ["ascii", "binary_little_endian"] {
        let of = |announced: &str| ply(format, announced, &points);
        for more in ["2402", "4000000000"] {
            bench.refuses("more.ply", of(more), &["ends before the", more, "cut off"]);
        }
        bench.refuses(
            "fewer.ply",
            of("100"),
            &["more data follow the 100 vertex entries"],
        );
        bench.refuses(
            "half.ply",
            &of("2401")[..9000],
            &["2401 vertex entries", "cut off"],
        );
        for count in ["-3", "many", "1e3", "99999999999999999999"] {
            bench.refuses(
                "count.ply",
                of(count),
                &["line 3", count, "as a whole number"],
            );
        }
    }
    let binary = ply("binary_little_endian", "2401", &points);
    let swapped = String::from_utf8_lossy(&binary[..40]).contains("little");
    assert!(swapped);
    let says_ascii = [&ply("ascii", "2401", &[])[..], &binary[120..]].concat();
    bench.refuses(
        "ascii.ply",
        says_ascii,
        &["not text, though the header says"],
    );
    let text = [
        &ply("binary_little_endian", "2401", &[])[..],
        text(&points).as_bytes(),
    ]
    .concat();
    bench.refuses("binary.ply", text, &["more data follow"]);
    let list = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int v\n\
                element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let list = [list.as_bytes(), &[0xff; 4000]].concat();
    bench.refuses("list.ply", list, &["a list of more than"]);
}

#[test]
fn compressed_wrongly() {
    let bench = Bench::new();
    let packed = gzip(text(&roof()).as_bytes());
    let name = "scan.xyz.gz";
    let half = packed.len() / 2;
    for end in [2, 9, half, packed.len() - 8, packed.len() - 1] {
        bench.refuses(name, &packed[..end], &["end too early", "cut off"]);
    }
    let mut damaged = packed.clone();
    damaged[half] ^= 0x40;
    bench.refuses(name, &damaged, &["compressed data (gzip)"]);
    let mut checksum = packed.clone();
    let at = checksum.len() - 6;
    checksum[at] ^= 1;
    bench.refuses(name, &checksum, &["are damaged", "copy the file again"]);
    let followed = [&packed[..], b"and something more"].concat();
    bench.refuses(name, followed, &["something that is not gzip follows"]);
    bench.remarks(name, gzip(&packed), "gzip-compressed 2 times over");
    bench.refuses(
        name,
        gzip(&gzip(&packed)),
        &["more than 2 times over; unpack it first"],
    );
    bench.remarks(name, text(&roof()), "named .gz, but is not compressed");
    bench.refuses("scan.xyz", b"BZh91AY&SY", &["is compressed with bzip2"]);
    // Damage in what is unpacked to IGES or a journal is damage of the compression, too.
    let points = gzip(iges(&roof()).as_bytes());
    bench.refuses("p.igs.gz", &points[..points.len() / 2], &["end too early"]);
    let mut journal = gzip(&[b"RELSCAN\n".as_slice(), &[1; 3000]].concat());
    journal.truncate(30);
    bench.refuses("j.scan.gz", &journal, &["end too early"]);
}

#[test]
fn names_that_say_something_else() {
    let bench = Bench::new();
    let part = text(&roof());
    bench.remarks(
        "ply.xyz",
        ply("ascii", "2401", &roof()),
        "but is a PLY file",
    );
    bench.remarks("gzip.ply", gzip(part.as_bytes()), "but is text");
    for name in ["text.igs", "text.ply", "text.scan"] {
        bench.remarks(name, &part, "was read as that");
    }
    bench.remarks("iges.txt", iges(&roof()), "but is an IGES file");
    bench.refuses(
        "words.ply",
        "a b c\n1 2 x\n",
        &["`x` is not a number", "begins with the line `ply`"],
    );
    bench.refuses("words.scan", "a b c\n1 2 x\n", &["begins with `RELSCAN`"]);
    for (content, format) in [
        (&b"\x89PNG\r\n\x1a\n"[..], "a PNG picture"),
        (b"ISO-10303-21;\nHEADER;\n", "a STEP file"),
        (b"solid part\n facet\n", "an STL mesh"),
        (b"PK\x03\x04", "a ZIP archive"),
        (b"<!DOCTYPE html>\n", "an HTML file"),
        (b"\xff\xfe1\x00 \x002\x00", "text in UTF-16"),
    ] {
        bench.refuses("scan.igs", content, &[format, "expected lines of `x y z`"]);
    }
    bench.refuses(
        "bytes.xyz",
        b"1 2 3\n\x01\x02",
        &["byte 6", "expected lines of `x y z`"],
    );
}

#[test]
fn iges_files_that_are_damaged() {
    let bench = Bench::new();
    let sound = iges(&roof());
    bench.write("sound.igs", sound.replace('\n', "\r\n"));
    let output = relief(bench.0.path(), &["convert", "sound.igs", "-o", "part.igs"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let lines: Vec<&str> = sound.lines().collect();
    let with = |line: usize, text: String| {
        let mut lines: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        lines[line - 1] = text;
        lines.join("\n")
    };
    let word = with(10, lines[9].replacen('.', "x", 1));
    bench.refuses(
        "word.igs",
        word,
        &["line 10, entity 106 (D1)", "not a number"],
    );
    let count = with(5, lines[4].replacen("2401", "9401", 1));
    bench.refuses(
        "count.igs",
        count,
        &["entity 106 (D1)", "the record ends before"],
    );
    let delimiter = with(lines.len() - 1, lines[lines.len() - 2].replace(';', " "));
    bench.refuses("end.igs", delimiter, &["entity 106 (D1)", "delimiter"]);
    let lost: Vec<&str> = [&lines[..9], &lines[10..]].concat();
    bench.refuses(
        "lost.igs",
        lost.join("\n"),
        &["line 10", "lines are missing or out of order"],
    );
    bench.refuses(
        "cut.igs",
        &sound[..sound.len() / 2],
        &["this line of", "the file was cut off"],
    );
    bench.refuses(
        "whole_lines.igs",
        lines[..50].join("\n"),
        &["no Terminate section", "cut off"],
    );
    let tabs = sound.replace("        ", "\t");
    bench.refuses("tabs.igs", tabs, &["line 1", "80 columns"]);
}

#[test]
fn cad_models_of_other_programs_are_no_scans() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/iges");
    let Ok(entries) = fs::read_dir(&folder) else {
        println!("skipped: {} is not there", folder.display());
        return;
    };
    let bench = Bench::new();
    let mut models = 0;
    for entry in entries {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let because: &[&str] = match name.as_str() {
            "igesio_first_line_82_cols.iges" | "igesio_first_line_without_80_cols.iges" => {
                &["line 1", "80 columns"]
            }
            "igesio_up_to_line_7_of_DE_section.iges" => &["no Terminate section", "cut off"],
            "occt_bad_header.igs" => &["Global section, field 14"],
            "igesio_sample_curves.igs" => &["holds 10 samples only"],
            "pyiges_sample.igs" => &["holds 4 samples only"],
            "occt_bug27069_points-with-comments.igs" => &["at one x, a single column"],
            _ => {
                models += 1;
                &["holds no measured points", "it is a CAD model, not a scan"]
            }
        };
        bench.refuses_file(path.to_str().unwrap(), because);
    }
    assert_eq!(models, 21);
}

#[test]
fn a_recorded_scan_with_line_ends_of_another_system_is_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/stanford_bunny/bun000_crlf.ply.gz");
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return;
    }
    let bench = Bench::new();
    let arguments = [
        "convert",
        path.to_str().unwrap(),
        "--json",
        "--pitch-mm",
        "2",
    ];
    let output = relief(bench.0.path(), &arguments);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["report"]["scan"]["samples"], 40_256);
    assert!(told["report"]["model"]["faces"].as_u64().unwrap() >= 1);
}
