//! Bytes to values (ISO 10303-21, clauses 5 to 7 and 10).

/// Lists may lie this deep in each other; those of the schemas do not go beyond four.
const MAX_DEPTH: usize = 16;

/// A value of a record. Slices are those of the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value<'a> {
    /// `$`.
    Unset,
    /// `*`.
    Derived,
    Integer(i64),
    Real(f64),
    /// What stands between the apostrophes.
    Text(&'a [u8]),
    /// An enumeration without its points.
    Word(&'a str),
    /// Binary, without its quotation marks.
    Binary(&'a [u8]),
    /// A reference to an instance.
    Id(u64),
    List(Box<[Value<'a>]>),
    /// A value with the name of its type.
    Typed(&'a str, Box<Value<'a>>),
}

/// Keyword and values.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part<'a> {
    pub(super) keyword: &'a str,
    pub(super) values: Box<[Value<'a>]>,
}

/// Text that cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Fault {
    /// Bytes from the start of the file.
    pub(super) at: usize,
    pub(super) reason: String,
}

/// Walks over the text.
#[derive(Debug, Clone)]
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Where the next token begins.
    pub(super) fn position(&mut self) -> Result<usize, Fault> {
        self.blanks()?;
        Ok(self.at)
    }

    pub(super) fn fault<T>(&self, reason: impl Into<String>) -> Result<T, Fault> {
        Err(Fault {
            at: self.at,
            reason: reason.into(),
        })
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Skips blanks and comments.
    fn blanks(&mut self) -> Result<(), Fault> {
        loop {
            match self.peek() {
                Some(b' ' | b'\t' | b'\r' | b'\n') => self.at += 1,
                Some(b'/') if self.rest().starts_with(b"/*") => {
                    let end = self.rest().windows(2).skip(2).position(|w| w == b"*/");
                    match end {
                        Some(length) => self.at += length + 4,
                        None => return self.fault("a comment begins here and has no end"),
                    }
                }
                _ => return Ok(()),
            }
        }
    }

    /// Takes a sign or word if it is next.
    pub(super) fn takes(&mut self, word: &str) -> Result<bool, Fault> {
        self.blanks()?;
        let there = self.rest().starts_with(word.as_bytes());
        if there {
            self.at += word.len();
        }
        Ok(there)
    }

    pub(super) fn expect(&mut self, word: &str) -> Result<(), Fault> {
        if self.takes(word)? {
            return Ok(());
        }
        let found = self.seen();
        self.fault(format!("expected `{word}`, found {found}"))
    }

    /// The next characters, as far as they can be shown.
    fn seen(&self) -> String {
        let rest = self.rest();
        if rest.is_empty() {
            return "the end of the file: it was cut off".to_owned();
        }
        let shown: String = rest
            .iter()
            .take(12)
            .map(|&b| {
                if (b' '..=b'~').contains(&b) {
                    char::from(b)
                } else {
                    '?'
                }
            })
            .collect();
        format!("`{shown}`")
    }

    /// The slice from here while a test holds.
    fn run(&mut self, holds: impl Fn(u8) -> bool) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(|&b| !holds(b)).unwrap_or(rest.len());
        self.at += length;
        rest.get(..length).unwrap_or_default()
    }

    /// The same as text, which ASCII always is.
    fn word(&mut self, holds: impl Fn(u8) -> bool) -> &'a str {
        let run = self.run(|b| b.is_ascii() && holds(b));
        std::str::from_utf8(run).unwrap_or_default()
    }

    fn keyword(&mut self) -> &'a str {
        self.word(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-' || b == b'!')
    }

    /// A keyword and its values in brackets.
    pub(super) fn part(&mut self) -> Result<Part<'a>, Fault> {
        self.blanks()?;
        let keyword = self.keyword();
        if keyword.is_empty() {
            let found = self.seen();
            return self.fault(format!("expected the name of an entity, found {found}"));
        }
        self.expect("(")?;
        let values = self.list(1)?;
        Ok(Part { keyword, values })
    }

    /// `#12`, without what follows.
    pub(super) fn id(&mut self) -> Result<u64, Fault> {
        self.expect("#")?;
        let from = self.at;
        let digits = self.word(|b| b.is_ascii_digit());
        match digits.parse() {
            Ok(id) => Ok(id),
            Err(_) => {
                self.at = from;
                self.fault("`#` is not followed by the number of an instance")
            }
        }
    }

    /// Values up to the closing bracket; the opening one is behind.
    fn list(&mut self, depth: usize) -> Result<Box<[Value<'a>]>, Fault> {
        if depth > MAX_DEPTH {
            return self.fault(format!(
                "lists lie more than {MAX_DEPTH} deep in each other"
            ));
        }
        let mut values = Vec::new();
        if self.takes(")")? {
            return Ok(values.into());
        }
        loop {
            values.push(self.value(depth)?);
            if self.takes(")")? {
                return Ok(values.into());
            }
            self.expect(",")?;
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value<'a>, Fault> {
        self.blanks()?;
        let from = self.at;
        match self.peek() {
            Some(b'$') => self.one(Value::Unset),
            Some(b'*') => self.one(Value::Derived),
            Some(b'#') => self.id().map(Value::Id),
            Some(b'\'') => self.text(),
            Some(b'"') => {
                self.at += 1;
                let digits = self.run(|b| b.is_ascii_hexdigit());
                self.expect("\"")?;
                Ok(Value::Binary(digits))
            }
            Some(b'.') => {
                self.at += 1;
                let word = self.word(|b| b.is_ascii_alphanumeric() || b == b'_');
                self.expect(".")?;
                Ok(Value::Word(word))
            }
            Some(b'(') => {
                self.at += 1;
                self.list(depth + 1).map(Value::List)
            }
            Some(b'+' | b'-' | b'0'..=b'9') => self.number(),
            Some(b'A'..=b'Z' | b'a'..=b'z' | b'!') => {
                let keyword = self.keyword();
                self.expect("(")?;
                let mut values = self.list(depth + 1)?.into_vec();
                match (values.pop(), values.is_empty()) {
                    (Some(value), true) => Ok(Value::Typed(keyword, Box::new(value))),
                    _ => {
                        self.at = from;
                        self.fault(format!("{keyword} should have one value"))
                    }
                }
            }
            _ => {
                let found = self.seen();
                self.fault(format!("expected a value, found {found}"))
            }
        }
    }

    fn one(&mut self, value: Value<'a>) -> Result<Value<'a>, Fault> {
        self.at += 1;
        Ok(value)
    }

    fn text(&mut self) -> Result<Value<'a>, Fault> {
        let from = self.at;
        self.at += 1;
        let start = self.at;
        loop {
            self.run(|b| b != b'\'');
            if self.peek().is_none() {
                self.at = from;
                return self.fault("a string begins here and has no end");
            }
            let end = self.at;
            self.at += 1;
            if self.peek() != Some(b'\'') {
                return Ok(Value::Text(self.bytes.get(start..end).unwrap_or_default()));
            }
            self.at += 1;
        }
    }

    fn number(&mut self) -> Result<Value<'a>, Fault> {
        let from = self.at;
        let number =
            self.word(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'E' | b'e'));
        let value = if number.contains('.') {
            number
                .parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .map(Value::Real)
        } else {
            number.parse().ok().map(Value::Integer)
        };
        match value {
            Some(value) => Ok(value),
            None => {
                self.at = from;
                let found = self.seen();
                self.fault(format!("{found} is no number that can be read"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(text: &str) -> Result<Part<'_>, Fault> {
        Scanner::new(text.as_bytes()).part()
    }

    #[test]
    fn values_of_every_kind() {
        let part = part(
            "A_1( $,*, 12,-1.5E-3,'it''s ,)',.UNSPECIFIED.,\"0FA\",#7,(1,(2.)),()\n/* )*/,B(3))",
        )
        .unwrap();
        assert_eq!(part.keyword, "A_1");
        let list = |values: Vec<Value<'static>>| Value::List(values.into());
        assert_eq!(
            part.values.into_vec(),
            [
                Value::Unset,
                Value::Derived,
                Value::Integer(12),
                Value::Real(-1.5e-3),
                Value::Text(b"it''s ,)"),
                Value::Word("UNSPECIFIED"),
                Value::Binary(b"0FA"),
                Value::Id(7),
                list(vec![Value::Integer(1), list(vec![Value::Real(2.0)])]),
                list(Vec::new()),
                Value::Typed("B", Box::new(Value::Integer(3))),
            ]
        );
    }

    #[test]
    fn faults_are_told_where_they_are() {
        for (text, at, reason) in [
            ("A(1,,2)", 4, "expected a value, found `,2)`"),
            ("A(1", 3, "cut off"),
            ("A('x)", 2, "a string begins here"),
            ("A(/* )", 2, "a comment begins here"),
            ("A(1e5)", 2, "no number"),
            ("A(1.E999)", 2, "no number"),
            ("A(99999999999999999999)", 2, "no number"),
            ("A(#)", 3, "number of an instance"),
            ("A(#99999999999999999999)", 3, "number of an instance"),
            ("A(B(1,2))", 2, "one value"),
            ("A 1", 2, "expected `(`, found `1`"),
            ("(1)", 0, "name of an entity"),
            ("A(\u{1})", 2, "found `?)`"),
        ] {
            let fault = part(text).unwrap_err();
            assert_eq!(fault.at, at, "{text}: {}", fault.reason);
            assert!(fault.reason.contains(reason), "{text}: {}", fault.reason);
        }
    }

    #[test]
    fn depth_is_bounded() {
        let nested = |depth: usize| format!("A{}{}", "(".repeat(depth), ")".repeat(depth));
        assert!(part(&nested(MAX_DEPTH)).is_ok());
        assert!(part(&nested(MAX_DEPTH + 1)).is_err());
        assert!(part(&nested(1_000_000)).is_err());
        assert!(part(&"A(".repeat(1_000_000)).is_err());
    }
}
