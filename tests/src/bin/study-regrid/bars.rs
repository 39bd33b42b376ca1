//! What the consensus estimator must hold, and what it is meant to reach.

use crate::Line;
use crate::scene::Outliers;

/// Bounds of a case.
struct Bounds {
    /// Root mean square error away from the step, millimetres.
    rms_mm: f64,
    /// Share of gross errors away from the step.
    gross: f64,
    /// Share of gross errors next to the step.
    near: f64,
    /// Nodes in between the planes.
    in_between: u64,
    /// Nodes on the wrong plane a pitch or more from the step.
    wrong_plane: u64,
}

impl Bounds {
    /// What must hold: a change that breaks it makes the estimator worse.
    fn must(line: &Line) -> Self {
        let few = u64::from(line.outliers == Outliers::Clustered) * 4;
        match line.share {
            share if share > 0.3 => Self {
                rms_mm: 0.012,
                gross: 0.0005,
                near: 0.03,
                in_between: few,
                wrong_plane: u64::MAX,
            },
            share => Self {
                rms_mm: 0.010,
                gross: if few > 0 { 1e-4 } else { 0.0 },
                near: if share > 0.1 { 0.025 } else { 0.015 },
                in_between: few,
                wrong_plane: few,
            },
        }
    }

    /// What is aimed at.
    fn target(line: &Line) -> Self {
        let must = Self::must(line);
        if line.share > 0.3 {
            return must;
        }
        Self {
            gross: 0.0,
            near: if line.share > 0.1 { 0.015 } else { 0.004 },
            in_between: 0,
            wrong_plane: 0,
            ..must
        }
    }

    fn missed(&self, line: &Line) -> Vec<String> {
        let figures = &line.figures;
        let case = format!("{} {:.0} %", line.outliers.name(), 100.0 * line.share);
        let mut missed = Vec::new();
        let mut check = |what: &str, value: f64, limit: f64| {
            // What is not a number misses, too.
            if value.is_nan() || value > limit {
                missed.push(format!("{case}: {what} {value:.5}, at most {limit}"));
            }
        };
        check("mm rms away", figures.rms_fine_mm(), self.rms_mm);
        check("share of gross errors away", figures.gross(), self.gross);
        check("share off near the step", figures.near_gross(), self.near);
        let (between, wrong) = (figures.in_between, figures.wrong_plane);
        check("nodes between", between as f64, self.in_between as f64);
        check("nodes wrong", wrong as f64, self.wrong_plane as f64);
        missed
    }
}

fn ours(lines: &[Line]) -> impl Iterator<Item = &Line> {
    lines.iter().filter(|line| line.name == "consensus")
}

/// What must hold of the consensus estimator and does not, in words.
pub(crate) fn broken(lines: &[Line]) -> Vec<String> {
    let of = |line| Bounds::must(line).missed(line);
    ours(lines).flat_map(of).collect()
}

/// The targets that the consensus estimator misses, in words.
pub(crate) fn missed(lines: &[Line]) -> Vec<String> {
    let of = |line| Bounds::target(line).missed(line);
    ours(lines).flat_map(of).collect()
}
