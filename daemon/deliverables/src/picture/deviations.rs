//! How far a scan lies off its nominal: a map in colours, and a histogram below it.

use colorous::RED_BLUE;
use compare::{Comparison, NodeState, Tolerance};
use range_image::RangeImage;

use super::canvas::{Canvas, Mask, Rgb, TEXT_HEIGHT, Weight, text_width};
use super::plot::{FAINT, INK, NOTHING, PAPER, Plot, ticks};
use super::scale::{LEAST_PLOT, ROOM, Scale};

/// Near the nominal, but without a deviation.
const EDGE: Rgb = [205, 208, 212];
/// What belongs to something else.
const FOREIGN: Rgb = [150, 155, 161];
/// Least width, so that title and legend fit, pixels.
const LEAST_WIDTH: usize = 760;
/// The histogram's bars are as high as this, pixels.
const BARS: usize = 130;
const LEFT: usize = 76;
const LINE: usize = 20;
/// As many regions are numbered in the map.
const MOST_NUMBERS: usize = 30;

/// Deviations as colour, red where there is more material and blue where there is less, regions
/// beyond the limits outlined and numbered; a legend, and the histogram in the same colours.
pub(super) fn draw(
    image: &RangeImage,
    comparison: &Comparison,
    tolerance: Option<Tolerance>,
    name: &str,
) -> Canvas {
    let statistics = comparison.statistics;
    let verdict = if comparison.passed() {
        "passed"
    } else {
        "out of tolerance"
    };
    let subtitle = format!(
        "deviation from nominal: {verdict}; mean {:+.3}, rms {:.3}, 95 % within {:.3} mm",
        statistics.mean_mm, statistics.rms_mm, statistics.percentile_95_mm
    );
    let last = comparison
        .histogram
        .limits_mm
        .last()
        .copied()
        .unwrap_or(1.0);
    let worst = comparison.regions.iter().map(|r| r.deviation_mm.abs());
    // The worst region must not look like one of the mildest that are beyond the scale.
    let limit = worst.fold(last, f64::max);
    let scale = Scale {
        heading: "deviation (mm)",
        low: -limit,
        high: limit,
        open: true,
        colour: &|share| {
            // The palette goes from red to blue.
            let colour = RED_BLUE.eval_continuous(1.0 - share);
            [colour.r, colour.g, colour.b]
        },
    };
    let mut plot = Plot::new(image, name, &subtitle, ROOM, LEAST_PLOT);
    let rows = image.rows();
    plot.paint(image, |column, row| {
        match comparison.states.get(column * rows + row)? {
            NodeState::Masked => None,
            NodeState::Compared(deviation) => Some(scale.of(*deviation)),
            NodeState::AtEdge => Some(EDGE),
            NodeState::Foreign => Some(FOREIGN),
        }
    });
    outline(&mut plot, image, &comparison.labels);
    number(&mut plot, image, comparison);
    scale.draw(&mut plot);
    if let Some(tolerance) = tolerance {
        mark_tolerance(&mut plot, &scale, tolerance);
    }
    plot.axes(image);
    below(plot.canvas, comparison, tolerance, &scale)
}

/// The borders between nodes of a region and others.
fn outline(plot: &mut Plot, image: &RangeImage, labels: &[u32]) {
    let rows = image.rows();
    let label = |column: usize, row: usize| {
        let inside = column < image.columns() && row < rows;
        inside
            .then(|| labels.get(column * rows + row))
            .flatten()
            .copied()
            .unwrap_or(0)
    };
    let half = image.pitch_mm() / 2.0;
    for (radius, paint) in [(2.2, PAPER), (1.0, INK)] {
        let mut mask = Mask::like(&plot.canvas);
        for column in 0..image.columns() {
            for row in 0..rows {
                let here = label(column, row);
                if here == 0 {
                    continue;
                }
                let (x, y) = (image.x_mm(column), image.y_mm(row));
                // Outside there is no region: the indices wrap to where there is no node.
                for (other, dx, dy) in [
                    (
                        label(column.wrapping_sub(1), row),
                        [-half; 2],
                        [-half, half],
                    ),
                    (label(column + 1, row), [half; 2], [-half, half]),
                    (
                        label(column, row.wrapping_sub(1)),
                        [-half, half],
                        [-half; 2],
                    ),
                    (label(column, row + 1), [-half, half], [half; 2]),
                ] {
                    if other != here {
                        let from = plot.place(image, x + dx[0], y + dy[0]);
                        let to = plot.place(image, x + dx[1], y + dy[1]);
                        mask.stroke(from, to, radius);
                    }
                }
            }
        }
        plot.canvas.stencil(&mask, paint);
    }
}

fn number(plot: &mut Plot, image: &RangeImage, comparison: &Comparison) {
    for (index, region) in comparison.regions.iter().take(MOST_NUMBERS).enumerate() {
        let text = (index + 1).to_string();
        let [_, y, _] = region.centre_mm;
        // Beside the region, so as not to hide it.
        let right = region.centre_mm[0] + region.size_mm[0] / 2.0;
        let [left, middle] = plot.place(image, right, y);
        let (left, top) = (
            left as usize + 6,
            (middle as usize).saturating_sub(TEXT_HEIGHT / 2),
        );
        let width = text_width(&text);
        plot.canvas.fill(left, top, width + 4, TEXT_HEIGHT, PAPER);
        plot.canvas.text(left + 2, top, &text, Weight::Bold, INK);
    }
}

/// Where the tolerance ends on the bar of colours.
fn mark_tolerance(plot: &mut Plot, scale: &Scale<'_>, tolerance: Tolerance) {
    for limit in [tolerance.lower_mm, tolerance.upper_mm] {
        if let Some((left, y, width)) = scale.place(plot, limit) {
            plot.canvas.fill(left, y.saturating_sub(1), width, 2, INK);
        }
    }
}

/// The picture with legend and histogram below it.
fn below(
    upper: Canvas,
    comparison: &Comparison,
    tolerance: Option<Tolerance>,
    scale: &Scale<'_>,
) -> Canvas {
    let width = upper.width().max(LEAST_WIDTH);
    let mut canvas = Canvas::new(width, upper.height() + 2 * LINE + BARS + 74, PAPER);
    canvas.paste(&upper);
    let mut top = upper.height();
    let mut left = LEFT;
    for (colour, text) in [
        (NOTHING, "not measured"),
        (EDGE, "at edges, not compared"),
        (FOREIGN, "not of the part"),
    ] {
        canvas.fill(left, top, 14, 14, colour);
        canvas.frame(left, top, 14, 14, FAINT);
        canvas.text(left + 20, top, text, Weight::Regular, INK);
        left += 20 + text_width(text) + 28;
    }
    top += 2 * LINE;
    histogram(
        &mut canvas,
        top,
        width - LEFT - 40,
        comparison,
        tolerance,
        scale,
    );
    canvas
}

fn histogram(
    canvas: &mut Canvas,
    top: usize,
    width: usize,
    comparison: &Comparison,
    tolerance: Option<Tolerance>,
    scale: &Scale<'_>,
) {
    let histogram = &comparison.histogram;
    let nodes: usize = histogram.counts.iter().sum::<usize>() + histogram.below + histogram.above;
    let heading = format!(
        "{nodes} nodes by deviation (mm); {} below and {} above these",
        histogram.below, histogram.above
    );
    canvas.text(LEFT, top, &heading, Weight::Regular, FAINT);
    let top = top + LINE + 4;
    let (Some(&first), Some(&last)) = (histogram.limits_mm.first(), histogram.limits_mm.last())
    else {
        return;
    };
    let x = |value: f64| {
        let share = ((value - first) / (last - first)).clamp(0.0, 1.0);
        LEFT + (share * width as f64).round() as usize
    };
    let most = histogram.counts.iter().copied().max().unwrap_or(0).max(1);
    for (limits, &count) in histogram.limits_mm.windows(2).zip(&histogram.counts) {
        let [low, high] = limits else { continue };
        let height = (count as f64 / most as f64 * BARS as f64).round() as usize;
        let (from, to) = (x(*low), x(*high));
        let bar = to.saturating_sub(from + 1);
        canvas.fill(
            from,
            top + BARS - height,
            bar,
            height,
            scale.of((low + high) / 2.0),
        );
        canvas.frame(from, top + BARS - height, bar, height, FAINT);
    }
    canvas.fill(LEFT, top + BARS, width, 1, FAINT);
    for tick in ticks(first, last, width / 90) {
        let here = x(tick.value);
        canvas.fill(here, top + BARS, 1, 5, FAINT);
        let left = here.saturating_sub(text_width(&tick.text) / 2);
        canvas.text(left, top + BARS + 8, &tick.text, Weight::Regular, INK);
    }
    for limit in tolerance.map_or(Vec::new(), |t| vec![t.lower_mm, t.upper_mm]) {
        if (first..=last).contains(&limit) {
            canvas.fill(x(limit), top, 2, BARS, INK);
        }
    }
}
