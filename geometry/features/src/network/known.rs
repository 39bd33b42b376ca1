//! What a network was taught, and how far from that an input is.
//!
//! Sigmoid outputs are sure of themselves however far an input is from all that was taught, so that
//! they cannot tell by themselves that they know nothing of it.

use std::collections::BTreeMap;

use crate::code::{Attributes, Digit, mirrored};
use crate::patterns::Pattern;

/// Attributes that were taught as one class.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taught {
    /// Index of the class.
    pub class: usize,
    /// What the network saw.
    pub attributes: Attributes,
    /// In how many patterns.
    pub count: usize,
}

/// What a network was taught, each once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Known {
    pub(super) taught: Vec<Taught>,
}

/// How far attributes are from each other that differ in sense or form: farther than codes are.
const OTHER_KIND: f64 = 10.0;

/// Of codes longer than the seven digits of Table 2, edits count for less, since there is more that
/// may be amiss.
const SHORT: f64 = 7.0;

impl Known {
    /// Those of patterns that came at least so many times, by class, the commonest first; and each
    /// class's commonest, however rare.
    #[must_use]
    pub fn of(patterns: &[Pattern], classes: &[String], least: usize) -> Self {
        let mut counts: BTreeMap<(usize, Attributes), usize> = BTreeMap::new();
        for pattern in patterns {
            let Some(class) = classes.iter().position(|own| *own == pattern.class) else {
                continue;
            };
            // A section has no first side.
            let code = pattern.attributes.code.clone();
            let attributes = Attributes {
                code: mirrored(&code).min(code),
                ..pattern.attributes
            };
            *counts.entry((class, attributes)).or_default() += 1;
        }
        let mut taught: Vec<Taught> = counts
            .into_iter()
            .map(|((class, attributes), count)| Taught {
                class,
                attributes,
                count,
            })
            .collect();
        taught.sort_by_key(|own| (own.class, usize::MAX - own.count));
        let mut last = None;
        taught.retain(|own| {
            let is_first = last.replace(own.class) != Some(own.class);
            !own.attributes.code.is_empty() && (is_first || own.count >= least)
        });
        Self { taught }
    }

    /// What was taught.
    #[must_use]
    pub fn taught(&self) -> &[Taught] {
        &self.taught
    }

    /// How many digits must change, come or go until attributes are some that were taught as this
    /// class, from either side; 10 more for another sense, and for another form. Infinite where
    /// nothing was taught.
    #[must_use]
    pub fn distance(&self, attributes: &Attributes, class: usize) -> f64 {
        let turned = mirrored(&attributes.code);
        let of = |own: &Taught| {
            let others = f64::from(u8::from(own.attributes.sense != attributes.sense))
                + f64::from(u8::from(own.attributes.form != attributes.form));
            let code = edits(&attributes.code, &own.attributes.code);
            let code = code.min(edits(&turned, &own.attributes.code));
            let longer = attributes.code.len().max(own.attributes.code.len());
            OTHER_KIND * others + code * SHORT / longer.max(SHORT as usize) as f64
        };
        let taught = self.taught.iter().filter(|own| own.class == class);
        taught.map(of).fold(f64::INFINITY, f64::min)
    }
}

/// The distance of two codes (Levenshtein): 1 for each digit that comes or goes, half the difference
/// for each that changes, so that a bend for a wall is half an edit.
fn edits(a: &[Digit], b: &[Digit]) -> f64 {
    let mut last: Vec<f64> = (0..=b.len()).map(|k| k as f64).collect();
    let mut next = last.clone();
    for (i, &from) in a.iter().enumerate() {
        next[0] = (i + 1) as f64;
        for (j, &to) in b.iter().enumerate() {
            let change = 0.5 * f64::from(from.number().abs_diff(to.number()));
            next[j + 1] = (last[j] + change).min(last[j + 1] + 1.0).min(next[j] + 1.0);
        }
        core::mem::swap(&mut last, &mut next);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patterns::table_2;

    fn digits(text: &str) -> Vec<Digit> {
        text.bytes()
            .filter_map(|own| Digit::of(own - b'0'))
            .collect()
    }

    #[test]
    fn edits_are_counted() {
        for (a, b, expected) in [
            ("4543212", "4543212", 0.0),
            ("4543212", "4544212", 0.5),
            ("4543212", "454212", 1.0),
            ("4543212", "", 7.0),
            ("5", "1", 2.0),
            ("4543212", "2123454", 8.0),
        ] {
            assert_eq!(edits(&digits(a), &digits(b)), expected, "{a} {b}");
            assert_eq!(edits(&digits(b), &digits(a)), expected, "{b} {a}");
        }
    }

    #[test]
    fn a_section_is_known_from_either_side_and_of_its_own_kind_only() {
        let patterns = table_2();
        let classes: Vec<String> = patterns.iter().map(|own| own.class.clone()).collect();
        let known = Known::of(&patterns, &classes, 1);
        assert_eq!(known.taught().len(), 6);
        let mut step = patterns[1].attributes.clone();
        assert_eq!(known.distance(&step, 1), 0.0);
        step.code = digits("4543454");
        assert_eq!(known.distance(&step, 1), 0.0);
        assert!(known.distance(&step, 2) > 0.0);
        let pocket = &patterns[0].attributes;
        assert_eq!(known.distance(pocket, 4), 10.0);
        assert_eq!(known.distance(pocket, 6), f64::INFINITY);
    }
}
