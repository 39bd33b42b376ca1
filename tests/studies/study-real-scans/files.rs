//! The recordings, and how each is read.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use flate2::read::GzDecoder;
use range_image::{Column, Sample};
use scan_files::{PointScan, ReadOptions, Units, from_points_mm, read};

/// A recording, as columns.
pub(crate) struct Recording {
    pub(crate) columns: Vec<Column>,
    pub(crate) pitch_mm: f64,
}

/// Distance in x that profiles without a stage are given, millimetres: about that of the
/// samples along them.
const STACKED_MM: f64 = 0.15;

/// The first of a folder of profiles, which make one recording.
const FIRST_PROFILE: &str = "Profile_0.bin";

/// Every recording below a folder, in the order of their paths; of a folder of profiles the
/// first. Meshes, which were made of many views, and files that hold the same samples as
/// another are no recordings.
pub(crate) fn all(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder)
            .with_context(|| format!("cannot list {}", folder.display()))?;
        for entry in entries {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.display().to_string();
            let known = [".ply.gz", ".pgm.gz", ".xyz.gz", FIRST_PROFILE];
            let other = ["zipper", "crlf", "robotframe"];
            if known.iter().any(|e| name.ends_with(e)) && !other.iter().any(|o| name.contains(o)) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// What a recording is called: its file, or the folder of its profiles.
pub(crate) fn name(path: &Path) -> String {
    let profiles = path.ends_with(FIRST_PROFILE);
    let named = if profiles { path.parent() } else { Some(path) };
    let name = named.and_then(Path::file_name).unwrap_or_default();
    let name = name.to_string_lossy();
    name.split('.').next().unwrap_or_default().to_owned()
}

/// Reads a recording.
pub(crate) fn recording(path: &Path) -> Result<Recording> {
    let name = path.display().to_string();
    let scan = if name.ends_with(".pgm.gz") {
        let mut bytes = Vec::new();
        GzDecoder::new(File::open(path)?).read_to_end(&mut bytes)?;
        let points = height_map(&bytes).with_context(|| format!("{name} is no height map"))?;
        from_points_mm(points, &name, &ReadOptions::default())?
    } else if name.ends_with(FIRST_PROFILE) {
        from_points_mm(profiles(path)?, &name, &ReadOptions::default())?
    } else {
        // Text says nothing of its unit; these recordings are in metres.
        let units = name.ends_with(".xyz.gz").then_some(Units::Metre);
        read(
            path,
            &ReadOptions {
                units,
                ..ReadOptions::default()
            },
        )?
    };
    Ok(columns(scan))
}

fn columns(scan: PointScan) -> Recording {
    let pitch_mm = scan.recommended_pitch_mm();
    let columns = scan.columns.into_iter().map(|column| {
        let samples = column.samples.into_iter().map(|sample| Sample {
            y_mm: sample.y_mm,
            z_mm: sample.z_mm,
            intensity: sample.intensity,
        });
        Column::new(column.x_mm, samples.collect())
    });
    Recording {
        columns: columns.collect(),
        pitch_mm,
    }
}

/// A sensor's height map: a binary PGM with 16 bits, each row a profile, its scales in a
/// comment. Profiles become columns.
fn height_map(bytes: &[u8]) -> Result<Vec<[f64; 3]>> {
    let mut rest = bytes;
    let mut line = || -> Result<String> {
        let end = rest
            .iter()
            .position(|b| *b == b'\n')
            .context("it ends early")?;
        let (head, tail) = rest.split_at(end);
        rest = tail.get(1..).unwrap_or_default();
        Ok(String::from_utf8_lossy(head).into_owned())
    };
    ensure!(line()? == "P5", "it does not begin with P5");
    let comment = line()?;
    let size = line()?;
    ensure!(line()? == "65535", "its values are not of 16 bits");
    let scale = |name: &str| -> Result<f64> {
        let words = comment.split_whitespace();
        let found = words
            .filter_map(|w| w.split_once('='))
            .find(|w| w.0 == name);
        let (_, value) = found.with_context(|| format!("its comment lacks {name}"))?;
        Ok(value.parse()?)
    };
    let (x, y, z) = (scale("px_x_mm")?, scale("px_y_mm")?, scale("px_z_mm")?);
    let Some((width, height)) = size.split_once(' ') else {
        bail!("its size is {size:?}");
    };
    let (width, height): (usize, usize) = (width.parse()?, height.parse()?);
    ensure!(rest.len() >= 2 * width * height, "it ends early");
    let values = rest.chunks_exact(2).take(width * height).enumerate();
    Ok(values
        .map(|(k, pair)| (k, u16::from_be_bytes([pair[0], pair[1]])))
        .filter(|(_, value)| *value > 0)
        .map(|(k, value)| {
            let (row, column) = ((k / width) as f64, (k % width) as f64);
            [row * y, column * x, f64::from(value) * z]
        })
        .collect())
}

/// All profiles of a folder beside each other: their sensor stood still.
fn profiles(first: &Path) -> Result<Vec<[f64; 3]>> {
    let mut points = Vec::new();
    for k in 0.. {
        let path = first.with_file_name(format!("Profile_{k}.bin"));
        if !path.exists() {
            break;
        }
        let bytes = std::fs::read(&path)?;
        let profile =
            profile(&bytes).with_context(|| format!("{} is no profile", path.display()))?;
        let x_mm = STACKED_MM * f64::from(k);
        points.extend(
            profile
                .into_iter()
                .map(|[y_mm, away_mm]| [x_mm, y_mm, -away_mm]),
        );
    }
    Ok(points)
}

/// A packet of an RF627 sensor: along the laser line and away from the sensor, millimetres.
/// A header of 64 bytes says what the greatest counts stand for; z of 0 is no sample.
fn profile(bytes: &[u8]) -> Result<Vec<[f64; 2]>> {
    const HEADER: usize = 64;
    let word = |at: usize| -> Result<u16> {
        let pair = bytes.get(at..at + 2).context("it ends early")?;
        Ok(u16::from_le_bytes([pair[0], pair[1]]))
    };
    ensure!(bytes.first() == Some(&0x11), "it does not begin with 0x11");
    let (range_mm, width_mm, counts) = (word(28)?, word(30)?, word(32)?);
    ensure!(counts > 0, "its greatest count is 0");
    let scale = |full_mm: u16| f64::from(full_mm) / f64::from(counts);
    let (x, z) = (scale(width_mm), scale(range_mm));
    let samples = bytes.get(HEADER..).context("it ends early")?;
    let count = |a: u8, b: u8| f64::from(i16::from_le_bytes([a, b]));
    let samples = samples.chunks_exact(4);
    Ok(samples
        .map(|s| [count(s[0], s[1]), count(s[2], s[3])])
        .filter(|s| s[1] != 0.0)
        .map(|s| [x * s[0], z * s[1]])
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_is_read_by_the_scales_of_its_header() {
        let mut bytes = vec![0_u8; 64];
        bytes[0] = 0x11;
        bytes[28..34].copy_from_slice(&[200, 0, 166, 0, 0, 0x40]);
        for count in [-8192_i16, 4096, 0, 0, 8192, 8192] {
            bytes.extend(count.to_le_bytes());
        }
        assert_eq!(profile(&bytes).unwrap(), [[-83.0, 50.0], [83.0, 100.0]]);
        assert!(profile(&bytes[..40]).is_err());
        assert!(profile(&[0; 80]).is_err());
    }

    #[test]
    fn a_height_map_is_read_row_by_row() {
        let mut bytes =
            b"P5\n# px_x_mm=0.5 px_y_mm=2 px_z_mm=0.01 missing=0\n3 2\n65535\n".to_vec();
        for value in [0_u16, 100, 0, 300, 0, 65535] {
            bytes.extend(value.to_be_bytes());
        }
        let points = height_map(&bytes).unwrap();
        assert_eq!(points.len(), 3);
        assert_eq!(points[0], [0.0, 0.5, 1.0]);
        assert_eq!(points[1], [2.0, 0.0, 3.0]);
        assert!(height_map(b"P5\n# nothing\n3 2\n65535\n").is_err());
        assert!(height_map(&bytes[..bytes.len() - 1]).is_err());
    }
}
