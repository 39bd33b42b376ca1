//! Sections from whatever file they are in.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use deliverables::{cut_remark, rows_of};
use scan_files::{RawSection, Unpacked};
use skin::Section;

use super::Args;
use crate::command::grid;
use crate::command::shown::Shown;
use crate::failure::Failure;

/// Sections, and what is to be said of where they come from.
pub(super) struct Sections {
    pub(super) sections: Vec<Section>,
    pub(super) notes: Vec<String>,
}

/// By so many bytes of a text file it is told whether it has sections in blocks.
const MOST_LOOKED_AT: u64 = 1 << 24;

/// What a file is, by its content.
enum Kind {
    /// Curves or chains of points in IGES.
    Curves,
    /// Blocks of points.
    Blocks,
    /// A scan, to be cut.
    Scan,
}

/// Reads sections, or a scan and cuts it.
pub(super) fn read(args: &Args, shown: &Shown) -> Result<Sections, Failure> {
    match kind(&args.input)? {
        Kind::Curves => curves(&args.input),
        Kind::Blocks => blocks(args),
        Kind::Scan => cut(args, shown),
    }
}

fn opened(path: &Path) -> Result<File, Failure> {
    let name = path.display();
    if path.is_dir() {
        return Err(Failure::Failed(format!(
            "{name} is a directory; name a file with sections in it"
        )));
    }
    File::open(path).map_err(|error| Failure::at(format!("cannot read {name}"), &error))
}

/// IGES files are told by the mark of their first line; of text, what has a blank line between two
/// points, or one that begins with `section`, is in blocks; all else is a scan.
fn kind(path: &Path) -> Result<Kind, Failure> {
    let name = path.display().to_string();
    let source = unpacked(opened(path)?, &name)?;
    let head = source.head();
    if head.len() > 72 && head[72] == b'S' {
        return Ok(Kind::Curves);
    }
    if head.starts_with(b"ply") || head.contains(&0) {
        return Ok(Kind::Scan);
    }
    let mut head = Vec::new();
    if source.take(MOST_LOOKED_AT).read_to_end(&mut head).is_err() {
        // Whoever reads it tells what is wrong with it.
        return Ok(Kind::Scan);
    }
    let (mut is_within, mut was_blank) = (false, false);
    for line in String::from_utf8_lossy(&head).lines().map(str::trim) {
        if line.is_empty() {
            was_blank = is_within;
        } else if line
            .get(..7)
            .is_some_and(|word| word.eq_ignore_ascii_case("section"))
        {
            return Ok(Kind::Blocks);
        } else if line.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
            // A point; neither a comment nor a header.
            if was_blank {
                return Ok(Kind::Blocks);
            }
            is_within = true;
        }
    }
    Ok(Kind::Scan)
}

fn unpacked(file: File, name: &str) -> Result<Unpacked<'static>, Failure> {
    Unpacked::new(file, name).map_err(|error| Failure::Failed(error.to_string()))
}

fn curves(path: &Path) -> Result<Sections, Failure> {
    let name = path.display().to_string();
    let source = unpacked(opened(path)?, &name)?;
    let chains =
        cad_exchange::iges::read_chains(source).map_err(|error| Failure::at(&name, &error))?;
    let section = |(k, chain): (usize, cad_exchange::iges::Chain)| {
        let own = format!(
            "section {} (entity {} in directory line {})",
            k + 1,
            chain.entity,
            chain.line
        );
        Section::by_its_ends(own, chain.points)
    };
    Ok(Sections {
        sections: chains.into_iter().enumerate().map(section).collect(),
        notes: Vec::new(),
    })
}

fn blocks(args: &Args) -> Result<Sections, Failure> {
    let name = args.input.display().to_string();
    let mut file = opened(&args.input)?;
    file.seek(SeekFrom::Start(0))
        .map_err(|error| Failure::at(format!("cannot read {name}"), &error))?;
    let source = BufReader::new(unpacked(file, &name)?);
    let raw = scan_files::read_sections(source, &name, args.units())
        .map_err(|error| Failure::Failed(error.to_string()))?;
    let section = |(k, raw): (usize, RawSection)| {
        let own = match raw.name {
            Some(own) => format!("section {} ({own}, line {})", k + 1, raw.line),
            None => format!("section {} (line {})", k + 1, raw.line),
        };
        match raw.is_closed {
            Some(is_closed) => Section {
                name: own,
                points: raw.points,
                is_closed,
                is_directed: false,
            },
            None => Section::by_its_ends(own, raw.points),
        }
    };
    Ok(Sections {
        sections: raw.into_iter().enumerate().map(section).collect(),
        notes: Vec::new(),
    })
}

fn cut(args: &Args, shown: &Shown) -> Result<Sections, Failure> {
    let input = grid::scan(&args.input, args.units())?;
    let settings = args.grid.apply(input.settings().regrid)?;
    let image = grid::image(&input, &settings, &args.input, shown)?;
    let every_mm = args.every_mm.unwrap_or(settings.pitch_mm);
    let cut = skin::cut(&image, rows_of(every_mm, settings.pitch_mm));
    let mut notes = input.notes;
    notes.extend(cut_remark(&cut));
    Ok(Sections {
        sections: cut.sections,
        notes,
    })
}
