//! Pictures as SVG: sections from above, and deviations beside each other.

use std::fmt::Write as _;

use relief_surfaces::svg::{begun, line};

const STYLES: &str = ".c{stroke:#0b62a8;stroke-width:1.3}.i{stroke:#b3261e;stroke-width:1.3}\
                      .p{stroke:#6e7781;stroke-width:0.8;stroke-dasharray:4 3}\
                      .q{fill:none;stroke:#6e7781}\
                      .t{stroke:#6e7781;stroke-width:1;stroke-dasharray:6 4}\
                      .n{stroke:#24292f;stroke-width:0.8}";
const WIDTH: f64 = 640.0;
const MARGIN: f64 = 20.0;

/// A line of a picture, and how it is drawn.
pub(crate) struct Line<'a> {
    pub(crate) label: String,
    pub(crate) class: &'static str,
    pub(crate) places: &'a [[f64; 2]],
}

/// A section from above: its data points, and curves with their control polygons.
pub(crate) fn section(points: &[[f64; 2]], lines: &[Line<'_>]) -> String {
    let all = || {
        points
            .iter()
            .chain(lines.iter().flat_map(|line| line.places))
    };
    let span = |d: usize| {
        all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (low.min(p[d]), high.max(p[d]))
        })
    };
    let ((x0, x1), (y0, y1)) = (span(0), span(1));
    let scale = (WIDTH - 2.0 * MARGIN) / (x1 - x0);
    let top = MARGIN + 18.0 * lines.len() as f64;
    let place = |[x, y]: [f64; 2]| [MARGIN + (x - x0) * scale, top + (y1 - y) * scale];
    let mut svg = begun(WIDTH, (top + (y1 - y0) * scale + MARGIN).round(), STYLES);
    for (index, own) in lines.iter().enumerate() {
        let y = 18.0 + 18.0 * index as f64;
        line(
            &mut svg,
            [[MARGIN, y - 4.0], [MARGIN + 30.0, y - 4.0]].into_iter(),
            own.class,
        );
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{y:.1}\">{}</text>",
            MARGIN + 38.0,
            own.label
        );
        line(&mut svg, own.places.iter().map(|p| place(*p)), own.class);
        if own.class == "p" {
            for [x, y] in own.places.iter().map(|p| place(*p)) {
                let _ = writeln!(
                    svg,
                    "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"5\" height=\"5\" class=\"q\"/>",
                    x - 2.5,
                    y - 2.5
                );
            }
        }
    }
    for [x, y] in points.iter().map(|p| place(*p)) {
        let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.6\"/>");
    }
    svg.push_str("</svg>\n");
    svg
}

/// Deviations of data points in their order, and a line at the tolerance.
pub(crate) fn deviations(tolerance_mm: f64, series: &[(&str, &'static str, &[f64])]) -> String {
    const HEIGHT: f64 = 300.0;
    const LEFT: f64 = 44.0;
    let (top, bottom) = (MARGIN + 18.0 * series.len() as f64, HEIGHT - 36.0);
    let high = 1.1 * tolerance_mm;
    let y = |off_mm: f64| bottom - off_mm / high * (bottom - top);
    let mut svg = begun(WIDTH, HEIGHT, STYLES);
    let x = |k: usize, count: usize| {
        LEFT + (WIDTH - LEFT - MARGIN) * k as f64 / count.saturating_sub(1).max(1) as f64
    };
    for mark in 0..=(tolerance_mm as usize) {
        let at = y(mark as f64);
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{mark}</text>",
            LEFT - 8.0,
            at + 4.0
        );
        line(&mut svg, [[LEFT - 4.0, at], [LEFT, at]].into_iter(), "n");
    }
    line(
        &mut svg,
        [[LEFT, top], [LEFT, bottom], [WIDTH - MARGIN, bottom]].into_iter(),
        "n",
    );
    line(
        &mut svg,
        [[LEFT, y(tolerance_mm)], [WIDTH - MARGIN, y(tolerance_mm)]].into_iter(),
        "t",
    );
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\">data points around the section; deviation in mm, tolerance {tolerance_mm} mm</text>",
        LEFT,
        HEIGHT - 12.0
    );
    for (index, (label, class, off_mm)) in series.iter().enumerate() {
        let at = 18.0 + 18.0 * index as f64;
        line(
            &mut svg,
            [[LEFT, at - 4.0], [LEFT + 30.0, at - 4.0]].into_iter(),
            class,
        );
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{at:.1}\">{label}</text>",
            LEFT + 38.0
        );
        let places = off_mm
            .iter()
            .enumerate()
            .map(|(k, off)| [x(k, off_mm.len()), y(*off)]);
        line(&mut svg, places, class);
    }
    svg.push_str("</svg>\n");
    svg
}
