//! Pictures of skinned sections: each as it lies, and how far its data points are off.

use skin::{Deviation, Skin};

use super::canvas::{Canvas, Mask, Rgb, TEXT_HEIGHT, Weight, fitted};
use super::plot::{FAINT, INK, NOTHING, PAPER};

/// More sections than this are thinned out.
const MOST: usize = 60;
/// Panels beside each other.
const ACROSS: usize = 6;
/// Side of a panel, pixels.
const SIDE: usize = 230;
/// Height of a strip, pixels.
const STRIP: usize = 64;
const STRIP_WIDTH: usize = 900;
const MARGIN: usize = 12;
const HEAD: usize = 54;
/// Places along a curve.
const PLACES: usize = 240;
const CURVE: Rgb = [11, 98, 168];
const LIMIT: Rgb = [176, 182, 189];
const BEFORE: Rgb = [179, 38, 30];

/// A section, and what belongs to it.
struct Shown<'a> {
    name: &'a str,
    height: f64,
    points: Vec<&'a Deviation>,
    before_mm: Vec<f64>,
}

impl Shown<'_> {
    fn most_mm(&self) -> f64 {
        self.points.iter().map(|own| own.off_mm).fold(0.0, f64::max)
    }
}

/// Those that are drawn.
fn shown(skin: &Skin) -> Vec<Shown<'_>> {
    let every = skin.sections.len().div_ceil(MOST).max(1);
    let mut all: Vec<Shown<'_>> = skin
        .sections
        .iter()
        .zip(&skin.heights)
        .map(|(name, height)| Shown {
            name,
            height: *height,
            points: Vec::new(),
            before_mm: Vec::new(),
        })
        .collect();
    for (k, own) in skin.deviations.iter().enumerate() {
        if let Some(of) = all.get_mut(own.section) {
            of.points.push(own);
            of.before_mm.extend(skin.before_mm.get(k));
        }
    }
    all.into_iter().step_by(every).collect()
}

fn remark(all: usize, drawn: usize) -> String {
    if drawn == all {
        format!("{all} sections")
    } else {
        format!("{drawn} of {all} sections")
    }
}

/// The two of x, y and z along which sections extend most.
fn plane(shown: &[Shown<'_>]) -> [usize; 2] {
    let mut spreads = [0.0_f64; 3];
    for own in shown {
        for (d, spread) in spreads.iter_mut().enumerate() {
            let (low, high) = span(own.points.iter().map(|p| p.place_mm[d]));
            *spread += (high - low).max(0.0);
        }
    }
    let least = (0..3).min_by(|a, b| spreads[*a].total_cmp(&spreads[*b]));
    match least {
        Some(0) => [1, 2],
        Some(1) => [0, 2],
        _ => [0, 1],
    }
}

fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

/// Each section's data points, and the surface's curve there, all at one scale.
pub(super) fn sections(skin: &Skin, name: &str) -> Canvas {
    let shown = shown(skin);
    let [right, up] = plane(&shown);
    let axis = |d: usize| ["x", "y", "z"][d];
    let (columns, rows) = (
        shown.len().clamp(3, ACROSS),
        shown.len().div_ceil(ACROSS).max(1),
    );
    let mut canvas = Canvas::new(
        columns * SIDE + 2 * MARGIN,
        HEAD + rows * SIDE + MARGIN,
        PAPER,
    );
    let extent = |d: usize| {
        let each = shown
            .iter()
            .map(|own| span(own.points.iter().map(|p| p.place_mm[d])));
        each.map(|(low, high)| high - low).fold(0.0, f64::max)
    };
    let room = (SIDE - 4 * MARGIN - 2 * TEXT_HEIGHT) as f64;
    let scale = room / extent(right).max(extent(up)).max(1e-9);
    let subtitle = format!(
        "{}: {} to the right, {} up, data and surface, and how far the farthest point is off; {:.3} mm per pixel",
        remark(skin.sections.len(), shown.len()),
        axis(right),
        axis(up),
        1.0 / scale,
    );
    headed(&mut canvas, name, &subtitle);
    let (mut curve, mut dots) = (Mask::like(&canvas), Mask::like(&canvas));
    for (k, own) in shown.iter().enumerate() {
        let (left, top) = (MARGIN + k % ACROSS * SIDE, HEAD + k / ACROSS * SIDE);
        canvas.frame(left, top, SIDE - 6, SIDE - 6, NOTHING);
        let label = fitted(own.name, SIDE - 20);
        canvas.text(left + 6, top + 4, &label, Weight::Regular, INK);
        let most = format!("max {:.3} mm", own.most_mm());
        let below = top + 6 + TEXT_HEIGHT;
        canvas.text(left + 6, below, &most, Weight::Regular, FAINT);
        let middle = |d: usize| {
            let (low, high) = span(own.points.iter().map(|p| p.place_mm[d]));
            low.midpoint(high)
        };
        let (cx, cy) = (middle(right), middle(up));
        let center = [
            (left + SIDE / 2) as f64,
            (top + SIDE / 2 + TEXT_HEIGHT) as f64,
        ];
        let place = |p: [f64; 3]| {
            [
                center[0] + (p[right] - cx) * scale,
                center[1] - (p[up] - cy) * scale,
            ]
        };
        let at = |k: usize| place(skin.surface.evaluate(k as f64 / PLACES as f64, own.height));
        let mut from = at(0);
        for k in 1..=PLACES {
            let to = at(k);
            curve.stroke(from, to, 0.5);
            from = to;
        }
        for point in &own.points {
            let at = place(point.place_mm);
            dots.stroke(at, at, 0.9);
        }
    }
    canvas.stencil(&curve, CURVE);
    canvas.stencil(&dots, INK);
    canvas
}

/// The deviation of each data point of each section along it, under the tolerance, and what it was
/// before knots were removed (Jo, Kwon & Han, Fig. 5).
pub(super) fn deviations(skin: &Skin, tolerance_mm: f64, name: &str) -> Canvas {
    let shown = shown(skin);
    let label_width = 180;
    let width = MARGIN + label_width + STRIP_WIDTH + MARGIN;
    let mut canvas = Canvas::new(width, HEAD + shown.len() * STRIP + MARGIN, PAPER);
    let before = if skin.before_mm.is_empty() {
        ""
    } else {
        "; red before knots were removed, blue after"
    };
    headed(
        &mut canvas,
        name,
        &format!(
            "{}: distance of each data point from the surface; the line is {tolerance_mm} mm{before}",
            remark(skin.sections.len(), shown.len()),
        ),
    );
    let (mut after, mut earlier) = (Mask::like(&canvas), Mask::like(&canvas));
    let high = 1.1 * tolerance_mm;
    for (k, own) in shown.iter().enumerate() {
        let left = MARGIN + label_width;
        let bottom = HEAD + (k + 1) * STRIP - 8;
        let deep = (STRIP - 14) as f64;
        canvas.text(
            MARGIN,
            bottom - 34,
            &fitted(own.name, label_width - 8),
            Weight::Regular,
            INK,
        );
        let most = format!("max {:.3} mm", own.most_mm());
        canvas.text(MARGIN, bottom - 17, &most, Weight::Regular, FAINT);
        canvas.fill(left, bottom, STRIP_WIDTH, 1, FAINT);
        let limit = bottom as f64 - deep * tolerance_mm / high;
        canvas.fill(left, limit.round() as usize, STRIP_WIDTH, 1, LIMIT);
        let along = |at: f64| left as f64 + at.clamp(0.0, 1.0) * STRIP_WIDTH as f64;
        let up = |off_mm: f64| bottom as f64 - deep * (off_mm / high).min(1.0);
        let mut order: Vec<usize> = (0..own.points.len()).collect();
        order.sort_by(|a, b| own.points[*a].at[0].total_cmp(&own.points[*b].at[0]));
        for pair in order.windows(2) {
            let ends = |value: &dyn Fn(usize) -> f64| {
                [pair[0], pair[1]].map(|k| [along(own.points[k].at[0]), up(value(k))])
            };
            let [from, to] = ends(&|k| own.points[k].off_mm);
            after.stroke(from, to, 0.6);
            if own.before_mm.len() == own.points.len() {
                let [from, to] = ends(&|k| own.before_mm[k]);
                earlier.stroke(from, to, 0.6);
            }
        }
    }
    canvas.stencil(&earlier, BEFORE);
    canvas.stencil(&after, CURVE);
    canvas
}

fn headed(canvas: &mut Canvas, title: &str, subtitle: &str) {
    let room = canvas.width() - 2 * MARGIN;
    canvas.text(MARGIN, 8, &fitted(title, room), Weight::Bold, INK);
    canvas.text(MARGIN, 26, &fitted(subtitle, room), Weight::Regular, FAINT);
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Unmonitored;
    use skin::{Method, Section, Settings};

    fn body(count: usize, method: Method) -> Skin {
        let ring = |k: usize| {
            let wide = 40.0 + 5.0 * k as f64 / count as f64;
            let angle = |j: usize| core::f64::consts::TAU * j as f64 / 40.0;
            let place = |j: usize| {
                [
                    wide * libm::cos(angle(j)),
                    20.0 * k as f64,
                    30.0 * libm::sin(angle(j)),
                ]
            };
            Section {
                name: format!("ring {k}"),
                points: (0..40).map(place).collect(),
                is_closed: true,
                is_directed: false,
            }
        };
        let sections: Vec<Section> = (0..count).map(ring).collect();
        let settings = Settings {
            method,
            ..Settings::new(0.5)
        };
        skin::skin(&sections, &settings, &Unmonitored).unwrap()
    }

    fn has(canvas: &Canvas, colour: Rgb) -> bool {
        canvas.pixels().chunks_exact(3).any(|own| own == colour)
    }

    #[test]
    fn sections_are_drawn_in_their_own_plane_with_curve_and_data() {
        let skin = body(7, Method::Relief);
        assert_eq!(plane(&shown(&skin)), [0, 2]);
        let canvas = sections(&skin, "body");
        assert_eq!(canvas.height(), HEAD + 2 * SIDE + MARGIN);
        assert!(has(&canvas, INK));
        // Nothing of the curve is beyond its panel: the last panels of the second row are empty.
        let blank = |x: usize, y: usize| {
            let index = (y * canvas.width() + x) * 3;
            canvas.pixels()[index..index + 3] == PAPER
        };
        let empty = (MARGIN + SIDE..canvas.width()).all(|x| blank(x, HEAD + SIDE + SIDE / 2));
        assert!(empty, "beyond the last section");
    }

    #[test]
    fn what_was_before_removal_is_drawn_where_it_is_known() {
        let own = deviations(&body(5, Method::Relief), 0.5, "body");
        assert!(!has(&own, BEFORE) && has(&own, CURVE));
        let published = deviations(&body(5, Method::Jo), 0.5, "body");
        assert!(has(&published, BEFORE));
    }

    #[test]
    fn many_sections_are_thinned_out_and_it_says_so() {
        let skin = body(70, Method::Relief);
        let drawn = shown(&skin).len();
        assert_eq!(drawn, 35);
        assert_eq!(remark(70, drawn), "35 of 70 sections");
    }
}
