//! Pictures of a grid's heights: contour lines, curvature, and how far a surface lies off.

use colorous::RED_BLUE;
use range_image::RangeImage;

use super::canvas::{Canvas, Mask, Rgb, Weight};
use super::plot::{FAINT, INK, Plot};
use super::scale::{LEAST_PLOT, ROOM, Scale};

/// Radius of a contour line, pixels; each fifth is stronger.
const THIN: f64 = 0.35;
const STRONG: f64 = 0.8;
/// Share of the nodes whose curvature the colours tell apart.
const TOLD_SHARE: f64 = 0.98;
const GROUND: Rgb = [205, 208, 212];

fn red_blue(share: f64) -> Rgb {
    // The palette goes from red to blue.
    let colour = RED_BLUE.eval_continuous(1.0 - share);
    [colour.r, colour.g, colour.b]
}

/// Deviations by node, as far as there is one, red where the data lie towards the camera.
pub(super) fn off_surface(
    image: &RangeImage,
    deviations_mm: &[f64],
    tolerance_mm: f64,
    name: &str,
) -> Canvas {
    let rows = image.rows();
    let seen = deviations_mm.iter().filter(|d| !d.is_nan());
    let (mut sum, mut count, mut beyond) = (0.0, 0_usize, 0_usize);
    for d in seen {
        sum += d * d;
        count += 1;
        beyond += usize::from(d.abs() > tolerance_mm);
    }
    let rms = (sum / count.max(1) as f64).sqrt();
    let subtitle = format!(
        "data off the surface along z: rms {rms:.4} mm, {beyond} of {count} nodes beyond {tolerance_mm} mm"
    );
    let scale = Scale {
        heading: "deviation (mm)",
        low: -tolerance_mm,
        high: tolerance_mm,
        open: true,
        colour: &red_blue,
    };
    let mut plot = Plot::new(image, name, &subtitle, ROOM, LEAST_PLOT);
    plot.cover(GROUND);
    plot.paint(image, |column, row| {
        let d = deviations_mm.get(column * rows + row)?;
        (!d.is_nan()).then(|| scale.of(*d))
    });
    scale.draw(&mut plot);
    plot.axes(image);
    plot.canvas
}

/// Lines of equal z, `step_mm` apart, each fifth strong.
pub(super) fn contours(image: &RangeImage, step_mm: f64, name: &str) -> Canvas {
    let subtitle = format!("contour lines every {step_mm} mm, each fifth strong");
    let mut plot = Plot::new(image, name, &subtitle, ROOM, LEAST_PLOT);
    plot.paint(image, |column, row| {
        image.z_mm(column, row).map(|_| [255; 3])
    });
    let (mut thin, mut strong) = (Mask::like(&plot.canvas), Mask::like(&plot.canvas));
    for i in 1..image.columns() {
        for j in 1..image.rows() {
            let corner = |i: usize, j: usize| {
                let z = image.z_mm(i, j)?;
                Some([image.x_mm(i), image.y_mm(j), z])
            };
            let corners = (
                corner(i - 1, j - 1),
                corner(i, j - 1),
                corner(i, j),
                corner(i - 1, j),
            );
            let (Some(a), Some(b), Some(c), Some(d)) = corners else {
                continue;
            };
            for triangle in [[a, b, c], [a, c, d]] {
                cut(image, &plot, triangle, step_mm, &mut thin, &mut strong);
            }
        }
    }
    plot.canvas.stencil(&thin, FAINT);
    plot.canvas.stencil(&strong, INK);
    plot.axes(image);
    plot.canvas
}

/// Strokes along the levels that cross a triangle.
fn cut(
    image: &RangeImage,
    plot: &Plot,
    triangle: [[f64; 3]; 3],
    step_mm: f64,
    thin: &mut Mask,
    strong: &mut Mask,
) {
    let z = triangle.map(|corner| corner[2]);
    let (low, high) = (
        z.iter().copied().fold(f64::INFINITY, f64::min),
        z.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    let mut level = (low / step_mm).ceil();
    // A step in z is not a hundred lines.
    if step_mm.is_nan() || step_mm <= 0.0 || (high - low) / step_mm > 20.0 {
        return;
    }
    while level * step_mm <= high {
        let at = level * step_mm;
        let mut ends = Vec::new();
        for k in 0..3 {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            if (from[2] <= at) != (to[2] <= at) {
                let share = (at - from[2]) / (to[2] - from[2]);
                let [x, y] = [0, 1].map(|d| from[d] + share * (to[d] - from[d]));
                ends.push(plot.place(image, x, y));
            }
        }
        if let [from, to] = ends.as_slice() {
            if level.rem_euclid(5.0) == 0.0 {
                strong.stroke(*from, *to, STRONG);
            } else {
                thin.stroke(*from, *to, THIN);
            }
        }
        level += 1.0;
    }
}

/// Half the sum of second derivatives along x and y at a node, 1/mm: mean curvature where the
/// surface is level.
fn curvature(image: &RangeImage, column: usize, row: usize) -> Option<f64> {
    let z = |i: Option<usize>, j: Option<usize>| image.z_mm(i?, j?);
    let (i, j) = (Some(column), Some(row));
    let here = z(i, j)?;
    let along_x = z(column.checked_sub(1), j)? + z(Some(column + 1), j)?;
    let along_y = z(i, row.checked_sub(1))? + z(i, Some(row + 1))?;
    let square = image.pitch_mm() * image.pitch_mm();
    Some((along_x + along_y - 4.0 * here) / (2.0 * square))
}

/// The curvature, 1/mm, that all but the most curved nodes stay below.
pub(super) fn curvature_limit(image: &RangeImage) -> f64 {
    let rows = image.rows();
    let mut seen: Vec<f64> = (0..image.columns() * rows)
        .filter_map(|n| curvature(image, n / rows, n % rows))
        .map(f64::abs)
        .collect();
    seen.sort_by(f64::total_cmp);
    let index = (seen.len() as f64 * TOLD_SHARE) as usize;
    seen.get(index).copied().unwrap_or(1.0).max(1e-9)
}

/// Curvature as colour: red in hollows, blue on hills.
pub(super) fn curvatures(image: &RangeImage, limit: f64, name: &str) -> Canvas {
    let subtitle = "mean curvature from second differences along x and y";
    let scale = Scale {
        heading: "curvature (1/mm)",
        low: -limit,
        high: limit,
        open: true,
        colour: &red_blue,
    };
    let mut plot = Plot::new(image, name, subtitle, ROOM, LEAST_PLOT);
    plot.cover(GROUND);
    plot.paint(image, |column, row| {
        curvature(image, column, row).map(|value| scale.of(value))
    });
    if image.valid_nodes() == 0 {
        plot.note("nothing measured", Weight::Regular, FAINT);
    }
    scale.draw(&mut plot);
    plot.axes(image);
    plot.canvas
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Lattice;

    fn bowl() -> RangeImage {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -10, -10, 21, 21);
        for i in 0..21 {
            for j in 0..21 {
                let (x, y) = (image.x_mm(i), image.y_mm(j));
                image.set_z_mm(i, j, Some(0.1 * (x * x + y * y)));
            }
        }
        image
    }

    #[test]
    fn a_bowl_has_its_curvature_and_round_contours() {
        let image = bowl();
        // z = 0.1 r^2 has second derivatives of 0.2 along both directions.
        assert!((curvature(&image, 10, 10).unwrap() - 0.2).abs() < 1e-12);
        assert!((curvature_limit(&image) - 0.2).abs() < 1e-12);
        assert_eq!(curvature(&image, 0, 4), None);
        let drawn = contours(&image, 0.5, "bowl");
        // The strong line at z = 2.5 lies at a radius of 5 mm: the middles of the sides.
        let plot = Plot::new(&image, "bowl", "", ROOM, LEAST_PLOT);
        let ink = |x: f64, y: f64| {
            let [px, py] = plot.place(&image, x, y);
            let at = (py as usize * drawn.width() + px as usize) * 3;
            drawn.pixels()[at] < 140
        };
        assert!(ink(3.536, 3.536) && ink(-3.536, 3.536));
        assert!(!ink(0.6, 0.6));
    }
}
