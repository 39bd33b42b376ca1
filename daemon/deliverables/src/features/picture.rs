//! Features drawn over the shaded part, with their numbers and dimensions.

use std::io::Write;

use features::feature::Feature;
use features::recognise::Recognition;
use range_image::RangeImage;

use crate::picture::{OutlineNote, write_outlines};

/// Chords of a circle.
const CHORDS: usize = 96;
/// Chords of a rounded corner.
const CORNER_CHORDS: usize = 8;

/// Draws the features of a part over its range image.
///
/// # Errors
/// The sink's.
pub fn write_features_picture(
    image: &RangeImage,
    recognition: &Recognition,
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    let notes: Vec<OutlineNote> = recognition
        .features
        .iter()
        .map(|feature| {
            let w = feature.heights_mm.0;
            let sizes = sizes(feature);
            OutlineNote {
                number: feature.id.to_string(),
                text: format!("{} {sizes}", feature.class.replace('_', " ")),
                is_doubtful: !feature.warnings.is_empty(),
                loop_mm: outline(feature.outline)
                    .into_iter()
                    .map(|[u, v]| {
                        let at = recognition.frame.world([u, v, w]);
                        [at.x, at.y]
                    })
                    .collect(),
                label_mm: [feature.centre_mm.x, feature.centre_mm.y],
            }
        })
        .collect();
    write_outlines(image, &notes, name, sink)
}

/// The dimensions in few words: length x width, then the others by name.
fn sizes(feature: &Feature) -> String {
    let value = |name: &str| {
        feature
            .dimension(name)
            .map(|d| format!("{:.3}", d.value_mm))
    };
    let mut told: Vec<String> = Vec::new();
    if let (Some(length), Some(width)) = (value("length"), value("width")) {
        told.push(format!("{length} x {width}"));
    } else {
        told.extend(value("width").map(|width| format!("width {width}")));
    }
    for (name, short) in [
        ("diameter", "d"),
        ("depth", "depth"),
        ("height", "height"),
        ("corner_radius", "r"),
        ("radius", "r"),
    ] {
        told.extend(value(name).map(|value| format!("{short} {value}")));
    }
    told.join(", ")
}

/// An outline as a polygon in the plan.
fn outline(shape: features::outline::Shape) -> Vec<[f64; 2]> {
    use features::outline::Shape;
    match shape {
        Shape::Circle(circle) => (0..CHORDS)
            .map(|k| {
                let (sin, cos) = libm::sincos(core::f64::consts::TAU * k as f64 / CHORDS as f64);
                let [u, v] = circle.centre_mm;
                [u + circle.radius_mm * cos, v + circle.radius_mm * sin]
            })
            .collect(),
        Shape::Rectangle(own) => {
            let corners = [(1, 1, 0.0), (0, 1, 1.0), (0, 0, 2.0), (1, 0, 3.0)];
            let mut points = Vec::new();
            for (a, b, quarters) in corners {
                let is_rounded = own.walls[a] && own.walls[2 + b];
                let radius = if is_rounded { own.corner_mm } else { 0.0 };
                let inwards = |side: usize| if side == 1 { -radius } else { radius };
                let centre = [own.first_mm[a] + inwards(a), own.second_mm[b] + inwards(b)];
                for k in 0..=CORNER_CHORDS {
                    let share = k as f64 / CORNER_CHORDS as f64;
                    let angle = core::f64::consts::FRAC_PI_2 * (quarters + share);
                    let (sin, cos) = libm::sincos(angle);
                    points.push(own.place([centre[0] + radius * cos, centre[1] + radius * sin]));
                }
            }
            points
        }
    }
}
