//! From a recipe to a network.

use range_image::{Cancelled, Monitor};

use super::classifier::{Bounds, Classifier};
use super::input::{Scale, input};
use super::known::Known;
use super::net::{Net, NetError};
use super::train::{Rates, descend};
use crate::chance::Chance;
use crate::class::Class;
use crate::code::{Attributes, mirrored, written};
use crate::patterns::{GivenPattern, Pattern, Purpose, draw, table_2, vary};

/// What a network is taught.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Teaching {
    /// Sections drawn for each class, so many.
    Drawn(usize),
    /// The six rows of Jun & Park, Table 2, and no more.
    Table2,
}

/// All that makes a network.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Of all draws.
    pub seed: u64,
    /// What it is taught.
    pub teaching: Teaching,
    /// Digits of a code that it looks at.
    pub digits: usize,
    /// Neurons of its hidden layer.
    pub hidden: usize,
    /// How digits come to its inputs.
    pub scale: Scale,
    /// How weights follow errors.
    pub rates: Rates,
    /// Weights are drawn from this below 0 to this above.
    pub initial: f64,
}

impl Recipe {
    /// The default network's.
    pub const SHIPPED: Self = Self {
        // Of the first five, the one whose training ended with the least error.
        seed: 5,
        teaching: Teaching::Drawn(600),
        digits: 15,
        hidden: 30,
        scale: Scale::Centred,
        // Patterns that look alike at times pull at the same weights; they settle as the rate falls.
        rates: Rates {
            epochs: 100,
            last_share: 0.02,
            ..Rates::PAPER
        },
        initial: 0.25,
    };

    /// That of Jun & Park: 9-15-6, taught the six rows of Table 2.
    pub const PUBLISHED: Self = Self {
        seed: 1,
        teaching: Teaching::Table2,
        digits: 7,
        hidden: 15,
        scale: Scale::Plain,
        rates: Rates::PAPER,
        initial: 0.25,
    };
}

/// A recipe, and what it came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// What was done.
    pub recipe: Recipe,
    /// Classes that users gave, with how many patterns.
    pub given: Vec<(String, usize)>,
    /// Patterns that were taught.
    pub patterns: usize,
    /// Epochs that were needed.
    pub epochs: usize,
    /// The error of the last.
    pub error: f64,
    /// Whether that is below the tolerance.
    pub has_converged: bool,
}

/// One epoch of training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch {
    /// From 1.
    pub epoch: usize,
    /// Half the sum of squares of a pattern's outputs less what they should be, on average.
    pub error: f64,
}

/// Why no network was made.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// Something in the recipe is out of bounds.
    #[error("{what} {value}: must be {expected}")]
    Recipe {
        /// Which.
        what: &'static str,
        /// As given.
        value: String,
        /// What it may be.
        expected: &'static str,
    },
    /// Two classes look the same to the network.
    #[error(
        "{class} (line {line}) looks just like {other}: code {code}, {sense}, {form}; the network cannot tell them apart. Give a section or a code that differs, or another form"
    )]
    Same {
        /// The user's.
        class: String,
        /// Of its pattern in its file.
        line: usize,
        /// The one that is taught already.
        other: String,
        /// The code of both.
        code: String,
        /// Of both.
        sense: &'static str,
        /// Of both.
        form: &'static str,
    },
    /// The published network is taught six rows.
    #[error(
        "the published network is taught the six rows of Table 2 and nothing else; leave out the patterns"
    )]
    NoMore,
    /// Layers without neurons.
    #[error(transparent)]
    Net(#[from] NetError),
    /// Nobody waits for it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Bounds of outputs and of the lead; below, a class is as good as another.
const LEAST_OUTPUT: f64 = 0.5;
const LEAST_MARGIN: f64 = 0.2;
/// So much of patterns that were not taught lie within the distance.
const WITHIN: f64 = 0.97;
/// No bound on distances is tighter: half an edit is one digit beside itself.
const LEAST_DISTANCE: f64 = 1.0;
/// Attributes that are a smaller share of their class's patterns may be sections gone wrong.
const LEAST_SHARE: f64 = 0.005;
/// Attributes are what a class is taught by where they are this share of its patterns.
const COMMON_SHARE: f64 = 0.05;

/// Makes a network: the same recipe and patterns give the same weights, bit for bit. Classes of
/// `given` that are new come behind the others; patterns of known ones are added to them.
///
/// # Errors
/// [`TrainError`], where the recipe is out of bounds, a given pattern is just like another class, or
/// the caller has lost interest.
pub fn train(
    recipe: &Recipe,
    given: &[GivenPattern],
    monitor: &dyn Monitor,
) -> Result<(Classifier, Vec<Epoch>), TrainError> {
    check(recipe)?;
    let taught = patterns(recipe, given, Purpose::Teaching)?;
    let classes = classes(recipe, given);
    let least = match recipe.teaching {
        Teaching::Drawn(count) => (LEAST_SHARE * count as f64) as usize,
        Teaching::Table2 => 1,
    };
    let known = Known::of(&taught, &classes, least);
    tell_apart(&taught, &classes, given)?;
    let mut chance = Chance::new(recipe.seed, 0);
    let sizes = [recipe.digits + 2, recipe.hidden, classes.len()];
    let mut net = Net::drawn(sizes, recipe.initial, &mut chance)?;
    let mut order: Vec<usize> = (0..taught.len()).collect();
    if recipe.teaching != Teaching::Table2 {
        // Class after class would be forgotten one after the other.
        for k in (1..order.len()).rev() {
            order.swap(k, chance.below(k + 1));
        }
    }
    let mut inputs = Vec::with_capacity(order.len());
    let mut targets = Vec::with_capacity(order.len());
    for &k in &order {
        let Some(target) = classes.iter().position(|own| *own == taught[k].class) else {
            continue;
        };
        inputs.push(input(&taught[k].attributes, recipe.digits, recipe.scale));
        targets.push(target);
    }
    let run = descend(&mut net, &inputs, &targets, &recipe.rates, monitor)?;
    let mut classifier = Classifier {
        digits: recipe.digits,
        scale: recipe.scale,
        net,
        known,
        bounds: Bounds::NONE,
        trained: Trained {
            recipe: recipe.clone(),
            given: counts(given),
            patterns: taught.len(),
            epochs: run.errors.len(),
            error: run.errors.last().copied().unwrap_or(f64::INFINITY),
            has_converged: run.has_converged,
        },
        classes,
    };
    if recipe.teaching != Teaching::Table2 {
        classifier.bounds = Bounds {
            output: LEAST_OUTPUT,
            margin: LEAST_MARGIN,
            distance: reach(&classifier, &patterns(recipe, given, Purpose::Bounds)?),
        };
    }
    let epoch = |(k, &error): (usize, &f64)| Epoch {
        epoch: k + 1,
        error,
    };
    let epochs = run.errors.iter().enumerate().map(epoch).collect();
    Ok((classifier, epochs))
}

fn check(recipe: &Recipe) -> Result<(), TrainError> {
    let refused = |what, value: String, expected| {
        Err(TrainError::Recipe {
            what,
            value,
            expected,
        })
    };
    let rates = &recipe.rates;
    if !(3..=99).contains(&recipe.digits) {
        return refused("digits", recipe.digits.to_string(), "3 to 99");
    }
    if !(1..=500).contains(&recipe.hidden) {
        return refused("hidden neurons", recipe.hidden.to_string(), "1 to 500");
    }
    if let Teaching::Drawn(count) = recipe.teaching
        && !(10..=100_000).contains(&count)
    {
        return refused("patterns of each class", count.to_string(), "10 to 100000");
    }
    if !(1..=10_000_000).contains(&rates.epochs) {
        return refused("epochs", rates.epochs.to_string(), "1 to 10000000");
    }
    for (what, value, low, high, expected) in [
        (
            "learning rate",
            rates.learning,
            1e-6,
            10.0,
            "0.000001 to 10",
        ),
        ("momentum", rates.momentum, 0.0, 0.999, "0 to 0.999"),
        ("tolerance", rates.tolerance, 0.0, 1.0, "0 to 1"),
        (
            "last share of the rate",
            rates.last_share,
            0.0,
            1.0,
            "0 to 1",
        ),
        (
            "first weights",
            recipe.initial,
            1e-6,
            10.0,
            "0.000001 to 10",
        ),
    ] {
        if !(low..=high).contains(&value) {
            return refused(what, value.to_string(), expected);
        }
    }
    Ok(())
}

fn counts(given: &[GivenPattern]) -> Vec<(String, usize)> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for own in given {
        match counts.iter_mut().find(|(class, _)| *class == own.class) {
            Some((_, count)) => *count += 1,
            None => counts.push((own.class.clone(), 1)),
        }
    }
    counts
}

/// Names of the classes, in the order of the outputs.
fn classes(recipe: &Recipe, given: &[GivenPattern]) -> Vec<String> {
    let ours: &[Class] = match recipe.teaching {
        Teaching::Drawn(_) => &Class::TAUGHT,
        Teaching::Table2 => &Class::ALL,
    };
    let mut classes: Vec<String> = ours.iter().map(|own| own.as_str().to_owned()).collect();
    for own in given {
        if !classes.contains(&own.class) {
            classes.push(own.class.clone());
        }
    }
    classes
}

/// Patterns for a purpose: what is drawn of our classes, and as many of each class that was given,
/// half as many where it is one of ours.
pub(super) fn patterns(
    recipe: &Recipe,
    given: &[GivenPattern],
    purpose: Purpose,
) -> Result<Vec<Pattern>, TrainError> {
    let count = match recipe.teaching {
        Teaching::Table2 if given.is_empty() => return Ok(table_2()),
        Teaching::Table2 => return Err(TrainError::NoMore),
        Teaching::Drawn(count) => count,
    };
    let mut patterns = Vec::new();
    let of = |class: &str, attributes: Attributes| Pattern {
        class: class.to_owned(),
        attributes,
    };
    for class in Class::TAUGHT {
        let drawn = draw(class, count, recipe.seed, purpose);
        let drawn = drawn.iter().map(|own| of(class.as_str(), own.attributes()));
        patterns.extend(drawn);
    }
    for (class, _) in counts(given) {
        let own: Vec<&GivenPattern> = given.iter().filter(|own| own.class == class).collect();
        let is_ours = Class::named(&class).is_some();
        let count = if is_ours { count / 2 } else { count };
        let varied = vary(&own, count, recipe.seed, purpose);
        patterns.extend(varied.into_iter().map(|own| of(&class, own)));
    }
    Ok(patterns)
}

/// Refuses what users give where it is just what another class is taught by.
fn tell_apart(
    taught: &[Pattern],
    classes: &[String],
    given: &[GivenPattern],
) -> Result<(), TrainError> {
    for own in given {
        let attributes = own.attributes();
        let turned = mirrored(&attributes.code);
        let is_same = |other: &Attributes| {
            (other.sense, other.form) == (attributes.sense, attributes.form)
                && (other.code == attributes.code || other.code == turned)
        };
        for class in classes.iter().filter(|class| **class != own.class) {
            let theirs = taught.iter().filter(|pattern| pattern.class == *class);
            let (mut all, mut same) = (0_usize, 0_usize);
            for pattern in theirs {
                all += 1;
                same += usize::from(is_same(&pattern.attributes));
            }
            if same > 0 && same as f64 >= COMMON_SHARE * all as f64 {
                return Err(TrainError::Same {
                    class: own.class.clone(),
                    line: own.line,
                    other: class.clone(),
                    code: written(&attributes.code),
                    sense: attributes.sense.as_str(),
                    form: attributes.form.as_str(),
                });
            }
        }
    }
    Ok(())
}

/// The distance within which nearly all patterns lie that were not taught.
fn reach(classifier: &Classifier, patterns: &[Pattern]) -> f64 {
    let distance = |pattern: &Pattern| {
        let class = classifier
            .classes
            .iter()
            .position(|own| *own == pattern.class);
        classifier
            .known
            .distance(&pattern.attributes, class.unwrap_or(usize::MAX))
    };
    let mut distances: Vec<f64> = patterns.iter().map(distance).collect();
    distances.sort_by(f64::total_cmp);
    let place = (WITHIN * distances.len() as f64) as usize;
    let bound = distances.get(place.min(distances.len().saturating_sub(1)));
    bound.copied().unwrap_or(LEAST_DISTANCE).max(LEAST_DISTANCE)
}
