//! What comparisons need to know of an IGES file's layout.

use anyhow::{Context, Result, ensure};

/// Columns of a line that carry content, before the section letter and the line's number.
const CONTENT: usize = 72;
/// A time as the global section writes it, `15HYYYYMMDD.HHMMSS`.
const TIME_HEAD: &str = "15H";
const TIME: usize = 15;

/// The file with the digits of both times in its global section (when the file was made,
/// when the model was changed) set to zero. Nothing else is touched, so that two files are
/// equal after it exactly if they differ in their times at most.
///
/// # Errors
/// When the text is not fixed-length ASCII, or has not exactly two times.
pub fn without_times(iges: &[u8]) -> Result<Vec<u8>> {
    let text = std::str::from_utf8(iges).context("the file is not ASCII")?;
    let lines: Vec<&str> = text.lines().collect();
    let is_global = |line: &&str| line.as_bytes().get(CONTENT) == Some(&b'G');
    let mut global = String::new();
    for line in lines.iter().copied().filter(|line| is_global(line)) {
        global += line.get(..CONTENT).context("a short line")?;
    }
    let mut found = 0;
    let mut from = 0;
    while let Some(at) = global[from..].find(TIME_HEAD) {
        let start = from + at + TIME_HEAD.len();
        let time = global.get(start..start + TIME).unwrap_or_default();
        if is_time(time) {
            global.replace_range(start..start + TIME, "00000000.000000");
            found += 1;
        }
        from = start;
    }
    ensure!(found == 2, "{found} times in the global section, not 2");
    let mut rest = global.as_str();
    let mut out = Vec::with_capacity(iges.len());
    for line in lines {
        if is_global(&line) {
            let (own, after) = rest.split_at(CONTENT);
            rest = after;
            out.extend_from_slice(own.as_bytes());
            out.extend_from_slice(&line.as_bytes()[CONTENT..]);
        } else {
            out.extend_from_slice(line.as_bytes());
        }
        out.push(b'\n');
    }
    Ok(out)
}

fn is_time(text: &str) -> bool {
    text.len() == TIME
        && text.bytes().enumerate().all(|(k, b)| {
            if k == 8 {
                b == b'.'
            } else {
                b.is_ascii_digit()
            }
        })
}

/// How many entities of a type the directory lists.
///
/// # Errors
/// When a line of the directory does not begin with a number.
pub fn entities(iges: &[u8], entity: u32) -> Result<usize> {
    let text = std::str::from_utf8(iges).context("the file is not ASCII")?;
    let mut count = 0;
    let directory = text
        .lines()
        .filter(|line| line.as_bytes().get(CONTENT) == Some(&b'D'));
    // Two lines to an entry; the first begins with the type.
    for line in directory.step_by(2) {
        let number = line.get(..8).context("a short line")?.trim();
        let number: u32 = number.parse().context("no type in the directory")?;
        count += usize::from(number == entity);
    }
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(time: &str, last: char) -> Vec<u8> {
        let global = format!("1H,,1H;,4Hpart,8Hpart.igs,15H{time},1.0,2HMM,15H{time};");
        let mut text = format!("{:<72}S{:>7}\n", "a part", 1);
        let mut number = 0;
        for chunk in global.as_bytes().chunks(72) {
            number += 1;
            text += &format!(
                "{:<72}G{number:>7}\n",
                std::str::from_utf8(chunk).expect("ASCII")
            );
        }
        text += &format!(
            "{:<72}D{:>7}\n{:<72}D{:>7}\n",
            "     144       1", 1, "     144", 2
        );
        text += &format!("{last:<72}T{:>7}\n", 1);
        text.into_bytes()
    }

    #[test]
    fn times_alone_are_passed_over() {
        let one = file("20261121.110830", 'x');
        assert_eq!(one.len() % 81, 0);
        let masked = without_times(&one).unwrap();
        assert_eq!(masked.len(), one.len());
        assert_ne!(masked, one);
        assert_eq!(
            masked,
            without_times(&file("20261122.235959", 'x')).unwrap()
        );
        assert_ne!(
            masked,
            without_times(&file("20261121.110830", 'y')).unwrap()
        );
        assert!(without_times(b"no IGES at all\n").is_err());
    }

    #[test]
    fn entities_are_counted_by_their_first_line() {
        let one = file("20261121.110830", 'x');
        assert_eq!(entities(&one, 144).unwrap(), 1);
        assert_eq!(entities(&one, 142).unwrap(), 0);
    }
}
