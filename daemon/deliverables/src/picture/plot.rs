//! The frame both pictures share: where a node falls on the canvas, axes in millimetres,
//! light and shade.

use range_image::RangeImage;

use super::canvas::{Canvas, Rgb, TEXT_HEIGHT, Weight, fitted, text_width};

/// Longer side of the plotted image, pixels, as near as whole pixels allow.
const PLOT_SIDE: usize = 840;
/// The same of an image that is [`SLENDER`] times as long as wide, or more.
const LONG_PLOT_SIDE: usize = 1600;
const SLENDER: f64 = 4.0;
/// Nodes are not drawn larger than this many pixels.
const MAX_PIXELS_PER_NODE: f64 = 12.0;
/// An image narrower than this is stretched across, and says so.
const MIN_SIDE: f64 = 40.0;
/// Least width of the canvas, so that titles fit, pixels.
const MIN_WIDTH: usize = 560;

const LEFT: usize = 76;
const TOP: usize = 62;
const BOTTOM: usize = 56;

pub(super) const PAPER: Rgb = [255, 255, 255];
pub(super) const INK: Rgb = [36, 41, 47];
pub(super) const FAINT: Rgb = [110, 119, 129];
pub(super) const NOTHING: Rgb = [240, 241, 243];

/// A canvas with a place on it for the image.
pub(super) struct Plot {
    pub(super) canvas: Canvas,
    /// Pixels per node along x and y.
    scale: [f64; 2],
    width: usize,
    height: usize,
}

/// Pixels per node along x and y.
fn scale(columns: usize, rows: usize) -> [f64; 2] {
    let (columns, rows) = (columns.max(1) as f64, rows.max(1) as f64);
    let (longer, shorter) = (columns.max(rows), columns.min(rows));
    let slender = ((longer / shorter - 2.0) / (SLENDER - 2.0)).clamp(0.0, 1.0);
    let side = PLOT_SIDE as f64 + slender * (LONG_PLOT_SIDE - PLOT_SIDE) as f64;
    let fit = side / longer;
    // Whole pixels per node keep nodes of one size, as long as there is a choice.
    let even = if fit >= 2.0 { fit.floor() } else { fit }.min(MAX_PIXELS_PER_NODE);
    [columns, rows].map(|nodes| even.max(MIN_SIDE / nodes))
}

impl Plot {
    /// A canvas with titles and axes for this image, `right` pixels beside the plot, and
    /// room for something `least_height` pixels high there.
    pub(super) fn new(
        image: &RangeImage,
        title: &str,
        subtitle: &str,
        right: usize,
        least_height: usize,
    ) -> Self {
        let scale = scale(image.columns(), image.rows());
        let side =
            |nodes: usize, scale: f64| ((nodes.max(1) as f64 * scale).round() as usize).max(1);
        let (width, height) = (
            side(image.columns(), scale[0]),
            side(image.rows(), scale[1]),
        );
        let mut plot = Self {
            canvas: Canvas::new(
                (LEFT + width + right).max(MIN_WIDTH),
                TOP + height.max(least_height) + BOTTOM,
                PAPER,
            ),
            scale,
            width,
            height,
        };
        let stretched = match scale[0] / scale[1] {
            ratio if ratio > 1.01 => format!("; x drawn {ratio:.1} times as large as y"),
            ratio if ratio < 0.99 => format!("; y drawn {:.1} times as large as x", 1.0 / ratio),
            _ => String::new(),
        };
        let room = plot.canvas.width() - LEFT - 8;
        plot.canvas
            .text(LEFT, 8, &fitted(title, room), Weight::Bold, INK);
        let subtitle = fitted(&format!("{subtitle}{stretched}"), room);
        plot.canvas
            .text(LEFT, 26, &subtitle, Weight::Regular, FAINT);
        plot.cover(NOTHING);
        plot
    }

    /// Fills the place of the image.
    pub(super) fn cover(&mut self, colour: Rgb) {
        self.canvas.fill(LEFT, TOP, self.width, self.height, colour);
    }

    /// Writes across the middle of the plot.
    pub(super) fn note(&mut self, text: &str, weight: Weight, colour: Rgb) {
        let middle = self.top() + self.height / 2;
        self.canvas.text(LEFT + 14, middle, text, weight, colour);
    }

    /// x of the plot's right edge on the canvas, pixels.
    pub(super) fn right(&self) -> usize {
        LEFT + self.width
    }

    /// y of the plot's upper edge on the canvas, pixels.
    pub(super) fn top(&self) -> usize {
        TOP
    }

    /// Height of the plot, pixels.
    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// Paints the nodes for which there is a colour. Where several nodes share a pixel,
    /// their colours are mixed.
    pub(super) fn paint(
        &mut self,
        image: &RangeImage,
        colour: impl Fn(usize, usize) -> Option<Rgb>,
    ) {
        let rows = image.rows();
        let colours: Vec<Option<Rgb>> = (0..image.columns())
            .flat_map(|column| (0..rows).map(move |row| (column, row)))
            .map(|(column, row)| colour(column, row))
            .collect();
        let columns: Vec<_> = (0..self.width)
            .map(|x| covered(x, self.scale[0], image.columns()))
            .collect();
        for y in 0..self.height {
            let from_top = covered(y, self.scale[1], rows);
            for (x, columns) in columns.iter().enumerate() {
                let (mut sum, mut count) = ([0_u32; 3], 0);
                for column in columns.clone() {
                    for row in from_top.clone() {
                        let node = column * rows + rows - 1 - row;
                        if let Some(Some(colour)) = colours.get(node) {
                            for (sum, &part) in sum.iter_mut().zip(colour) {
                                *sum += u32::from(part);
                            }
                            count += 1;
                        }
                    }
                }
                if count > 0 {
                    let mean = sum.map(|sum| ((sum + count / 2) / count) as u8);
                    self.canvas.set(LEFT + x, TOP + y, mean);
                }
            }
        }
    }

    /// Where a place of the part frame falls on the canvas, pixels.
    pub(super) fn place(&self, image: &RangeImage, x_mm: f64, y_mm: f64) -> [f64; 2] {
        let column = (x_mm - image.x_mm(0)) / image.pitch_mm();
        let row = (y_mm - image.y_mm(0)) / image.pitch_mm();
        let from_top = image.rows() as f64 - (row + 0.5);
        [
            LEFT as f64 + (column + 0.5) * self.scale[0],
            TOP as f64 + from_top * self.scale[1],
        ]
    }

    /// Frame, ticks and numbers.
    pub(super) fn axes(&mut self, image: &RangeImage) {
        let (right, bottom) = (LEFT + self.width, TOP + self.height);
        self.canvas.frame(LEFT, TOP, self.width, self.height, FAINT);
        if image.columns() > 0 && image.rows() > 0 {
            let (first, last) = (image.x_mm(0), image.x_mm(image.columns() - 1));
            for tick in ticks(first, last, self.width / 90) {
                let x = self.place(image, tick.value, 0.0)[0].round() as usize;
                self.canvas.fill(x, bottom, 1, 5, FAINT);
                let left = x.saturating_sub(text_width(&tick.text) / 2);
                self.canvas
                    .text(left, bottom + 8, &tick.text, Weight::Regular, INK);
            }
            let (first, last) = (image.y_mm(0), image.y_mm(image.rows() - 1));
            for tick in ticks(first, last, self.height / 60) {
                let y = self.place(image, 0.0, tick.value)[1].round() as usize;
                self.canvas.fill(LEFT - 5, y, 5, 1, FAINT);
                let left = (LEFT - 9).saturating_sub(text_width(&tick.text));
                let top = y.saturating_sub(TEXT_HEIGHT / 2);
                self.canvas
                    .text(left, top, &tick.text, Weight::Regular, INK);
            }
        }
        let label = "x (mm)";
        let left = right.saturating_sub((self.width + text_width(label)) / 2);
        self.canvas
            .text(left, bottom + 30, label, Weight::Regular, FAINT);
        self.canvas
            .text(8, TOP - 26, "y (mm)", Weight::Regular, FAINT);
    }
}

/// The nodes along one axis that a pixel shows: those it covers if it covers several, else
/// the one at its middle.
fn covered(pixel: usize, scale: f64, nodes: usize) -> core::ops::Range<usize> {
    if scale >= 1.0 {
        let node = ((pixel as f64 + 0.5) / scale) as usize;
        return node.min(nodes)..(node + 1).min(nodes);
    }
    let first = (pixel as f64 / scale).round() as usize;
    let end = ((pixel + 1) as f64 / scale).round() as usize;
    first.min(nodes)..end.max(first + 1).min(nodes)
}

/// A mark on a scale.
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) text: String,
}

/// About `wanted` marks at round numbers between two values, both ends included.
pub(super) fn ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        let text = format!("{low:.3}");
        return vec![Tick { value: low, text }];
    }
    let raw = span / wanted.max(2) as f64;
    let exponent = libm::floor(libm::log10(raw)) as i32;
    let decade = libm::pow(10.0, f64::from(exponent));
    let step = decade
        * [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .find(|m| m * decade >= raw)
            .unwrap_or(10.0);
    let decimals = usize::try_from(-libm::floor(libm::log10(step * 1.001)) as i32).unwrap_or(0);
    let first = libm::ceil(low / step - 1e-9) as i64;
    let last = libm::floor(high / step + 1e-9) as i64;
    (first..=last)
        .map(|index| {
            let value = index as f64 * step;
            Tick {
                value,
                text: format!("{value:.decimals$}"),
            }
        })
        .collect()
}

/// How brightly a node is lit, 0 to 1, by a lamp above the viewer's left shoulder.
///
/// The slope is taken between neighbours for which `joined` holds, as far as two nodes
/// away, so that noise does not speckle and borders stay sharp.
pub(super) fn shade(
    image: &RangeImage,
    column: usize,
    row: usize,
    joined: impl Fn(usize, usize) -> bool,
) -> f64 {
    const LAMP: [f64; 3] = [-0.42, 0.52, 0.744];
    let at = |dc: i64, dr: i64| -> Option<f64> {
        let c = usize::try_from(column as i64 + dc).ok()?;
        let r = usize::try_from(row as i64 + dr).ok()?;
        if joined(c, r) { image.z_mm(c, r) } else { None }
    };
    let slope = |step: [i64; 2]| -> f64 {
        let reach = |sense: i64| -> Option<(f64, f64)> {
            [2, 1].into_iter().find_map(|n| {
                at(sense * n * step[0], sense * n * step[1]).map(|z| ((sense * n) as f64, z))
            })
        };
        let here = at(0, 0).map(|z| (0.0, z));
        match (reach(-1).or(here), reach(1).or(here)) {
            (Some((a, low)), Some((b, high))) if b > a => {
                (high - low) / ((b - a) * image.pitch_mm())
            }
            _ => 0.0,
        }
    };
    let (p, q) = (slope([1, 0]), slope([0, 1]));
    let length = (p * p + q * q + 1.0).sqrt();
    ((-p * LAMP[0] - q * LAMP[1] + LAMP[2]) / length).max(0.0)
}

/// A colour dimmed to this share of its strength.
pub(super) fn dimmed(colour: Rgb, share: f64) -> Rgb {
    colour.map(|c| (f64::from(c) * share).round().clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Lattice;

    #[test]
    fn ticks_stand_at_round_numbers_within_the_range() {
        let marks = ticks(-49.8, 50.3, 10);
        let texts: Vec<&str> = marks.iter().map(|t| t.text.as_str()).collect();
        assert_eq!(texts, ["-40", "-20", "0", "20", "40"]);
        let fine = ticks(0.0, 0.31, 3);
        assert_eq!(
            fine.iter().map(|t| t.text.as_str()).collect::<Vec<_>>(),
            ["0.0", "0.2"]
        );
        assert_eq!(ticks(3.0, 3.0, 5).len(), 1);
    }

    #[test]
    fn a_slope_towards_the_lamp_is_brighter_than_one_away() {
        let plane = |a: f64| {
            let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 5, 5);
            for c in 0..5 {
                for r in 0..5 {
                    image.set_z_mm(c, r, Some(a * c as f64));
                }
            }
            shade(&image, 2, 2, |_, _| true)
        };
        // Rising in x, the surface faces left, where the lamp hangs.
        assert!(plane(0.5) > plane(0.0) && plane(0.0) > plane(-0.5));
        assert!((plane(0.0) - 0.744).abs() < 1e-12);
    }

    #[test]
    fn odd_shapes_are_scaled_with_sense() {
        // A single column is stretched to be seen, a long scan shrunk to fit a page.
        let [x, y] = scale(1, 500);
        assert!(x >= 40.0 && (2.0..=4.0).contains(&y), "{x} {y}");
        let [x, y] = scale(6000, 400);
        assert!((x - y).abs() < 1e-12 && (1599.0..=1601.0).contains(&(6000.0 * x)));
        let [x, y] = scale(6000, 50);
        assert!(6000.0 * x <= 1601.0 && 50.0 * y >= 40.0);
        assert_eq!(scale(221, 208), [3.0, 3.0]);
    }

    #[test]
    fn nodes_that_share_a_pixel_are_mixed_and_none_is_lost() {
        let image = RangeImage::masked(Lattice { pitch_mm: 0.1 }, 0, 0, 6400, 1600);
        let mut plot = Plot::new(&image, "t", "s", 10, 0);
        plot.paint(&image, |c, _| {
            Some(if c % 2 == 0 { [0; 3] } else { [200; 3] })
        });
        let index = ((TOP + 100) * plot.canvas.width() + LEFT + 300) * 3;
        assert_eq!(&plot.canvas.pixels()[index..index + 3], [100; 3]);
        let all: usize = (0..1600).map(|x| covered(x, 0.25, 6400).len()).sum();
        assert_eq!(all, 6400);
    }

    #[test]
    fn a_node_falls_in_the_middle_of_its_pixels() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 10, -4, 84, 42);
        image.set_z_mm(0, 0, Some(1.0));
        let mut plot = Plot::new(&image, "t", "s", 10, 0);
        plot.paint(&image, |c, r| (c == 0 && r == 0).then_some([1, 2, 3]));
        let [x, y] = plot.place(&image, 5.0, -2.0);
        assert_eq!((x, y), (LEFT as f64 + 5.0, (TOP + 42 * 10) as f64 - 5.0));
        let index = (y as usize * plot.canvas.width() + x as usize) * 3;
        assert_eq!(&plot.canvas.pixels()[index..index + 3], [1, 2, 3]);
    }
}
