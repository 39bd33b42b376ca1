//! Pictures of a surface.

use std::io;

use surfacing::{HeightGrid, Made, Settings};

use crate::picture;

/// Contour lines in a picture, about.
const CONTOURS: f64 = 40.0;

/// The deviations, and contours and curvature before and after fairing, as PNG with the names of
/// their files.
///
/// # Errors
/// A picture that is too large for its format.
pub fn surface_pictures(
    scan: &str,
    grid: &HeightGrid,
    made: &Made,
    settings: &Settings,
) -> io::Result<Vec<(String, Vec<u8>)>> {
    let (before, after) = (grid.to_image(), made.data.to_image());
    let (low, high) = before.z_extent_mm().unwrap_or((0.0, 0.0));
    let step_mm = picture::round_step((high - low) / CONTOURS);
    let limit = picture::curvature_limit(&after);
    let mut drawn = Vec::new();
    let mut put = |name: &str, draw: &dyn Fn(&mut dyn io::Write) -> io::Result<()>| {
        let mut png = Vec::new();
        draw(&mut png)?;
        drawn.push((name.to_owned(), png));
        io::Result::Ok(())
    };
    put("deviations.png", &|sink| {
        let deviations = (made.deviations_mm.as_slice(), settings.tolerance_mm);
        picture::write_off_surface(&after, deviations, scan, sink)
    })?;
    let is_faired = made.report.fairing.is_some();
    for (image, word, is_wanted) in [(&before, "before", true), (&after, "after", is_faired)] {
        if !is_wanted {
            continue;
        }
        let (ending, title) = if is_faired {
            (format!("-{word}"), format!("{scan}, {word} fairing"))
        } else {
            (String::new(), scan.to_owned())
        };
        put(&format!("contours{ending}.png"), &|sink| {
            picture::write_contours(image, step_mm, &title, sink)
        })?;
        put(&format!("curvature{ending}.png"), &|sink| {
            picture::write_curvature(image, limit, &title, sink)
        })?;
    }
    Ok(drawn)
}
