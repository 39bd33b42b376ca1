//! One line of numbers: which character separates, and what each value means.

/// What is wrong with a line.
#[derive(Debug, PartialEq)]
pub(crate) enum Problem {
    NotANumber(String),
    DecimalComma(String),
    TooFew(usize),
}

/// A point in the file's units.
#[derive(Debug, PartialEq)]
pub(crate) struct TextPoint {
    pub(crate) xyz: [f64; 3],
    pub(crate) intensity: Option<f64>,
    /// Values that were not looked at.
    pub(crate) surplus: usize,
}

/// Position of each value on a line.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Layout {
    named: Option<Named>,
}

#[derive(Debug, Clone, PartialEq)]
struct Named {
    xyz: [usize; 3],
    intensity: Option<usize>,
}

/// Which values of a line are which, once its first line has told.
#[derive(Debug, Default)]
pub(crate) struct Layouts(Option<Layout>);

impl Layouts {
    /// The layout of a line of values; `None` for the header that may be the first line.
    pub(crate) fn of(&mut self, content: &str) -> Option<&Layout> {
        if self.0.is_none() {
            let header = Layout::from_header(content);
            let is_header = header.is_some();
            self.0 = Some(header.unwrap_or_default());
            if is_header {
                return None;
            }
        }
        self.0.as_ref()
    }

    /// Whether a header names an intensity.
    pub(crate) fn names_intensity(&self) -> bool {
        self.0.as_ref().is_some_and(Layout::names_intensity)
    }
}

impl Layout {
    /// The layout a header line gives, or `None` if the line holds numbers. A header that
    /// does not name x, y and z says nothing: the first three values are taken.
    pub(crate) fn from_header(line: &str) -> Option<Self> {
        let (fields, _) = split(line).ok()?;
        if fields.iter().any(|f| number(f).is_some()) {
            return None;
        }
        let names: Vec<String> = fields.iter().map(|f| name(f)).collect();
        let find = |wanted: &[&str]| names.iter().position(|n| wanted.contains(&n.as_str()));
        let named = match (find(&["x"]), find(&["y"]), find(&["z"])) {
            (Some(x), Some(y), Some(z)) => Some(Named {
                xyz: [x, y, z],
                intensity: find(&["intensity", "i", "reflectance", "amplitude"]),
            }),
            _ => None,
        };
        Some(Self { named })
    }

    pub(crate) fn names_intensity(&self) -> bool {
        self.named.as_ref().is_some_and(|n| n.intensity.is_some())
    }

    pub(crate) fn point(&self, line: &str) -> Result<TextPoint, Problem> {
        let (fields, decimal_commas) = split(line)?;
        let value = |index: usize| -> Result<f64, Problem> {
            let field = fields.get(index).ok_or(Problem::TooFew(fields.len()))?;
            let parsed = if decimal_commas {
                number(&field.replace(',', "."))
            } else {
                number(field)
            };
            parsed.ok_or_else(|| Problem::NotANumber(excerpt(field)))
        };
        let (xyz, intensity) = match &self.named {
            Some(named) => (named.xyz, named.intensity),
            None => ([0, 1, 2], (fields.len() == 4).then_some(3)),
        };
        Ok(TextPoint {
            xyz: [value(xyz[0])?, value(xyz[1])?, value(xyz[2])?],
            intensity: intensity.map(value).transpose()?,
            surplus: (fields.len() - 3).saturating_sub(usize::from(intensity.is_some())),
        })
    }
}

/// The fields of a line, and whether commas in them are decimal commas.
///
/// Semicolons separate if there are any; else commas, unless blanks are needed too to
/// tell the fields apart; else blanks. Where a comma could be either, the line is refused.
fn split(line: &str) -> Result<(Vec<&str>, bool), Problem> {
    let trimmed = |field: &'_ str| -> bool { !field.is_empty() };
    if line.contains(';') {
        let mut fields: Vec<&str> = line.split(';').map(str::trim).collect();
        drop_trailing_empty(&mut fields);
        let commas = fields.iter().any(|f| f.contains(','));
        if commas && fields.iter().any(|f| f.contains('.')) {
            return Err(Problem::DecimalComma(excerpt(line)));
        }
        return Ok((fields, commas));
    }
    if line.contains(',') {
        let mut fields: Vec<&str> = line.split(',').map(str::trim).collect();
        drop_trailing_empty(&mut fields);
        let numeric = fields.iter().filter(|f| number(f).is_some()).count();
        let needs_blanks = fields.iter().any(|f| {
            let mut parts = f.split_whitespace();
            parts.clone().count() > 1 && parts.all(|p| number(p).is_some())
        });
        // `1,5,2,0,3,1` is either six whole numbers or three with decimal commas.
        let undecidable = fields.len() >= 6
            && fields.len().is_multiple_of(2)
            && numeric == fields.len()
            && !line.contains(['.', 'e', 'E']);
        if needs_blanks || undecidable {
            return Err(Problem::DecimalComma(excerpt(line)));
        }
        return Ok((fields, false));
    }
    Ok((
        line.split_whitespace().filter(|f| trimmed(f)).collect(),
        false,
    ))
}

fn drop_trailing_empty(fields: &mut Vec<&str>) {
    while fields.last().is_some_and(|f| f.is_empty()) {
        fields.pop();
    }
}

fn number(field: &str) -> Option<f64> {
    field.parse().ok()
}

/// A column's name without quotes, a leading `//`, and a unit: `"X [mm]"` is `x`.
fn name(field: &str) -> String {
    let bare: String = field
        .trim_matches(|c: char| !c.is_alphanumeric())
        .to_ascii_lowercase();
    bare.split(|c: char| !c.is_alphanumeric())
        .next()
        .unwrap_or_default()
        .to_owned()
}

/// Enough of a text to recognise it in an error message.
fn excerpt(text: &str) -> String {
    const LENGTH: usize = 40;
    if text.chars().count() <= LENGTH {
        text.to_owned()
    } else {
        text.chars().take(LENGTH).chain("...".chars()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn xyz(line: &str) -> [f64; 3] {
        Layout::default().point(line).unwrap().xyz
    }

    #[test]
    fn blanks_commas_and_semicolons_separate() {
        let expected = [1.5, -2.0, 300.0];
        for line in [
            "1.5 -2 3e2",
            "1.5\t -2\t3e2",
            "1.5,-2,3e2",
            "1.5, -2 ,3e2,",
            "1.5;-2;3e2",
            "1,5;-2,0;300",
            "1.5 ; -2 ; 3e2 ;",
        ] {
            assert_eq!(xyz(line), expected, "{line}");
        }
    }

    #[test]
    fn decimal_commas_are_refused_where_a_comma_could_separate() {
        for line in ["1,5 2,0 3,1", "1,5,2,0,3,1", "1.234,5;2,0;3,1", "1,5 2 3"] {
            assert_eq!(
                Layout::default().point(line),
                Err(Problem::DecimalComma(line.to_owned())),
                "{line}"
            );
        }
    }

    #[test]
    fn a_fourth_value_is_the_intensity_and_more_are_counted() {
        let four = Layout::default().point("1 2 3 77").unwrap();
        assert_eq!((four.intensity, four.surplus), (Some(77.0), 0));
        let six = Layout::default().point("1 2 3 0.0 0.0 0.0").unwrap();
        assert_eq!((six.intensity, six.surplus), (None, 3));
    }

    #[test]
    fn a_header_may_give_the_order() {
        let layout = Layout::from_header("\"Z [mm]\";\"I\";\"X [mm]\";\"Y [mm]\";t").unwrap();
        let point = layout.point("3;9;1;2;0").unwrap();
        assert_eq!(point.xyz, [1.0, 2.0, 3.0]);
        assert_eq!((point.intensity, point.surplus), (Some(9.0), 1));
        assert!(Layout::from_header("1 2 3").is_none());
        assert_eq!(Layout::from_header("a b c"), Some(Layout::default()));
    }

    #[test]
    fn what_is_missing_or_no_number_is_named() {
        assert_eq!(Layout::default().point("1 2"), Err(Problem::TooFew(2)));
        assert_eq!(
            Layout::default().point("1 two 3"),
            Err(Problem::NotANumber("two".to_owned()))
        );
    }
}
