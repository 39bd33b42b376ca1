//! The finished grid columns of a scan, put aside for its job.
//!
//! A cache and nothing more: it spares the worker the regridding that was done while the
//! scanner moved, and it is on disk so that acquisition needs no more memory for a long
//! scan than for a short one. It is never trusted across a restart, so it needs neither
//! sync nor checksum; the journal is what counts.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;

use range_image::{GridColumn, Lattice, NodeQuality, RangeImage, RangeImageBuilder};

/// Writes the columns as they are finished.
#[derive(Debug)]
pub(crate) struct GridFile {
    out: BufWriter<File>,
}

impl GridFile {
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        Ok(Self {
            out: BufWriter::new(File::create(path)?),
        })
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
        let mut file = GridFile::create(&path).unwrap();
        let lattice = Lattice { pitch_mm: 0.5 };
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
    }
}
