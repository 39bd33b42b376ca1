//! Files made to take a reader as long, and as much memory, as a file of their size can.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::time::Duration;

use anyhow::{Context, Result};
use flate2::Compression;
use flate2::write::GzEncoder;
use range_image::{Calibration, calibration::Head};
use scan_files::{ReadOptions, Unpacked, read_from};
use scan_record::{EndCause, Header, JournalWriter, RawColumn, RawSample};

use super::seeds::at_commas;
use super::{Dice, GZIP_MAGIC, Meter, journal};

/// What a reader came to with one of them.
#[derive(Debug, Clone)]
pub struct Worst {
    /// Which.
    pub name: &'static str,
    /// The reader that took longest.
    pub reader: &'static str,
    /// Length of the file.
    pub bytes: usize,
    /// It unfolds to more.
    pub packed: bool,
    /// Most memory that any reader took beside the file, bytes.
    pub peak_bytes: usize,
    /// Time that the slowest reader had a processor.
    pub took: Duration,
    /// What the reader that its format is for said: what it found, or why nothing.
    pub said: String,
}

/// A file of the size that is asked for, or somewhat less.
type Make = fn(usize) -> Result<Vec<u8>>;
type Reader = fn(&[u8]) -> Result<String, String>;

/// Each reader by itself, and its name.
const READERS: [(&str, Reader); 4] = [
    ("text, PLY", |bytes| {
        read_from(bytes, "worst", &ReadOptions::default())
            .map(|scan| format!("{} points in {} columns", scan.points(), scan.columns.len()))
            .map_err(|error| error.to_string())
    }),
    ("IGES, points", |bytes| {
        let source = unpacked(bytes)?;
        let points = cad_exchange::iges::read_points(source).map_err(|error| error.to_string())?;
        let count = points.len();
        scan_files::from_points_mm(points, "worst", &ReadOptions::default())
            .map(|_| format!("{count} points"))
            .map_err(|error| error.to_string())
    }),
    ("IGES, model", |bytes| {
        let source = unpacked(bytes)?;
        cad_exchange::iges::read_model(source)
            .map(|model| format!("{} faces", model.faces.len()))
            .map_err(|error| error.to_string())
    }),
    ("journal", |bytes| {
        let source = unpacked(bytes)?;
        journal(source)
            .map(|(columns, _)| format!("{} columns", columns.len()))
            .map_err(|error| format!("{error:#}"))
    }),
];

/// All of them.
const FILES: [(&str, Make); 25] = [
    ("text: short points, many of them the same", |size| {
        lines(size, |line, dice| {
            let [x, y, z] = [(); 3].map(|()| dice.below(10));
            writeln!(line, "{x} {y} {z}")
        })
    }),
    ("text: scattered points", |size| {
        lines(size, |line, dice| {
            let [x, y, z] = [(); 3].map(|()| dice.below(20_000));
            writeln!(line, "{x} {y} {z}")
        })
    }),
    ("text: columns of two points", |size| {
        let mut count = 0_u32;
        lines(size, |line, dice| {
            count += 1;
            writeln!(line, ".{:06} {} 0", count / 2, dice.below(10))
        })
    }),
    ("text: distances of every size", |size| {
        lines(size, |line, dice| {
            let x = (dice.below(1 << 31) >> dice.below(31)) as f64 * 1e-5;
            writeln!(line, "{x} {} 0", dice.below(100))
        })
    }),
    ("text: lines without points", |size| Ok(vec![b'\n'; size])),
    ("text: no measurement", |size| {
        lines(size, |line, _| line.write_str("nan nan nan\n"))
    }),
    ("text: numbers of five thousand digits", |size| {
        let digits = format!("9007199254740993.{}1", "0".repeat(5_000));
        lines(size, |line, _| writeln!(line, "{digits} {digits} {digits}"))
    }),
    ("text: eight thousand values a line", |size| {
        let rest = ",1".repeat(8_000);
        lines(size, |line, dice| {
            writeln!(line, "{}.5,1,1{rest}", dice.below(99))
        })
    }),
    ("PLY: points of three bytes", |size| {
        let head = |count| {
            format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty uchar x\n\
                 property uchar y\nproperty uchar z\nend_header\n"
            )
        };
        let mut dice = Dice::new(1);
        let mut file = head(size / 3).into_bytes();
        file.extend((0..size / 3 * 3).map(|_| dice.number() as u8));
        Ok(file)
    }),
    ("PLY: points in text", |size| {
        let body = lines(size, |line, dice| {
            let [x, y, z] = [(); 3].map(|()| dice.below(10));
            writeln!(line, "{x} {y} {z}")
        })?;
        let count = body.len() / 6;
        let head = format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty uchar x\nproperty uchar y\n\
             property uchar z\nend_header\n"
        );
        Ok([head.into_bytes(), body].concat())
    }),
    ("PLY: nothing but empty lists", |size| {
        let mut file = format!(
            "ply\nformat binary_little_endian 1.0\nelement face {size}\nproperty list uchar \
             uchar i\nelement vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar \
             z\nend_header\n"
        )
        .into_bytes();
        file.resize(file.len() + size + 3, 0);
        Ok(file)
    }),
    ("PLY: a header as long as it may be", |size| {
        let names = (0..6_000).fold(String::new(), |text, k| {
            text + &format!("element e{k} 100\nproperty uchar a\n")
        });
        let mut file = format!(
            "ply\nformat binary_little_endian 1.0\n{names}element vertex {size}\nproperty uchar \
             x\nproperty uchar y\nproperty uchar z\nend_header\n"
        )
        .into_bytes();
        file.resize(size.max(file.len()), 0);
        Ok(file)
    }),
    ("PLY: thousands of properties", |size| {
        let names = (0..10_000).fold(String::new(), |text, k| {
            text + &format!("property uchar a{k}\n")
        });
        let count = size / 10_003;
        let mut file = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty uchar \
             x\nproperty uchar y\nproperty uchar z\n{names}end_header\n"
        )
        .into_bytes();
        let mut dice = Dice::new(1);
        file.extend((0..count * 10_003).map(|_| dice.number() as u8));
        Ok(file)
    }),
    ("gzip: lines without points", |size| {
        packed_until(size, b"\n")
    }),
    ("gzip: short points", |size| packed_until(size, b"1 2 3\n")),
    ("gzip: no measurement", |size| {
        packed_until(size, b"nan 1 1\n")
    }),
    ("gzip twice: lines without points", |size| {
        gzip(&packed_until(size.saturating_mul(200), b"\n")?)
    }),
    ("gzip: nothing, again and again", |size| {
        let nothing = gzip(b"")?;
        Ok(nothing.repeat(size / nothing.len()))
    }),
    ("gzip twice: nothing, again and again", |size| {
        let nothing = gzip(b"")?;
        packed_until(size, &nothing)
    }),
    ("IGES: short points", |size| {
        let line = "1,2,3,4,5,6,7,8,9,1,2,3,4,5,6,7,8,9,1,2,3,4,5,6,7,8,9,1,2,3,";
        let count = size / 82;
        let mut parameters = vec![format!("106,2,{},", count * 10)];
        parameters.extend(vec![line.to_owned(); count]);
        parameters.push("0;".into());
        Ok(iges(&[Entry::of(106, 1)], &parameters))
    }),
    ("IGES: points that share their parameters", |size| {
        let blanks = size / 2 / 82;
        let points = vec![Entry::of(116, 1); size / 2 / 162];
        let mut parameters = vec!["116,".to_owned()];
        parameters.extend(vec![String::new(); blanks]);
        parameters.push("1,2,3;".into());
        Ok(iges(&points, &parameters))
    }),
    ("IGES: points behind chains of matrices", |size| {
        let count = size / (162 + 162 + 82 + 82);
        let identity = "124,1,0,0,0,0,1,0,0,0,0,1,0;".to_owned();
        let mut entries = Vec::new();
        for k in 0..count {
            let next = if k % 31 == 30 || k + 1 == count {
                0
            } else {
                2 * k + 3
            };
            entries.push(Entry::of(124, k + 1).moved(next));
        }
        for k in 0..count {
            entries.push(Entry::of(116, count + 1).moved(2 * k + 1));
        }
        let mut parameters = vec![identity; count];
        parameters.extend(vec!["116,1,2,3;".to_owned(); count]);
        Ok(iges(&entries, &parameters))
    }),
    ("IGES: borders of the same curves", |size| {
        // A third of the file each: a curve, a composite of it, a face with its borders.
        let (pieces, parts, borders) = (size / 3 / 32, size / 3 / 3, size / 3 / 3);
        let breaks = (0..=pieces).fold(String::new(), |text, k| text + &format!("{k},"));
        let cubic = "1,".repeat(12 * (pieces + 1));
        let records = [
            (112, format!("112,3,2,3,{pieces},{breaks}{cubic}0;")),
            (102, format!("102,{parts},{}0;", "1,".repeat(parts))),
            (142, "142,0,7,3,3,0;".to_owned()),
            (114, "114,3,1,1,1,0,1,0,1;".to_owned()),
            (
                144,
                format!("144,7,1,{borders},{}0;", "5,".repeat(borders + 1)),
            ),
        ];
        let (mut entries, mut parameters) = (Vec::new(), Vec::new());
        for (entity, record) in records {
            entries.push(Entry::of(entity, parameters.len() + 1));
            parameters.extend(at_commas(&record, 64));
        }
        Ok(iges(&entries, &parameters))
    }),
    ("journal: columns without samples", |size| {
        scan(size / 25, 0)
    }),
    ("journal: columns of one sample", |size| scan(size / 35, 1)),
];

/// Reads files of about this size with every reader by itself.
///
/// # Errors
/// When a file cannot be made.
pub fn worst(size: usize, meter: &dyn Meter, shown: impl Fn(&Worst)) -> Result<Vec<Worst>> {
    let mut all = Vec::new();
    for (name, make) in FILES {
        let bytes = make(size)?;
        let mut worst = Worst {
            name,
            reader: "",
            bytes: bytes.len(),
            packed: bytes.starts_with(&GZIP_MAGIC),
            peak_bytes: 0,
            took: Duration::ZERO,
            said: String::new(),
        };
        for (reader, read) in READERS {
            let before = meter.begin();
            let begun = processor_time()?;
            let read = read(&bytes);
            let took = processor_time()?.saturating_sub(begun);
            worst.peak_bytes = worst.peak_bytes.max(meter.peak().saturating_sub(before));
            if took >= worst.took {
                worst.took = took;
                worst.reader = reader;
                worst.said = read.unwrap_or_else(|error| error);
            }
        }
        shown(&worst);
        all.push(worst);
    }
    Ok(all)
}

/// Time that this thread, in which all readers work, has had a processor: other work on the
/// machine does not count.
fn processor_time() -> Result<Duration> {
    const FILE: &str = "/proc/thread-self/schedstat";
    let text = std::fs::read_to_string(FILE).with_context(|| format!("cannot read {FILE}"))?;
    let first = text.split_whitespace().next().context("no time in it")?;
    Ok(Duration::from_nanos(first.parse()?))
}

fn unpacked(bytes: &[u8]) -> Result<impl io::BufRead, String> {
    Unpacked::new(bytes, "worst").map_err(|error| error.to_string())
}

/// Lines until there are so many bytes.
fn lines(
    size: usize,
    mut line: impl FnMut(&mut String, &mut Dice) -> std::fmt::Result,
) -> Result<Vec<u8>> {
    let (mut text, mut dice) = (String::with_capacity(size), Dice::new(1));
    while text.len() < size {
        line(&mut text, &mut dice)?;
    }
    Ok(text.into_bytes())
}

fn gzip(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}

/// The same again and again, until the compressed file has so many bytes or unfolds to more
/// than is read.
fn packed_until(size: usize, content: &[u8]) -> Result<Vec<u8>> {
    const PIECE_BYTES: usize = 1 << 20;
    let piece = content.repeat(PIECE_BYTES / content.len());
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    let mut unpacked = 0_u64;
    while encoder.get_ref().len() < size && unpacked <= scan_files::MOST_UNPACKED_BYTES {
        encoder.write_all(&piece)?;
        unpacked += piece.len() as u64;
    }
    Ok(encoder.finish()?)
}

/// A directory entry.
#[derive(Debug, Clone, Copy)]
struct Entry {
    entity: u32,
    line: usize,
    matrix: usize,
}

impl Entry {
    /// Of this type, with its parameters from this line.
    fn of(entity: u32, line: usize) -> Self {
        Self {
            entity,
            line,
            matrix: 0,
        }
    }

    fn moved(self, matrix: usize) -> Self {
        Self { matrix, ..self }
    }
}

fn iges(entries: &[Entry], parameters: &[String]) -> Vec<u8> {
    let mut text = format!("{:<72}S{:7}\n", "worst", 1);
    let global = ",,1Hw,1Hw,1Hw,1Hw,32,38,6,308,15,1Hw,1.,2,2HMM;";
    text += &format!("{global:<72}G{:7}\n", 1);
    for (
        index,
        Entry {
            entity,
            line,
            matrix,
        },
    ) in entries.iter().enumerate()
    {
        let own = (2 * index + 1) % 10_000_000;
        text += &format!("{entity:8}{line:8}{:32}{matrix:8}{:16}D{own:7}\n", "", "");
        text += &format!("{entity:8}{:64}D{:7}\n", "", own + 1);
    }
    for (index, line) in parameters.iter().enumerate() {
        text += &format!("{line:<72}P{:7}\n", (index + 1) % 10_000_000);
    }
    text += &format!("{:<72}T{:7}\n", "", 1);
    text.into_bytes()
}

fn scan(columns: usize, samples: usize) -> Result<Vec<u8>> {
    let header = Header {
        calibration: Calibration {
            table_origin_mm: 0.0,
            table_count_mm: 1e-5,
            head: Head::Cartesian { count_mm: 1e-5 },
            correction: None,
        },
        column_pitch_mm: 0.5,
        sample_spacing_mm: 0.5,
        identity: Vec::new(),
        plan: Vec::new(),
        settings: Vec::new(),
        metadata: Vec::new(),
        correction: Vec::new(),
    };
    let sample = RawSample {
        lateral_counts: 1,
        range_counts: 1,
        intensity: 1,
        saturated: false,
    };
    let mut writer = JournalWriter::new(Vec::new(), &header)?;
    for index in 0..columns as u32 {
        writer.append(&RawColumn {
            index,
            table_counts: index as i32,
            dropouts: 0,
            samples: vec![sample; samples],
        })?;
    }
    Ok(writer.finish(&EndCause::Complete)?)
}
