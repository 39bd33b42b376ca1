//! The middle layer: directory entries and the parameter records they point to.

use std::cell::Cell;
use std::io::Read;
use std::ops::Range;

use super::error::ReadError;
use super::global::Global;
use super::lines::{Lines, Section};
use super::values::{Value, next_value, parse_real};

/// Columns of a parameter line that hold values.
const PARAMETER_COLUMNS: usize = 64;
/// Columns of a field of a directory entry.
const FIELD_COLUMNS: usize = 8;
/// How often the Parameter section may be read, on average over its lines. Once is what most
/// files need; edges, colours and names that entities share are read again for each.
/// Pointers could else make a short file take any time and memory.
const MOST_READINGS: usize = 8;
/// Lines that may be read beyond that, so that files of a few lines are free to share them.
const SPARE_LINES: usize = 1000;
/// Types of entities that a message lists one by one.
const LISTED_TYPES: usize = 5;

/// A directory entry.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entity {
    /// Entity type number.
    pub(super) entity: u32,
    /// Form number.
    pub(super) form: i64,
    /// Level; 0 for none, negative for a pointer to several.
    pub(super) level: i64,
    /// Pointer to a transformation matrix, or 0.
    pub(super) transformation: i64,
    /// Colour number, or minus a pointer to a definition.
    pub(super) colour: i64,
    /// The subordinate switch: 1 or 3 for a physically dependent entity.
    pub(super) subordinate: u8,
    /// The use flag: 1 annotation, 2 definition, 5 in a parameter plane.
    pub(super) purpose: u8,
    /// Sequence number of the first of its two directory lines.
    pub(super) directory: usize,
    first_parameter_line: i64,
    parameter_lines: i64,
}

/// A file whose directory has been read; parameters are read entity by entity.
#[derive(Debug)]
pub(super) struct File {
    lines: Lines,
    pub(super) global: Global,
    pub(super) entities: Vec<Entity>,
    /// Lines of the Parameter section that may still be read.
    lines_left: Cell<usize>,
}

impl File {
    pub(super) fn read(source: impl Read) -> Result<Self, ReadError> {
        let lines = Lines::read(source)?;
        let global = Global::read(&lines)?;
        let count = lines.count(Section::Directory);
        if count % 2 != 0 {
            return Err(ReadError::Line {
                line: lines.number(Section::Directory, count - 1),
                reason: format!(
                    "the Directory section has {count} lines, but an entity takes two: a line is \
                     missing"
                ),
            });
        }
        let entities = (0..count / 2)
            .map(|index| entity(&lines, index))
            .collect::<Result<Vec<_>, _>>()?;
        let most_lines = lines
            .count(Section::Parameter)
            .saturating_mul(MOST_READINGS);
        Ok(Self {
            lines,
            global,
            entities,
            lines_left: Cell::new(most_lines.saturating_add(SPARE_LINES)),
        })
    }

    /// The parameters of an entity, from after its type number.
    pub(super) fn record<'a>(&'a self, entity: &'a Entity) -> Result<Record<'a>, ReadError> {
        let count = self.lines.count(Section::Parameter);
        let first = usize::try_from(entity.first_parameter_line).unwrap_or(0);
        let mut record = Record {
            file: self,
            entity,
            line: 0,
            end: 0,
            column: 0,
            ended: false,
        };
        if !(1..=count).contains(&first) {
            return Err(self.defect(
                entity,
                format!(
                    "its parameters should begin on line {} of the Parameter section, which has \
                     {count} lines",
                    entity.first_parameter_line
                ),
            ));
        }
        let announced = usize::try_from(entity.parameter_lines).unwrap_or(0);
        record.line = first - 1;
        record.pay(1)?;
        // Writers that leave the count out still end their records.
        record.end = if announced == 0 {
            count
        } else {
            (first - 1).saturating_add(announced).min(count)
        };
        let entity_type = record.integer("its type number")?;
        if entity_type != i64::from(entity.entity) {
            let reason = format!("its parameters are those of an entity {entity_type}");
            return Err(record.defect(reason));
        }
        Ok(record)
    }

    /// The entity that a pointer points to.
    pub(super) fn entity(&self, pointer: i64) -> Option<&Entity> {
        let index = usize::try_from(pointer).ok()?.checked_sub(1)?;
        if index % 2 != 0 {
            return None;
        }
        self.entities.get(index / 2)
    }

    /// An error about an entity, at its directory entry.
    pub(super) fn defect(&self, entity: &Entity, reason: impl Into<String>) -> ReadError {
        ReadError::Entity {
            line: self.lines.number(Section::Directory, entity.directory - 1),
            entity: entity.entity,
            directory: entity.directory,
            reason: reason.into(),
        }
    }

    /// The most frequent types of entities and how many there are of each, for messages.
    pub(super) fn census(&self) -> String {
        let mut types: Vec<u32> = self.entities.iter().map(|entity| entity.entity).collect();
        types.sort_unstable();
        let mut groups: Vec<(usize, u32)> = types
            .chunk_by(|a, b| a == b)
            .filter_map(|group| Some((group.len(), *group.first()?)))
            .collect();
        groups.sort_by_key(|&(count, entity)| (std::cmp::Reverse(count), entity));
        let mut told: Vec<String> = groups
            .iter()
            .take(LISTED_TYPES)
            .map(|(count, entity)| format!("{count} of type {entity}"))
            .collect();
        let others: usize = groups.iter().skip(LISTED_TYPES).map(|group| group.0).sum();
        if others > 0 {
            told.push(format!("{others} of other types"));
        }
        if told.is_empty() {
            return "no entities at all".to_owned();
        }
        told.join(", ")
    }
}

fn entity(lines: &Lines, index: usize) -> Result<Entity, ReadError> {
    let field = |second: usize, number: usize, name: &'static str| -> Result<i64, ReadError> {
        let line = 2 * index + second;
        let from = number * FIELD_COLUMNS;
        let columns: Range<usize> = from..from + FIELD_COLUMNS;
        let bytes = lines.columns(Section::Directory, line, columns);
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim();
        if text.is_empty() {
            return Ok(0);
        }
        text.parse().map_err(|_| ReadError::Directory {
            line: lines.number(Section::Directory, line),
            directory: 2 * index + 1,
            name,
            value: text.to_owned(),
        })
    };
    let status = lines.columns(Section::Directory, 2 * index, 64..72);
    // Two digits each; blanks and the standard's asterisks count as 0.
    let digits = |at: usize| {
        let digit = |k: usize| match status.get(k) {
            Some(b @ b'0'..=b'9') => b - b'0',
            _ => 0,
        };
        10 * digit(at) + digit(at + 1)
    };
    let number = field(0, 0, "the entity type")?;
    Ok(Entity {
        entity: u32::try_from(number).map_err(|_| ReadError::Directory {
            line: lines.number(Section::Directory, 2 * index),
            directory: 2 * index + 1,
            name: "the entity type",
            value: number.to_string(),
        })?,
        form: field(1, 4, "the form number")?,
        level: field(0, 4, "the level")?,
        transformation: field(0, 6, "the transformation matrix")?,
        colour: field(1, 2, "the colour")?,
        subordinate: digits(2),
        purpose: digits(4),
        directory: 2 * index + 1,
        first_parameter_line: field(0, 1, "the pointer to its parameters")?,
        parameter_lines: field(1, 3, "the number of its parameter lines")?,
    })
}

/// A cursor over the values of an entity.
#[derive(Debug)]
pub(super) struct Record<'a> {
    file: &'a File,
    entity: &'a Entity,
    /// Line of the Parameter section being read, from 0.
    line: usize,
    /// The line after the last.
    end: usize,
    column: usize,
    ended: bool,
}

impl<'a> Record<'a> {
    /// An error about the line being read.
    pub(super) fn defect(&self, reason: impl Into<String>) -> ReadError {
        let line = self.line.min(self.end.saturating_sub(1));
        ReadError::Entity {
            line: self.file.lines.number(Section::Parameter, line),
            entity: self.entity.entity,
            directory: self.entity.directory,
            reason: reason.into(),
        }
    }

    /// Takes lines off what may still be read of the file.
    fn pay(&self, lines: usize) -> Result<(), ReadError> {
        let left = &self.file.lines_left;
        match left.get().checked_sub(lines) {
            Some(rest) => {
                left.set(rest);
                Ok(())
            }
            None => Err(self.defect(format!(
                "so many entities share their parameters that reading them all would take the \
                 file's Parameter section more than {MOST_READINGS} times over"
            ))),
        }
    }

    /// The next value; empty ones for ever after the last.
    fn value(&mut self) -> Result<Value, ReadError> {
        if self.ended {
            return Ok(Value::Empty);
        }
        let (lines, end) = (&self.file.lines, self.end);
        let (mut line, mut column) = (self.line, self.column);
        let next = || {
            while line < end {
                let columns = lines.columns(Section::Parameter, line, 0..PARAMETER_COLUMNS);
                // A line cut short stands for one filled with blanks.
                if column < PARAMETER_COLUMNS {
                    column += 1;
                    return Some(columns.get(column - 1).copied().unwrap_or(b' '));
                }
                line += 1;
                column = 0;
            }
            None
        };
        let result = next_value(next, self.file.global.delimiters);
        let passed = line - self.line;
        (self.line, self.column) = (line, column);
        let (value, last) = result.map_err(|reason| self.defect(reason))?;
        self.pay(passed)?;
        self.ended = last;
        Ok(value)
    }

    /// True when no values are left.
    pub(super) fn ended(&self) -> bool {
        self.ended
    }

    /// The next value as an integer, 0 where it is left out.
    pub(super) fn integer(&mut self, name: &str) -> Result<i64, ReadError> {
        match self.value()? {
            Value::Empty => Ok(0),
            Value::Word(word) => word
                .parse()
                .map_err(|_| self.defect(format!("{name} is {word:?}, not an integer"))),
            Value::Text(text) => Err(self.defect(format!("{name} is the string {text:?}"))),
        }
    }

    /// The next value as a count of things that take at least one value each.
    pub(super) fn count(&mut self, name: &str) -> Result<usize, ReadError> {
        let value = self.integer(name)?;
        let room = (self.end - self.line.min(self.end)).saturating_mul(PARAMETER_COLUMNS);
        usize::try_from(value)
            .ok()
            .filter(|&count| count <= room)
            .ok_or_else(|| {
                self.defect(format!(
                    "{name} is {value}, which its record has no room for"
                ))
            })
    }

    /// The next value as a real, 0 where it is left out.
    pub(super) fn real(&mut self, name: &str) -> Result<f64, ReadError> {
        if self.ended {
            return Err(self.defect(format!("the record ends before {name}")));
        }
        match self.value()? {
            Value::Empty => Ok(0.0),
            Value::Word(word) => parse_real(&word)
                .ok_or_else(|| self.defect(format!("{name} is {word:?}, not a number"))),
            Value::Text(text) => Err(self.defect(format!("{name} is the string {text:?}"))),
        }
    }

    /// The next `N` values as reals.
    pub(super) fn reals<const N: usize>(&mut self, name: &str) -> Result<[f64; N], ReadError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.real(name)?;
        }
        Ok(values)
    }

    /// The next `count` values as reals.
    pub(super) fn list(&mut self, count: usize, name: &str) -> Result<Vec<f64>, ReadError> {
        // Not with_capacity: the count is what the file says, the values what it has.
        let mut values = Vec::new();
        for _ in 0..count {
            values.push(self.real(name)?);
        }
        Ok(values)
    }

    /// The next value as a string.
    pub(super) fn text(&mut self, name: &str) -> Result<String, ReadError> {
        match self.value()? {
            Value::Empty => Ok(String::new()),
            Value::Text(text) => Ok(text),
            Value::Word(word) => Err(self.defect(format!("{name} is {word:?}, not a string"))),
        }
    }

    /// The next value as a pointer to an entity of one of some types.
    pub(super) fn pointer(&mut self, name: &str, types: &[u32]) -> Result<&'a Entity, ReadError> {
        let pointer = self.integer(name)?;
        match self.file.entity(pointer) {
            Some(entity) if types.contains(&entity.entity) => Ok(entity),
            Some(entity) => Err(self.defect(format!(
                "{name} is an entity {}, not one of {types:?}",
                entity.entity
            ))),
            None => Err(self.defect(format!("{name} points to D{pointer}, which is not there"))),
        }
    }
}
