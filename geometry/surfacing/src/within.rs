//! A surface drawn within the tolerance where that of least squares is beyond it.
//!
//! Least squares make the sum of squares small, not the greatest deviation, which other
//! coefficients of the same knots bring down to a half or two thirds. Those wanted are common to
//! two convex sets: all splines with these knots, onto which least squares project, and all
//! heights within the tolerance of the data. They are looked for by the iteration of Douglas &
//! Rachford (1956) as Lions & Mercier (1979) put it, each step of which is one fit by least
//! squares over a full grid: `x += box(2 P x - x) - P x`. Heights of masked nodes are free, so
//! that those nodes draw at nothing.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::axis::Axis;
use crate::fit;
use crate::problem::{Fit, Problem};

/// Most steps, and fits by least squares that one is worth.
const MOST_STEPS: usize = 80;
pub(crate) const STEP_FITS: usize = 2;
/// Share of the tolerance that is aimed at, so that it is reached in the end.
const AIM: f64 = 0.985;
/// Where the surface of least squares is farther off than this many tolerances, nothing draws it
/// in: what can be won is less than a half.
const TOO_FAR: f64 = 2.2;
/// Steps after which the greatest deviation must have come down to this many tolerances.
const SOON: usize = 16;
const SOON_NEAR: f64 = 1.3;

/// What drawing in came to.
pub(crate) struct Drawn {
    pub(crate) fit: Fit,
    /// Steps made, each of which costs [`STEP_FITS`] fits.
    pub(crate) steps: usize,
}

/// The surface of least squares if it is within the tolerance, or one drawn within it; where
/// there is none, or none is found, that of least squares.
///
/// # Errors
/// [`Cancelled`] at the monitor's wish.
pub(crate) fn fit_within(
    problem: &Problem,
    u: &Axis,
    v: &Axis,
    monitor: &dyn Monitor,
) -> Result<Drawn, Cancelled> {
    let least = problem.fit_axes(u, v);
    let tolerance = problem.tolerance;
    let mut steps = 0;
    if least.score.max <= tolerance || least.score.max > TOO_FAR * tolerance {
        return Ok(Drawn { fit: least, steps });
    }
    let mut surface = fit::values(u, v, &least.coefficients);
    // At masked nodes least squares over the full grid are to begin where those of the data end.
    let mut x = surface.clone();
    let mut nearest = least.score.max;
    while steps < MOST_STEPS {
        monitor.check()?;
        reflected(problem, &mut x, &surface, AIM * tolerance);
        let coefficients = fit::full(u, v, &x);
        surface = fit::values(u, v, &coefficients);
        steps += 1;
        let off = farthest(problem, &surface);
        if off <= tolerance {
            let score = problem.score(u, v, &coefficients);
            let fit = Fit {
                coefficients,
                score,
            };
            return Ok(Drawn { fit, steps });
        }
        nearest = nearest.min(off);
        if steps == SOON && nearest > SOON_NEAR * tolerance {
            break;
        }
    }
    Ok(Drawn { fit: least, steps })
}

/// One step: `x += box(2 surface - x) - surface`.
fn reflected(problem: &Problem, x: &mut [f64], surface: &[f64], aim: f64) {
    let rows = problem.rows;
    x.par_chunks_mut(rows)
        .zip(surface.par_chunks(rows))
        .zip(
            problem
                .z
                .par_chunks(rows)
                .zip(problem.is_data.par_chunks(rows)),
        )
        .with_min_len(16)
        .for_each(|((x, surface), (z, is_data))| {
            for (((x, surface), z), is_data) in x.iter_mut().zip(surface).zip(z).zip(is_data) {
                if *is_data {
                    let reflected = 2.0 * surface - *x;
                    *x += reflected.clamp(z - aim, z + aim) - surface;
                } else {
                    *x = *surface;
                }
            }
        });
}

fn farthest(problem: &Problem, surface: &[f64]) -> f64 {
    let off = surface
        .par_iter()
        .zip(&problem.z)
        .zip(&problem.is_data)
        .with_min_len(4096)
        .map(|((s, z), is_data)| if *is_data { (s - z).abs() } else { 0.0 });
    off.reduce(|| 0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Breaks;
    use crate::grid::HeightGrid;
    use range_image::Unmonitored;

    /// Hills with a sharp one, which least squares flatten, and a hole beside it.
    fn problem(tolerance: f64, is_holed: bool) -> Problem<'static> {
        let z = (0..60 * 50).map(|n| {
            let (x, y) = ((n / 50) as f64, (n % 50) as f64);
            let (a, b) = (x - 27.0, y - 22.0);
            if is_holed && (35.0..44.0).contains(&x) && (10.0..30.0).contains(&y) {
                return f64::NAN;
            }
            libm::sin(x * 0.2) + 3.0 * libm::exp(-(a * a + b * b) / 40.0)
        });
        let grid = HeightGrid::new(1.0, [0.0; 2], 60, 50, z.collect()).unwrap();
        Problem::new(&grid, tolerance, &Unmonitored)
    }

    fn axes() -> (Axis, Axis) {
        let axis = |nodes| Axis::new(&Breaks::uniform(nodes, 8)).unwrap();
        (axis(60), axis(50))
    }

    #[test]
    fn a_surface_is_drawn_within_what_least_squares_exceed() {
        let (u, v) = axes();
        for is_holed in [false, true] {
            let least = problem(1.0, is_holed).fit_axes(&u, &v).score;
            let tolerance = 0.7 * least.max;
            let problem = problem(tolerance, is_holed);
            let drawn = fit_within(&problem, &u, &v, &Unmonitored).unwrap();
            let score = problem.score(&u, &v, &drawn.fit.coefficients);
            assert_eq!(score, drawn.fit.score);
            assert!(score.max <= tolerance, "{score:?}");
            assert!(drawn.steps > 0 && score.sum_of_squares >= least.sum_of_squares);
            assert!(
                score.sum_of_squares < 2.0 * least.sum_of_squares,
                "{score:?}"
            );
        }
    }

    #[test]
    fn where_there_is_none_that_of_least_squares_stays() {
        let (u, v) = axes();
        let least = problem(1.0, false).fit_axes(&u, &v);
        for share in [0.46, 0.1] {
            let problem = problem(share * least.score.max, false);
            let drawn = fit_within(&problem, &u, &v, &Unmonitored).unwrap();
            assert!(drawn.steps <= MOST_STEPS);
            assert_eq!(drawn.fit.coefficients, least.coefficients);
        }
    }
}
