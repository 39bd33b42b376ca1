//! What networks are taught by: sections of each class, drawn with other sizes, edges, slopes,
//! noise, gaps, tilts and sides each time, and put in codes by the coder that real sections go
//! through; and what users give.

mod profile;
mod scan;
mod shapes;
mod user;

pub use user::{GivenPattern, PatternError, Shown, parse};

use crate::chance::Chance;
use crate::class::Class;
use crate::code::{self, Attributes, Digit, End, Form, Section, Sense, mirrored};
use profile::Profile;
use scan::View;
use shapes::Scope;

/// What a network is taught: so many attributes are of this class.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// Its name.
    pub class: String,
    /// What the network sees of it.
    pub attributes: Attributes,
}

/// A section as drawn, before it has its code.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// (s, z) in order, millimetres.
    pub points: Vec<[f64; 2]>,
    /// Standard deviation of z, millimetres.
    pub noise_mm: f64,
    /// Distance of samples along s, millimetres.
    pub pitch_mm: f64,
    /// What it ends in.
    pub ends: [End; 2],
    /// In or out.
    pub sense: Sense,
    /// Of its outline.
    pub form: Form,
}

impl Drawn {
    /// With its code.
    #[must_use]
    pub fn attributes(&self) -> Attributes {
        Attributes {
            code: code::code(&Section {
                points: &self.points,
                noise_mm: self.noise_mm,
                pitch_mm: self.pitch_mm,
                ends: self.ends,
            }),
            sense: self.sense,
            form: self.form,
        }
    }
}

/// Which draws are for what, so that no network is judged by what it was taught.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Patterns that are taught.
    Teaching,
    /// Patterns by which bounds are set.
    Bounds,
    /// Patterns by which the network is judged.
    Judging,
}

impl Purpose {
    fn stream(self) -> u64 {
        match self {
            Self::Teaching => 1,
            Self::Bounds => 2,
            Self::Judging => 3,
        }
    }
}

/// So many sections of a class. The same class, seed and purpose give the same.
#[must_use]
pub fn draw(class: Class, count: usize, seed: u64, purpose: Purpose) -> Vec<Drawn> {
    let stream = purpose.stream() * 64 + class as u64;
    let mut chance = Chance::new(seed, stream);
    (0..count).map(|_| one(class, &mut chance)).collect()
}

fn one(class: Class, chance: &mut Chance) -> Drawn {
    let view = view(chance);
    let scope = Scope {
        pitch_mm: view.pitch_mm,
        least_mm: 10.0 * view.noise_mm,
    };
    let shape = shapes::shape(class, &scope, chance);
    let mut ends = shape.ends;
    let mut profile = shape.profile;
    if chance.happens(0.5) {
        profile = profile.mirrored();
        ends.reverse();
    }
    Drawn {
        points: looked_at(profile, &view, chance),
        noise_mm: view.noise_mm,
        pitch_mm: view.pitch_mm,
        ends,
        sense: shape.sense,
        form: shape.form,
    }
}

fn view(chance: &mut Chance) -> View {
    let shadow = match chance.below(3) {
        0 => chance.between(0.2, 0.6),
        1 => -chance.between(0.2, 0.6),
        _ => 0.0,
    };
    View {
        pitch_mm: chance.scaled(0.15, 1.0),
        noise_mm: chance.scaled(0.01, 0.2),
        outliers: chance.between(0.0, 0.05),
        dropouts: chance.between(0.0, 0.04),
        shadow,
        is_blurred: chance.happens(0.5),
        hole: if chance.happens(0.1) {
            chance.between(0.03, 0.12)
        } else {
            0.0
        },
    }
}

fn looked_at(profile: Profile, view: &View, chance: &mut Chance) -> Vec<[f64; 2]> {
    let tilted = profile.tilted(f64::to_radians(chance.between(-3.0, 3.0)));
    scan::seen(&tilted, view, chance)
}

/// So many patterns of what a user has given: from each side, codes with a digit changed now and
/// then, sections seen as drawn ones are.
#[must_use]
pub fn vary(given: &[&GivenPattern], count: usize, seed: u64, purpose: Purpose) -> Vec<Attributes> {
    let mut chance = Chance::new(seed, purpose.stream() * 64 + 63);
    let mut all = Vec::with_capacity(count);
    for k in 0..count {
        let Some(pattern) = given.get(k % given.len().max(1)) else {
            break;
        };
        let mut own = pattern.attributes();
        match &pattern.shown {
            Shown::Code(_) => {
                if chance.happens(0.1) && !own.code.is_empty() {
                    let place = chance.below(own.code.len());
                    own.code[place] = beside(own.code[place], &mut chance);
                }
                if chance.happens(0.5) {
                    own.code = mirrored(&own.code);
                }
            }
            Shown::Section {
                points,
                noise_mm,
                pitch_mm,
                ends,
            } => {
                let mut profile = Profile {
                    corners: points.clone(),
                };
                let mut ends = *ends;
                if chance.happens(0.5) {
                    profile = profile.mirrored();
                    ends.reverse();
                }
                let view = View {
                    pitch_mm: *pitch_mm,
                    noise_mm: *noise_mm,
                    ..view(&mut chance)
                };
                own = Drawn {
                    points: looked_at(profile, &view, &mut chance),
                    noise_mm: *noise_mm,
                    pitch_mm: *pitch_mm,
                    ends,
                    sense: own.sense,
                    form: own.form,
                }
                .attributes();
            }
        }
        all.push(own);
    }
    all
}

fn beside(digit: Digit, chance: &mut Chance) -> Digit {
    let number = digit.number();
    let other = if chance.happens(0.5) && number > 1 {
        number - 1
    } else {
        number + 1
    };
    Digit::of(other).unwrap_or(Digit::Falling)
}

/// The six rows of Jun & Park, Table 2.
#[must_use]
pub fn table_2() -> Vec<Pattern> {
    let row = |class: Class, code: [u8; 7], sense: Sense, form: Form| Pattern {
        class: class.as_str().to_owned(),
        attributes: Attributes {
            code: code.into_iter().filter_map(Digit::of).collect(),
            sense,
            form,
        },
    };
    let (hollow, raised) = ([4, 5, 4, 3, 2, 1, 2], [2, 1, 2, 3, 4, 5, 4]);
    let (concave, convex) = (Sense::Concave, Sense::Convex);
    vec![
        row(Class::Pocket, hollow, concave, Form::ClosedRectangular),
        row(Class::Step, [2, 1, 2, 3, 2, 1, 2], concave, Form::Open),
        row(Class::Slot, hollow, concave, Form::Open),
        row(Class::Boss, raised, convex, Form::Circular),
        row(Class::Hole, hollow, concave, Form::Circular),
        row(Class::Block, raised, convex, Form::ClosedRectangular),
    ]
}
