//! A network as a file: TOML, with the recipe that made it.
//!
//! Numbers are written so that they are read back bit for bit; the same network gives the same
//! bytes.

use core::fmt::Write as _;
use std::sync::OnceLock;

use serde::Deserialize;

use super::classifier::{Bounds, Classifier};
use super::input::Scale;
use super::known::{Known, Taught};
use super::net::{Net, NetError};
use super::recipe::{Recipe, Teaching, Trained};
use super::train::Rates;
use crate::code::{Attributes, Digit, Form, Sense, written};

/// The default network's file.
pub const SHIPPED: &str = include_str!("../../networks/default.toml");
/// The file of the network of Jun & Park.
pub const PUBLISHED: &str = include_str!("../../networks/published.toml");

/// Of the file's form; files of another are refused.
const VERSION: i64 = 1;
/// By this a file is told from other TOML.
const KIND: &str = "relief-feature-network";
const MOST_CLASSES: usize = 1000;

/// Why a file is no network.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FileError {
    /// Not TOML, or with other keys than a network's.
    #[error("line {line}: {message}")]
    Form {
        /// From 1.
        line: usize,
        /// What is wrong there.
        message: String,
    },
    /// Something else.
    #[error(
        "{kind:?} is no network of `relief features train`, whose files begin with kind = {KIND:?}"
    )]
    Kind {
        /// As found.
        kind: String,
    },
    /// Made by a newer program.
    #[error(
        "version {found} of a network's file; this program reads version {VERSION}; train it anew, or take a newer program"
    )]
    Version {
        /// As found.
        found: i64,
    },
    /// Weights that do not fit.
    #[error(transparent)]
    Net(#[from] NetError),
    /// A value that cannot be.
    #[error("{key}: {message}")]
    Value {
        /// Where.
        key: String,
        /// What is wrong.
        message: String,
    },
}

#[derive(Deserialize)]
struct Head {
    kind: Option<String>,
    version: Option<i64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(rename = "version")]
    _version: i64,
    classes: Vec<String>,
    digits: usize,
    hidden: usize,
    scale: ScaleName,
    bounds: Option<BoundsEntry>,
    recipe: RecipeEntry,
    known: KnownEntry,
    weights: WeightsEntry,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum ScaleName {
    Plain,
    Centred,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoundsEntry {
    output: f64,
    margin: f64,
    distance: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RecipeEntry {
    seed: i64,
    /// None: the rows of Table 2.
    patterns_per_class: Option<usize>,
    initial: f64,
    learning: f64,
    momentum: f64,
    tolerance: f64,
    most_epochs: usize,
    last_share: f64,
    patterns: usize,
    epochs: usize,
    error: f64,
    converged: bool,
    given: Vec<(String, usize)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KnownEntry {
    taught: Vec<TaughtEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TaughtEntry {
    class: String,
    code: String,
    sense: String,
    form: String,
    count: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WeightsEntry {
    hidden: Vec<Vec<f64>>,
    output: Vec<Vec<f64>>,
}

impl Classifier {
    /// The default network.
    ///
    /// # Panics
    /// Never: a test reads the file that is built in.
    #[must_use]
    #[allow(clippy::expect_used, reason = "a test reads the file that is built in")]
    pub fn shipped() -> &'static Self {
        static READ: OnceLock<Classifier> = OnceLock::new();
        READ.get_or_init(|| Self::read(SHIPPED).expect("the built-in network is sound"))
    }

    /// The network of Jun & Park: 9-15-6, taught the rows of Table 2, never in doubt.
    ///
    /// # Panics
    /// Never: a test reads the file that is built in.
    #[must_use]
    #[allow(clippy::expect_used, reason = "a test reads the file that is built in")]
    pub fn published() -> &'static Self {
        static READ: OnceLock<Classifier> = OnceLock::new();
        READ.get_or_init(|| Self::read(PUBLISHED).expect("the built-in network is sound"))
    }

    /// Reads a network's file.
    ///
    /// # Errors
    /// [`FileError`], where it is not one, or its weights do not fit its layers.
    pub fn read(text: &str) -> Result<Self, FileError> {
        let form = |error: &toml::de::Error| {
            let start = error.span().map_or(0, |span| span.start);
            let before = text.as_bytes().iter().take(start);
            FileError::Form {
                line: 1 + before.filter(|&&byte| byte == b'\n').count(),
                message: error.message().replace('\n', "; "),
            }
        };
        let head: Head = toml::from_str(text).map_err(|error| form(&error))?;
        if head.kind.as_deref() != Some(KIND) {
            let kind = head.kind.unwrap_or_default();
            return Err(FileError::Kind { kind });
        }
        if head.version != Some(VERSION) {
            let found = head.version.unwrap_or_default();
            return Err(FileError::Version { found });
        }
        let file: File = toml::from_str(text).map_err(|error| form(&error))?;
        file.classifier()
    }

    /// The network's file; [`Classifier::read`] gives the same network.
    #[must_use]
    pub fn written(&self) -> String {
        let mut text = format!(
            "# A network that tells machining features by their attributes.\n# Made by `relief features train`; see docs/features-network.md.\n\nkind = \"{KIND}\"\nversion = {VERSION}\nclasses = {:?}\ndigits = {}\nhidden = {}\nscale = \"{}\"\n",
            self.classes,
            self.digits,
            self.net.sizes()[1],
            self.scale.as_str()
        );
        let recipe = &self.trained.recipe;
        let rates = &recipe.rates;
        text.push_str("\n[recipe]\n");
        let per_class = match recipe.teaching {
            Teaching::Drawn(count) => format!("patterns_per_class = {count}\n"),
            Teaching::Table2 => String::new(),
        };
        let given: Vec<String> = (self.trained.given.iter())
            .map(|(class, count)| format!("[{class:?}, {count}]"))
            .collect();
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "seed = {}\n{per_class}initial = {:?}\nlearning = {:?}\nmomentum = {:?}\ntolerance = {:?}\nmost_epochs = {}\nlast_share = {:?}\n# What it came to.\npatterns = {}\nepochs = {}\nerror = {:?}\nconverged = {}\n# Classes that were given beside those, and how many patterns of each.\ngiven = [{}]\n",
            recipe.seed,
            recipe.initial,
            rates.learning,
            rates.momentum,
            rates.tolerance,
            rates.epochs,
            rates.last_share,
            self.trained.patterns,
            self.trained.epochs,
            self.trained.error,
            self.trained.has_converged,
            given.join(", ")
        );
        if self.bounds != Bounds::NONE {
            let _ = write!(
                text,
                "\n# What is beyond these is unknown.\n[bounds]\noutput = {:?}\nmargin = {:?}\ndistance = {:?}\n",
                self.bounds.output, self.bounds.margin, self.bounds.distance
            );
        }
        text.push_str("\n# A row for each neuron: a weight for each input, then that of its bias.\n[weights]\n");
        let layers = [
            ("hidden", self.net.hidden(), self.net.sizes()[0]),
            ("output", self.net.output(), self.net.sizes()[1]),
        ];
        for (layer, weights, inputs) in layers {
            let _ = writeln!(text, "{layer} = [");
            for neuron in weights.chunks(inputs + 1) {
                let _ = writeln!(text, "    {neuron:?},");
            }
            text.push_str("]\n");
        }
        text.push_str("\n# What was taught, and how often.\n[known]\ntaught = [\n");
        for own in &self.known.taught {
            let Attributes { code, sense, form } = &own.attributes;
            let class = self.classes.get(own.class).map_or("", String::as_str);
            let _ = writeln!(
                text,
                "    {{ class = {class:?}, code = \"{}\", sense = \"{}\", form = \"{}\", count = {} }},",
                written(code),
                sense.as_str(),
                form.as_str(),
                own.count
            );
        }
        text.push_str("]\n");
        text
    }
}

fn wrong(key: impl Into<String>, message: impl Into<String>) -> FileError {
    FileError::Value {
        key: key.into(),
        message: message.into(),
    }
}

impl File {
    fn classifier(self) -> Result<Classifier, FileError> {
        let count = self.classes.len();
        if !(1..=MOST_CLASSES).contains(&count) {
            return Err(wrong(
                "classes",
                format!("must be 1 to {MOST_CLASSES} names"),
            ));
        }
        let mut names = self.classes.clone();
        names.sort();
        names.dedup();
        if names.len() != count || names.iter().any(String::is_empty) {
            return Err(wrong("classes", "must be names that differ"));
        }
        let sizes = [self.digits.saturating_add(2), self.hidden, count];
        let hidden = rows(self.weights.hidden, sizes[0], "hidden")?;
        let output = rows(self.weights.output, sizes[1], "output")?;
        let net = Net::new(sizes, hidden, output)?;
        let bounds = match self.bounds {
            None => Bounds::NONE,
            Some(own) => {
                let is_share = |value: f64| (0.0..=1.0).contains(&value);
                if !(is_share(own.output) && is_share(own.margin)) {
                    return Err(wrong("bounds", "output and margin must be 0 to 1"));
                }
                if !(own.distance.is_finite() && own.distance > 0.0) {
                    return Err(wrong("bounds", "distance must be above 0"));
                }
                Bounds {
                    output: own.output,
                    margin: own.margin,
                    distance: own.distance,
                }
            }
        };
        let taught = self.known.taught.iter().enumerate();
        let taught = taught.map(|(k, own)| own.taught(k, &self.classes));
        let taught = taught.collect::<Result<Vec<_>, _>>()?;
        let scale = match self.scale {
            ScaleName::Plain => Scale::Plain,
            ScaleName::Centred => Scale::Centred,
        };
        let seed = u64::try_from(self.recipe.seed)
            .map_err(|_| wrong("recipe.seed", "must be 0 or more"))?;
        Ok(Classifier {
            digits: self.digits,
            scale,
            net,
            known: Known { taught },
            bounds,
            trained: self.recipe.trained(seed, self.digits, self.hidden, scale),
            classes: self.classes,
        })
    }
}

/// Rows of weights one behind the other.
fn rows(rows: Vec<Vec<f64>>, inputs: usize, layer: &str) -> Result<Vec<f64>, FileError> {
    let expected = inputs.saturating_add(1);
    if let Some(k) = rows.iter().position(|row| row.len() != expected) {
        let found = rows[k].len();
        return Err(wrong(
            format!("weights.{layer}"),
            format!(
                "neuron {} has {found} weights; must be {expected}, one for each input and its bias",
                k + 1
            ),
        ));
    }
    Ok(rows.concat())
}

impl TaughtEntry {
    fn taught(&self, index: usize, classes: &[String]) -> Result<Taught, FileError> {
        let refused = |message: String| wrong(format!("taught {}", index + 1), message);
        let class = classes.iter().position(|own| *own == self.class);
        let class = class.ok_or_else(|| refused(format!("{:?} is none of classes", self.class)))?;
        let digit = |byte: u8| Digit::of(byte.wrapping_sub(b'0'));
        let code: Option<Vec<Digit>> = self.code.bytes().map(digit).collect();
        let code =
            code.ok_or_else(|| refused(format!("code {:?}: digits are 1 to 5", self.code)))?;
        let sense = Sense::ALL
            .into_iter()
            .find(|own| own.as_str() == self.sense);
        let form = Form::ALL.into_iter().find(|own| own.as_str() == self.form);
        let (Some(sense), Some(form)) = (sense, form) else {
            return Err(refused(
                "sense must be concave or convex, form circular, closed or open".to_owned(),
            ));
        };
        Ok(Taught {
            class,
            attributes: Attributes { code, sense, form },
            count: self.count,
        })
    }
}

impl RecipeEntry {
    fn trained(self, seed: u64, digits: usize, hidden: usize, scale: Scale) -> Trained {
        Trained {
            recipe: Recipe {
                seed,
                teaching: (self.patterns_per_class).map_or(Teaching::Table2, Teaching::Drawn),
                digits,
                hidden,
                scale,
                rates: Rates {
                    learning: self.learning,
                    momentum: self.momentum,
                    tolerance: self.tolerance,
                    epochs: self.most_epochs,
                    last_share: self.last_share,
                },
                initial: self.initial,
            },
            given: self.given,
            patterns: self.patterns,
            epochs: self.epochs,
            error: self.error,
            has_converged: self.converged,
        }
    }
}
