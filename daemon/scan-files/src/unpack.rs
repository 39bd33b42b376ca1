//! Compression taken off a file, told by content, with words for what is wrong with it.

use std::io::{self, BufRead, BufReader, Cursor, Read};

use flate2::bufread::GzDecoder;

use crate::error::ScanFileError;

const BUFFER_BYTES: usize = 256 * 1024;
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// Enough to tell all formats apart: the mark of a tar archive is the last to come.
const HEAD_BYTES: u64 = 512;
/// Files that were packed twice by mistake are read; what is packed more often is no
/// accident, and each layer multiplies by a thousand what a small file can unfold to.
const MOST_LAYERS: u32 = 2;
/// Most that a layer of compression is unpacked to: 64 bytes for each of the points that are
/// read, half as much again as a line of text with an intensity takes. A few kB can unfold to
/// this, and to any number without a bound.
pub const MOST_UNPACKED_BYTES: u64 = 1 << 30;
/// Parts, each with a head of its own, that compressed data may be made of, beside one for each
/// kilobyte that is in them: what packs in blocks makes them of 64 kB. A part takes time, even
/// if nothing is in it.
const MOST_PARTS: u64 = 1 << 16;
/// How much is still unpacked to find out whether damage explains what could not be read.
const SEARCHED_BYTES: u64 = 1 << 28;

/// A byte source without its compression.
///
/// Reading fails with [`io::ErrorKind::InvalidData`] and plain words where the compressed
/// data are damaged or cut off.
pub struct Unpacked<'a> {
    head: Vec<u8>,
    reader: Box<dyn BufRead + 'a>,
    layers: u32,
    name: String,
}

impl<'a> Unpacked<'a> {
    /// Takes off the compression, if there is any; `name` stands for the file in errors.
    ///
    /// # Errors
    /// [`ScanFileError::Read`] when the first bytes cannot be read or unpacked,
    /// [`ScanFileError::PackedTooOften`], [`ScanFileError::Empty`].
    pub fn new(source: impl Read + 'a, name: &str) -> Result<Self, ScanFileError> {
        let mut reader: Box<dyn BufRead + 'a> =
            Box::new(BufReader::with_capacity(BUFFER_BYTES, source));
        let mut layers = 0;
        loop {
            let mut head = Vec::new();
            reader
                .by_ref()
                .take(HEAD_BYTES)
                .read_to_end(&mut head)
                .map_err(|source| ScanFileError::Read {
                    file: name.to_owned(),
                    after: "0 bytes".to_owned(),
                    source,
                })?;
            let packed = head.starts_with(&GZIP_MAGIC);
            if head.is_empty() {
                return Err(ScanFileError::Empty {
                    file: name.to_owned(),
                    packed: layers > 0,
                });
            }
            let whole = Cursor::new(head.clone()).chain(reader);
            if !packed {
                return Ok(Self {
                    head,
                    reader: Box::new(whole),
                    layers,
                    name: name.to_owned(),
                });
            }
            if layers == MOST_LAYERS {
                return Err(ScanFileError::PackedTooOften {
                    file: name.to_owned(),
                    limit: MOST_LAYERS,
                });
            }
            layers += 1;
            reader = Box::new(BufReader::with_capacity(
                BUFFER_BYTES,
                Gunzip::new(whole, MOST_UNPACKED_BYTES),
            ));
        }
    }

    /// The first bytes, 512 or as many as there are.
    #[must_use]
    pub fn head(&self) -> &[u8] {
        &self.head
    }

    /// How often the file was compressed.
    #[must_use]
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// After content that made no sense: whether the compressed data are damaged, which
    /// often shows by their checksum only, at their end. Takes some seconds at most.
    #[must_use]
    pub fn damage(&mut self) -> Option<ScanFileError> {
        if self.layers == 0 {
            return None;
        }
        let rest = self.reader.by_ref().take(SEARCHED_BYTES);
        let source = io::copy(&mut { rest }, &mut io::sink()).err()?;
        Some(ScanFileError::Damaged {
            file: self.name.clone(),
            source,
        })
    }
}

impl std::fmt::Debug for Unpacked<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Unpacked")
            .field("name", &self.name)
            .field("layers", &self.layers)
            .finish_non_exhaustive()
    }
}

impl Read for Unpacked<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }
}

impl BufRead for Unpacked<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.reader.consume(amount);
    }
}

/// A decoder of all parts of a layer, whose errors are told in the user's words.
struct Gunzip<R> {
    /// None after the last part.
    part: Option<GzDecoder<R>>,
    parts: u64,
    unpacked: u64,
    most: u64,
}

impl<R: BufRead> Gunzip<R> {
    fn new(packed: R, most: u64) -> Self {
        Self {
            part: Some(GzDecoder::new(packed)),
            parts: 1,
            unpacked: 0,
            most,
        }
    }

    /// Refuses what would go on without end.
    fn check(&self) -> io::Result<()> {
        let what = if self.unpacked > self.most {
            format!(
                "unfold to more than {} bytes, the most that is read",
                self.most
            )
        } else if self.parts > MOST_PARTS + self.unpacked / 1024 {
            format!(
                "are made of more than {} parts with next to nothing in them",
                self.parts - 1
            )
        } else {
            return Ok(());
        };
        let text = format!("the compressed data (gzip) {what}: unpack the file and look into it");
        Err(io::Error::new(io::ErrorKind::InvalidData, text))
    }
}

impl<R: BufRead> Read for Gunzip<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            self.check()?;
            let Some(part) = &mut self.part else {
                return Ok(0);
            };
            let read = part.read(buffer).map_err(|error| self.told(&error))?;
            self.unpacked += read as u64;
            if read > 0 {
                return Ok(read);
            }
            let rest = self.part.take().map(GzDecoder::into_inner);
            if let Some(mut rest) = rest
                && !rest.fill_buf()?.is_empty()
            {
                self.parts += 1;
                self.part = Some(GzDecoder::new(rest));
            }
        }
    }
}

impl<R> Gunzip<R> {
    fn told(&self, error: &io::Error) -> io::Error {
        let cause = error.to_string();
        // What the decoder says of a stream that just ends depends on where it ends.
        let cut = error.kind() == io::ErrorKind::UnexpectedEof || cause.contains("incomplete");
        let text = if matches!(error.kind(), io::ErrorKind::InvalidData) && cause.contains("gzip (")
        {
            // An outer layer has told it already.
            cause
        } else if cut {
            format!(
                "the compressed data (gzip) end too early, after {} unpacked bytes: the file was \
                 cut off, copy it again",
                self.unpacked
            )
        } else if self.unpacked > 0 && cause.contains("header") {
            format!(
                "something that is not gzip follows the compressed data, after {} unpacked \
                 bytes: compress the file anew",
                self.unpacked
            )
        } else if matches!(
            error.kind(),
            io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput
        ) {
            format!(
                "the compressed data (gzip) are damaged, after {} unpacked bytes ({cause}): copy \
                 the file again",
                self.unpacked
            )
        } else {
            return io::Error::new(error.kind(), cause);
        };
        io::Error::new(io::ErrorKind::InvalidData, text)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    #[test]
    fn what_unfolds_without_end_is_not_read_to_its_end() {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&[b'\n'; 100_000]).unwrap();
        let packed = encoder.finish().unwrap();
        let read = |most| {
            let mut bytes = Vec::new();
            let read = Gunzip::new(&*packed, most).read_to_end(&mut bytes);
            read.map_err(|error| error.to_string())
        };
        assert_eq!(read(100_000), Ok(100_000));
        let told = read(50_000).unwrap_err();
        assert!(
            told.contains("(gzip) unfold to more than 50000 bytes"),
            "{told}"
        );
    }

    #[test]
    fn parts_are_read_one_after_the_other_but_not_nothing_without_end() {
        let packed = |bytes: &[u8]| {
            let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        };
        let (nothing, one) = (packed(b""), packed(b"1"));
        let read = |packed: &[u8]| {
            let mut text = String::new();
            let read = Gunzip::new(packed, MOST_UNPACKED_BYTES).read_to_string(&mut text);
            read.map(|_| text).map_err(|error| error.to_string())
        };
        let some = [&one[..], &nothing, &one, &nothing].concat();
        assert_eq!(read(&some), Ok("11".into()));
        let told = read(&nothing.repeat(70_000)).unwrap_err();
        assert!(told.contains("more than 65536 parts"), "{told}");
    }
}
