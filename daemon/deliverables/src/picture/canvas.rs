//! A picture in memory: filled shapes, smooth lines, text.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Red, green and blue, 0 to 255.
pub(super) type Rgb = [u8; 3];

/// Height of a line of text, pixels.
pub(super) const TEXT_HEIGHT: usize = 16;

/// Light or heavy letters.
#[derive(Debug, Clone, Copy)]
pub(super) enum Weight {
    Regular,
    Bold,
}

/// Pixels in rows from the top, three bytes each.
pub(super) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize, colour: Rgb) -> Self {
        Self {
            width,
            height,
            pixels: colour.repeat(width * height),
        }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.height
    }

    pub(super) fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    pub(super) fn set(&mut self, x: usize, y: usize, colour: Rgb) {
        self.blend(x, y, colour, 1.0);
    }

    /// Lays a colour over a pixel; `share` 0 leaves it, 1 covers it. Outside: nothing.
    pub(super) fn blend(&mut self, x: usize, y: usize, colour: Rgb, share: f64) {
        if x >= self.width || y >= self.height {
            return;
        }
        let start = (y * self.width + x) * 3;
        if let Some(pixel) = self.pixels.get_mut(start..start + 3) {
            for (old, new) in pixel.iter_mut().zip(colour) {
                *old = mix(*old, new, share);
            }
        }
    }

    pub(super) fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: Rgb) {
        for row in y..y + height {
            for column in x..x + width {
                self.set(column, row, colour);
            }
        }
    }

    /// A frame one pixel wide just inside the rectangle.
    pub(super) fn frame(&mut self, x: usize, y: usize, width: usize, height: usize, colour: Rgb) {
        if width == 0 || height == 0 {
            return;
        }
        self.fill(x, y, width, 1, colour);
        self.fill(x, y + height - 1, width, 1, colour);
        self.fill(x, y, 1, height, colour);
        self.fill(x + width - 1, y, 1, height, colour);
    }

    /// Copies a canvas into the upper left corner.
    pub(super) fn paste(&mut self, other: &Self) {
        for y in 0..other.height.min(self.height) {
            for x in 0..other.width.min(self.width) {
                let start = (y * other.width + x) * 3;
                if let Some(&[r, g, b]) = other.pixels.get(start..start + 3) {
                    self.set(x, y, [r, g, b]);
                }
            }
        }
    }

    /// Lays a colour over the canvas as strongly as the mask says.
    pub(super) fn stencil(&mut self, mask: &Mask, colour: Rgb) {
        for y in 0..self.height.min(mask.height) {
            for x in 0..self.width.min(mask.width) {
                let share = mask.at(x, y);
                if share > 0 {
                    self.blend(x, y, colour, f64::from(share) / 255.0);
                }
            }
        }
    }

    /// Writes text with its upper left corner here; letters the font lacks become `?`.
    pub(super) fn text(&mut self, x: usize, y: usize, text: &str, weight: Weight, colour: Rgb) {
        let weight = match weight {
            Weight::Regular => FontWeight::Regular,
            Weight::Bold => FontWeight::Bold,
        };
        for (index, letter) in text.chars().enumerate() {
            let raster = get_raster(letter, weight, RasterHeight::Size16)
                .or_else(|| get_raster('?', weight, RasterHeight::Size16));
            let Some(raster) = raster else { continue };
            let left = x + index * letter_width();
            for (row, line) in raster.rows().enumerate() {
                for (column, &share) in line.iter().enumerate() {
                    self.blend(left + column, y + row, colour, f64::from(share) / 255.0);
                }
            }
        }
    }
}

fn letter_width() -> usize {
    get_raster_width(FontWeight::Regular, RasterHeight::Size16)
}

/// Width of a text, pixels.
pub(super) fn text_width(text: &str) -> usize {
    text.chars().count() * letter_width()
}

/// The longest beginning of a text that fits this many pixels, with a mark where cut.
pub(super) fn fitted(text: &str, width: usize) -> String {
    let room = width / letter_width();
    if text.chars().count() <= room {
        return text.to_owned();
    }
    let mut cut: String = text.chars().take(room.saturating_sub(3)).collect();
    cut.push_str("...");
    cut
}

/// A colour between two others; `share` 0 gives the first, 1 the second.
pub(super) fn mix(from: u8, to: u8, share: f64) -> u8 {
    let share = share.clamp(0.0, 1.0);
    (f64::from(from) * (1.0 - share) + f64::from(to) * share).round() as u8
}

/// How strongly each pixel is covered by what was drawn, 0 to 255. Overlapping strokes
/// do not add up, so a line made of short pieces shows no beads.
pub(super) struct Mask {
    width: usize,
    height: usize,
    cover: Vec<u8>,
}

impl Mask {
    pub(super) fn like(canvas: &Canvas) -> Self {
        Self {
            width: canvas.width,
            height: canvas.height,
            cover: vec![0; canvas.width * canvas.height],
        }
    }

    fn at(&self, x: usize, y: usize) -> u8 {
        self.cover.get(y * self.width + x).copied().unwrap_or(0)
    }

    /// A straight stroke with round ends; a stroke of no length is a disc.
    pub(super) fn stroke(&mut self, from: [f64; 2], to: [f64; 2], radius: f64) {
        if !(from.iter().chain(&to).all(|c| c.is_finite())) {
            return;
        }
        let reach = radius + 1.0;
        let span = |a: f64, b: f64, limit: usize| {
            let low = (a.min(b) - reach).floor().clamp(0.0, limit as f64) as usize;
            let high = (a.max(b) + reach).ceil().clamp(0.0, limit as f64) as usize;
            low..high
        };
        let along = [to[0] - from[0], to[1] - from[1]];
        let length_squared = along[0] * along[0] + along[1] * along[1];
        for y in span(from[1], to[1], self.height) {
            for x in span(from[0], to[0], self.width) {
                let offset = [x as f64 + 0.5 - from[0], y as f64 + 0.5 - from[1]];
                let share = if length_squared > 0.0 {
                    ((offset[0] * along[0] + offset[1] * along[1]) / length_squared).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let (dx, dy) = (offset[0] - share * along[0], offset[1] - share * along[1]);
                let distance = (dx * dx + dy * dy).sqrt();
                let cover = ((radius + 0.5 - distance).clamp(0.0, 1.0) * 255.0).round() as u8;
                if let Some(pixel) = self.cover.get_mut(y * self.width + x) {
                    *pixel = (*pixel).max(cover);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_covers_its_middle_and_nothing_far_from_it() {
        let canvas = Canvas::new(20, 10, [255; 3]);
        let mut mask = Mask::like(&canvas);
        mask.stroke([2.5, 5.5], [17.5, 5.5], 1.0);
        assert_eq!(
            (mask.at(10, 5), mask.at(10, 4), mask.at(10, 8)),
            (255, 128, 0)
        );
        assert_eq!(mask.at(19, 5), 0);
    }

    #[test]
    fn drawing_beyond_the_edges_is_harmless() {
        let mut canvas = Canvas::new(8, 8, [255; 3]);
        canvas.text(4, 4, "\u{4e2d}x", Weight::Bold, [0; 3]);
        canvas.fill(6, 6, 100, 100, [1, 2, 3]);
        let mut mask = Mask::like(&canvas);
        mask.stroke([-1e9, f64::NAN], [1e9, 0.0], 2.0);
        mask.stroke([-50.0, 4.0], [50.0, 4.0], 1.0);
        canvas.stencil(&mask, [9; 3]);
        assert_eq!(canvas.pixels().len(), 8 * 8 * 3);
        assert_eq!(&canvas.pixels()[(4 * 8) * 3..(4 * 8) * 3 + 3], [9; 3]);
    }

    #[test]
    fn long_text_is_cut_with_a_mark() {
        let width = text_width("abcdefgh");
        assert_eq!(fitted("abcdefgh", width), "abcdefgh");
        assert_eq!(fitted("abcdefghi", width), "abcde...");
    }
}
