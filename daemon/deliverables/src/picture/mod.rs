//! Pictures of a scan, as PNG: y up, axes in millimetres, and what the colours mean.

mod borders;
mod canvas;
mod deviations;
mod heights;
mod inliers;
mod machined;
mod outlines;
mod plot;
mod range;
mod regions;
mod residuals;
mod scale;
mod sections;

use std::io::Write;

use compare::{Comparison, Tolerance};
use pipeline::Outcome;
use range_image::RangeImage;
use skin::Skin;

use crate::deviations::Deviations;
use canvas::Canvas;

pub use outlines::OutlineNote;
pub use regions::RegionNote;

/// Draws the range image with a colour scale in millimetres and writes it as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_range(image: &RangeImage, name: &str, sink: impl Write) -> std::io::Result<()> {
    encode(&range::draw(image, name), sink)
}

/// Draws outlines with their numbers over the shaded part, with a legend, and writes it as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_outlines(
    image: &RangeImage,
    notes: &[OutlineNote],
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&outlines::draw(image, notes, name), sink)
}

/// Draws the regions over the shaded part, with trim loops, vertices, numbers and a
/// legend, and writes it as PNG. Background and crumbs have colours of their own.
///
/// # Errors
/// What the sink reports.
pub fn write_regions(
    image: &RangeImage,
    outcome: &Outcome,
    notes: &[RegionNote],
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&regions::draw(image, outcome, notes, name), sink)
}

/// Draws how far the nodes lie off the trimmed faces, along the normals of these, and writes it as
/// PNG: red where they lie towards the camera, blue behind, grey where there is no face.
///
/// # Errors
/// What the sink reports.
pub fn write_residuals(
    image: &RangeImage,
    outcome: &Outcome,
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    let deviations = Deviations::of(image, outcome);
    let model = &outcome.reconstruction.model;
    let drawn = residuals::draw(image, &deviations, model, name);
    encode(&drawn, sink)
}

/// Draws how far a scan lies off its nominal, with a histogram, and writes it as PNG. What is
/// significantly beyond the limits is outlined, and numbered in the order of the regions.
///
/// # Errors
/// What the sink reports.
pub fn write_deviations(
    image: &RangeImage,
    comparison: &Comparison,
    tolerance: Option<Tolerance>,
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&deviations::draw(image, comparison, tolerance, name), sink)
}

/// Draws how far the nodes lie off a surface along z (`deviations`: millimetres, column by
/// column, NaN where there is none, and the tolerance, which is where the colours end), and
/// writes it as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_off_surface(
    image: &RangeImage,
    (deviations_mm, tolerance_mm): (&[f64], f64),
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(
        &heights::off_surface(image, deviations_mm, tolerance_mm, name),
        sink,
    )
}

/// Draws lines of equal z this far apart, and writes them as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_contours(
    image: &RangeImage,
    step_mm: f64,
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&heights::contours(image, step_mm, name), sink)
}

/// Draws the curvature of the grid, 1/mm, in colours that end at `limit`, and writes it as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_curvature(
    image: &RangeImage,
    limit: f64,
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&heights::curvatures(image, limit, name), sink)
}

/// The curvature, 1/mm, that all but the most curved nodes stay below.
#[must_use]
pub fn curvature_limit(image: &RangeImage) -> f64 {
    heights::curvature_limit(image)
}

/// The least of 1, 2 and 5 times a power of ten that is not below `step`; 1 for what is no
/// positive number.
#[must_use]
pub fn round_step(step: f64) -> f64 {
    if !(step > 0.0 && step.is_finite()) {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(step)));
    let mut steps = [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power);
    steps.find(|s| *s >= step * 0.999_999).unwrap_or(step)
}

/// Draws how far a machined surface lies above its model, which the image has in the place of
/// heights, and writes it as PNG: blue where too much is gone, red where something is left.
///
/// # Errors
/// What the sink reports.
pub fn write_machined(
    deviations: &RangeImage,
    name: &str,
    subtitle: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&machined::draw(deviations, name, subtitle), sink)
}

/// Draws skinned sections beside each other, data and curve, and writes them as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_sections(skin: &Skin, name: &str, sink: impl Write) -> std::io::Result<()> {
    encode(&sections::sections(skin, name), sink)
}

/// Draws how far the data points of each section are from the surface, and were before knots were
/// removed if that is known, and writes it as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_section_deviations(
    skin: &Skin,
    tolerance_mm: f64,
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&sections::deviations(skin, tolerance_mm, name), sink)
}

/// Draws the share of inliers among the samples around each node, ready to be written as
/// PNG; `None` where the image says nothing of its nodes' quality.
#[must_use]
pub fn inliers(image: &RangeImage, name: &str) -> Option<Picture> {
    inliers::draw(image, name).map(Picture)
}

/// A picture that is drawn but not written.
pub struct Picture(Canvas);

impl Picture {
    /// Writes it as PNG.
    ///
    /// # Errors
    /// What the sink reports.
    pub fn write(&self, sink: impl Write) -> std::io::Result<()> {
        encode(&self.0, sink)
    }
}

fn encode(canvas: &Canvas, sink: impl Write) -> std::io::Result<()> {
    let side = |pixels: usize| u32::try_from(pixels).map_err(std::io::Error::other);
    let mut encoder = png::Encoder::new(sink, side(canvas.width())?, side(canvas.height())?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let write = || {
        let mut writer = encoder.write_header()?;
        writer.write_image_data(canvas.pixels())?;
        writer.finish()
    };
    // Its own conversion would hide of which kind an error of the sink is.
    write().map_err(|error| match error {
        png::EncodingError::IoError(error) => error,
        other => std::io::Error::other(other),
    })
}

#[cfg(test)]
mod tests {
    use std::io::{self, ErrorKind};

    use super::*;

    struct Full;

    impl Write for Full {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(ErrorKind::StorageFull.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn an_error_of_the_sink_keeps_its_kind() {
        let canvas = Canvas::new(8, 8, [0; 3]);
        assert_eq!(
            encode(&canvas, Full).unwrap_err().kind(),
            ErrorKind::StorageFull
        );
    }
}
