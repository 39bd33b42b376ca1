//! Truth and range images of the scenes, kept on disk: drawing, scanning and regridding take
//! longer than what is studied.
//!
//! The folder is named by a hash of every source that has a part in them, so that a change of
//! the simulator, of the scenes or of the regridder makes new ones.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use range_image::{Lattice, NodeQuality, RangeImage};
use relief_tests::scenes::truth::Region;
use relief_tests::scenes::{self, Drawn, Set, Truth, View, scan};
use sha2::{Digest, Sha256};
use sim_scanner::scene::FaceId;

/// Sources that decide what a range image or a truth is.
const SOURCES: [&str; 6] = [
    "daemon/scan-files/src/pitch.rs",
    "geometry/pipeline/src/settings.rs",
    "geometry/range-image/src",
    "geometry/regrid/src",
    "sim-scanner/src",
    "tests/src/scenes",
];

/// Libraries whose versions do, too.
const LIBRARIES: [&str; 6] = [
    "glam",
    "libm",
    "nalgebra",
    "parry3d-f64",
    "rand_core",
    "rand_xoshiro",
];

/// Where the material is.
#[derive(Debug)]
pub(crate) struct Store {
    folder: PathBuf,
}

/// The workspace's folder.
pub(crate) fn root() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.ancestors().nth(2).unwrap_or(own).to_owned()
}

/// Where builds and studies leave their files.
pub(crate) fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// One scene as it is judged.
#[derive(Debug)]
pub(crate) struct Subject {
    pub(crate) set: Set,
    pub(crate) seed: u64,
    pub(crate) kind: String,
    pub(crate) truth: Truth,
}

impl Store {
    /// The store for the sources as they are.
    pub(crate) fn open() -> Result<Self> {
        let root = root();
        let mut hash = Sha256::new();
        for source in SOURCES {
            add(&mut hash, &root.join(source))?;
        }
        let lock = fs::read_to_string(root.join("Cargo.lock")).context("no Cargo.lock")?;
        let of = |name: &str| format!("\nname = \"{name}\"\n");
        let entries = lock.split("[[package]]");
        for entry in entries.filter(|e| LIBRARIES.iter().any(|name| e.contains(&of(name)))) {
            hash.update(entry);
        }
        let key: String = hash.finalize()[..8]
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        let folder = target().join("studies/segmentation").join(key);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        Ok(Self { folder })
    }

    /// A scene and the range images of the views asked for.
    pub(crate) fn get(
        &self,
        set: Set,
        seed: u64,
        views: &[View],
    ) -> Result<(Subject, Vec<RangeImage>)> {
        let name = format!("{}-{seed}", set.name());
        let truth_file = self.folder.join(format!("{name}.truth"));
        let mut drawn: Option<Drawn> = None;
        let subject = match read(&truth_file, read_truth)? {
            Some((kind, truth)) => Subject {
                set,
                seed,
                kind,
                truth,
            },
            None => {
                let made = drawn.insert(scenes::draw(set, seed)?);
                write(&truth_file, &truth_bytes(made))?;
                Subject {
                    set,
                    seed,
                    kind: made.kind.to_owned(),
                    truth: made.truth.clone(),
                }
            }
        };
        let mut images = Vec::new();
        for view in views {
            let file = self.folder.join(format!("{name}-{}.image", view.name()));
            let image = match read(&file, read_image)? {
                Some(image) => image,
                None => {
                    let drawn = match &drawn {
                        Some(drawn) => drawn,
                        None => drawn.insert(scenes::draw(set, seed)?),
                    };
                    let image = scan::range_image(drawn, *view)?;
                    write(&file, &image_bytes(&image))?;
                    image
                }
            };
            images.push(image);
        }
        Ok((subject, images))
    }
}

fn add(hash: &mut Sha256, path: &Path) -> Result<()> {
    let failed = || format!("cannot read {}", path.display());
    if path.is_dir() {
        let entries = fs::read_dir(path).with_context(failed)?;
        let mut inside = entries
            .map(|entry| entry.map(|e| e.path()))
            .collect::<Result<Vec<_>, _>>()
            .with_context(failed)?;
        inside.sort();
        return inside.iter().try_for_each(|entry| add(hash, entry));
    }
    let bytes = fs::read(path).with_context(failed)?;
    hash.update(bytes.len().to_le_bytes());
    hash.update(&bytes);
    Ok(())
}

fn read<T>(path: &Path, take: impl FnOnce(&mut Bytes<'_>) -> Option<T>) -> Result<Option<T>> {
    if !path.exists() {
        return Ok(None);
    }
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let taken = take(&mut Bytes(&bytes));
    ensure!(taken.is_some(), "{} is damaged: remove it", path.display());
    Ok(taken)
}

/// Two runs at a time must not read each other's halves.
fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let part = path.with_extension(format!("part-{}", std::process::id()));
    fs::write(&part, bytes).with_context(|| format!("cannot write {}", part.display()))?;
    fs::rename(&part, path).with_context(|| format!("cannot write {}", path.display()))
}

struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take(&mut self) -> Option<[u8; 8]> {
        let (word, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*word)
    }

    fn int(&mut self) -> Option<i64> {
        self.take().map(i64::from_le_bytes)
    }

    fn size(&mut self) -> Option<usize> {
        usize::try_from(self.int()?).ok()
    }

    fn number(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }
}

fn image_bytes(image: &RangeImage) -> Vec<u8> {
    let (i, j) = image.origin();
    let mut out = image.pitch_mm().to_le_bytes().to_vec();
    for number in [i, j, image.columns() as i64, image.rows() as i64] {
        out.extend(number.to_le_bytes());
    }
    for (node, z) in image.raw_z_mm().iter().enumerate() {
        out.extend(z.to_le_bytes());
        if z.is_nan() {
            continue;
        }
        let (column, row) = (node / image.rows(), node % image.rows());
        let quality = image.quality(column, row).unwrap_or_default();
        let counts = [quality.inliers, quality.samples, 0, 0].map(u16::to_le_bytes);
        out.extend(counts.concat());
        let lengths = [quality.scale_mm, quality.nearest_mm].map(f32::to_le_bytes);
        out.extend(lengths.concat());
    }
    out
}

fn read_image(bytes: &mut Bytes<'_>) -> Option<RangeImage> {
    let pitch_mm = bytes.number()?;
    let (i, j) = (bytes.int()?, bytes.int()?);
    let (columns, rows) = (bytes.size()?, bytes.size()?);
    let mut image = RangeImage::masked(Lattice { pitch_mm }, i, j, columns, rows);
    for column in 0..columns {
        for row in 0..rows {
            let z = bytes.number()?;
            if z.is_nan() {
                continue;
            }
            image.set_z_mm(column, row, Some(z));
            let [a, b, c, d, ..] = bytes.take()?;
            let [e, f, g, h, i, j, k, l] = bytes.take()?;
            let quality = NodeQuality {
                inliers: u16::from_le_bytes([a, b]),
                samples: u16::from_le_bytes([c, d]),
                scale_mm: f32::from_le_bytes([e, f, g, h]),
                nearest_mm: f32::from_le_bytes([i, j, k, l]),
            };
            // Set only where one is known, so that an image without any stays so.
            if quality.samples > 0 {
                image.set_quality(column, row, quality);
            }
        }
    }
    Some(image)
}

fn truth_bytes(drawn: &Drawn) -> Vec<u8> {
    let truth = &drawn.truth;
    let mut out = truth.lattice.pitch_mm.to_le_bytes().to_vec();
    let int = |out: &mut Vec<u8>, number: i64| out.extend(number.to_le_bytes());
    for number in [
        truth.i_first,
        truth.j_first,
        truth.columns as i64,
        truth.rows as i64,
        truth.regions.len() as i64,
    ] {
        int(&mut out, number);
    }
    for region in &truth.regions {
        for number in [region.face.body, region.face.face, region.nodes] {
            int(&mut out, number as i64);
        }
    }
    for label in &truth.labels {
        int(&mut out, i64::from(*label));
    }
    out.extend(drawn.kind.as_bytes());
    out
}

fn read_truth(bytes: &mut Bytes<'_>) -> Option<(String, Truth)> {
    let pitch_mm = bytes.number()?;
    let (i_first, j_first) = (bytes.int()?, bytes.int()?);
    let (columns, rows, regions) = (bytes.size()?, bytes.size()?, bytes.size()?);
    let regions = (0..regions)
        .map(|k| {
            let (body, face) = (bytes.size()?, bytes.size()?);
            Some(Region {
                label: u16::try_from(k + 1).ok()?,
                face: FaceId { body, face },
                nodes: bytes.size()?,
            })
        })
        .collect::<Option<Vec<_>>>()?;
    let labels = (0..columns * rows)
        .map(|_| u16::try_from(bytes.int()?).ok())
        .collect::<Option<Vec<_>>>()?;
    let kind = String::from_utf8(bytes.0.to_vec()).ok()?;
    let truth = Truth {
        lattice: Lattice { pitch_mm },
        i_first,
        j_first,
        columns,
        rows,
        labels,
        regions,
    };
    Some((kind, truth))
}
