//! What the consensus estimator must hold, and what it is meant to reach.

use crate::Line;
use crate::scene::Outliers;

/// Bounds of a case.
struct Bounds {
    /// Root mean square error away from the step, gross errors and all, millimetres.
    rms_mm: f64,
    /// The same without gross errors.
    rms_fine_mm: f64,
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
    /// What must hold: a change that breaks it makes the estimator worse. Looser than the
    /// target where that is not reached, and stated apart from it.
    fn must(line: &Line) -> Self {
        let clustered = line.outliers == Outliers::Clustered;
        let (few, gross) = if clustered { (1, 1e-5) } else { (0, 0.0) };
        let target = Self::target(line);
        if line.share > 0.3 {
            return Self {
                in_between: few,
                ..target
            };
        }
        Self {
            gross,
            near: if line.share > 0.1 { 0.025 } else { 0.015 },
            in_between: few,
            wrong_plane: few,
            ..target
        }
    }

    /// What is aimed at. Where outliers are nearly half, only a share of gross errors is
    /// asked for, and precision without them.
    fn target(line: &Line) -> Self {
        if line.share > 0.3 {
            return Self {
                rms_mm: f64::INFINITY,
                rms_fine_mm: 0.012,
                gross: 0.0005,
                near: 0.03,
                in_between: u64::MAX,
                wrong_plane: u64::MAX,
            };
        }
        Self {
            rms_mm: 0.010,
            rms_fine_mm: 0.010,
            gross: f64::INFINITY,
            near: if line.share > 0.1 { 0.015 } else { 0.004 },
            in_between: 0,
            wrong_plane: 0,
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
        check("mm rms away", figures.rms_mm(), self.rms_mm);
        let fine_mm = figures.rms_fine_mm();
        check(
            "mm rms away without gross errors",
            fine_mm,
            self.rms_fine_mm,
        );
        check("share of gross errors away", figures.gross(), self.gross);
        check("share off near the step", figures.near_gross(), self.near);
        let (between, wrong) = (figures.in_between, figures.wrong_plane);
        check(
            "nodes on neither plane",
            between as f64,
            self.in_between as f64,
        );
        check(
            "nodes on the wrong plane",
            wrong as f64,
            self.wrong_plane as f64,
        );
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
