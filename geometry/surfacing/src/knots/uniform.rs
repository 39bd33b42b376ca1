//! Equal spans: 2, 4, 8, ... (Koo & Lee, Figure 4).

use range_image::{Cancelled, Monitor};

use crate::axis::Breaks;
use crate::knots::Knots;
use crate::problem::Problem;

/// Equal spans of powers of two along each direction: of all pairs within the tolerance that
/// with the fewest control points, or that which comes nearest.
///
/// # Errors
/// [`Cancelled`] at the monitor's wish.
pub(crate) fn place(problem: &Problem, monitor: &dyn Monitor) -> Result<Knots, Cancelled> {
    let spans = |nodes: usize| {
        let mut spans = vec![1];
        while let Some(&last) = spans.last()
            && last * 2 + 3 <= nodes
        {
            spans.push(last * 2);
        }
        spans
    };
    let (us, vs) = (spans(problem.columns), spans(problem.rows));
    let mut pairs: Vec<Knots> = us
        .iter()
        .flat_map(|&u| vs.iter().map(move |&v| (u, v)))
        .map(|(u, v)| Knots {
            u: Breaks::uniform(problem.columns, u),
            v: Breaks::uniform(problem.rows, v),
        })
        .collect();
    pairs.sort_by_key(|knots| (knots.control_points(), knots.u.control_count()));
    let mut nearest: Option<(f64, Knots)> = None;
    for knots in pairs {
        monitor.check()?;
        let Some(fit) = problem.fit(&knots) else {
            continue;
        };
        let max = fit.score.max;
        if max <= problem.tolerance {
            return Ok(knots);
        }
        if nearest.as_ref().is_none_or(|(least, _)| max < *least) {
            nearest = Some((max, knots));
        }
    }
    Ok(nearest.map_or_else(
        || Knots {
            u: Breaks::none(problem.columns),
            v: Breaks::none(problem.rows),
        },
        |(_, knots)| knots,
    ))
}
