//! A network with the names of its classes and what it knows.

use super::input::{Scale, input};
use super::known::Known;
use super::net::Net;
use super::recipe::Trained;
use crate::code::Attributes;

/// What an answer must fulfil to be one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The greatest output is at least this.
    pub output: f64,
    /// It leads before the second by at least this.
    pub margin: f64,
    /// The input is no farther than this from what was taught as its class; infinite for a network
    /// that always answers. See [`Known::distance`].
    pub distance: f64,
}

impl Bounds {
    /// None: the greatest output is the answer, as in Jun & Park, section 6.4.
    pub const NONE: Self = Self {
        output: 0.0,
        margin: 0.0,
        distance: f64::INFINITY,
    };
}

/// Why an input is of no class that the network knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doubt {
    /// The network gives no class an output above its bound.
    Weak,
    /// Two classes are too close to each other.
    Torn,
    /// The attributes are unlike all that was taught as the class of the greatest output.
    Strange,
}

impl Doubt {
    /// For people.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Weak => "no class has a great output",
            Self::Torn => "two classes are as likely",
            Self::Strange => "like nothing that the network was taught",
        }
    }
}

/// What a network answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Class of the greatest output, whether that is an answer or not.
    pub class: String,
    /// 0 to 1: the greatest output, made smaller by the distance from what was taught; half of it at
    /// the bound.
    pub score: f64,
    /// The greatest output less the second.
    pub margin: f64,
    /// From what was taught as this class; 0 for what was taught just so.
    pub distance: f64,
    /// Outputs of all classes, in the network's order.
    pub scores: Vec<(String, f64)>,
    /// Why the class is no answer; `None` where it is one.
    pub doubt: Option<Doubt>,
}

impl Verdict {
    /// Whether it is of no class that the network knows.
    #[must_use]
    pub fn is_unknown(&self) -> bool {
        self.doubt.is_some()
    }

    /// The class, if it is an answer.
    #[must_use]
    pub fn known(&self) -> Option<&str> {
        self.doubt.is_none().then_some(self.class.as_str())
    }
}

/// A network, its classes, and what it was taught.
#[derive(Debug, Clone, PartialEq)]
pub struct Classifier {
    pub(super) classes: Vec<String>,
    pub(super) digits: usize,
    pub(super) scale: Scale,
    pub(super) net: Net,
    pub(super) known: Known,
    pub(super) bounds: Bounds,
    pub(super) trained: Trained,
}

impl Classifier {
    /// Its classes, in the order of its outputs.
    #[must_use]
    pub fn classes(&self) -> &[String] {
        &self.classes
    }

    /// Digits of a code that it looks at.
    #[must_use]
    pub fn digits(&self) -> usize {
        self.digits
    }

    /// Its weights.
    #[must_use]
    pub fn net(&self) -> &Net {
        &self.net
    }

    /// What it was taught.
    #[must_use]
    pub fn known(&self) -> &Known {
        &self.known
    }

    /// What its answers must fulfil.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The recipe that made it, and what that came to.
    #[must_use]
    pub fn trained(&self) -> &Trained {
        &self.trained
    }

    /// Tells what has these attributes.
    #[must_use]
    pub fn classify(&self, attributes: &Attributes) -> Verdict {
        let outputs = self
            .net
            .outputs(&input(attributes, self.digits, self.scale));
        let mut best = (0, f64::NEG_INFINITY);
        let mut second = 0.0_f64;
        for (k, &own) in outputs.iter().enumerate() {
            if own > best.1 {
                second = best.1.max(0.0);
                best = (k, own);
            } else {
                second = second.max(own);
            }
        }
        let distance = self.known.distance(attributes, best.0);
        let margin = best.1 - second;
        let doubt = if distance > self.bounds.distance {
            Some(Doubt::Strange)
        } else if best.1 < self.bounds.output {
            Some(Doubt::Weak)
        } else if margin < self.bounds.margin {
            Some(Doubt::Torn)
        } else {
            None
        };
        let nearness = if self.bounds.distance.is_finite() {
            1.0 / (1.0 + (distance / self.bounds.distance) * (distance / self.bounds.distance))
        } else {
            1.0
        };
        Verdict {
            class: self.classes.get(best.0).cloned().unwrap_or_default(),
            score: best.1 * nearness,
            margin,
            distance,
            scores: self.classes.iter().cloned().zip(outputs).collect(),
            doubt,
        }
    }
}
