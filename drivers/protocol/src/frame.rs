//! Frames: a delimiter, the stuffed body with its checksum, a delimiter.

use crc::{CRC_32_ISO_HDLC, Crc};

use crate::message::Message;
use crate::wire::Writer;

/// Most bytes of a frame on the wire, both delimiters counted.
///
/// Short enough that on a line with one bad bit in 100,000 ninety-nine frames in a
/// hundred still arrive whole, and that resending one costs little.
pub const MAX_WIRE: usize = 128;

/// Bytes of the checksum behind the body.
pub(crate) const CRC_LEN: usize = 4;

/// Bytes of kind and tag at the start of the body.
pub(crate) const HEADER_LEN: usize = 3;

/// Most bytes of a body: the frame without two delimiters, the one byte that stuffing
/// adds, and the checksum.
pub const MAX_BODY: usize = MAX_WIRE - 2 - 1 - CRC_LEN;

/// Most bytes of a message's payload: the body without kind and tag.
pub const MAX_PAYLOAD: usize = MAX_BODY - HEADER_LEN;

/// The byte that stands between frames and nowhere else.
pub(crate) const DELIMITER: u8 = 0;

pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The checksum of a body: CRC-32 as in Ethernet and zip (`CRC-32/ISO-HDLC`).
#[must_use]
pub fn crc32(body: &[u8]) -> u32 {
    CRC.checksum(body)
}

/// One frame, ready to be sent.
#[derive(Clone, PartialEq, Eq)]
pub struct Frame {
    bytes: heapless::Vec<u8, MAX_WIRE>,
}

impl Frame {
    /// Frames a message.
    ///
    /// `tag` is the request id for requests and their replies, else the sender's running
    /// number of the frame.
    #[must_use]
    pub fn new<M: Message>(tag: u16, message: &M) -> Self {
        let mut payload = Writer::default();
        message.encode(&mut payload);
        Self::from_payload(M::KIND, tag, payload.as_bytes())
    }

    /// Frames a payload of any kind, such as one kept to answer a repeated request.
    ///
    /// What is beyond [`MAX_PAYLOAD`] is left out.
    #[must_use]
    pub fn from_payload(kind: u8, tag: u16, payload: &[u8]) -> Self {
        let payload = payload.get(..MAX_PAYLOAD).unwrap_or(payload);
        let mut body = heapless::Vec::<u8, { MAX_BODY + CRC_LEN }>::new();
        let [tag_low, tag_high] = tag.to_le_bytes();
        // None of these can overflow: the constants above leave room for every part.
        let _ = body.extend_from_slice(&[kind, tag_low, tag_high]);
        let _ = body.extend_from_slice(payload);
        let crc = crc32(&body);
        let _ = body.extend_from_slice(&crc.to_le_bytes());

        let mut stuffed = [0; MAX_WIRE];
        let len = cobs::try_encode(&body, &mut stuffed).unwrap_or(0);
        let mut bytes = heapless::Vec::new();
        let _ = bytes.push(DELIMITER);
        let _ = bytes.extend_from_slice(stuffed.get(..len).unwrap_or(&[]));
        let _ = bytes.push(DELIMITER);
        Self { bytes }
    }

    /// The bytes for the wire.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }
}

impl core::fmt::Debug for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Frame(")?;
        for byte in &self.bytes {
            write!(f, "{byte:02x}")?;
        }
        f.write_str(")")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_has_the_catalogue_check_value() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn the_longest_frame_fills_the_wire_limit_exactly() {
        let full = Frame::from_payload(0x7f, 0xffff, &[0xff; MAX_PAYLOAD]);
        assert_eq!(full.as_bytes().len(), MAX_WIRE);
        let cut = Frame::from_payload(0x7f, 0xffff, &[0xff; MAX_PAYLOAD + 9]);
        assert_eq!(cut, full);
    }
}
