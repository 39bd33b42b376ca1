//! Reading a journal back, one column at a time.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use crate::column::RawColumn;
use crate::format::{
    Fields, KIND_COLUMN, KIND_END, KIND_HEADER, MAGIC, PREAMBLE_BYTES, RECORD_HEAD_BYTES, VERSION,
    checksum, payload_limit,
};
use crate::header::Header;
use crate::writer::EndCause;

/// A journal cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The medium refused.
    #[error("cannot read the scan journal: {0}")]
    Io(#[from] io::Error),
    /// The first bytes are those of something else.
    #[error("this is no scan journal: it does not begin with \"RELSCAN\"")]
    NotAJournal,
    /// Written by a newer program.
    #[error(
        "this scan journal has format version {found}, this program reads up to {VERSION}: \
         use a newer version of Relief"
    )]
    UnknownVersion {
        /// The version in the file.
        found: u16,
    },
    /// Without its header a scan has no meaning.
    #[error("the header of this scan journal (byte {at_byte}) is damaged: {what}")]
    DamagedHeader {
        /// Where the header's record begins.
        at_byte: u64,
        /// What is wrong with it.
        what: &'static str,
    },
}

/// How a journal ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// With its end record, as it should.
    Closed(EndCause),
    /// Torn or damaged; everything before is sound.
    Damaged {
        /// Where the first record that does not check begins.
        at_byte: u64,
        /// Columns before it, all kept.
        columns: u32,
        /// What is wrong with it.
        what: &'static str,
    },
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Closed(EndCause::Complete) => f.write_str("complete"),
            Self::Closed(EndCause::Aborted(reason)) => write!(f, "aborted: {reason}"),
            Self::Closed(EndCause::Fault(reason)) => write!(f, "ended by a fault: {reason}"),
            Self::Damaged {
                at_byte,
                columns,
                what,
            } => write!(
                f,
                "incomplete: at byte {at_byte} {what}; {columns} columns before it are kept"
            ),
        }
    }
}

/// Where a journal without an end record can be gone on with: behind its last sound record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Continuation {
    pub(crate) at_byte: u64,
    pub(crate) columns: u32,
    pub(crate) last_index: Option<u32>,
}

impl Continuation {
    /// Bytes of the sound records.
    #[must_use]
    pub fn at_byte(&self) -> u64 {
        self.at_byte
    }
}

/// Streams the columns of a journal; holds one at a time.
#[derive(Debug)]
pub struct JournalReader<R> {
    source: R,
    header: Header,
    at_byte: u64,
    columns: u32,
    last_index: Option<u32>,
    payload: Vec<u8>,
    ending: Option<Ending>,
}

/// What stands where a record should.
enum Record {
    Sound(u8),
    /// The source ended exactly here.
    Nothing,
    Bad(&'static str),
}

impl JournalReader<BufReader<File>> {
    /// Opens a journal and reads its header.
    ///
    /// # Errors
    /// As [`JournalReader::new`].
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::new(BufReader::new(File::open(path)?))
    }
}

impl<R: Read> JournalReader<R> {
    /// Reads the header. A source that is not buffered costs three reads a column.
    ///
    /// # Errors
    /// Any [`ReadError`].
    pub fn new(mut source: R) -> Result<Self, ReadError> {
        let mut preamble = [0; PREAMBLE_BYTES];
        let read = fill(&mut source, &mut preamble)?;
        if read < PREAMBLE_BYTES || !preamble.starts_with(&MAGIC) {
            return Err(ReadError::NotAJournal);
        }
        let found = u16::from_le_bytes([preamble[8], preamble[9]]);
        if !Header::knows(found) {
            return Err(ReadError::UnknownVersion { found });
        }
        let at_byte = PREAMBLE_BYTES as u64;
        let damaged = |what| ReadError::DamagedHeader { at_byte, what };
        let mut payload = Vec::new();
        let header = match read_record(&mut source, &mut payload)? {
            Record::Sound(KIND_HEADER) => Header::decode(&payload, found).map_err(damaged)?,
            Record::Sound(_) => return Err(damaged("another record stands in its place")),
            Record::Nothing => return Err(damaged("the file ends there")),
            Record::Bad(what) => return Err(damaged(what)),
        };
        Ok(Self {
            source,
            header,
            at_byte: at_byte + record_bytes(&payload),
            columns: 0,
            last_index: None,
            payload,
            ending: None,
        })
    }

    /// What was known before the first column.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Where it can be gone on with, once all its columns have been read; `None` before, and if
    /// it has its end record.
    #[must_use]
    pub fn continuation(&self) -> Option<Continuation> {
        match self.ending {
            Some(Ending::Damaged { at_byte, .. }) => Some(Continuation {
                at_byte,
                columns: self.columns,
                last_index: self.last_index,
            }),
            Some(Ending::Closed(_)) | None => None,
        }
    }

    /// The next column; `None` at the end, which [`Self::ending`] then describes.
    ///
    /// # Errors
    /// [`ReadError::Io`] only: damage ends the stream and is told by [`Self::ending`].
    pub fn next_column(&mut self) -> Result<Option<RawColumn>, ReadError> {
        if self.ending.is_some() {
            return Ok(None);
        }
        let what = match read_record(&mut self.source, &mut self.payload)? {
            Record::Sound(KIND_COLUMN) => match RawColumn::decode(&self.payload) {
                Some(column) if self.last_index.is_none_or(|last| column.index > last) => {
                    self.last_index = Some(column.index);
                    self.columns += 1;
                    self.at_byte += record_bytes(&self.payload);
                    return Ok(Some(column));
                }
                Some(_) => "a column stands out of order",
                None => "a column does not have the length its samples need",
            },
            Record::Sound(KIND_END) => match decode_end(&self.payload, self.columns) {
                Ok(cause) => {
                    self.ending = Some(Ending::Closed(cause));
                    return Ok(None);
                }
                Err(what) => what,
            },
            Record::Sound(_) => "a second header stands among the columns",
            Record::Nothing => "the file ends without its end record",
            Record::Bad(what) => what,
        };
        self.ending = Some(Ending::Damaged {
            at_byte: self.at_byte,
            columns: self.columns,
            what,
        });
        Ok(None)
    }

    /// Columns read so far.
    #[must_use]
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// How the journal ends; `None` before [`Self::next_column`] has come to it.
    #[must_use]
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }
}

fn decode_end(payload: &[u8], columns: u32) -> Result<EndCause, &'static str> {
    let mut fields = Fields(payload);
    let (Some(code), Some(counted)) = (fields.u8(), fields.u32()) else {
        return Err("the end record is too short");
    };
    if counted != columns {
        return Err("the end record counts other columns than there are");
    }
    let reason = String::from_utf8_lossy(fields.0).into_owned();
    match code {
        0 => Ok(EndCause::Complete),
        1 => Ok(EndCause::Aborted(reason)),
        2 => Ok(EndCause::Fault(reason)),
        _ => Err("the end record names no known cause"),
    }
}

/// Bytes of the whole record around a payload.
fn record_bytes(payload: &[u8]) -> u64 {
    (RECORD_HEAD_BYTES + payload.len() + size_of::<u32>()) as u64
}

/// Reads a record into `payload`, which never grows beyond its kind's limit.
fn read_record(source: &mut impl Read, payload: &mut Vec<u8>) -> io::Result<Record> {
    const TORN: &str = "a record is cut off";
    let mut head = [0; RECORD_HEAD_BYTES];
    match fill(source, &mut head)? {
        0 => return Ok(Record::Nothing),
        RECORD_HEAD_BYTES => {}
        _ => return Ok(Record::Bad(TORN)),
    }
    let [kind, a, b, c, d] = head;
    let length = u32::from_le_bytes([a, b, c, d]) as usize;
    match payload_limit(kind) {
        None => return Ok(Record::Bad("a record is of no known kind")),
        Some(limit) if length > limit => {
            return Ok(Record::Bad("a record claims an impossible length"));
        }
        Some(_) => {}
    }
    payload.clear();
    payload.resize(length, 0);
    let mut trailer = [0; size_of::<u32>()];
    if fill(source, payload)? < length || fill(source, &mut trailer)? < trailer.len() {
        return Ok(Record::Bad(TORN));
    }
    if u32::from_le_bytes(trailer) != checksum(&head, payload) {
        return Ok(Record::Bad("a record does not match its checksum"));
    }
    Ok(Record::Sound(kind))
}

/// Fills the buffer as far as the source goes; fewer bytes mean its end.
fn fill(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match source.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}
