//! Attributes to the numbers at the network's inputs.

use crate::code::{Attributes, Digit};

/// How digits are given to the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// As they are, 1 to 5, and 0 for none, as in Table 2.
    Plain,
    /// From -1 to 1, and -1.5 for none, so that no input is far from the others; taught sooner.
    Centred,
}

impl Scale {
    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Centred => "centred",
        }
    }

    fn of(self, digit: f64) -> f64 {
        match self {
            Self::Plain => digit,
            Self::Centred => 0.5 * (digit - 3.0),
        }
    }
}

/// A code of just so many digits: shorter ones stand in the middle, with none (`None`) around them,
/// of longer ones so many are taken, evenly from the first to the last.
pub(super) fn fitted(code: &[Digit], digits: usize) -> Vec<Option<Digit>> {
    let count = code.len();
    if count > digits {
        let spread = |k: usize| (k * (count - 1) + (digits - 1) / 2) / (digits - 1).max(1);
        return (0..digits).map(|k| code.get(spread(k)).copied()).collect();
    }
    let before = (digits - count) / 2;
    let mut fitted = vec![None; digits];
    for (place, &digit) in fitted.iter_mut().skip(before).zip(code) {
        *place = Some(digit);
    }
    fitted
}

/// The digits, then (A) and (B).
pub(super) fn input(attributes: &Attributes, digits: usize, scale: Scale) -> Vec<f64> {
    let number = |digit: Option<Digit>| digit.map_or(0.0, |own| f64::from(own.number()));
    let code = fitted(&attributes.code, digits);
    let code = code.into_iter().map(|digit| scale.of(number(digit)));
    let others = [attributes.sense.number(), attributes.form.number()];
    code.chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::{Form, Sense};

    fn code(text: &str) -> Vec<Digit> {
        text.bytes()
            .filter_map(|own| Digit::of(own - b'0'))
            .collect()
    }

    #[test]
    fn the_first_row_of_table_2() {
        let pocket = Attributes {
            code: code("4543212"),
            sense: Sense::Concave,
            form: Form::ClosedRectangular,
        };
        let row = [4.0, 5.0, 4.0, 3.0, 2.0, 1.0, 2.0, -1.0, 1.0];
        assert_eq!(input(&pocket, 7, Scale::Plain), row);
        let centred = input(&pocket, 9, Scale::Centred);
        assert_eq!(centred[..3], [-1.5, 0.5, 1.0]);
        assert_eq!(centred[8..], [-1.5, -1.0, 1.0]);
    }

    #[test]
    fn long_codes_keep_both_ends() {
        let numbers = |text: &str, digits: usize| -> Vec<u8> {
            let fitted = fitted(&code(text), digits).into_iter();
            fitted.map(|own| own.map_or(0, Digit::number)).collect()
        };
        assert_eq!(numbers("454345432123212", 7), [4, 4, 5, 3, 1, 2, 2]);
        assert_eq!(numbers("3212", 7), [0, 3, 2, 1, 2, 0, 0]);
        assert_eq!(numbers("45", 1), [4]);
        assert_eq!(numbers("", 2), [0, 0]);
    }
}
