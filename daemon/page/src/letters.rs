//! Letters that do no harm: those that nobody sees, or that turn a line around, are told by their
//! numbers.

/// Whether a letter has no shape, or changes that of others.
fn is_hidden(letter: char) -> bool {
    letter.is_control()
        || matches!(
            letter,
            '\u{ad}'
                | '\u{61c}'
                | '\u{180e}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{feff}'
                | '\u{fff9}'..='\u{fffb}'
        )
}

/// A letter by its number, for where it cannot be shown.
pub(crate) fn by_number(letter: char) -> String {
    format!("[U+{:04X}]", u32::from(letter))
}

/// Text of one line whose letters can all be seen. White space of any kind is a space, and what
/// has no shape is told by its number, but for the joiners that some scripts are written with.
pub(crate) fn visible(text: &str) -> String {
    let mut seen = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '\u{200c}' | '\u{200d}' => seen.push(letter),
            _ if letter.is_whitespace() && letter != '\u{a0}' => {
                if !seen.ends_with(' ') || letter == ' ' {
                    seen.push(' ');
                }
            }
            _ if is_hidden(letter) => seen.push_str(&by_number(letter)),
            _ => seen.push(letter),
        }
    }
    composed(&seen)
}

/// Hangul syllables of their parts, which is how some computers keep names of files (The Unicode
/// Standard, section 3.12).
fn composed(text: &str) -> String {
    const SYLLABLES: u32 = 0xac00;
    const LEAD: u32 = 0x1100;
    const VOWEL: u32 = 0x1161;
    // One before the first, since there may be none.
    const TAIL: u32 = 0x11a7;
    let mut whole = String::with_capacity(text.len());
    for letter in text.chars() {
        let last = whole.chars().next_back().map_or(0, u32::from);
        let part = u32::from(letter);
        let joined = match (last.checked_sub(LEAD), part.checked_sub(VOWEL)) {
            (Some(lead @ 0..19), Some(vowel @ 0..21)) => Some(SYLLABLES + (lead * 21 + vowel) * 28),
            _ => match (last.checked_sub(SYLLABLES), part.checked_sub(TAIL)) {
                (Some(open @ 0..11172), Some(tail @ 1..28)) if open % 28 == 0 => Some(last + tail),
                _ => None,
            },
        };
        match joined.and_then(char::from_u32) {
            Some(joined) => {
                whole.pop();
                whole.push(joined);
            }
            None => whole.push(letter),
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_seen_is_told_by_its_number() {
        assert_eq!(visible("a\tb\nc"), "a b c");
        assert_eq!(visible("a\u{202e}b\u{0}"), "a[U+202E]b[U+0000]");
        assert_eq!(visible("\u{645}\u{200c}\u{645}"), "\u{645}\u{200c}\u{645}");
    }

    #[test]
    fn parts_of_syllables_are_joined() {
        // "Part", once whole and once in parts.
        assert_eq!(
            visible("\u{1107}\u{116e}\u{1111}\u{116e}\u{11b7}"),
            "\u{bd80}\u{d488}"
        );
        assert_eq!(visible("\u{bd80}\u{d488}"), "\u{bd80}\u{d488}");
        assert_eq!(visible("\u{116e}\u{1107}"), "\u{116e}\u{1107}");
    }
}
