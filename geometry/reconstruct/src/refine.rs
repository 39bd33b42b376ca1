//! Splines that are refined where the residuals ask for it, and nowhere else.
//!
//! The fit begins with a polynomial. Then the spans are halved again and again, along one
//! parameter at a time, and of the basis functions on the halved spans only those get a
//! coefficient of their own that the data speak for: if the residuals were noise, a single
//! function would take from their sum of squares, on average, the noise's density; one
//! that takes many times as much has met a shape. It is the rule by which wavelets tell
//! signal from noise (Donoho & Johnstone 1994).

use nurbs::uniform::{Lines, Scores};
use nurbs::{Observation, Parameter, Singular, UniformSpline};

use crate::fit::Domain;

/// How many times the noise's density a function must take to be no accident, where at
/// least this part of the functions on spans of one size takes as much. In normal noise
/// one function in 200 takes 8 times as much, one in 5000 14 times; where many more do,
/// few of them are accidents (Benjamini & Hochberg 1995). Nodes from least medians have
/// longer tails: of three planes of 40,000 nodes one had more than 36 times, none 50.
const SIGNIFICANT: [(f64, f64); 3] = [(8.0, 0.1), (14.0, 0.03), (50.0, 0.0)];

/// Price of a term of the polynomial, in the noise's density.
const PRICE: f64 = 7.0;

/// A function with less than this part of the greatest mass of data is not asked: what it
/// takes says little of the shape and much of single nodes.
const LEAST_MASS: f64 = 0.1;

/// Weight of bending against data: carries surfaces on where there are none. Ten times as
/// much is felt beside the data's ends, where functions have little mass, as a shape that
/// is not there.
const BENDING: f64 = 1e-5;

/// Weight that holds back powers the data do not determine.
const RIDGE: f64 = 1e-7;

/// What a fit is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// Root mean square residual at which nothing more is refined, and size of a
    /// coefficient that is not worth one, millimetres.
    pub tolerance_mm: f64,
    /// Variance of the noise's mean over many nodes, times their number, square
    /// millimetres: the noise's variance at a node, times the number of nodes that share
    /// it.
    pub noise_density_mm2: f64,
    /// Spans are not made narrower, millimetres.
    pub least_span_mm: f64,
    /// Most spans along a side.
    pub most_spans: usize,
    /// How far around the observations the surface is used, millimetres; beyond that it keeps
    /// within bounds.
    pub margin_mm: f64,
}

/// Fits a spline over the domain; with it the number of coefficients that the data were asked for:
/// the terms of the polynomial, and the functions set free since, as far as data lie under them.
///
/// # Errors
/// [`Singular`] when the observations lie on a line or are fewer than three.
pub(crate) fn fit(
    observations: &[Observation],
    domain: &Domain,
    demand: &Demand,
) -> Result<(UniformSpline, usize), Singular> {
    let (mut spline, parameters) = refined(observations, domain, demand)?;
    let bounds = bounds(observations, domain);
    spline.bound_far(observations, demand.margin_mm, bounds);
    Ok((spline, parameters))
}

/// What a surface keeps within where nothing is known of it: the values of the observations, and
/// to either side of them the greater side of the domain.
fn bounds(observations: &[Observation], domain: &Domain) -> (f64, f64) {
    let width = |(low, high): (f64, f64)| high - low;
    let side = width(domain.x_mm).max(width(domain.y_mm));
    let values = observations.iter().map(|o| o.value);
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (least, greatest) = values.fold(none, |(low, high), z| (low.min(z), high.max(z)));
    (least - side, greatest + side)
}

fn refined(
    observations: &[Observation],
    domain: &Domain,
    demand: &Demand,
) -> Result<(UniformSpline, usize), Singular> {
    let lines = Lines::new(observations);
    let (mut spline, mut residuals, mut parameters) = polynomial(&lines, domain, demand)?;
    loop {
        if is_near(&lines, &residuals, demand) {
            return Ok((spline, parameters));
        }
        let candidates = [Parameter::U, Parameter::V].map(|along| {
            let (columns, rows) = spline.functions();
            let spans = match along {
                Parameter::U => columns,
                Parameter::V => rows,
            } - 3;
            let allowed =
                spline.span(along) >= 2.0 * demand.least_span_mm && 2 * spans <= demand.most_spans;
            allowed.then(|| Candidate::new(&spline, along, &lines, &residuals, demand))
        });
        let [u, v] = candidates;
        let chosen = match (u, v) {
            (Some(u), Some(v)) => {
                let wider = spline.span(Parameter::U) >= spline.span(Parameter::V);
                if u.excess > v.excess || (u.excess == v.excess && wider) {
                    u
                } else {
                    v
                }
            }
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => return Ok((spline, parameters)),
        };
        spline = chosen.spline;
        if chosen.excess > 0.0 {
            let (columns, rows) = spline.functions();
            let free = with_neighbours(&chosen.free, columns, rows);
            let asked = free.iter().zip(&chosen.mass);
            parameters += asked.filter(|(free, mass)| **free && **mass > 0.0).count();
            // Not all of what was set free on wide spans is still there on narrow ones.
            parameters = parameters.min(columns * rows);
            spline.improve(&lines, &mut residuals, &free, BENDING);
        }
    }
}

fn is_near(lines: &Lines<'_>, residuals: &[f64], demand: &Demand) -> bool {
    let (squares, data) = squares(lines, residuals);
    squares <= demand.tolerance_mm * demand.tolerance_mm * data
}

/// Weighted sum of squares, and of weights.
fn squares(lines: &Lines<'_>, residuals: &[f64]) -> (f64, f64) {
    let pairs = residuals.iter().zip(lines.observations());
    pairs.fold((0.0, 0.0), |(squares, data), (r, o)| {
        (squares + o.weight * r * r, data + o.weight)
    })
}

/// The polynomial of the lowest degree that is as good as any: total degree 1, 2, 3, or
/// degree 3 both ways.
fn polynomial(
    lines: &Lines<'_>,
    domain: &Domain,
    demand: &Demand,
) -> Result<(UniformSpline, Vec<f64>, usize), Singular> {
    let mut best: Option<(f64, UniformSpline, Vec<f64>, usize)> = None;
    for total in [1, 2, 3, 6] {
        let degrees = (0..4).flat_map(|p| (0..4).map(move |q| (p, q)));
        let terms: Vec<_> = degrees.filter(|(p, q)| p + q <= total).collect();
        let spline = UniformSpline::fit_polynomial(
            domain.x_mm,
            domain.y_mm,
            &terms,
            lines.observations(),
            RIDGE,
        );
        let spline = match (spline, &best) {
            (Ok(spline), _) => spline,
            (Err(_), Some(_)) => break,
            (Err(error), None) => return Err(error),
        };
        let residuals = spline.residuals(lines);
        let price = PRICE * demand.noise_density_mm2 * terms.len() as f64;
        let score = squares(lines, &residuals).0 + price;
        let near = is_near(lines, &residuals, demand);
        if best.as_ref().is_none_or(|(least, ..)| score < *least) {
            best = Some((score, spline, residuals, terms.len()));
        }
        if near {
            break;
        }
    }
    let (_, spline, residuals, terms) = best.ok_or(Singular { row: 0 })?;
    Ok((spline, residuals, terms))
}

/// A spline with halved spans, and which of its functions are worth a coefficient.
struct Candidate {
    spline: UniformSpline,
    free: Vec<bool>,
    /// Of each of its functions, as [`Scores::mass`].
    mass: Vec<f64>,
    excess: f64,
}

impl Candidate {
    fn new(
        spline: &UniformSpline,
        along: Parameter,
        lines: &Lines<'_>,
        residuals: &[f64],
        demand: &Demand,
    ) -> Self {
        let spline = spline.halved(along);
        let scores = spline.scores(lines, residuals);
        let free = worthwhile(&scores, demand);
        let gains = scores.gain.iter().zip(&free);
        let excess = gains.filter(|(_, free)| **free).map(|(gain, _)| gain).sum();
        Self {
            spline,
            free,
            mass: scores.mass,
            excess,
        }
    }
}

fn worthwhile(scores: &Scores, demand: &Demand) -> Vec<bool> {
    let greatest = scores.mass.iter().copied().fold(0.0, f64::max);
    let asked = |k: usize| scores.mass[k] >= LEAST_MASS * greatest;
    let functions = scores.gain.len();
    let all = (0..functions).filter(|k| asked(*k)).count() as f64;
    let takes = |k: usize, times: f64| {
        asked(k)
            && scores.gain[k] > times * demand.noise_density_mm2
            && scores.amplitude(k) > demand.tolerance_mm
    };
    for (times, part) in SIGNIFICANT {
        let worth: Vec<bool> = (0..functions).map(|k| takes(k, times)).collect();
        if worth.iter().filter(|w| **w).count() as f64 >= part * all {
            return worth;
        }
    }
    vec![false; functions]
}

/// The chosen functions and those next to them.
fn with_neighbours(chosen: &[bool], columns: usize, rows: usize) -> Vec<bool> {
    let mut free = vec![false; chosen.len()];
    for (k, _) in chosen.iter().enumerate().filter(|(_, chosen)| **chosen) {
        let (i, j) = (k / rows, k % rows);
        for i in i.saturating_sub(1)..=(i + 1).min(columns - 1) {
            for j in j.saturating_sub(1)..=(j + 1).min(rows - 1) {
                free[i * rows + j] = true;
            }
        }
    }
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_MM: f64 = 0.02;

    fn demand() -> Demand {
        Demand {
            tolerance_mm: 0.005,
            noise_density_mm2: NOISE_MM * NOISE_MM,
            least_span_mm: 2.0,
            most_spans: 64,
            margin_mm: 3.0,
        }
    }

    const DOMAIN: Domain = Domain {
        x_mm: (-3.0, 83.0),
        y_mm: (-3.0, 63.0),
    };

    /// Nodes 1 mm apart with noise from SplitMix64, twelve uniform draws each.
    fn nodes(z: impl Fn(f64, f64) -> f64) -> Vec<Observation> {
        let mut state = 7_u64;
        let mut uniform = move || {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut bits = state;
            bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut nodes = Vec::new();
        for i in 0..=80 {
            for j in 0..=60 {
                let (u, v) = (f64::from(i), f64::from(j));
                let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                nodes.push(Observation {
                    u,
                    v,
                    value: z(u, v) + NOISE_MM * normal,
                    weight: 1.0,
                });
            }
        }
        nodes
    }

    /// Root mean square distance from the truth, and numbers of patches both ways.
    fn fitted(z: impl Fn(f64, f64) -> f64) -> (f64, usize, usize) {
        let nodes = nodes(&z);
        let (spline, _) = fit(&nodes, &DOMAIN, &demand()).unwrap();
        let off = |o: &Observation| (spline.value(o.u, o.v) - z(o.u, o.v)).powi(2);
        let rms = (nodes.iter().map(off).sum::<f64>() / nodes.len() as f64).sqrt();
        let patches = spline.to_patches().unwrap();
        (rms, patches.u_breaks.len() - 1, patches.v_breaks.len() - 1)
    }

    #[test]
    fn noise_on_a_plane_is_not_fitted() {
        let (rms, columns, rows) = fitted(|x, y| 0.3 * x - 0.1 * y);
        assert_eq!((columns, rows), (1, 1));
        assert!(rms < NOISE_MM / 20.0, "{rms}");
    }

    #[test]
    fn a_shape_bent_one_way_is_refined_that_way() {
        let (rms, columns, rows) = fitted(|x, _| 4.0 * libm::sin(x / 5.0));
        assert!((8..=32).contains(&columns), "{columns}");
        assert_eq!(rows, 1);
        assert!(rms < NOISE_MM / 3.0, "{rms}");
    }

    #[test]
    fn a_knob_is_met_without_fitting_the_noise_around_it() {
        let knob = |x: f64, y: f64| {
            let square = (x - 31.0) * (x - 31.0) + (y - 22.0) * (y - 22.0);
            1.5 * libm::exp(-square / 18.0)
        };
        let (rms, columns, rows) = fitted(knob);
        assert!(rms < NOISE_MM / 3.0, "{rms}");
        assert!((4..=32).contains(&columns) && (4..=32).contains(&rows));
    }

    #[test]
    fn parameters_are_as_many_as_the_data_were_asked_for() {
        // A plane has three numbers.
        let (_, parameters) = fit(&nodes(|x, y| 0.3 * x - 0.1 * y), &DOMAIN, &demand()).unwrap();
        assert_eq!(parameters, 3);
        // Noise takes from the sum of squares what each number is worth, no more: the rest says
        // how many there were.
        let wave = |x: f64, y: f64| 2.0 * libm::sin(x / 8.0) * libm::cos(y / 9.0);
        let nodes = nodes(wave);
        let finest = Demand {
            tolerance_mm: 1e-4,
            ..demand()
        };
        let (spline, parameters) = fit(&nodes, &DOMAIN, &finest).unwrap();
        let left: f64 = nodes
            .iter()
            .map(|o| (spline.value(o.u, o.v) - wave(o.u, o.v)).powi(2))
            .sum();
        let followed = left / (NOISE_MM * NOISE_MM);
        let told = parameters as f64;
        assert!((40..=600).contains(&parameters), "{parameters}");
        assert!(
            (0.4 * told..=1.4 * told).contains(&followed),
            "{followed} of {told}"
        );
    }

    #[test]
    fn beyond_its_data_a_surface_keeps_near_them() {
        // A strip across the domain, bent along itself: what lies beside it tells nothing.
        let mut strip = nodes(|x, y| 8.0 * libm::sin((x + y) / 6.0));
        strip.retain(|o| (o.u - o.v - 10.0).abs() < 4.0);
        let (spline, _) = fit(&strip, &DOMAIN, &demand()).unwrap();
        let surface = spline.to_patches().unwrap();
        let mut farthest = 0.0_f64;
        for i in 0..=86 {
            for j in 0..=66 {
                let z = surface.z(f64::from(i) - 3.0, f64::from(j) - 3.0);
                farthest = farthest.max(z.abs());
            }
        }
        // 8 mm of shape and the longer side of the domain.
        assert!(farthest <= 8.0 + 86.0 + 0.1, "{farthest}");
    }

    #[test]
    fn limits_of_spans_hold() {
        let nodes = nodes(|x, y| libm::sin(x) * libm::sin(y));
        let few = Demand {
            most_spans: 8,
            ..demand()
        };
        let (spline, _) = fit(&nodes, &DOMAIN, &few).unwrap();
        let (columns, rows) = spline.functions();
        assert!(columns <= 11 && rows <= 11);
        let (spline, _) = fit(&nodes, &DOMAIN, &demand()).unwrap();
        assert!(spline.span(Parameter::U) >= 2.0 && spline.span(Parameter::V) >= 2.0);
    }
}
