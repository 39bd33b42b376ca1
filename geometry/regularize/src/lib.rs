//! Regularities among shapes that were fitted: found where the uncertainties allow of them, and
//! imposed.
//!
//! ```text
//! shapes, covariances --> what comes into question --> within the bound? --> likeliest first,
//!                         (directions, places, sizes,   hardly by chance?    each as those before
//!                         symmetry, round numbers)                           leave it --> solve
//! ```
//!
//! A regularity is accepted where
//!
//! - noise alone leaves what has it so far off with a probability that is that of a normal number
//!   beyond the bound, or more (chi-square of its equations, given all that holds already);
//! - things without any tie would hardly be so near: with as many tries as there are of its kind
//!   in this part, no more than one in twenty of those accepted may be chance (Benjamini and
//!   Hochberg 1995). Directions are taken to be spread evenly over the sphere, places over the
//!   part, radii over as much as they measure, and numbers between the lines of a grid. Nearer
//!   than one standard uncertainty counts as one, so that the less is known, the less is found;
//! - nothing is moved farther than the limits.
//!
//! Neighbours that are said to touch need no such proof: that they go over into each other smoothly
//! is seen where they do. They are made to have one tangent plane along a line before all else.
//!
//! What all accepted ones make of the shapes is the weighted least squares of the fits' covariances
//! with the regularities as conditions; the covariances lose what the conditions settle. Where
//! regularities contradict each other, the less likely are refused. What others imply is not
//! listed: of three parallel planes, two pairs are.

mod chance;
mod chart;
mod found;
mod propose;
mod rule;
mod run;
mod settings;
mod state;
mod touch;

use shapes::{Joint, Numbers, Shape};

use chart::Chart;
use run::Run;
pub use run::TANGENT_BOUND;
use state::State;

pub use chance::survival;
pub use found::{Kind, Reason, Refused, Regularity, Target};
pub use settings::{Round, Settings, SettingsError};

/// A shape as it was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// What it is called in the lists.
    pub label: u16,
    /// The shape.
    pub shape: Shape,
    /// How well it is known.
    pub joint: Joint,
}

/// A shape that regularities have adjusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Adjusted {
    /// Its label.
    pub label: u16,
    /// The shape.
    pub shape: Shape,
    /// Its numbers and how well they are known.
    pub numbers: Numbers,
    /// The same with what they have in common.
    pub joint: Joint,
    /// How far its direction or half angle was turned, radians.
    pub turned_rad: f64,
    /// How far its place or one of its sizes was moved, millimetres.
    pub moved_mm: f64,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Regularized {
    /// The shapes that regularities tie, in the order in which they were given.
    pub adjusted: Vec<Adjusted>,
    /// The regularities, in the order in which they were accepted.
    pub accepted: Vec<Regularity>,
    /// What is nearly one.
    pub refused: Vec<Refused>,
}

/// Finds regularities among shapes and adjusts these so that they have them. Those that are said to
/// be `touching` go over into each other smoothly, and are made to do so first. `size_mm` is the
/// size of the part: what places are spread over. The time it takes grows with the cube of the
/// number of shapes: a hundred take about a second.
///
/// # Errors
/// A setting outside of its limits. Shapes whose numbers or covariances are no numbers are tied to
/// nothing.
pub fn regularize(
    shapes: &[Fitted],
    touching: &[[u16; 2]],
    size_mm: f64,
    settings: &Settings,
) -> Result<Regularized, SettingsError> {
    settings.validate()?;
    let all = |run: &mut Run<'_>| run.all();
    Ok(adjust(shapes, touching, size_mm, settings, all))
}

/// As [`regularize`] with the limits of its defaults, but that those touch which are `touching` is
/// all that shapes are given.
#[must_use]
pub fn join(shapes: &[Fitted], touching: &[[u16; 2]], size_mm: f64) -> Regularized {
    adjust(shapes, touching, size_mm, &Settings::default(), |_| ())
}

fn adjust(
    shapes: &[Fitted],
    touching: &[[u16; 2]],
    size_mm: f64,
    settings: &Settings,
    others: impl FnOnce(&mut Run<'_>),
) -> Regularized {
    let is_known = |own: &&Fitted| {
        let base = Chart::of(&own.shape).base;
        let numbers = base.direction.iter().chain(base.place.iter());
        let mut numbers = numbers.chain(&base.sizes).chain(own.joint.iter());
        numbers.all(|number| number.is_finite())
    };
    let known: Vec<&Fitted> = shapes.iter().filter(is_known).collect();
    if known.is_empty() || !(size_mm > 0.0 && size_mm.is_finite()) {
        return Regularized::default();
    }
    let labels: Vec<u16> = known.iter().map(|own| own.label).collect();
    let fits = known.iter().map(|own| (&own.shape, &own.joint));
    let mut run = Run::new(State::new(fits, size_mm), settings, &labels);
    let index = |label: u16| labels.iter().position(|own| *own == label);
    let pairs = touching.iter();
    let pairs: Vec<[usize; 2]> = pairs
        .filter_map(|[a, b]| Some([index(*a)?, index(*b)?]))
        .collect();
    run.touch(&pairs);
    others(&mut run);
    let adjusted = run.tied().into_iter().map(|shape| {
        let chart = &run.state.charts[shape];
        let told = run.state.told(shape);
        let covariance = run.covariance(shape);
        let (turned_rad, moved_mm) = chart.extent(run.state.of(&run.state.moved, shape));
        Adjusted {
            label: labels[shape],
            shape: chart.shape(&told),
            numbers: chart.numbers(&told, &covariance),
            joint: chart.joint(&covariance),
            turned_rad,
            moved_mm,
        }
    });
    let adjusted = adjusted.collect();
    Regularized {
        adjusted,
        accepted: run.accepted,
        refused: run.refused,
    }
}
