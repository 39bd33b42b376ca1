//! NC code: ISO 6983 as Fanuc's controls and LinuxCNC read it.

use std::io::{self, Write};

use crate::machine::{Dialect, Machine};
use crate::motion::{Arc, Move, Operation, Plane, Travel};

/// Longest comment: some controls take no longer lines.
const LONGEST_COMMENT: usize = 70;

/// What the program's head says.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// What is milled.
    pub title: String,
    /// Which program wrote it.
    pub author: String,
    /// When, in words.
    pub timestamp: String,
}

/// Writes the program. Same operations and header: same bytes.
///
/// # Errors
/// What the sink reports.
pub fn write(
    machine: &Machine,
    operations: &[Operation],
    header: &Header,
    sink: &mut impl Write,
) -> io::Result<()> {
    let mut post = Post {
        machine,
        sink,
        words: Words::default(),
    };
    post.head(operations, header)?;
    for operation in operations {
        post.operation(operation)?;
    }
    post.foot()
}

/// A coordinate as it will be written.
#[must_use]
pub fn rounded(value: f64, decimals: u8) -> f64 {
    let scale = scale(decimals);
    // Adding 0 makes one of both zeros.
    (value * scale).round() / scale + 0.0
}

pub(crate) fn scale(decimals: u8) -> f64 {
    (0..decimals).fold(1.0, |scale, _| scale * 10.0)
}

/// What is in effect and need not be said again.
#[derive(Default)]
struct Words {
    motion: Option<&'static str>,
    plane: Option<Plane>,
    at: [Option<String>; 3],
    feed: Option<String>,
}

struct Post<'a, W> {
    machine: &'a Machine,
    sink: &'a mut W,
    words: Words,
}

impl<W: Write> Post<'_, W> {
    fn line(&mut self, text: &str) -> io::Result<()> {
        writeln!(self.sink, "{text}")
    }

    /// A comment that neither its own brackets nor foreign letters can break.
    fn comment(&mut self, text: &str) -> io::Result<()> {
        let fanuc = self.machine.dialect == Dialect::Fanuc;
        let sound = |c: char| match c {
            '(' | ')' | '%' | ';' => ' ',
            c if c.is_ascii_graphic() || c == ' ' => {
                if fanuc {
                    c.to_ascii_uppercase()
                } else {
                    c
                }
            }
            _ => '?',
        };
        let text: String = text.chars().take(LONGEST_COMMENT).map(sound).collect();
        self.line(&format!("({})", text.trim()))
    }

    fn head(&mut self, operations: &[Operation], header: &Header) -> io::Result<()> {
        self.line("%")?;
        match self.machine.dialect {
            Dialect::Fanuc => self.line(&format!("O{:04}", self.machine.program))?,
            // There O begins a subroutine.
            Dialect::LinuxCnc => self.comment(&format!("program {}", self.machine.program))?,
        }
        // Some controls act on comments that begin with certain words.
        self.comment(&format!("model: {}", header.title))?;
        self.comment(&format!("{} {}", header.author, header.timestamp))?;
        for operation in operations {
            self.comment(&format!(
                "T{} {}: {}",
                operation.tool, operation.cutter, operation.name
            ))?;
        }
        self.line("G21 G90 G94 G17")?;
        self.line("G40 G49 G80")?;
        if self.machine.dialect == Dialect::LinuxCnc {
            // Exactly along the path as far as the acceleration allows.
            self.line("G64 P0.001")?;
        }
        self.line(&format!("G{}", self.machine.work_offset_code))
    }

    fn operation(&mut self, operation: &Operation) -> io::Result<()> {
        self.words = Words::default();
        self.comment(&operation.name)?;
        self.up()?;
        self.line(&format!("T{} M6", operation.tool))?;
        self.line(&format!("S{} M3", operation.spindle_rpm.round()))?;
        let mut moves = operation.moves.iter();
        if let Some(first) = moves.next() {
            let [x, y, z] = first.to_mm.map(|c| self.number(c));
            self.line(&format!("G0 X{x} Y{y}"))?;
            self.line(&format!("G43 H{} Z{z}", operation.tool))?;
            self.words.motion = Some("G0");
            self.words.at = [Some(x), Some(y), Some(z)];
        }
        if operation.coolant {
            self.line("M8")?;
        }
        let mut from = operation
            .moves
            .first()
            .map_or([0.0; 3], |first| first.to_mm);
        for step in moves {
            self.step(step, from)?;
            from = step.to_mm;
        }
        if operation.coolant {
            self.line("M9")?;
        }
        self.line("M5")
    }

    fn step(&mut self, step: &Move, from: [f64; 3]) -> io::Result<()> {
        let mut words: Vec<String> = Vec::new();
        let motion = match &step.travel {
            Travel::Rapid => "G0",
            Travel::Line => "G1",
            Travel::Arc(arc) if arc.counter_clockwise => "G3",
            Travel::Arc(_) => "G2",
        };
        let is_there = (0..3).all(|axis| {
            let number = self.number(step.to_mm[axis]);
            self.words.at[axis].as_deref() == Some(number.as_str())
        });
        // Nothing is said of a line that leads nowhere, and nothing of it is remembered.
        if is_there && !matches!(step.travel, Travel::Arc(_)) {
            return Ok(());
        }
        if let Travel::Arc(arc) = &step.travel
            && self.words.plane.unwrap_or(Plane::Xy) != arc.plane
        {
            words.push(plane(arc.plane).to_owned());
            self.words.plane = Some(arc.plane);
        }
        if self.words.motion != Some(motion) {
            words.push(motion.to_owned());
            self.words.motion = Some(motion);
        }
        let in_arc = |axis: usize| match &step.travel {
            Travel::Arc(arc) => arc.plane.axes().contains(&axis),
            _ => false,
        };
        for (axis, letter) in ["X", "Y", "Z"].iter().enumerate() {
            let number = self.number(step.to_mm[axis]);
            let changed = self.words.at[axis].as_deref() != Some(number.as_str());
            // Of an arc both coordinates are said: without them some controls go once around.
            if changed || in_arc(axis) {
                words.push(format!("{letter}{number}"));
                self.words.at[axis] = Some(number);
            }
        }
        if let Travel::Arc(arc) = &step.travel {
            words.extend(self.centre(arc, from));
        }
        if step.travel != Travel::Rapid {
            let feed = decimal(step.feed_mm_per_min, 1, self.machine.dialect);
            if self.words.feed.as_deref() != Some(feed.as_str()) {
                words.push(format!("F{feed}"));
                self.words.feed = Some(feed);
            }
        }
        self.line(&words.join(" "))
    }

    /// Where the centre is from the start, along the axes of the plane.
    fn centre(&self, arc: &Arc, from: [f64; 3]) -> Vec<String> {
        let mut axes = arc.plane.axes();
        axes.sort_unstable();
        let word = |axis: usize| {
            let letter = ["I", "J", "K"][axis];
            let offset = arc.centre_mm[axis] - from[axis];
            format!("{letter}{}", self.number(offset))
        };
        axes.map(word).to_vec()
    }

    fn foot(&mut self) -> io::Result<()> {
        self.up()?;
        self.line("M30")?;
        self.line("%")
    }

    /// As far up as the machine goes, by its own coordinates, and the plane as it was.
    fn up(&mut self) -> io::Result<()> {
        match self.machine.dialect {
            Dialect::Fanuc => {
                self.line("G91 G28 Z0.")?;
                self.line("G90 G17")
            }
            Dialect::LinuxCnc => {
                let top = self.number(self.machine.travel.z_mm[1]);
                self.line(&format!("G53 G0 Z{top}"))?;
                self.line("G17")
            }
        }
    }

    fn number(&self, value: f64) -> String {
        decimal(value, self.machine.decimals, self.machine.dialect)
    }
}

fn plane(plane: Plane) -> &'static str {
    match plane {
        Plane::Xy => "G17",
        Plane::Zx => "G18",
        Plane::Yz => "G19",
    }
}

/// A number without needless zeros. Fanuc's controls take one without a point for a multiple of
/// their least increment, so that there it always has one.
fn decimal(value: f64, decimals: u8, dialect: Dialect) -> String {
    let text = format!("{:.*}", usize::from(decimals), rounded(value, decimals));
    let text = text.trim_end_matches('0');
    match dialect {
        Dialect::Fanuc => text.to_owned(),
        Dialect::LinuxCnc => text.trim_end_matches('.').to_owned(),
    }
}
