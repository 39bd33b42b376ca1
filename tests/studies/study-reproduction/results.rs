//! The figures of all runs, and what is asked of them in turn.

use pipeline::Method;

use crate::conditions::{SEEDS, Subject};
use crate::experiment::Figures;
use crate::regions::RegionFigures;
use crate::upright::Found;

/// One run's figures, and which run it was.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) subject: Subject,
    pub(crate) method: Method,
    pub(crate) seed: u64,
    pub(crate) figures: Figures,
}

/// The figures of all runs.
#[derive(Debug, Clone, Default)]
pub(crate) struct Results {
    pub(crate) entries: Vec<Entry>,
    /// Silhouettes along an axis.
    pub(crate) upright: Vec<Found>,
}

/// The roads in the order of the tables.
pub(crate) const ROADS: [Method; 2] = [Method::ShimLee, Method::Relief];

/// What the worst of several figures is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Worst {
    Least,
    Most,
}

impl Results {
    /// The runs of an object on a road, by seed.
    pub(crate) fn of(&self, subject: Subject, method: Method) -> impl Iterator<Item = &Entry> {
        self.entries
            .iter()
            .filter(move |e| e.subject == subject && e.method == method)
    }

    /// The first seed's run of an object on a road.
    pub(crate) fn first(&self, subject: Subject, method: Method) -> Option<&Figures> {
        let mut of = self.of(subject, method);
        of.find(|e| e.seed == *SEEDS.start()).map(|e| &e.figures)
    }

    /// The worst and the median over the seeds. A figure that a run lacks is NaN, and the
    /// worst.
    pub(crate) fn over_seeds(
        &self,
        subject: Subject,
        method: Method,
        worst: Worst,
        figure: impl Fn(&Figures) -> f64,
    ) -> [f64; 2] {
        let values = self.of(subject, method).map(|e| figure(&e.figures));
        worst_and_median(values.collect(), worst)
    }
}

fn worst_and_median(mut values: Vec<f64>, worst: Worst) -> [f64; 2] {
    values.sort_by(|a, b| {
        let order = a.is_nan().cmp(&b.is_nan()).reverse();
        order.then(match worst {
            Worst::Least => a.total_cmp(b),
            Worst::Most => b.total_cmp(a),
        })
    });
    [0, values.len() / 2].map(|k| values.get(k).copied().unwrap_or(f64::NAN))
}

/// A figure of one region; NaN where the region was not found.
pub(crate) fn of_region(
    figures: &Figures,
    region: usize,
    figure: impl Fn(&RegionFigures) -> f64,
) -> f64 {
    match figures.regions.get(region) {
        Some(Some(found)) => figure(found),
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_figure_is_the_worst() {
        let values = vec![3.0, 1.0, 2.0];
        assert_eq!(worst_and_median(values.clone(), Worst::Least), [1.0, 2.0]);
        assert_eq!(worst_and_median(values, Worst::Most), [3.0, 2.0]);
        let [worst, median] = worst_and_median(vec![3.0, f64::NAN, 2.0], Worst::Least);
        assert!(worst.is_nan() && median == 2.0);
    }
}
