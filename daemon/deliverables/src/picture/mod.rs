//! Pictures of a scan, as PNG.

mod canvas;
mod plot;
mod range;
mod regions;

use std::io::Write;

use range_image::{RangeImage, RegionMap};
use reconstruct::Model;

use canvas::Canvas;

pub use regions::RegionNote;

/// Draws the range image with a colour scale in millimetres and writes it as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_range(image: &RangeImage, name: &str, sink: impl Write) -> std::io::Result<()> {
    encode(&range::draw(image, name), sink)
}

/// Draws the regions over the shaded part, with trim loops, vertices, numbers and a
/// legend, and writes it as PNG.
///
/// # Errors
/// What the sink reports.
pub fn write_regions(
    image: &RangeImage,
    regions: &RegionMap,
    model: &Model,
    notes: &[RegionNote],
    name: &str,
    sink: impl Write,
) -> std::io::Result<()> {
    encode(&regions::draw(image, regions, model, notes, name), sink)
}

fn encode(canvas: &Canvas, sink: impl Write) -> std::io::Result<()> {
    let side = |pixels: usize| u32::try_from(pixels).map_err(std::io::Error::other);
    let mut encoder = png::Encoder::new(sink, side(canvas.width())?, side(canvas.height())?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(canvas.pixels())?;
    writer.finish()?;
    Ok(())
}
