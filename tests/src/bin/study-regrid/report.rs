//! The table.

use std::fmt::Write;
use std::ops::RangeInclusive;

use crate::Line;
use crate::peers::Python;
use crate::scene::{COLUMNS, NOISE_MM, OUTLIER_RANGE_MM, PITCH_MM, SAMPLES, STEP_MM};

/// A line of the table.
pub(crate) fn row(line: &Line) -> String {
    let f = &line.figures;
    format!(
        "| {} | {:.0} | {} | {:.4} | {:.4} | {:.4} | {:.2} | {} | {} | {} | {:.0} |",
        line.outliers.name(),
        100.0 * line.share,
        line.name,
        f.rms_mm(),
        f.rms_fine_mm(),
        100.0 * f.gross(),
        100.0 * f.near_gross(),
        f.in_between,
        f.wrong_plane,
        f.holes,
        line.nodes_per_s
    )
}

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
         that are off by over 0.5 mm (%). *Between* counts nodes there that are over 0.5 mm\n\
         from both planes, *wrong* those on the wrong plane a pitch or more from the step, and\n\
         *holes* nodes without a value two pitches and more within the outermost samples.\n\
         Nodes/s is of one thread, all in the same run.\n\n\
         `consensus` takes 49 and is not told the noise; `least median` is the paper's least\n\
         median with windows of 32, `least squares` takes 49.\n",
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
        "\n| outliers | % | estimator | away, mm | without gross | gross, % | near, % | between \
         | wrong | holes | nodes/s |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for line in lines {
        text.push_str(&row(line));
        text.push('\n');
    }
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
