//! Which kind of surface the samples speak for.
//!
//! Every family that could yet be the best is fitted, and so are polynomials, which stand for
//! whatever is none of them. What tells is how much of the samples' scatter a surface leaves
//! over, with a price for every number it needs (Schwarz 1978, "Estimating the dimension of a
//! model"): never a distance that someone has fixed, so that a shallow bend is no plane where
//! the noise is small, and noise makes no cone of a cylinder.

use nalgebra::SVector;

use crate::fit::{ACROSS, FEW, Fit, MANY, Sample, Sieved, finished, found};
use crate::robust;
use crate::shape::Family;
use crate::start::{Frame, Middle};
use crate::sweep::SweptFit;

/// What the samples speak for.
#[derive(Debug, Clone)]
pub enum Verdict {
    /// A surface of one of the families.
    Shape(Box<Fit>),
    /// None of them, but one profile that is swept over it; [`decide`] does not look for these,
    /// [`crate::swept`] does.
    Swept(Box<SweptFit>),
    /// None of them.
    FreeForm,
    /// The samples are too few to tell, or lie on a line.
    Unknown,
}

/// One of the surfaces that were compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Its family; `None` for a polynomial.
    pub family: Option<Family>,
    /// How many free numbers it has.
    pub freedom: usize,
    /// What it leaves over and costs; the least is the best. Differences are in units of twice
    /// the logarithm of the odds.
    pub score: f64,
}

/// A verdict and what it rests on.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// The verdict.
    pub verdict: Verdict,
    /// What was fitted to all samples, the best first.
    pub candidates: Vec<Candidate>,
}

impl Evidence {
    /// The shape that the samples speak for, if they do for one.
    #[must_use]
    pub fn fit(&self) -> Option<&Fit> {
        match &self.verdict {
            Verdict::Shape(fit) => Some(fit),
            Verdict::Swept(_) | Verdict::FreeForm | Verdict::Unknown => None,
        }
    }

    /// The same, to keep.
    #[must_use]
    pub fn into_fit(self) -> Option<Fit> {
        match self.verdict {
            Verdict::Shape(fit) => Some(*fit),
            Verdict::Swept(_) | Verdict::FreeForm | Verdict::Unknown => None,
        }
    }
}

/// Independent samples for each free number that a surface must have to be looked at.
const PER_NUMBER: f64 = 3.0;
/// Distances count up to so many deviations.
const MOST: f64 = 4.0;
/// How much better a polynomial must be than a shape not to be one by chance.
const DOUBT: f64 = 5.0;
/// A shape that would not be the best if it left so many times less than it does where some of
/// the samples have led it is not fitted to all: they make up for a few hundredths of it, and for
/// more only where the descent has not ended.
const HOPELESS: f64 = 3.0;
/// The most terms of a polynomial that is alone, for want of samples: whether it lacks any is not known.
const FEWEST_TERMS: usize = 6;
/// What each number costs above its price, so that of a hundred planes not one gets a radius
/// from its noise.
pub(crate) const CAUTION: f64 = 4.0;

/// Decides what kind of surface the samples are of. `area` is that of [`fit`].
#[must_use]
pub fn decide(samples: &[Sample], area: f64) -> Evidence {
    decide_among(samples, area, FEW)
}

/// The same with a longer search for tori: for what is known to be all of a surface. In a window
/// of one, a torus that is near enough says little.
#[must_use]
pub fn decide_whole(samples: &[Sample], area: f64) -> Evidence {
    decide_among(samples, area, MANY)
}

fn decide_among(samples: &[Sample], area: f64, sieved: Sieved) -> Evidence {
    let independent = samples.len() as f64 / area.max(1.0);
    let enough = |freedom: usize| are_enough(independent, freedom);
    let mut scale = Scale {
        independent,
        surfaces: polynomials_of(samples, independent),
    };
    let middle = Middle::of(samples);
    for family in Family::ALL {
        if enough(family.freedom())
            && scale.leaves_room(family.freedom())
            && let Some(found) = middle
                .as_ref()
                .and_then(|m| found(family, samples, m, sieved))
            && scale.leaves_hope(&found.offs(samples).collect::<Vec<_>>(), family.freedom())
            && let Some(fit) = finished(found, samples, area)
        {
            scale.surfaces.push(Surface {
                off: fit.offs(samples).collect(),
                freedom: family.freedom(),
                fit: Some(fit),
            });
        }
    }
    let mut scored = scale.scored();
    scored.sort_by(|a, b| a.0.score.total_cmp(&b.0.score));
    let best = |is_shape: bool| {
        let found = scored.iter().find(|(c, _)| c.family.is_some() == is_shape);
        found.map(|(candidate, _)| candidate.score)
    };
    let verdict = match (best(true), best(false)) {
        (None, None) => Verdict::Unknown,
        (None, Some(_)) => Verdict::FreeForm,
        (Some(shape), Some(other)) if other + DOUBT < shape => Verdict::FreeForm,
        _ => scored
            .iter()
            .find_map(|(_, fit)| fit.cloned())
            .map_or(Verdict::Unknown, |fit| Verdict::Shape(Box::new(fit))),
    };
    let candidates = scored.iter().map(|(candidate, _)| *candidate).collect();
    Evidence {
        verdict,
        candidates,
    }
}

/// Surfaces on the scale that compares them.
pub(crate) struct Scale {
    pub(crate) independent: f64,
    pub(crate) surfaces: Vec<Surface>,
}

impl Scale {
    /// Distances count up to this, in deviations of the samples.
    fn most(&self) -> f64 {
        let deviations = self.surfaces.iter().map(Surface::deviation);
        MOST * deviations
            .fold(f64::INFINITY, f64::min)
            .max(robust::LEAST_SCATTER)
    }

    fn score(&self, left: f64, freedom: usize) -> f64 {
        let left = left.max(robust::LEAST_SCATTER * robust::LEAST_SCATTER);
        let price = libm::log(self.independent.max(2.0)) + CAUTION;
        self.independent * libm::log(left) + freedom as f64 * price
    }

    /// Whether a shape with so many free numbers could yet be the best: with more of them, it costs
    /// what it costs, and it will hardly leave less than polynomials do for all their freedom. Where
    /// these leave more than a shape does, as they do of what turns far away, or would leave less
    /// with more terms, they tell nothing.
    fn leaves_room(&self, freedom: usize) -> bool {
        let most = self.most();
        if self.surfaces.is_empty() {
            return true;
        }
        let least = |is_shape: bool| {
            let own = self.surfaces.iter();
            let own = own.filter(|surface| surface.fit.is_some() == is_shape);
            let left = own.map(|surface| surface.left(most));
            left.reduce(f64::min)
        };
        if least(true).is_some() && (least(false) > least(true) || self.lacks_terms(most)) {
            return true;
        }
        let shapes = self.surfaces.iter().filter(|surface| surface.fit.is_some());
        let scores = shapes.map(|shape| self.score(shape.left(most), shape.freedom));
        let spared = |freedom| 1.0 - freedom as f64 / self.independent;
        let floor = self.floor(most, spared) * spared(freedom);
        scores.fold(f64::INFINITY, f64::min) > self.score(floor, freedom)
    }

    /// Whether polynomials are worth their terms up to the last one: more would be worth theirs, too.
    fn lacks_terms(&self, most: f64) -> bool {
        let polynomials = self.surfaces.iter().filter(|surface| surface.fit.is_none());
        let last = polynomials.clone().map(|p| p.freedom).max();
        let best = polynomials.min_by(|a, b| {
            let score = |p: &Surface| self.score(p.left(most), p.freedom);
            score(a).total_cmp(&score(b))
        });
        best.is_some_and(|best| Some(best.freedom) == last && last > Some(FEWEST_TERMS))
    }

    /// The least that any of the surfaces leaves, were it not for its freedom, which spares a share
    /// of the noise.
    fn floor(&self, most: f64, spared: impl Fn(usize) -> f64) -> f64 {
        let surfaces = self.surfaces.iter();
        let left = surfaces.map(|surface| surface.left(most) / spared(surface.freedom));
        left.fold(f64::INFINITY, f64::min)
    }

    /// Whether a shape with so many free numbers that lies so far off the samples could be the best
    /// once it is fitted to all of them.
    fn leaves_hope(&self, off: &[f64], freedom: usize) -> bool {
        let most = self.most();
        let scores = self.surfaces.iter();
        let scores = scores.map(|surface| self.score(surface.left(most), surface.freedom));
        let least = scores.fold(f64::INFINITY, f64::min);
        self.score(left(off, most) / HOPELESS, freedom) <= least + DOUBT
    }

    pub(crate) fn scored(&self) -> Vec<(Candidate, Option<&Fit>)> {
        let most = self.most();
        let scored = self.surfaces.iter().map(|surface| {
            let candidate = Candidate {
                family: surface.fit.as_ref().map(|fit| fit.shape.family()),
                freedom: surface.freedom,
                score: self.score(surface.left(most), surface.freedom),
            };
            (candidate, surface.fit.as_ref())
        });
        scored.collect()
    }
}

/// A surface to be compared.
pub(crate) struct Surface {
    /// How far each sample is off it, in its deviations.
    pub(crate) off: Vec<f64>,
    pub(crate) freedom: usize,
    pub(crate) fit: Option<Fit>,
}

impl Surface {
    pub(crate) fn deviation(&self) -> f64 {
        robust::deviation(self.off.iter().copied())
    }

    fn left(&self, most: f64) -> f64 {
        left(&self.off, most)
    }
}

/// Mean of the squares, each up to a most.
fn left(off: &[f64], most: f64) -> f64 {
    let squares = off.iter().map(|off| off.abs().min(most).powi(2));
    squares.sum::<f64>() / off.len() as f64
}

fn are_enough(independent: f64, freedom: usize) -> bool {
    freedom as f64 * PER_NUMBER <= independent
}

/// The polynomials that are looked at; none where the samples lie on a line.
pub(crate) fn polynomials_of(samples: &[Sample], independent: f64) -> Vec<Surface> {
    let enough = |freedom: usize| are_enough(independent, freedom);
    let frame = Frame::of(samples);
    frame.map_or_else(Vec::new, |frame| polynomials(samples, &frame, &enough))
}

/// Polynomials over the samples' plane, of degrees 2, 3, 4 and 6.
fn polynomials(
    samples: &[Sample],
    frame: &Frame,
    enough: &(impl Fn(usize) -> bool + Sync),
) -> Vec<Surface> {
    let low = || {
        rayon::join(
            || polynomial::<6>(samples, frame, 2, enough),
            || polynomial::<10>(samples, frame, 3, enough),
        )
    };
    let high = || {
        rayon::join(
            || polynomial::<15>(samples, frame, 4, enough),
            || polynomial::<28>(samples, frame, 6, enough),
        )
    };
    // The last of them takes most of the time.
    let ((fourth, sixth), (second, third)) = rayon::join(high, low);
    [second, third, fourth, sixth]
        .into_iter()
        .flatten()
        .collect()
}

/// The polynomial of a degree with its `N` terms.
fn polynomial<const N: usize>(
    samples: &[Sample],
    frame: &Frame,
    degree: usize,
    enough: &impl Fn(usize) -> bool,
) -> Option<Surface> {
    if !enough(N) {
        return None;
    }
    let pairs = (0..=degree).flat_map(|i| (0..=degree - i).map(move |j| (i, j)));
    let pairs: Vec<(usize, usize)> = pairs.collect();
    let terms = |u: &[f64; 7], v: &[f64; 7]| {
        let mut terms = [0.0; N];
        for (term, &(i, j)) in terms.iter_mut().zip(&pairs) {
            *term = u[i] * v[j];
        }
        SVector::from(terms)
    };
    let place = |sample: &Sample| {
        let [u, v, w] = frame.coordinates(&sample.point_mm);
        (chebyshev(u / frame.reach), chebyshev(v / frame.reach), w)
    };
    let equation = |sample: &Sample| {
        let ((u, _), (v, _), w) = place(sample);
        (terms(&u, &v) / sample.sigma_mm, w / sample.sigma_mm)
    };
    let equations: Vec<_> = samples.iter().map(equation).collect();
    let (near, _) = robust::solve(&equations)?;
    let solved = robust::least_squares(&equations, &near)?;
    let off = samples.iter().map(|sample| {
        let ((u, du), (v, dv), w) = place(sample);
        let [along, across] = [terms(&du, &v), terms(&u, &dv)];
        let [along, across] = [along, across].map(|terms| terms.dot(&solved) / frame.reach);
        // As the shapes have it, but of the height above in place of the distance.
        let [ray_u, ray_v, ray_w] = frame.turned(&sample.ray);
        let covered = ray_w - along * ray_u - across * ray_v;
        let rise2 = 1.0 + along * along + across * across;
        let deviation = (covered * covered + ACROSS * ACROSS * rise2).sqrt() * sample.sigma_mm;
        (w - terms(&u, &v).dot(&solved)) / deviation
    });
    Some(Surface {
        off: off.collect(),
        freedom: N,
        fit: None,
    })
}

/// Chebyshev's polynomials up to degree 6, and their derivatives.
fn chebyshev(x: f64) -> ([f64; 7], [f64; 7]) {
    let mut values = [1.0, x, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut slopes = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for k in 2..values.len() {
        values[k] = 2.0 * x * values[k - 1] - values[k - 2];
        slopes[k] = 2.0 * (values[k - 1] + x * slopes[k - 1]) - slopes[k - 2];
    }
    (values, slopes)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    /// Surfaces that 1000 samples lie so far off, and whether they are shapes.
    fn scale(surfaces: &[(f64, usize, bool)]) -> Scale {
        let plane: Vec<Sample> = (0..20)
            .map(|k| Sample {
                point_mm: Vector3::new(f64::from(k % 5), f64::from(k / 5), 0.1 * f64::from(k % 3)),
                ray: Vector3::z(),
                sigma_mm: 0.1,
            })
            .collect();
        let fit = crate::fit(Family::Plane, &plane, 1.0);
        assert!(fit.is_some());
        let surface = |&(off, freedom, is_shape): &(f64, usize, bool)| Surface {
            off: vec![off; 1000],
            freedom,
            fit: fit.clone().filter(|_| is_shape),
        };
        Scale {
            independent: 1000.0,
            surfaces: surfaces.iter().map(surface).collect(),
        }
    }

    #[test]
    fn polynomials_tell_how_little_a_shape_can_leave_where_they_leave_no_more() {
        let sphere = (1.05, 4, true);
        // With 15 numbers they leave no less: 6 will do no better.
        let (third, fourth) = ((1.055, 10, false), (1.049, 15, false));
        assert!(!scale(&[third, fourth, sphere]).leaves_room(6));
        assert!(scale(&[third, (1.0, 15, false), sphere]).leaves_room(6));
        // They leave more, for want of terms.
        assert!(scale(&[third, (1.2, 15, false), sphere]).leaves_room(6));
        // As little, but would leave less with more terms: so it is of a slender cone beside a
        // cylinder that leans.
        assert!(scale(&[(1.6, 15, false), (1.049, 28, false), (1.06, 5, true)]).leaves_room(6));
        // What they spare of the noise by their own freedom is not held against others.
        assert!(scale(&[(1.0, 6, false), (1.012, 4, true)]).leaves_room(6));
        // There are too few samples for any.
        assert!(!scale(&[sphere]).leaves_room(6));
        assert!(scale(&[]).leaves_room(6));
    }
}
