//! A kept scan: the append-only journal of raw columns, and its calibration to
//! millimetres.
//!
//! The journal is written while the scanner moves, one record for a column, and is read
//! again by the worker, by a rerun years later, and by `relief convert`. It holds device
//! counts, so that nothing the software does can spoil what was measured; the
//! calibration that turns them into millimetres stands in its header as numbers.
//!
//! The counts stay what the device sent, and the calibration what it announced, whatever is
//! known of how the scanner deviates as it is mounted: a correction stands beside them, with the
//! numbers that were used and where they came from. So a scan gives the same millimetres forever,
//! and can still be calibrated anew.
//!
//! # File format, versions 1 and 2 (`.scan`)
//!
//! All integers are little-endian; `f64` is its IEEE 754 bits.
//!
//! ```text
//! file    = magic "RELSCAN\n" (8 bytes), version u16, reserved u16 = 0, record*
//! record  = kind u8, length u32, payload [u8; length], checksum u32
//! ```
//!
//! The checksum is CRC-32/ISO-HDLC (as in Ethernet and zip) over kind, length and
//! payload. The first record is the header, then come columns in ascending index, last
//! the end record; nothing follows it.
//!
//! | kind | record | payload |
//! | --- | --- | --- |
//! | 1 | header | table origin mm f64, table count mm f64, head kind u8, four f64 of the head, column pitch mm f64, sample spacing mm f64, then four byte strings: identity, plan, settings, metadata, each `length u32, bytes` |
//! | 2 | column | index u32, table position counts i32, dropouts u32, samples u32, then per sample: lateral counts i32, range counts i32, intensity u8, flags u8 (bit 0: saturated) |
//! | 3 | end | cause u8 (0 complete, 1 aborted, 2 fault), columns u32, reason: UTF-8 to the end |
//!
//! Head kind 0 is polar: camera y mm, camera z mm, rad per angle count, mm per range
//! count. Kind 1 is Cartesian: mm per count and three zeros. The four byte strings
//! belong to the writer (the service keeps JSON there); readers of the geometry need
//! none of them.
//!
//! Version 2 has a correction behind the header's four byte strings: ten f64 (angle offset rad,
//! angle scale, range offset mm, range scale, camera x, y, z mm, table towards y rad, table
//! towards z rad, table scale, as [`range_image::Correction`] has them), then a fifth byte string
//! that says where it came from. A scan without a correction is written as version 1, byte for
//! byte as ever. A program that knows version 1 alone refuses version 2 rather than to leave the
//! correction out.
//!
//! # Durability
//!
//! A record is on disk once [`JournalWriter::sync`] has returned; how many appends share
//! one sync is the caller's policy. A file whose end is missing, torn or damaged is read
//! up to the first record that does not check, and [`Ending::Damaged`] tells the byte and
//! what was kept; [`JournalWriter::continue_on`] goes on behind it. Reading needs memory for
//! one column; lengths are checked against [`MAX_SAMPLES`] and [`MAX_HEADER_BYTES`] before
//! anything is allocated.

mod column;
mod format;
mod header;
mod reader;
mod writer;

pub use column::{RawColumn, RawSample};
pub use format::{MAGIC, MAX_HEADER_BYTES, MAX_REASON_BYTES, MAX_SAMPLES, SAMPLE_BYTES, VERSION};
pub use header::Header;
pub use reader::{Continuation, Ending, JournalReader, ReadError};
pub use writer::{EndCause, JournalWriter, Storage, WriteError, most_bytes};
