//! The finished grid columns of a scan, put aside for its job.
//!
//! A cache and nothing more: it spares the worker the regridding that was done while the
//! scanner moved, and it is on disk so that acquisition needs no more memory for a long
//! scan than for a short one. It is never trusted across a restart, so it needs neither
//! sync nor checksum; the journal is what counts.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

use range_image::{GridColumn, Lattice, NodeQuality, RangeImage, RangeImageBuilder};
use relief_api::LiveColumn;

/// Writes the columns as they are finished.
#[derive(Debug)]
pub(crate) struct GridFile {
    out: BufWriter<File>,
}

impl GridFile {
    /// Begins a file with the pitch of its lattice.
    pub(crate) fn create(path: &Path, pitch_mm: f64) -> io::Result<Self> {
        let mut out = BufWriter::new(File::create(path)?);
        out.write_all(&pitch_mm.to_le_bytes())?;
        out.flush()?;
        Ok(Self { out })
    }

    /// What has been appended can be read by others from now on.
    pub(crate) fn show(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    pub(crate) fn append(&mut self, column: &GridColumn) -> io::Result<()> {
        self.out.write_all(&column.i.to_le_bytes())?;
        self.out.write_all(&column.j_first.to_le_bytes())?;
        self.out
            .write_all(&(column.z_mm.len() as u64).to_le_bytes())?;
        for z in &column.z_mm {
            self.out.write_all(&z.to_le_bytes())?;
        }
        let qualities = column.quality.len() as u64;
        self.out.write_all(&qualities.to_le_bytes())?;
        for quality in &column.quality {
            self.out.write_all(&quality.inliers.to_le_bytes())?;
            self.out.write_all(&quality.samples.to_le_bytes())?;
            self.out.write_all(&quality.scale_mm.to_le_bytes())?;
            self.out.write_all(&quality.nearest_mm.to_le_bytes())?;
        }
        Ok(())
    }

    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// The range image of all columns in the file.
pub(crate) fn read(path: &Path, lattice: Lattice) -> io::Result<RangeImage> {
    let mut source = BufReader::new(File::open(path)?);
    let mut builder = RangeImageBuilder::new(lattice);
    let mut word = [0; 8];
    source.read_exact(&mut word)?;
    if f64::from_le_bytes(word).to_bits() != lattice.pitch_mm.to_bits() {
        return Err(io::Error::other("it is of another lattice"));
    }
    loop {
        // Only between columns may the file end.
        if source.read(&mut word[..1])? == 0 {
            return Ok(builder.finish());
        }
        source.read_exact(&mut word[1..])?;
        let i = i64::from_le_bytes(word);
        source.read_exact(&mut word)?;
        let j_first = i64::from_le_bytes(word);
        source.read_exact(&mut word)?;
        let mut z_mm = Vec::new();
        for _ in 0..u64::from_le_bytes(word) {
            source.read_exact(&mut word)?;
            z_mm.push(f64::from_le_bytes(word));
        }
        source.read_exact(&mut word)?;
        let mut quality = Vec::new();
        for _ in 0..u64::from_le_bytes(word) {
            quality.push(read_quality(&mut source)?);
        }
        builder.push(GridColumn {
            i,
            j_first,
            z_mm,
            quality,
        });
    }
}

/// Bytes of a node's quality.
const QUALITY_BYTES: i64 = 12;

/// The columns that are in the file so far, thinned to about so many nodes at most: the pitch of
/// the lattice, which nodes are taken (those whose indices can be divided by this), and the columns.
/// The file may be being written.
pub(crate) fn read_thinned(
    path: &Path,
    most_nodes: usize,
) -> io::Result<(f64, u32, Vec<LiveColumn>)> {
    let mut source = BufReader::new(File::open(path)?);
    let mut word = [0; 8];
    source.read_exact(&mut word)?;
    let pitch_mm = f64::from_le_bytes(word);
    let mut nodes = 0;
    visit(&mut source, |_, _, count| {
        nodes += count;
        false
    })?;
    let step = step(nodes, most_nodes);
    source.seek(SeekFrom::Start(8))?;
    let mut columns = Vec::new();
    let taken = visit(&mut source, |i, _, _| i.rem_euclid(step) == 0)?;
    for (i, j_first, z_mm) in taken {
        columns.push(thinned(i, j_first, &z_mm, step));
    }
    Ok((pitch_mm, step as u32, columns))
}

/// Every so manyth node of every so manyth column is about so many nodes.
pub(crate) fn step(nodes: usize, most_nodes: usize) -> i64 {
    let mut step = 1_usize;
    while nodes / (step * step) > most_nodes {
        step += 1;
    }
    step as i64
}

/// Every so manyth node of a column.
pub(crate) fn thinned(i: i64, j_first: i64, z_mm: &[f64], step: i64) -> LiveColumn {
    let skipped = (-j_first).rem_euclid(step) as usize;
    let z_mm: Vec<f64> = z_mm
        .iter()
        .skip(skipped)
        .step_by(step as usize)
        .copied()
        .collect();
    LiveColumn::new(i, j_first + skipped as i64, &z_mm)
}

/// Columns, each with its index and the first of its nodes'.
type Columns = Vec<(i64, i64, Vec<f64>)>;

/// The whole columns that `wanted` says yes to, being told their indices and how many nodes they
/// have.
fn visit(
    source: &mut BufReader<File>,
    mut wanted: impl FnMut(i64, i64, usize) -> bool,
) -> io::Result<Columns> {
    let mut taken = Vec::new();
    let end = source.get_ref().metadata()?.len();
    let mut at = source.stream_position()?;
    let mut word = [0; 8];
    loop {
        // What is still being written is not there yet.
        if at + 24 > end {
            return Ok(taken);
        }
        source.read_exact(&mut word)?;
        let i = i64::from_le_bytes(word);
        source.read_exact(&mut word)?;
        let j_first = i64::from_le_bytes(word);
        source.read_exact(&mut word)?;
        let nodes = u64::from_le_bytes(word);
        at += 24 + nodes.saturating_mul(8);
        if at + 8 > end {
            return Ok(taken);
        }
        if wanted(i, j_first, nodes as usize) {
            let mut z_mm = Vec::with_capacity(nodes as usize);
            for _ in 0..nodes {
                source.read_exact(&mut word)?;
                z_mm.push(f64::from_le_bytes(word));
            }
            taken.push((i, j_first, z_mm));
        } else {
            source.seek_relative(nodes as i64 * 8)?;
        }
        source.read_exact(&mut word)?;
        let qualities = u64::from_le_bytes(word) as i64;
        source.seek_relative(qualities * QUALITY_BYTES)?;
        at += 8 + qualities as u64 * QUALITY_BYTES as u64;
    }
}

fn read_quality(source: &mut impl Read) -> io::Result<NodeQuality> {
    let (mut count, mut length) = ([0; 2], [0; 4]);
    source.read_exact(&mut count)?;
    let inliers = u16::from_le_bytes(count);
    source.read_exact(&mut count)?;
    let samples = u16::from_le_bytes(count);
    source.read_exact(&mut length)?;
    let scale_mm = f32::from_le_bytes(length);
    source.read_exact(&mut length)?;
    Ok(NodeQuality {
        inliers,
        samples,
        scale_mm,
        nearest_mm: f32::from_le_bytes(length),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.grid");
        let of = |inliers| NodeQuality {
            inliers,
            samples: 9,
            scale_mm: 0.1,
            nearest_mm: 1.0 / 3.0,
        };
        let columns = [
            GridColumn {
                i: -2,
                j_first: 5,
                z_mm: vec![0.1, f64::NAN, -3.5],
                quality: [1, 0, 7].map(of).to_vec(),
            },
            GridColumn {
                i: 1,
                j_first: 4,
                z_mm: vec![1.0 / 3.0],
                quality: Vec::new(),
            },
        ];
        let lattice = Lattice { pitch_mm: 0.5 };
        let mut file = GridFile::create(&path, lattice.pitch_mm).unwrap();
        let mut builder = RangeImageBuilder::new(lattice);
        for column in columns {
            file.append(&column).unwrap();
            builder.push(column);
        }
        file.finish().unwrap();
        let (read, built) = (read(&path, lattice).unwrap(), builder.finish());
        assert_eq!(read.origin(), built.origin());
        let bits = |image: &RangeImage| -> Vec<u64> {
            image.raw_z_mm().iter().map(|z| z.to_bits()).collect()
        };
        assert_eq!(bits(&read), bits(&built));
        assert_eq!(read.quality(0, 3), built.quality(0, 3));
        assert!(read.qualities().eq([1, 7].map(of)));
        let other = Lattice { pitch_mm: 0.25 };
        assert!(super::read(&path, other).is_err(), "another lattice");
    }

    #[test]
    fn what_is_being_written_is_shown_as_far_as_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.grid");
        let mut file = GridFile::create(&path, 0.5).unwrap();
        let (pitch_mm, step, columns) = read_thinned(&path, 100).unwrap();
        assert_eq!((pitch_mm, step, columns), (0.5, 1, vec![]));
        for i in -4..4 {
            let quality = NodeQuality {
                inliers: 1,
                samples: 1,
                scale_mm: 0.0,
                nearest_mm: 0.0,
            };
            file.append(&GridColumn {
                i,
                j_first: -3,
                z_mm: (0..6).map(|k| f64::from(k) + i as f64 * 10.0).collect(),
                quality: vec![quality; 6],
            })
            .unwrap();
        }
        file.show().unwrap();
        let (_, step, all) = read_thinned(&path, 48).unwrap();
        assert_eq!((step, all.len()), (1, 8));
        assert_eq!(
            all[0],
            LiveColumn::new(-4, -3, &[-40.0, -39.0, -38.0, -37.0, -36.0, -35.0])
        );
        // Nodes of even indices: -2, 0 and 2 of -4, -2, 0 and 2.
        let (_, step, thin) = read_thinned(&path, 12).unwrap();
        assert_eq!(step, 2);
        let indices: Vec<i64> = thin.iter().map(|column| column.i).collect();
        assert_eq!(indices, [-4, -2, 0, 2]);
        assert_eq!(thin[3], LiveColumn::new(2, -2, &[21.0, 23.0, 25.0]));
        // The last column is only half there.
        let bytes = std::fs::read(&path).unwrap();
        for cut in [1, 60, 100] {
            std::fs::write(&path, &bytes[..bytes.len() - cut]).unwrap();
            let (_, _, columns) = read_thinned(&path, 100).unwrap();
            assert!(columns.len() >= 7, "{cut}: {}", columns.len());
            assert_eq!(columns[..7], all[..7]);
        }
    }
}
