//! A file as header and numbered instances, and an instance's values one after the other.

use std::collections::BTreeMap;
use std::io::Read;

use super::syntax::{Fault, Part, Scanner, Value};
use super::{MAX_FILE_BYTES, ReadError, text};

/// Kinds of entities that are listed where there are many.
const LISTED: usize = 8;

/// One or more entities under a number.
#[derive(Debug)]
struct Instance<'a> {
    /// Bytes from the start of the file.
    at: usize,
    parts: Box<[Part<'a>]>,
}

/// A parsed file.
#[derive(Debug)]
pub(super) struct Exchange<'a> {
    bytes: &'a [u8],
    /// What is told of entities that are not read.
    advice: &'static str,
    header: Vec<Part<'a>>,
    instances: BTreeMap<u64, Instance<'a>>,
}

/// The bytes of a file, as far as it may be read.
pub(super) fn bytes(source: impl Read) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    source.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(ReadError::TooLarge {
            limit: MAX_FILE_BYTES,
        });
    }
    Ok(bytes)
}

/// Line and column of a byte, from 1.
fn place(bytes: &[u8], at: usize) -> (usize, usize) {
    let before = bytes.get(..at).unwrap_or(bytes);
    let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
    let from = before
        .iter()
        .rposition(|&b| b == b'\n')
        .map_or(0, |n| n + 1);
    (line, before.len() - from + 1)
}

impl<'a> Exchange<'a> {
    /// # Errors
    /// [`ReadError::Form`], [`ReadError::Syntax`].
    pub(super) fn parse(bytes: &'a [u8], advice: &'static str) -> Result<Self, ReadError> {
        let mut scanner = Scanner::new(bytes);
        if !matches!(scanner.takes("ISO-10303-21;"), Ok(true)) {
            return Err(ReadError::Form);
        }
        let mut exchange = Self {
            bytes,
            advice,
            header: Vec::new(),
            instances: BTreeMap::new(),
        };
        exchange.sections(&mut scanner).map_err(|fault| {
            let (line, column) = place(bytes, fault.at);
            ReadError::Syntax {
                line,
                column,
                reason: fault.reason,
            }
        })?;
        Ok(exchange)
    }

    fn sections(&mut self, scanner: &mut Scanner<'a>) -> Result<(), Fault> {
        scanner.expect("HEADER;")?;
        while !scanner.takes("ENDSEC;")? {
            self.header.push(scanner.part()?);
            scanner.expect(";")?;
        }
        scanner.expect("DATA")?;
        scanner.expect(";")?;
        while !scanner.takes("ENDSEC;")? {
            let at = scanner.position()?;
            let id = scanner.id()?;
            scanner.expect("=")?;
            let mut parts = Vec::new();
            if scanner.takes("(")? {
                while !scanner.takes(")")? {
                    parts.push(scanner.part()?);
                }
            } else {
                parts.push(scanner.part()?);
            }
            scanner.expect(";")?;
            let parts = parts.into();
            if self.instances.insert(id, Instance { at, parts }).is_some() {
                let reason = format!("there are two instances #{id}");
                return Err(Fault { at, reason });
            }
        }
        scanner.expect("END-ISO-10303-21;")
    }

    /// The values of a record of the header.
    pub(super) fn header(&self, record: &'static str) -> Result<&[Value<'a>], ReadError> {
        let part = self.header.iter().find(|part| part.keyword == record);
        part.map(|part| &*part.values).ok_or(ReadError::Header {
            record,
            reason: "it is not there".to_owned(),
        })
    }

    /// Numbers of all instances of an entity, in ascending order.
    pub(super) fn all(&self, keyword: &str) -> Vec<u64> {
        self.instances
            .iter()
            .filter(|(_, instance)| instance.parts.iter().any(|part| part.keyword == keyword))
            .map(|(&id, _)| id)
            .collect()
    }

    /// How often each entity occurs.
    pub(super) fn entities(&self) -> BTreeMap<&'a str, usize> {
        let mut counts = BTreeMap::new();
        for part in self.instances.values().flat_map(|instance| &instance.parts) {
            *counts.entry(part.keyword).or_insert(0) += 1;
        }
        counts
    }

    /// The commonest entities in words.
    pub(super) fn census(&self) -> String {
        let mut counts: Vec<_> = self.entities().into_iter().collect();
        counts.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        let more = counts.len() > LISTED;
        let listed: Vec<String> = counts
            .iter()
            .take(LISTED)
            .map(|(keyword, count)| format!("{count} {}", short(keyword)))
            .collect();
        match (listed.is_empty(), more) {
            (true, _) => "but nothing at all".to_owned(),
            (false, true) => format!("but {} and others", listed.join(", ")),
            (false, false) => format!("but {}", listed.join(", ")),
        }
    }

    /// The values of the instance `id`, which must be of one of these entities.
    pub(super) fn fields<'b>(
        &'b self,
        id: u64,
        expected: &[&'static str],
    ) -> Result<Fields<'a, 'b>, ReadError> {
        let (at, parts) = match self.instances.get(&id) {
            Some(instance) => (instance.at, &*instance.parts),
            None => (0, &[][..]),
        };
        let found = parts.iter().find(|part| expected.contains(&part.keyword));
        if let Some(part) = found {
            return Ok(Fields {
                exchange: self,
                at,
                id,
                keyword: part.keyword,
                values: part.values.iter(),
            });
        }
        let wanted = expected.join(" or ");
        let Some(part) = parts.first() else {
            return Err(ReadError::Instance {
                line: 1,
                entity: wanted,
                id,
                reason: "it is referred to, but the file does not have it".to_owned(),
            });
        };
        Err(self.defect(
            at,
            id,
            part.keyword,
            format!("expected {wanted} here; {}", self.advice),
        ))
    }

    fn defect(&self, at: usize, id: u64, keyword: &str, reason: String) -> ReadError {
        ReadError::Instance {
            line: place(self.bytes, at).0,
            entity: short(keyword).to_owned(),
            id,
            reason,
        }
    }
}

/// Keywords of hostile files are as long as they like.
pub(super) fn short(keyword: &str) -> &str {
    keyword.get(..80).unwrap_or(keyword)
}

/// The values of an instance, taken one after the other.
#[derive(Debug, Clone)]
pub(super) struct Fields<'a, 'b> {
    exchange: &'b Exchange<'a>,
    at: usize,
    id: u64,
    keyword: &'a str,
    values: std::slice::Iter<'b, Value<'a>>,
}

impl<'a, 'b> Fields<'a, 'b> {
    pub(super) fn defect(&self, reason: impl Into<String>) -> ReadError {
        self.exchange
            .defect(self.at, self.id, self.keyword, reason.into())
    }

    pub(super) fn keyword(&self) -> &'a str {
        self.keyword
    }

    fn next(&mut self, what: &str) -> Result<&'b Value<'a>, ReadError> {
        match self.values.next() {
            Some(value) => Ok(value),
            None => Err(self.defect(format!("it ends before {what}"))),
        }
    }

    fn no<T>(&self, what: &str, kind: &str) -> Result<T, ReadError> {
        Err(self.defect(format!("{what} is not {kind}")))
    }

    /// Passes over a value.
    pub(super) fn skip(&mut self, what: &str) -> Result<(), ReadError> {
        self.next(what).map(|_| ())
    }

    pub(super) fn text(&mut self, what: &str) -> Result<String, ReadError> {
        match self.next(what)? {
            Value::Text(raw) => match text::decoded(raw) {
                Some(text) => Ok(text),
                None => Err(self.defect(format!("{what} has a control directive that is unknown"))),
            },
            Value::Unset => Ok(String::new()),
            _ => self.no(what, "a string"),
        }
    }

    pub(super) fn real(&mut self, what: &str) -> Result<f64, ReadError> {
        let value = self.next(what)?;
        self.number(value, what)
    }

    fn number(&self, value: &Value<'a>, what: &str) -> Result<f64, ReadError> {
        match *value {
            Value::Real(real) => Ok(real),
            Value::Integer(integer) => Ok(integer as f64),
            _ => self.no(what, "a number"),
        }
    }

    /// A number under the name of its type, or under none where only that one may be, as some
    /// programs write.
    pub(super) fn measure(&mut self, keyword: &str, what: &str) -> Result<f64, ReadError> {
        match self.next(what)? {
            Value::Typed(of, value) if *of == keyword => self.number(value, what),
            value @ (Value::Real(_) | Value::Integer(_)) => self.number(value, what),
            _ => self.no(what, keyword),
        }
    }

    pub(super) fn count(&mut self, what: &str) -> Result<usize, ReadError> {
        let value = self.next(what)?;
        self.natural(value, what)
    }

    fn natural(&self, value: &Value<'a>, what: &str) -> Result<usize, ReadError> {
        let number = match *value {
            Value::Integer(integer) => usize::try_from(integer).ok(),
            _ => None,
        };
        number.map_or_else(|| self.no(what, "a number of things"), Ok)
    }

    pub(super) fn word(&mut self, what: &str) -> Result<&'a str, ReadError> {
        match self.next(what)? {
            Value::Word(word) => Ok(word),
            Value::Unset => Ok(""),
            _ => self.no(what, "an enumeration"),
        }
    }

    pub(super) fn logical(&mut self, what: &str) -> Result<bool, ReadError> {
        match self.word(what)? {
            "T" => Ok(true),
            "F" => Ok(false),
            _ => self.no(what, ".T. or .F."),
        }
    }

    pub(super) fn id(&mut self, what: &str) -> Result<u64, ReadError> {
        match self.next(what)? {
            Value::Id(id) => Ok(*id),
            _ => self.no(what, "a reference"),
        }
    }

    /// A reference that may be left out.
    pub(super) fn id_or_none(&mut self, what: &str) -> Result<Option<u64>, ReadError> {
        match self.next(what)? {
            Value::Id(id) => Ok(Some(*id)),
            Value::Unset => Ok(None),
            _ => self.no(what, "a reference"),
        }
    }

    fn list(&mut self, what: &str) -> Result<&'b [Value<'a>], ReadError> {
        match self.next(what)? {
            Value::List(values) => Ok(values),
            _ => self.no(what, "a list"),
        }
    }

    fn ids_of(&self, values: &[Value<'a>], what: &str) -> Result<Vec<u64>, ReadError> {
        values
            .iter()
            .map(|value| match value {
                Value::Id(id) => Ok(*id),
                _ => self.no(what, "a list of references"),
            })
            .collect()
    }

    pub(super) fn ids(&mut self, what: &str) -> Result<Vec<u64>, ReadError> {
        let list = self.list(what)?;
        self.ids_of(list, what)
    }

    /// Lists of references, in a list.
    pub(super) fn rows(&mut self, what: &str) -> Result<Vec<Vec<u64>>, ReadError> {
        let rows = self.list(what)?;
        rows.iter()
            .map(|row| match row {
                Value::List(values) => self.ids_of(values, what),
                _ => self.no(what, "a list of lists"),
            })
            .collect()
    }

    /// Lists of numbers, in a list.
    pub(super) fn rows_of_reals(&mut self, what: &str) -> Result<Vec<Vec<f64>>, ReadError> {
        let rows = self.list(what)?;
        rows.iter()
            .map(|row| match row {
                Value::List(values) => values
                    .iter()
                    .map(|value| self.number(value, what))
                    .collect(),
                _ => self.no(what, "a list of lists"),
            })
            .collect()
    }

    pub(super) fn reals(&mut self, what: &str) -> Result<Vec<f64>, ReadError> {
        let list = self.list(what)?;
        list.iter().map(|value| self.number(value, what)).collect()
    }

    pub(super) fn counts(&mut self, what: &str) -> Result<Vec<usize>, ReadError> {
        let list = self.list(what)?;
        list.iter().map(|value| self.natural(value, what)).collect()
    }
}
