//! Strings (ISO 10303-21, 6.4.3).

/// What stands between the apostrophes of a string, decoded; `None` for a control
/// directive that the standard does not have, or that is cut off.
pub(super) fn decoded(raw: &[u8]) -> Option<String> {
    let mut out = String::new();
    let mut rest = raw;
    while let Some((&first, after)) = rest.split_first() {
        rest = match first {
            // The scanner ends a string at an apostrophe that has no second one.
            b'\'' => {
                out.push('\'');
                after.strip_prefix(b"'").unwrap_or(after)
            }
            b'\\' => directive(after, &mut out)?,
            // Bytes beyond ASCII do not belong here; old files mean ISO 8859-1.
            _ => {
                out.push(char::from(first));
                after
            }
        };
    }
    Some(out)
}

/// What follows a backslash; returns what follows the directive.
fn directive<'a>(rest: &'a [u8], out: &mut String) -> Option<&'a [u8]> {
    if let Some(rest) = rest.strip_prefix(b"\\") {
        out.push('\\');
        return Some(rest);
    }
    if let Some(rest) = rest.strip_prefix(b"S\\") {
        let (&c, rest) = rest.split_first()?;
        out.push(char::from(c.checked_add(128)?));
        return Some(rest);
    }
    if let Some(rest) = rest.strip_prefix(b"X\\") {
        let (code, rest) = code(rest, 2)?;
        out.push(char::from_u32(code)?);
        return Some(rest);
    }
    // A page of ISO 8859; the first is the default, and the others are not known here.
    if let Some(rest) = rest.strip_prefix(b"PA\\") {
        return Some(rest);
    }
    let (digits, mut rest) = if let Some(rest) = rest.strip_prefix(b"X2\\") {
        (4, rest)
    } else {
        (8, rest.strip_prefix(b"X4\\")?)
    };
    loop {
        if let Some(rest) = rest.strip_prefix(b"\\X0\\") {
            return Some(rest);
        }
        let (c, after) = code(rest, digits)?;
        out.push(char::from_u32(c)?);
        rest = after;
    }
}

fn code(bytes: &[u8], digits: usize) -> Option<(u32, &[u8])> {
    let (code, rest) = bytes.split_at_checked(digits)?;
    let code = std::str::from_utf8(code).ok()?;
    let plain = code.bytes().all(|b| b.is_ascii_hexdigit());
    Some((plain.then(|| u32::from_str_radix(code, 16).ok())??, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directives() {
        for (raw, expected) in [
            ("", Some("")),
            ("it''s", Some("it's")),
            ("a\\\\b", Some("a\\b")),
            ("Geh\\X2\\00E4\\X0\\use", Some("Geh\u{e4}use")),
            ("\\X4\\0001F600\\X0\\!", Some("\u{1f600}!")),
            ("\\X\\E4\\S\\d", Some("\u{e4}\u{e4}")),
            ("\\PA\\x", Some("x")),
            ("\\X2\\00E4", None),
            ("\\X2\\00E", None),
            ("\\X2\\D800\\X0\\", None),
            ("\\X2\\+0E4\\X0\\", None),
            ("\\Q", None),
            ("\\", None),
            ("\\S\\", None),
        ] {
            assert_eq!(decoded(raw.as_bytes()).as_deref(), expected, "{raw}");
        }
        assert_eq!(decoded(b"\xe4").as_deref(), Some("\u{e4}"));
    }
}
