//! Files of a hundred bytes that ask for everything: each made for one reader, read by all.

use std::io::Write;
use std::time::{Duration, Instant};

use anyhow::Result;
use flate2::Compression;
use flate2::write::GzEncoder;

use super::{GZIP_MAGIC, Meter, read_all};

/// Most memory that reading such a file may take, unless it is packed: what the readers'
/// buffers have, and the longest record that a journal may hold.
pub const MOST_SMALL_BYTES: usize = 16 << 20;

/// What one of them came to.
#[derive(Debug, Clone)]
pub struct Small {
    /// Which.
    pub name: &'static str,
    /// It unfolds to more.
    pub packed: bool,
    /// Its length.
    pub bytes: usize,
    /// Most memory in use, bytes.
    pub peak_bytes: usize,
    /// How long all readers took.
    pub took: Duration,
}

/// Reads each with every reader; what can be read goes on to a model.
///
/// # Errors
/// When a file cannot be made.
pub fn small(meter: &dyn Meter) -> Result<Vec<Small>> {
    let mut all = Vec::new();
    for (name, content) in files()? {
        let before = meter.begin();
        let begun = Instant::now();
        read_all(&content, true);
        all.push(Small {
            name,
            packed: content.starts_with(&GZIP_MAGIC),
            bytes: content.len(),
            peak_bytes: meter.peak().saturating_sub(before),
            took: begun.elapsed(),
        });
    }
    Ok(all)
}

fn files() -> Result<Vec<(&'static str, Vec<u8>)>> {
    let ply = |rest: &str| format!("ply\nformat {rest}").into_bytes();
    let journal = |kind: u8, length: u32| {
        let mut file = b"RELSCAN\n\x01\0\0\0".to_vec();
        file.push(kind);
        file.extend(length.to_le_bytes());
        file
    };
    let iges = |line: &str, section: char| format!("{line:<72}{section}{:>7}\n", 1).into_bytes();
    let packed = |content: &[u8]| -> Result<Vec<u8>> {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
        gzip.write_all(content)?;
        Ok(gzip.finish()?)
    };
    let lattice = (0..16).fold(String::new(), |text, k| {
        text + &format!("{} {} 0\n", k / 4, k % 4)
    });
    Ok(vec![
        (
            "PLY that announces four thousand million vertices",
            ply(
                "binary_little_endian 1.0\nelement vertex 4294967295\nproperty double x\nend_header\n",
            ),
        ),
        (
            "the same in text",
            ply("ascii 1.0\nelement vertex 4294967295\nproperty uchar x\nend_header\n1\n"),
        ),
        (
            "PLY with a list of that length",
            ply(
                "binary_big_endian 1.0\nelement f 1\nproperty list uint uchar i\nend_header\n\u{7f}\u{7f}\u{7f}\u{7f}",
            ),
        ),
        ("journal with the longest header", journal(1, 1 << 20)),
        (
            "journal with a header beyond the longest",
            journal(1, u32::MAX),
        ),
        ("journal with a column for a header", journal(2, 655_376)),
        (
            "IGES with a string of that length",
            iges("1H,,1H;,4294967295Hx", 'G'),
        ),
        (
            "IGES with more entities than it has",
            iges("     116 9999999       0       0", 'D'),
        ),
        (
            "far apart",
            format!("{lattice}21474 21474 0\n").into_bytes(),
        ),
        (
            "farther apart",
            format!("{lattice}1e308 -1e308 0\n").into_bytes(),
        ),
        (
            "nearer than near",
            "0 0 0\n1e-8 0 0\n0 1e-8 0\n".repeat(3).into_bytes(),
        ),
        (
            "a hundred thousand zeros, packed",
            packed(&[b'0'; 100_000])?,
        ),
        (
            "ten million zeros, packed twice",
            packed(&packed(&vec![b'0'; 10_000_000])?)?,
        ),
        (
            "packed, and packed, and packed",
            packed(&packed(&packed(b"1 2 3")?)?)?,
        ),
        ("nothing but signs", "-".repeat(100).into_bytes()),
        (
            "a number of a hundred digits",
            format!("{} 1 1\n", "9".repeat(100)).into_bytes(),
        ),
    ])
}
