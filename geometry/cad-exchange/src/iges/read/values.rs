//! Free-format values: numbers and Hollerith strings between delimiters.

use super::error::ReadError;

/// Longest run of characters that is taken for a number.
const MAX_NUMBER_LENGTH: usize = 128;

/// The characters that end a value and a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Delimiters {
    pub(super) value: u8,
    pub(super) record: u8,
}

impl Default for Delimiters {
    fn default() -> Self {
        Self {
            value: b',',
            record: b';',
        }
    }
}

/// A value between two delimiters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Value {
    /// Nothing, which stands for the field's default.
    Empty,
    /// Anything that is not a string.
    Word(String),
    /// A Hollerith string.
    Text(String),
}

/// Why the next value cannot be told.
pub(super) type Defect = String;

/// Takes the next value from the characters of a section; the flag tells that it ended
/// the record.
pub(super) fn next_value(
    mut next: impl FnMut() -> Option<u8>,
    delimiters: Delimiters,
) -> Result<(Value, bool), Defect> {
    let mut word = Vec::new();
    loop {
        let Some(byte) = next() else {
            return Err(format!(
                "the record does not end with its delimiter {:?}",
                char::from(delimiters.record)
            ));
        };
        if byte == delimiters.value || byte == delimiters.record {
            let text = String::from_utf8_lossy(&word).trim().to_owned();
            let value = if text.is_empty() {
                Value::Empty
            } else {
                Value::Word(text)
            };
            return Ok((value, byte == delimiters.record));
        }
        if matches!(byte, b'H' | b'h')
            && let Some(length) = hollerith_length(&word)
        {
            return text(next, delimiters, length);
        }
        if word.is_empty() && byte.is_ascii_whitespace() {
            continue;
        }
        if word.len() == MAX_NUMBER_LENGTH {
            return Err(format!(
                "{:?}... is neither a number nor a string",
                String::from_utf8_lossy(&word[..16.min(word.len())])
            ));
        }
        word.push(byte);
    }
}

/// The count before an `H`, where there is one and nothing else.
fn hollerith_length(word: &[u8]) -> Option<usize> {
    let digits = std::str::from_utf8(word).ok()?.trim();
    (!digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
        .then(|| digits.parse().ok())
        .flatten()
}

fn text(
    mut next: impl FnMut() -> Option<u8>,
    delimiters: Delimiters,
    length: usize,
) -> Result<(Value, bool), Defect> {
    let mut text = Vec::new();
    for _ in 0..length {
        let Some(byte) = next() else {
            return Err(format!(
                "a string of {length} characters runs beyond the record"
            ));
        };
        text.push(byte);
    }
    let text = String::from_utf8_lossy(&text).into_owned();
    loop {
        match next() {
            Some(byte) if byte == delimiters.value => return Ok((Value::Text(text), false)),
            Some(byte) if byte == delimiters.record => return Ok((Value::Text(text), true)),
            Some(byte) if byte.is_ascii_whitespace() => {}
            Some(byte) => {
                return Err(format!(
                    "the string {text:?} is followed by {:?} instead of a delimiter",
                    char::from(byte)
                ));
            }
            None => {
                return Err(format!(
                    "the string {text:?} is not followed by a delimiter"
                ));
            }
        }
    }
}

/// A real constant: exponents with `E` or `D`, the point optional.
pub(super) fn parse_real(word: &str) -> Option<f64> {
    let plain = word
        .bytes()
        .all(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'e' | b'E' | b'd' | b'D'));
    if !plain {
        return None;
    }
    let number: f64 = word.replace(['d', 'D'], "e").parse().ok()?;
    number.is_finite().then_some(number)
}

/// The delimiters as the Global section declares them, and how many of its characters
/// that takes.
pub(super) fn declared_delimiters(global: &[u8]) -> Result<(Delimiters, usize), ReadError> {
    let mut delimiters = Delimiters::default();
    let declared = |at: usize, field, name| -> Result<(Option<u8>, usize), ReadError> {
        let rest = global.get(at..).unwrap_or_default();
        let at = at + rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
        let rest = global.get(at..).unwrap_or_default();
        let Some(&[b'1', b'H' | b'h', delimiter]) = rest.get(..3) else {
            return Ok((None, at));
        };
        let forbidden = delimiter.is_ascii_alphanumeric()
            || !(b' '..=b'~').contains(&delimiter)
            || matches!(delimiter, b' ' | b'+' | b'-' | b'.');
        if forbidden {
            let reason = format!("{:?} cannot be a delimiter", char::from(delimiter));
            return Err(ReadError::Global {
                field,
                name,
                reason,
            });
        }
        Ok((Some(delimiter), at + 3))
    };
    let (first, mut at) = declared(0, 1, "parameter delimiter")?;
    delimiters.value = first.unwrap_or(delimiters.value);
    expect(global, &mut at, delimiters.value, 1, "parameter delimiter")?;
    let (second, next) = declared(at, 2, "record delimiter")?;
    delimiters.record = second.unwrap_or(delimiters.record);
    at = next;
    if delimiters.value == delimiters.record {
        return Err(ReadError::Global {
            field: 2,
            name: "record delimiter",
            reason: format!(
                "{:?} delimits parameters already",
                char::from(delimiters.record)
            ),
        });
    }
    expect(global, &mut at, delimiters.value, 2, "record delimiter")?;
    Ok((delimiters, at))
}

fn expect(
    global: &[u8],
    at: &mut usize,
    delimiter: u8,
    field: usize,
    name: &'static str,
) -> Result<(), ReadError> {
    let rest = global.get(*at..).unwrap_or_default();
    let blanks = rest
        .iter()
        .position(|b| !b.is_ascii_whitespace())
        .unwrap_or(rest.len());
    if rest.get(blanks) == Some(&delimiter) {
        *at += blanks + 1;
        return Ok(());
    }
    let reason = format!("expected {:?} after it", char::from(delimiter));
    Err(ReadError::Global {
        field,
        name,
        reason,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Result<Vec<Value>, Defect> {
        let mut bytes = text.bytes();
        let mut values = Vec::new();
        loop {
            let (value, last) = next_value(|| bytes.next(), Delimiters::default())?;
            values.push(value);
            if last {
                return Ok(values);
            }
        }
    }

    #[test]
    fn words_strings_and_gaps() {
        let word = |s: &str| Value::Word(s.to_owned());
        let text = |s: &str| Value::Text(s.to_owned());
        assert_eq!(
            values(" 12 ,, 3Ha,;  , -1.5D-3,0H,2Hx ;comment").unwrap(),
            [
                word("12"),
                Value::Empty,
                text("a,;"),
                word("-1.5D-3"),
                text(""),
                text("x ")
            ]
        );
        assert_eq!(values(";").unwrap(), [Value::Empty]);
    }

    #[test]
    fn records_that_break_off() {
        for (record, expected) in [
            ("1,2", "does not end"),
            ("9Habc;", "runs beyond"),
            ("3Habcd;", "followed by 'd'"),
            ("3Habc", "not followed"),
        ] {
            let defect = values(record).unwrap_err();
            assert!(defect.contains(expected), "{defect}");
        }
        assert!(values(&"7".repeat(400)).unwrap_err().contains("neither"));
        assert!(values("99999999999999999999999H,;").unwrap().len() == 2);
    }

    #[test]
    fn reals() {
        for (word, value) in [
            ("1.", 1.0),
            (".5", 0.5),
            ("-3", -3.0),
            ("+2.5E+01", 25.0),
            ("1.D-2", 0.01),
            ("0.E+000", 0.0),
            ("1d3", 1000.0),
        ] {
            assert_eq!(parse_real(word), Some(value), "{word}");
        }
        for word in ["", "x", "nan", "inf", "1e999", "1,5", "--1", "E", "."] {
            assert_eq!(parse_real(word), None, "{word}");
        }
    }

    #[test]
    fn delimiters() {
        let check = |text: &str, value: u8, record: u8, taken: usize| {
            let expected = (Delimiters { value, record }, taken);
            assert_eq!(
                declared_delimiters(text.as_bytes()).unwrap(),
                expected,
                "{text}"
            );
        };
        check(",,3Habc", b',', b';', 2);
        check("1H,,1H;,3Habc", b',', b';', 8);
        check("1H//1H#/3Habc", b'/', b'#', 8);
        check(" 1H/ / 1H#/3Habc", b'/', b'#', 11);
        check("1H///3Habc", b'/', b';', 5);
        for (text, expected) in [
            ("", "field 1 (parameter delimiter): expected ','"),
            ("1H,", "field 1"),
            ("1H7,", "'7' cannot be"),
            ("1H,,1H,,", "field 2 (record delimiter): ',' delimits"),
            ("1H,,1H;;", "field 2 (record delimiter): expected ','"),
        ] {
            let error = declared_delimiters(text.as_bytes())
                .unwrap_err()
                .to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
