//! The table.

use std::fmt::Write;
use std::ops::RangeInclusive;

use crate::Line;
use crate::peers::Python;
use crate::scene::{COLUMNS, NOISE_MM, OUTLIER_RANGE_MM, PITCH_MM, SAMPLES, STEP_MM};

/// A line of the table.
pub(crate) fn row(line: &Line) -> String {
    let f = &line.figures;
    // Some are asked for nodes near the step alone, in no measured time.
    let number = |value: f64, digits: usize| {
        if value.is_nan() {
            "-".to_owned()
        } else {
            format!("{value:.digits$}")
        }
    };
    format!(
        "| {} | {:.0} | {} | {} | {} | {} | {:.2} | {} | {} | {} | {} |",
        line.outliers.name(),
        100.0 * line.share,
        line.name,
        number(f.rms_mm(), 4),
        number(f.rms_fine_mm(), 4),
        number(100.0 * f.gross(), 4),
        100.0 * f.near_gross(),
        f.in_between,
        f.wrong_plane,
        f.holes,
        number(line.nodes_per_s, 0)
    )
}

/// What is asked of the estimator, as [`crate::bars`] checks it.
const TARGETS: &str = "\nTargets, for every kind of outliers up to 30 %: 0.010 mm rms away \
     from the step, gross errors\nand all; no node on neither plane and none on the wrong one; \
     of those near the step at most\n0.4 % off up to 10 % outliers, 1.5 % beyond. At 45 %: \
     0.012 mm without gross errors, 0.05 %\nof them, and 3 % near the step.\n";

/// The page with the table.
pub(crate) fn page(
    lines: &[Line],
    seeds: &RangeInclusive<u64>,
    missed: &[String],
    python: Option<&Python>,
) -> String {
    let mut text = format!(
        "# Regridding at a step edge, among outliers\n\n\
         Made by `cargo xtask study regrid`.\n\n\
         Two planes, tilted alike, with a step of {STEP_MM} mm along a straight line whose\n\
         direction and place depend on the seed, as does the tilt (slopes up to 0.2).\n\
         {COLUMNS} columns of {SAMPLES} samples, {PITCH_MM} mm apart; columns scatter by a\n\
         twentieth of that, samples by a fifth, and each column starts anywhere. Nodes lie\n\
         {PITCH_MM} mm apart. Noise {NOISE_MM} mm. Seeds {} to {}; while tuning, 1 to 10 were\n\
         looked at.\n\n\
         Outliers lie within {OUTLIER_RANGE_MM} mm: *uniform*, each on its own to either side;\n\
         *one-sided*, each on its own before the surface; *clustered*, in runs of 3 to 8 along\n\
         a column that are off by the same amount.\n\n\
         *Away* from the step are nodes 1.5 mm and more from it, those at the outermost samples\n\
         included: root mean square error of all (mm), the same without gross errors (over\n\
         0.5 mm), and their share (%). *Near* is the share of nodes within 1.5 mm of the step\n\
         that are off by over 0.5 mm (%), of those with a value. *Neither* counts nodes there\n\
         that are over 0.5 mm from both planes, *wrong* nodes that are a pitch or more from the\n\
         step, however far, and within 0.5 mm of the plane on its other side, and *holes* nodes\n\
         without a value two pitches and more within the outermost samples, near the step or\n\
         not. These three are sums over all scans.\n\
         Nodes/s is of one thread, all in the same run.\n\n\
         `consensus` takes 49 and is not told the noise; `least median` is the paper's least\n\
         median with windows of 32, `least squares` takes 49. `nearest true sample` is told both\n\
         planes and all outliers, and puts each node near the step on the plane of the nearest\n\
         sample that is none: as well as the samples alone can tell. Who does better knows that\n\
         edges are straight over some distance.\n",
        seeds.start(),
        seeds.end(),
    );
    if let Some(python) = python {
        let _ = write!(
            text,
            "Peers ({}) take 49 samples a node; they see the scan of seed {} alone,\n\
             scikit-learn all nodes near the step and one in 31 elsewhere.\n",
            python.versions,
            seeds.start()
        );
    }
    text.push_str(
        "\n| outliers | % | estimator | away, mm | without gross | gross, % | near, % | neither \
         | wrong | holes | nodes/s |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for line in lines {
        text.push_str(&row(line));
        text.push('\n');
    }
    text.push_str(TARGETS);
    if missed.is_empty() {
        text.push_str("\n`consensus` reaches every target.\n");
    } else {
        text.push_str("\nTargets that `consensus` misses:\n\n");
        for bar in missed {
            let _ = writeln!(text, "- {bar}");
        }
    }
    text
}
