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

/// Every recording below a folder, in the order of their paths. Meshes, which were made of
/// many views, and files that hold the same samples as another are no recordings.
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
            let known = [".ply.gz", ".pgm.gz", ".xyz.gz"];
            let other = ["zipper", "crlf", "robotframe", "edge_strip"];
            if known.iter().any(|e| name.ends_with(e)) && !other.iter().any(|o| name.contains(o)) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Reads a recording.
pub(crate) fn recording(path: &Path) -> Result<Recording> {
    let name = path.display().to_string();
    let scan = if name.ends_with(".pgm.gz") {
        let mut bytes = Vec::new();
        GzDecoder::new(File::open(path)?).read_to_end(&mut bytes)?;
        let points = height_map(&bytes).with_context(|| format!("{name} is no height map"))?;
        from_points_mm(points, &name, &ReadOptions::default())?
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

#[cfg(test)]
mod tests {
    use super::*;

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
