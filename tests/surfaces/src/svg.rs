//! Pictures as SVG.

use std::fmt::Write as _;

/// A picture on white of this width and height, pixels, begun; `styles` are those of its classes.
#[must_use]
pub fn begun(width: f64, height: f64, styles: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<style>polyline{{fill:none}}{styles}</style>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    )
}

/// A line through places, in the style of a class.
pub fn line(svg: &mut String, places: impl Iterator<Item = [f64; 2]>, class: &str) {
    let words: Vec<String> = places.map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    let _ = writeln!(
        svg,
        "<polyline class=\"{class}\" points=\"{}\"/>",
        words.join(" ")
    );
}
