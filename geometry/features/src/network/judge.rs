//! How well a network does on patterns that it was not taught.

use super::classifier::Classifier;
use super::recipe::{Teaching, TrainError, patterns};
use crate::chance::Chance;
use crate::code::{Attributes, Digit, Form, Sense};
use crate::patterns::{GivenPattern, Pattern, Purpose};

/// Answers on patterns that were not taught.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Judged {
    /// Classes, in the order of rows and columns.
    pub classes: Vec<String>,
    /// For each class, how many of its patterns the network called each class; last, unknown.
    pub confusion: Vec<Vec<usize>>,
    /// Codes that mean nothing.
    pub foreign: usize,
    /// Those of them that it gave a class nevertheless.
    pub foreign_known: usize,
}

impl Judged {
    /// Patterns of all classes.
    #[must_use]
    pub fn patterns(&self) -> usize {
        self.confusion.iter().flatten().sum()
    }

    /// Those that have their own class.
    #[must_use]
    pub fn right(&self) -> usize {
        let own = self.confusion.iter().enumerate();
        own.filter_map(|(k, row)| row.get(k)).sum()
    }

    /// Those that were called unknown.
    #[must_use]
    pub fn unknown(&self) -> usize {
        self.confusion.iter().filter_map(|row| row.last()).sum()
    }
}

/// Random codes of 1 to 15 digits with random attributes; by chance, some are those of a class.
#[must_use]
pub fn foreign_codes(count: usize, seed: u64) -> Vec<Attributes> {
    let mut chance = Chance::new(seed, 255);
    let mut one = || {
        let digits = 1 + chance.below(15);
        let mut digit = || Digit::ALL[chance.below(Digit::ALL.len())];
        let code = (0..digits).map(|_| digit()).collect();
        Attributes {
            code,
            sense: Sense::ALL[chance.below(Sense::ALL.len())],
            form: Form::ALL[chance.below(Form::ALL.len())],
        }
    };
    (0..count).map(|_| one()).collect()
}

/// Sections of each class that the published network is judged by.
const PER_CLASS: usize = 600;

/// Judges a network by patterns drawn for that, as many as it was taught, of the classes that it
/// has, and by as many random codes. The published one, which was taught six rows, is judged by drawn
/// sections as well.
///
/// # Errors
/// None of a network that was trained.
pub fn judge(classifier: &Classifier, given: &[GivenPattern]) -> Result<Judged, TrainError> {
    let mut recipe = classifier.trained().recipe.clone();
    if recipe.teaching == Teaching::Table2 {
        recipe.teaching = Teaching::Drawn(PER_CLASS);
    }
    let patterns = patterns(&recipe, given, Purpose::Judging)?;
    Ok(judged(classifier, &patterns, recipe.seed))
}

/// Judges a network by any patterns; those of classes that it has not are left out.
#[must_use]
pub fn judged(classifier: &Classifier, patterns: &[Pattern], seed: u64) -> Judged {
    let classes = classifier.classes().to_vec();
    let mut confusion = vec![vec![0; classes.len() + 1]; classes.len()];
    for pattern in patterns {
        let Some(row) = classes.iter().position(|own| *own == pattern.class) else {
            continue;
        };
        let verdict = classifier.classify(&pattern.attributes);
        let known = verdict.known();
        let column = classes.iter().position(|own| Some(own.as_str()) == known);
        confusion[row][column.unwrap_or(classes.len())] += 1;
    }
    let foreign = foreign_codes(patterns.len(), seed);
    let is_known = |own: &&Attributes| !classifier.classify(own).is_unknown();
    Judged {
        confusion,
        foreign_known: foreign.iter().filter(is_known).count(),
        foreign: foreign.len(),
        classes,
    }
}
