//! Text files: `x y z` and perhaps an intensity on each line.

mod fields;
mod lines;

use std::io::BufRead;

use crate::error::{Place, ScanFileError};
use crate::gather::Gather;
use crate::units::Units;

pub(crate) use fields::Layouts;
use fields::Problem;
pub(crate) use lines::Lines;

pub(crate) fn parse(reader: impl BufRead, gather: &mut Gather<'_>) -> Result<(), ScanFileError> {
    let units = gather.options.units.unwrap_or(Units::Millimetre);
    let mut lines = Lines::new(reader, gather.file);
    let mut layouts = Layouts::default();
    let mut surplus = 0_usize;
    while let Some(line) = lines.next()? {
        let number = line.number;
        let content = line.text.trim();
        if content.is_empty() {
            continue;
        }
        let Some(layout) = layouts.of(content) else {
            continue;
        };
        match layout.point(content) {
            Ok(point) => {
                surplus = surplus.max(point.surplus);
                gather.push(point.xyz, point.intensity, units, Place::Line(number))?;
            }
            Err(Problem::TooFew(found)) if !line.ended && !gather.points.is_empty() => {
                return Err(ScanFileError::CutOff {
                    file: gather.file.to_owned(),
                    line: number,
                    found,
                });
            }
            Err(problem) => return Err(problem.at(gather.file, number)),
        }
    }
    if surplus > 0 {
        gather.note(format!(
            "up to {surplus} further value(s) on a line were ignored; only x, y, z{} were read",
            if layouts.names_intensity() {
                " and the intensity"
            } else {
                ""
            }
        ));
    }
    Ok(())
}

impl Problem {
    pub(crate) fn at(self, file: &str, line: u64) -> ScanFileError {
        let file = file.to_owned();
        match self {
            Self::NotANumber(text) => ScanFileError::NotANumber { file, line, text },
            Self::DecimalComma(text) => ScanFileError::DecimalComma { file, line, text },
            Self::TooFew(found) => ScanFileError::TooFewValues { file, line, found },
        }
    }
}
