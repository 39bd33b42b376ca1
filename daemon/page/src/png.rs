//! What a PDF file takes over from a PNG file as it stands: size and compressed rows.

/// A PNG file that cannot be taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PngError {
    /// It has no signature, or ends within a chunk.
    #[error("the picture is no whole PNG file")]
    Broken,
    /// It is not of the one kind that is drawn here.
    #[error("the picture is not of 8 bits of red, green and blue without interlacing")]
    Kind,
}

/// The parts of a PNG file.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Rows {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Rows with the filter of each before it, as one zlib stream.
    pub(crate) compressed: Vec<u8>,
}

const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];

/// Takes a PNG file apart (ISO 15948, section 5).
pub(crate) fn rows(file: &[u8]) -> Result<Rows, PngError> {
    let mut rest = file.strip_prefix(&SIGNATURE).ok_or(PngError::Broken)?;
    let mut size = None;
    let mut compressed = Vec::new();
    loop {
        let (length, after) = rest.split_first_chunk::<4>().ok_or(PngError::Broken)?;
        let (kind, after) = after.split_first_chunk::<4>().ok_or(PngError::Broken)?;
        let length = u32::from_be_bytes(*length) as usize;
        let (content, after) = after.split_at_checked(length).ok_or(PngError::Broken)?;
        // The checksum is not looked at: what is taken over was drawn a moment ago.
        let (_, after) = after.split_first_chunk::<4>().ok_or(PngError::Broken)?;
        match kind {
            b"IHDR" => {
                let &[a, b, c, d, e, f, g, h, ref kind @ ..] = content else {
                    return Err(PngError::Broken);
                };
                // Depth, colours, compression, filter, interlacing.
                if kind != [8, 2, 0, 0, 0] {
                    return Err(PngError::Kind);
                }
                size = Some([[a, b, c, d], [e, f, g, h]].map(u32::from_be_bytes));
            }
            b"IDAT" => compressed.extend_from_slice(content),
            b"IEND" => break,
            _ => {}
        }
        rest = after;
    }
    match size {
        Some([width, height]) if width > 0 && height > 0 => Ok(Rows {
            width,
            height,
            compressed,
        }),
        _ => Err(PngError::Broken),
    }
}
