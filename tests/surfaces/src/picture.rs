//! Pictures as SVG: curves in rows, and nets.

use std::fmt::Write as _;

use relief_surfaces::svg::{begun, line};

const STYLES: &str = ".c{stroke:#0b62a8;stroke-width:1.3}.k{stroke:#b3261e;stroke-width:1.3}\
                      .n{stroke:#24292f;stroke-width:0.6}";
const WIDTH: f64 = 640.0;
const ROW: f64 = 110.0;
const LEFT: f64 = 150.0;

/// Curves below each other, each with its data points, and ticks at its knots.
pub(crate) struct Row {
    pub(crate) label: String,
    /// Place along the section and height, both in millimetres.
    pub(crate) points: Vec<[f64; 2]>,
    pub(crate) curve: Vec<[f64; 2]>,
    pub(crate) knots: Vec<f64>,
}

/// The rows as one picture.
pub(crate) fn rows(rows: &[Row]) -> String {
    let height = ROW * rows.len() as f64 + 10.0;
    let mut svg = begun(WIDTH, height, STYLES);
    for (index, row) in rows.iter().enumerate() {
        let all = || row.points.iter().chain(&row.curve);
        let span = |d: usize| {
            let values = all().map(|p| p[d]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            })
        };
        let ((x0, x1), (z0, z1)) = (span(0), span(1));
        let top = ROW * index as f64 + 14.0;
        let place = |[x, z]: [f64; 2]| {
            [
                LEFT + (x - x0) / (x1 - x0) * (WIDTH - LEFT - 14.0),
                top + (z1 - z) / (z1 - z0) * (ROW - 34.0),
            ]
        };
        for (line, label) in row.label.lines().enumerate() {
            let y = top + 16.0 + 16.0 * line as f64;
            let _ = writeln!(svg, "<text x=\"8\" y=\"{y:.1}\">{label}</text>");
        }
        for &point in &row.points {
            let [x, y] = place(point);
            let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.6\"/>");
        }
        line(&mut svg, row.curve.iter().map(|&p| place(p)), "c");
        for &knot in &row.knots {
            let [x, _] = place([knot, z0]);
            let (from, to) = (top + ROW - 30.0, top + ROW - 22.0);
            line(&mut svg, [[x, from], [x, to]].into_iter(), "k");
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// Nets of heights beside each other, seen from before and above.
pub(crate) fn nets(nets: &[(&str, usize, &[f64])]) -> String {
    const SIDE: f64 = 330.0;
    let mut svg = begun(SIDE * nets.len() as f64, 330.0, STYLES);
    for (index, (label, rows, z)) in nets.iter().enumerate() {
        let columns = z.len() / rows;
        let left = SIDE * index as f64;
        let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"20\">{label}</text>", left + 8.0);
        let (low, high) = z
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| {
                (l.min(*z), h.max(*z))
            });
        let place = |i: usize, j: usize| {
            let (x, y) = (
                i as f64 / (columns - 1) as f64,
                j as f64 / (rows - 1) as f64,
            );
            let up = (z[i * rows + j] - low) / (high - low);
            [
                left + 20.0 + 200.0 * x + 90.0 * y,
                310.0 - 150.0 * y - 110.0 * up,
            ]
        };
        for i in 0..columns {
            line(&mut svg, (0..*rows).map(|j| place(i, j)), "n");
        }
        for j in 0..*rows {
            line(&mut svg, (0..columns).map(|i| place(i, j)), "n");
        }
    }
    svg.push_str("</svg>\n");
    svg
}
