//! The fewest control points that hold a tolerance: how many breaks around, where, and how many rows
//! across.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::around::{Ring, ring};
use crate::basis::{Basis, LEAST_SPANS};
use crate::error::SkinError;
use crate::settings::Settings;
use crate::space::{greatest, is_nearer};
use crate::spread::{Net, thinned};
use crate::stack::{Course, Stack};

/// Rounds of one fit.
const ROUNDS: usize = 8;

/// How often breaks of one number are moved to where the deviations are.
const SETTLINGS: usize = 6;

/// The error of a cubic spline goes with this power of its span.
const ORDER: f64 = 4.0;

/// Least density of breaks, of the mean.
const LEAST_DENSITY: f64 = 0.05;

/// By how much the number of breaks grows while it is looked for.
const GROWTH: f64 = 1.4;

/// Fewer rows are tried one by one from so many on, and above in steps of this part.
const FEW_ROWS: usize = 24;
const FEWER_ROWS: f64 = 0.85;

/// So many numbers of rows in turn that do not do are enough: fewer do not either.
const FAILURES: usize = 8;

/// Fewest rows.
const LEAST_ROWS: usize = 4;

/// Breaks are taken out one by one as long as that takes no more than so many data points to be
/// fitted.
const MOST_WORK: usize = 3_000_000;

/// Fewer rows are not looked for where one least squares takes more multiplications than this,
/// some seconds.
const MOST_OF_SOLVE: usize = 4_000_000_000;

/// Breaks around, and the curves of all sections over them.
#[derive(Debug, Clone)]
struct Trial {
    basis: Basis,
    rings: Vec<Ring>,
    most_mm: f64,
}

/// How densely breaks lie, as a function of the parameter that is constant between places.
#[derive(Debug, Clone)]
struct Density {
    places: Vec<f64>,
    rates: Vec<f64>,
}

impl Density {
    fn even() -> Self {
        Self {
            places: vec![0.0, 1.0],
            rates: vec![1.0],
        }
    }

    /// Breaks between which the density has equal parts.
    fn breaks(&self, spans: usize) -> Vec<f64> {
        let mut sums = vec![0.0];
        for (pair, rate) in self.places.windows(2).zip(&self.rates) {
            sums.push(sums[sums.len() - 1] + (pair[1] - pair[0]) * rate);
        }
        let whole = sums[sums.len() - 1];
        let at = |k: usize| {
            if k == spans {
                return 1.0;
            }
            let sum = whole * k as f64 / spans as f64;
            let after = sums.partition_point(|s| *s <= sum).clamp(1, sums.len() - 1);
            let share = (sum - sums[after - 1]) / (sums[after] - sums[after - 1]);
            self.places[after - 1] + share * (self.places[after] - self.places[after - 1])
        };
        (0..=spans).map(at).collect()
    }

    /// Denser where the deviations of curves are great, so that they become alike.
    fn after(basis: &Basis, rings: &[Ring]) -> Self {
        let spans = basis.spans();
        let mut off = vec![0.0_f64; spans];
        for ring in rings {
            for (t, off_mm) in ring.at.iter().zip(&ring.off_mm) {
                let own = &mut off[basis.span(*t)];
                *own = own.max(*off_mm);
            }
        }
        // What a span does is done to its neighbours as well.
        let beside = |k: usize| {
            let [before, after] = if basis.is_closed {
                [(k + spans - 1) % spans, (k + 1) % spans]
            } else {
                [k.saturating_sub(1), (k + 1).min(spans - 1)]
            };
            (off[before] + 2.0 * off[k] + off[after]) / 4.0
        };
        let widths = basis.breaks.windows(2).map(|pair| pair[1] - pair[0]);
        let rate = |(k, width): (usize, f64)| libm::pow(beside(k), 1.0 / ORDER) / width;
        let mut rates: Vec<f64> = widths.enumerate().map(rate).collect();
        let mean = rates.iter().sum::<f64>() / spans as f64;
        if mean <= 0.0 {
            return Self::even();
        }
        rates
            .iter_mut()
            .for_each(|rate| *rate = rate.max(LEAST_DENSITY * mean));
        Self {
            places: basis.breaks.clone(),
            rates,
        }
    }
}

/// The net with the fewest control points that holds the tolerance.
pub(crate) fn net(
    stack: &Stack,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Net, SkinError> {
    let tolerance_mm = settings.tolerance_mm;
    let (mut trial, density) = fewest_around(stack, tolerance_mm, monitor)?;
    monitor.progress(0.4);
    thin(stack, &mut trial, tolerance_mm, monitor)?;
    monitor.progress(0.6);
    let degree = settings.degree_across;
    let whole = Net::through(
        trial.basis.clone(),
        trial.rings.clone(),
        &stack.heights,
        degree,
    );
    let Some(mut best) = whole else {
        return Err(undetermined(stack));
    };
    let least = LEAST_ROWS.max(degree + 1);
    let mut failures = 0;
    let mut rows = stack.courses.len();
    loop {
        rows = if rows <= FEW_ROWS {
            rows.saturating_sub(1)
        } else {
            (rows as f64 * FEWER_ROWS) as usize
        };
        if rows < least || failures == FAILURES {
            break;
        }
        monitor.check()?;
        let asked = (rows, degree);
        match with_rows(
            stack,
            (&trial, &density),
            asked,
            &best,
            tolerance_mm,
            monitor,
        )? {
            Some(net) => (best, failures) = (net, 0),
            None => failures += 1,
        }
    }
    monitor.progress(0.9);
    Ok(best)
}

/// The fewest breaks around over which every section holds the tolerance.
fn fewest_around(
    stack: &Stack,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<(Trial, Density), SkinError> {
    let most = stack
        .courses
        .iter()
        .map(|course| course.points.len())
        .max()
        .unwrap_or(0);
    let most = most.max(LEAST_SPANS);
    let mut spans = LEAST_SPANS;
    let mut density = Density::even();
    let mut failed = LEAST_SPANS - 1;
    let found = loop {
        monitor.check()?;
        let (trial, next) = settled(stack, &density, spans, tolerance_mm, monitor)?;
        let Some(trial) = trial else {
            return Err(undetermined(stack));
        };
        density = next;
        if trial.most_mm <= tolerance_mm {
            break trial;
        }
        if spans >= most {
            return Err(out_of_reach(stack, &trial, tolerance_mm));
        }
        failed = spans;
        spans = ((spans as f64 * GROWTH) as usize).max(spans + 1).min(most);
    };
    let mut best = found;
    while best.basis.spans() - failed > 1 {
        monitor.check()?;
        let middle = failed.midpoint(best.basis.spans());
        match settled(stack, &density, middle, tolerance_mm, monitor)? {
            (Some(trial), next) if trial.most_mm <= tolerance_mm => (best, density) = (trial, next),
            _ => failed = middle,
        }
    }
    Ok((best, density))
}

/// The section with the fewest points tells the least.
fn undetermined(stack: &Stack) -> SkinError {
    let fewest = stack
        .courses
        .iter()
        .min_by_key(|course| course.points.len());
    SkinError::Undetermined {
        section: fewest.map(|course| course.name.clone()).unwrap_or_default(),
    }
}

fn out_of_reach(stack: &Stack, trial: &Trial, tolerance_mm: f64) -> SkinError {
    let worst = trial.rings.iter().zip(&stack.courses);
    let worst = worst.max_by(|a, b| a.0.most_mm.total_cmp(&b.0.most_mm));
    SkinError::OutOfReach {
        section: worst
            .map(|(_, course)| course.name.clone())
            .unwrap_or_default(),
        reached_mm: trial.most_mm,
        tolerance_mm,
    }
}

/// The best fit over so many breaks, that are moved to where the deviations are; and the density of
/// these.
fn settled(
    stack: &Stack,
    density: &Density,
    spans: usize,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<(Option<Trial>, Density), Cancelled> {
    let mut density = density.clone();
    let mut best: Option<(Trial, Density)> = None;
    for _ in 0..SETTLINGS {
        let Some(trial) = over(stack, density.breaks(spans), tolerance_mm, monitor)? else {
            break;
        };
        let next = Density::after(&trial.basis, &trial.rings);
        let is_better = best
            .as_ref()
            .is_none_or(|(best, _)| is_nearer(trial.most_mm, best.most_mm));
        let is_done = trial.most_mm <= tolerance_mm;
        if is_better {
            best = Some((trial, density));
        }
        if is_done {
            break;
        }
        density = next;
    }
    Ok(match best {
        Some((trial, density)) => (Some(trial), density),
        None => (None, Density::even()),
    })
}

/// All sections over these breaks.
fn over(
    stack: &Stack,
    breaks: Vec<f64>,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<Trial>, Cancelled> {
    let basis = Basis {
        breaks,
        is_closed: stack.is_closed,
    };
    let of = |course: &Course| {
        monitor.check()?;
        Ok(ring(course, &basis, &course.at, (ROUNDS, tolerance_mm)))
    };
    let rings: Result<Vec<Option<Ring>>, Cancelled> = stack.courses.par_iter().map(of).collect();
    let Some(rings) = rings?.into_iter().collect::<Option<Vec<Ring>>>() else {
        return Ok(None);
    };
    let most_mm = greatest(rings.iter().map(|ring| ring.most_mm));
    Ok(Some(Trial {
        basis,
        rings,
        most_mm,
    }))
}

/// Takes breaks out one by one, each time the one without which the deviations grow least, as long
/// as the tolerance is held.
fn thin(
    stack: &Stack,
    trial: &mut Trial,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<(), SkinError> {
    let points: usize = stack.courses.iter().map(|course| course.points.len()).sum();
    while trial.basis.spans() > LEAST_SPANS && points * trial.basis.spans() * ROUNDS <= MOST_WORK {
        monitor.check()?;
        let without = |k: usize| {
            let mut breaks = trial.basis.breaks.clone();
            breaks.remove(k);
            over(stack, breaks, tolerance_mm, monitor)
        };
        let all: Result<Vec<Option<Trial>>, Cancelled> =
            (1..trial.basis.spans()).map(without).collect();
        let all = all?.into_iter().flatten();
        let Some(best) = all.min_by(|a, b| a.most_mm.total_cmp(&b.most_mm)) else {
            break;
        };
        // Once more with the breaks moved.
        let best = if best.most_mm <= tolerance_mm {
            best
        } else {
            let density = Density::after(&best.basis, &best.rings);
            let spans = best.basis.spans();
            match settled(stack, &density, spans, tolerance_mm, monitor)?.0 {
                Some(moved) if moved.most_mm <= tolerance_mm => moved,
                _ => break,
            }
        };
        *trial = best;
    }
    Ok(())
}

/// A net with so many rows and fewer control points than the best so far, if one holds the
/// tolerance.
fn with_rows(
    stack: &Stack,
    (trial, density): (&Trial, &Density),
    (rows, degree): (usize, usize),
    best: &Net,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<Net>, Cancelled> {
    let Some(across) = thinned(&stack.heights, degree, rows) else {
        return Ok(None);
    };
    let wrapped = trial.basis.written() - trial.basis.spans();
    let most = (best.written() - 1) / rows;
    let starts: Vec<Vec<f64>> = stack.courses.iter().map(|own| own.at.clone()).collect();
    let over = |breaks: Vec<f64>| {
        let basis = Basis {
            breaks,
            is_closed: stack.is_closed,
        };
        let asked = (ROUNDS, tolerance_mm);
        Net::least_squares(stack, &basis, &across, &starts, asked, monitor)
    };
    // Breaks are moved to where the deviations are, as they are without fewer rows.
    let fit = |breaks: Vec<f64>| -> Result<Option<Net>, Cancelled> {
        let spans = breaks.len() - 1;
        let mut best: Option<Net> = None;
        let mut breaks = breaks;
        for _ in 0..SETTLINGS {
            let Some(net) = over(breaks)? else {
                return Ok(None);
            };
            breaks = Density::after(&net.basis, &net.rings).breaks(spans);
            if best
                .as_ref()
                .is_none_or(|best| is_nearer(net.most_mm, best.most_mm))
            {
                best = Some(net);
            }
            if best
                .as_ref()
                .is_some_and(|best| best.most_mm <= tolerance_mm)
            {
                break;
            }
        }
        Ok(best)
    };
    let holds = |net: &Net| net.most_mm <= tolerance_mm;
    let least = trial.basis.spans();
    let is_affordable = |most: &usize| {
        let functions = most + if stack.is_closed { 0 } else { wrapped };
        *most >= least && Net::work(functions, rows, degree) <= MOST_OF_SOLVE
    };
    let Some(most) = most.checked_sub(wrapped).filter(is_affordable) else {
        return Ok(None);
    };
    // With as many as may be first: where those do not do, none will.
    let Some(mut found) = fit(density.breaks(most))?.filter(holds) else {
        return Ok(None);
    };
    let mut failed = least - 1;
    while found.basis.spans() - failed > 1 {
        let middle = failed.midpoint(found.basis.spans());
        let own = (middle == least).then(|| trial.basis.breaks.clone());
        match fit(own.unwrap_or_else(|| density.breaks(middle)))?.filter(holds) {
            Some(net) => found = net,
            None => failed = middle,
        }
    }
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::testing::waisted;

    fn stack(sections: usize) -> Stack {
        Stack::of(&waisted(sections, 120), &Settings::new(1.0)).unwrap()
    }

    #[test]
    fn fewer_control_points_do_for_a_wider_tolerance_and_all_hold_it() {
        let stack = stack(9);
        let mut before = usize::MAX;
        for tolerance_mm in [0.01, 0.1, 1.0, 7.0] {
            let settings = Settings::new(tolerance_mm);
            let net = net(&stack, &settings, &Unmonitored).unwrap();
            assert!(net.most_mm <= tolerance_mm);
            assert!(net.written() < before, "{} {before}", net.written());
            before = net.written();
        }
    }

    #[test]
    fn a_body_that_changes_slowly_takes_fewer_rows_than_sections() {
        let stack = stack(41);
        let net = net(&stack, &Settings::new(1.0), &Unmonitored).unwrap();
        assert!(
            net.across.control_count() < 14,
            "{}",
            net.across.control_count()
        );
    }

    #[test]
    fn densities_put_breaks_where_they_are_great() {
        let density = Density {
            places: vec![0.0, 0.5, 1.0],
            rates: vec![3.0, 1.0],
        };
        let breaks = density.breaks(4);
        let expected = [0.0, 1.0 / 6.0, 1.0 / 3.0, 0.5, 1.0];
        let off = breaks.iter().zip(expected).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12, "{breaks:?}");
    }
}
