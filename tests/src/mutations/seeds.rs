//! Sound files of every format, small, to be damaged.

use std::fmt::Write as _;
use std::io::{self, Write};

use anyhow::Result;
use flate2::Compression;
use flate2::write::GzEncoder;
use range_image::{Calibration, calibration::Head};
use scan_record::{EndCause, Header, JournalWriter, RawColumn, RawSample};

use super::Dice;

const SIDE: i32 = 14;

/// A sound file.
#[derive(Debug, Clone)]
pub struct Seed {
    /// Its format.
    pub name: &'static str,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// One file of every format, plain.
///
/// # Errors
/// When a journal cannot be written.
pub fn seeds() -> Result<Vec<Seed>> {
    let points = roof();
    let mut blanks = String::from("# roof\n");
    let mut semicolons = String::from("\"X [mm]\";\"Y [mm]\";\"Z [mm]\";intensity\r\n");
    for [x, y, z] in &points {
        writeln!(blanks, "{x} {y} {z}")?;
        let line = format!("{x};{y};{z};{}\r\n", (z * 7.0) as i32);
        semicolons += &line.replace('.', ",");
    }
    Ok(vec![
        seed("text", blanks.into_bytes()),
        seed("text with semicolons", semicolons.into_bytes()),
        seed("PLY ascii", ply("ascii", &points)),
        seed(
            "PLY binary, little-endian",
            ply("binary_little_endian", &points),
        ),
        seed("PLY binary, big-endian", ply("binary_big_endian", &points)),
        seed("IGES 106", iges(&points, 100).into_bytes()),
        seed("IGES 116", iges(&points, 1).into_bytes()),
        seed("journal", journal(&mut Dice::new(0), false)?),
    ])
}

fn seed(name: &'static str, bytes: Vec<u8>) -> Seed {
    Seed { name, bytes }
}

/// The bytes compressed.
///
/// # Errors
/// Never: memory takes any bytes.
pub(super) fn gzip(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes)?;
    encoder.finish()
}

fn roof() -> Vec<[f64; 3]> {
    (-SIDE..=SIDE)
        .flat_map(|i| (-SIDE..=SIDE).map(move |j| (f64::from(i) * 0.5, f64::from(j) * 0.5)))
        .map(|(x, y)| [x, y, 20.0 - 0.5 * x.abs() + 0.25 * y])
        .collect()
}

/// Vertices, and faces after them, as scanners' programs write them.
fn ply(format: &str, points: &[[f64; 3]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment roof\nelement vertex {}\nproperty float x\n\
         property double y\nproperty float z\nproperty uchar intensity\nelement face 2\n\
         property list uchar int vertex_indices\nend_header\n",
        points.len()
    )
    .into_bytes();
    let faces = [[0_i32, 1, 2], [1, 2, 3]];
    if format == "ascii" {
        for [x, y, z] in points {
            bytes.extend_from_slice(format!("{x} {y} {z} 90\n").as_bytes());
        }
        for [a, b, c] in faces {
            bytes.extend_from_slice(format!("3 {a} {b} {c}\n").as_bytes());
        }
        return bytes;
    }
    let mut put = |mut value: Vec<u8>| {
        if format == "binary_big_endian" {
            value.reverse();
        }
        bytes.extend(value);
    };
    for &[x, y, z] in points {
        put((x as f32).to_le_bytes().to_vec());
        put(y.to_le_bytes().to_vec());
        put((z as f32).to_le_bytes().to_vec());
        put(vec![90]);
    }
    for face in faces {
        put(vec![3]);
        face.iter()
            .for_each(|corner| put(corner.to_le_bytes().to_vec()));
    }
    bytes
}

/// Points in entities of so many each, all under one matrix.
fn iges(points: &[[f64; 3]], each: usize) -> String {
    let mut records = vec![(
        124,
        0,
        "124,1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.;".to_owned(),
    )];
    for group in points.chunks(each) {
        let values: Vec<String> = group.iter().flatten().map(|v| format!("{v:?}")).collect();
        let values = values.join(",");
        records.push(if each == 1 {
            (116, 0, format!("116,{values},0;"))
        } else {
            (106, 2, format!("106,2,{},{values};", group.len()))
        });
    }
    let global = "1H,,1H;,4Hroof,6Hroof.x,3Hsys,1H1,32,38,6,308,15,4Hroof,1.,2,2HMM,1,0.,,0.,1.;";
    let mut text = format!("{:<72}S{:7}\n", "roof", 1);
    let global: Vec<&str> = split(global, 72);
    for (index, line) in global.iter().enumerate() {
        text += &format!("{line:<72}G{:7}\n", index + 1);
    }
    let mut data = String::new();
    let mut line = 0;
    for (index, (entity, form, parameters)) in records.iter().enumerate() {
        let own = 2 * index + 1;
        let lines = at_commas(parameters, 64);
        let matrix = i32::from(*entity != 124);
        text += &format!(
            "{entity:8}{:8}{:8}{:8}{:8}{:8}{matrix:8}{:8}00000000D{own:7}\n",
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
            lines.len(),
            "",
            own + 1
        );
        for part in lines {
            line += 1;
            data += &format!("{part:<64} {own:7}P{line:7}\n");
        }
    }
    let counts = format!(
        "S{:7}G{:7}D{:7}P{line:7}",
        1,
        global.len(),
        2 * records.len()
    );
    text + &data + &format!("{counts:<72}T{:7}\n", 1)
}

fn split(text: &str, width: usize) -> Vec<&str> {
    let mut rest = text;
    let mut parts = Vec::new();
    while !rest.is_empty() {
        let (part, others) = rest.split_at(width.min(rest.len()));
        parts.push(part);
        rest = others;
    }
    parts
}

/// A record in lines no wider than this.
pub(super) fn at_commas(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for value in text.split_inclusive(',') {
        match lines.last_mut() {
            Some(line) if line.len() + value.len() <= width => line.push_str(value),
            _ => lines.push(value.to_owned()),
        }
    }
    lines
}

/// A journal whose checksums are right; of a roof, or `wild`, of numbers that no scanner
/// sends: damage of its bytes would not come past the checksums.
///
/// # Errors
/// When the writer refuses.
pub(super) fn journal(dice: &mut Dice, wild: bool) -> Result<Vec<u8>> {
    let mut length = |usual: f64| {
        const ODD: [f64; 9] = [1e-300, -1e-9, 1e-5, 1e4, 1e9, 1e300, f64::MAX, -1.0, 0.0];
        match wild && dice.once_in(3) {
            true => dice.pick(&ODD).unwrap_or(usual),
            false => usual,
        }
    };
    let header = Header {
        calibration: Calibration {
            table_origin_mm: length(-7.0),
            table_count_mm: length(0.01),
            head: Head::Cartesian {
                count_mm: length(0.01),
            },
            correction: None,
        },
        column_pitch_mm: length(0.5),
        sample_spacing_mm: length(0.5),
        identity: br#"{"model":"M","serial":"1"}"#.to_vec(),
        plan: b"{}".to_vec(),
        settings: Vec::new(),
        metadata: b"{}".to_vec(),
        correction: Vec::new(),
    };
    let mut count = |usual: i32| match wild && dice.once_in(40) {
        true => dice.pick(&[i32::MIN, i32::MAX, 0, -1]).unwrap_or(usual),
        false => usual,
    };
    let mut writer = JournalWriter::new(Vec::new(), &header)?;
    for i in 0..=2 * SIDE {
        let samples = (-SIDE..=SIDE).map(|j| RawSample {
            lateral_counts: count(j * 50),
            range_counts: count(2000 - 25 * (i - SIDE).abs()),
            intensity: 90,
            saturated: false,
        });
        let samples = samples.collect();
        writer.append(&RawColumn {
            index: i as u32,
            table_counts: count(i * 50),
            dropouts: 3,
            samples,
        })?;
    }
    Ok(writer.finish(&EndCause::Complete)?)
}
