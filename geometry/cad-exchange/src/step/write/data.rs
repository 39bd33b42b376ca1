//! The data section as it grows.
//!
//! Instances are numbered as they are added and may refer only to those added before, so
//! every number is known the moment it is written.

use std::fmt;

use super::spell;

/// Lines are broken between values beyond this many columns.
const COLUMNS: usize = 78;

/// Number of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Id(usize);

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// Instances, each from the beginning of a line.
#[derive(Debug, Default)]
pub(super) struct Data {
    text: String,
    line: usize,
    count: usize,
}

impl Data {
    /// Number of instances so far.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Adds an instance of one entity.
    pub(super) fn add(&mut self, keyword: &str, values: impl FnOnce(&mut Values<'_>)) -> Id {
        self.instance(|list| {
            list.data.text.push_str(keyword);
            list.list(values);
        })
    }

    /// Adds an instance of several entities (external mapping), spelled by the caller.
    pub(super) fn complex(&mut self, spelled: &str) -> Id {
        self.instance(|list| list.data.text.push_str(spelled))
    }

    fn instance(&mut self, spell: impl FnOnce(&mut Values<'_>)) -> Id {
        self.count += 1;
        let id = Id(self.count);
        self.text.push_str(&format!("{id}="));
        spell(&mut Values {
            data: self,
            first: true,
        });
        self.text.push_str(";\n");
        self.line = self.text.len();
        id
    }
}

/// The values of an instance or of a list in it.
#[derive(Debug)]
pub(super) struct Values<'a> {
    data: &'a mut Data,
    first: bool,
}

impl Values<'_> {
    fn value(&mut self, spell: impl FnOnce(&mut String)) {
        if !self.first {
            self.data.text.push(',');
        }
        let from = self.data.text.len();
        spell(&mut self.data.text);
        if self.data.text.len() - self.data.line > COLUMNS && !self.first {
            self.data.text.insert(from, '\n');
            self.data.line = from + 1;
        }
        self.first = false;
    }

    pub(super) fn real(&mut self, value: f64) {
        self.value(|out| spell::real(out, value));
    }

    pub(super) fn integer(&mut self, value: usize) {
        self.value(|out| out.push_str(&value.to_string()));
    }

    pub(super) fn text(&mut self, value: &str) {
        self.value(|out| spell::text(out, value));
    }

    pub(super) fn id(&mut self, id: Id) {
        self.value(|out| out.push_str(&id.to_string()));
    }

    /// A value as it stands: `$`, `*`, `.T.`.
    pub(super) fn word(&mut self, word: &str) {
        self.value(|out| out.push_str(word));
    }

    pub(super) fn reals(&mut self, values: &[f64]) {
        self.list(|list| values.iter().for_each(|&value| list.real(value)));
    }

    pub(super) fn integers(&mut self, values: &[usize]) {
        self.list(|list| values.iter().for_each(|&value| list.integer(value)));
    }

    pub(super) fn ids(&mut self, values: &[Id]) {
        self.list(|list| values.iter().for_each(|&value| list.id(value)));
    }

    /// A value of a named type, such as `LENGTH_MEASURE(25.4)`.
    pub(super) fn typed(&mut self, keyword: &str, value: f64) {
        self.value(|out| {
            out.push_str(keyword);
            out.push('(');
            spell::real(out, value);
            out.push(')');
        });
    }

    pub(super) fn list(&mut self, values: impl FnOnce(&mut Values<'_>)) {
        if !self.first {
            self.data.text.push(',');
        }
        self.first = false;
        self.data.text.push('(');
        values(&mut Values {
            data: self.data,
            first: true,
        });
        self.data.text.push(')');
    }
}
