//! Numbers and byte-level helpers of the file format.

use crc::{CRC_32_ISO_HDLC, Crc};

/// First bytes of every journal. The line feed catches transfers in text mode.
pub const MAGIC: [u8; 8] = *b"RELSCAN\n";

/// The newest format version, which is written where there is a correction; without one it is
/// the first, so that earlier programs read it, too.
pub const VERSION: u16 = 2;

/// Most samples a column may have: four times what the finest profile sensors on the
/// market deliver (16 384 points), and 640 KiB of memory for a hostile file.
pub const MAX_SAMPLES: usize = 65_536;

/// Most bytes the header's payload may have.
pub const MAX_HEADER_BYTES: usize = 1 << 20;

/// Most bytes kept of the reason in an end record; longer ones are cut.
pub const MAX_REASON_BYTES: usize = 4_096;

/// Magic, version, reserved.
pub(crate) const PREAMBLE_BYTES: usize = 12;
/// Kind and length before a payload.
pub(crate) const RECORD_HEAD_BYTES: usize = 5;
/// Index, table position, dropouts and number of samples.
pub(crate) const COLUMN_HEAD_BYTES: usize = 16;
/// Bytes of a sample in the file: lateral, range, intensity, flags.
pub const SAMPLE_BYTES: usize = 10;
/// Cause and number of columns.
pub(crate) const END_HEAD_BYTES: usize = 5;

pub(crate) const KIND_HEADER: u8 = 1;
pub(crate) const KIND_COLUMN: u8 = 2;
pub(crate) const KIND_END: u8 = 3;

const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The most a payload of this kind may hold; `None` for a kind that does not exist.
pub(crate) fn payload_limit(kind: u8) -> Option<usize> {
    match kind {
        KIND_HEADER => Some(MAX_HEADER_BYTES),
        KIND_COLUMN => Some(COLUMN_HEAD_BYTES + MAX_SAMPLES * SAMPLE_BYTES),
        KIND_END => Some(END_HEAD_BYTES + MAX_REASON_BYTES),
        _ => None,
    }
}

/// Kind and length as they stand before the payload.
pub(crate) fn record_head(kind: u8, payload_bytes: usize) -> [u8; RECORD_HEAD_BYTES] {
    // Every writer keeps to `payload_limit`, which is far below 4 GiB.
    let [a, b, c, d] = (payload_bytes as u32).to_le_bytes();
    [kind, a, b, c, d]
}

/// Checksum of a record.
pub(crate) fn checksum(head: &[u8], payload: &[u8]) -> u32 {
    let mut digest = CRC32.digest();
    digest.update(head);
    digest.update(payload);
    digest.finalize()
}

/// Takes numbers off the front of a payload; `None` past its end.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[b]| b)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn i32(&mut self) -> Option<i32> {
        self.array().map(i32::from_le_bytes)
    }

    pub(crate) fn f64(&mut self) -> Option<f64> {
        self.array().map(f64::from_le_bytes)
    }

    /// A byte string behind its length.
    pub(crate) fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()? as usize;
        let (head, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(head)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
