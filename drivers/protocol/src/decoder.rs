//! From bytes, as they trickle in, to packets.

use crate::frame::{CRC, CRC_LEN, DELIMITER, HEADER_LEN, MAX_PAYLOAD, MAX_WIRE, crc32};

/// A frame whose checksum holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Which message it is.
    pub kind: u8,
    /// Request id, or the sender's running number.
    pub tag: u16,
    /// The message's fields.
    pub payload: heapless::Vec<u8, MAX_PAYLOAD>,
}

impl Packet {
    /// The checksum it came with.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        let mut digest = CRC.digest();
        digest.update(&[self.kind]);
        digest.update(&self.tag.to_le_bytes());
        digest.update(&self.payload);
        digest.finalize()
    }
}

/// What a [`Decoder`] has seen since it was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DecoderCounts {
    /// Bytes fed.
    pub bytes: u64,
    /// Good frames.
    pub frames: u64,
    /// Stretches between delimiters whose checksum did not hold.
    pub bad_checksum: u64,
    /// Stretches that were not stuffed rightly, or too short to be a frame.
    pub malformed: u64,
    /// Stretches longer than any frame.
    pub too_long: u64,
}

impl DecoderCounts {
    /// Stretches between delimiters that were not good frames.
    #[must_use]
    pub fn bad(&self) -> u64 {
        self.bad_checksum + self.malformed + self.too_long
    }
}

/// Finds frames in a stream of bytes.
///
/// Fed slices of any length, it keeps at most one frame, and finds the next good frame
/// after any garbage: every frame begins with a delimiter, which also ends the garbage.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    stuffed: heapless::Vec<u8, { MAX_WIRE - 2 }>,
    overflowed: bool,
    counts: DecoderCounts,
}

impl Decoder {
    /// A decoder that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// What has been seen so far.
    #[must_use]
    pub fn counts(&self) -> DecoderCounts {
        self.counts
    }

    /// The next packet in `bytes`, which is advanced past what was used.
    ///
    /// `None` means that `bytes` is used up; a frame begun in it is finished by later calls.
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<Packet> {
        loop {
            let mut pieces = bytes.splitn(2, |byte| *byte == DELIMITER);
            let piece = pieces.next()?;
            let rest = pieces.next();
            self.overflowed |= self.stuffed.extend_from_slice(piece).is_err();
            self.counts.bytes += piece.len() as u64 + u64::from(rest.is_some());
            *bytes = rest.unwrap_or_default();
            // Without a delimiter they are used up.
            rest?;
            if let Some(packet) = self.close() {
                return Some(packet);
            }
        }
    }

    /// Judges what has come since the last delimiter.
    fn close(&mut self) -> Option<Packet> {
        let packet = if self.overflowed {
            self.counts.too_long += 1;
            None
        } else if self.stuffed.is_empty() {
            // Two delimiters in a row: the end of one frame and the start of the next.
            None
        } else {
            match unframe(&self.stuffed) {
                Ok(packet) => {
                    self.counts.frames += 1;
                    Some(packet)
                }
                Err(Flaw::Malformed) => {
                    self.counts.malformed += 1;
                    None
                }
                Err(Flaw::Checksum) => {
                    self.counts.bad_checksum += 1;
                    None
                }
            }
        };
        self.stuffed.clear();
        self.overflowed = false;
        packet
    }
}

/// What is wrong with a stretch between delimiters.
enum Flaw {
    Malformed,
    Checksum,
}

fn unframe(stuffed: &[u8]) -> Result<Packet, Flaw> {
    // Unstuffing never lengthens, so that this buffer always suffices.
    let mut buffer = [0; MAX_WIRE];
    let report = cobs::decode(stuffed, &mut buffer).map_err(|_| Flaw::Malformed)?;
    let body = buffer.get(..report.frame_size()).ok_or(Flaw::Malformed)?;
    let (body, crc) = body.split_last_chunk::<CRC_LEN>().ok_or(Flaw::Malformed)?;
    let (&[kind, low, high], payload) = body
        .split_first_chunk::<HEADER_LEN>()
        .ok_or(Flaw::Malformed)?;
    if crc32(body) != u32::from_le_bytes(*crc) {
        return Err(Flaw::Checksum);
    }
    Ok(Packet {
        kind,
        tag: u16::from_le_bytes([low, high]),
        payload: heapless::Vec::from_slice(payload).map_err(|_| Flaw::Malformed)?,
    })
}
