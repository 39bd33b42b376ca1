//! Pictures of a surface.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use deliverables::{picture, write_atomically};
use surfacing::{HeightGrid, Made, Settings};

use crate::failure::Failure;

/// Contour lines in a picture, about.
const CONTOURS: f64 = 40.0;

/// Draws the deviations, and contours and curvature before and after fairing.
pub(super) fn draw(
    directory: &Path,
    scan: &str,
    grid: &HeightGrid,
    made: &Made,
    settings: &Settings,
) -> Result<Vec<PathBuf>, Failure> {
    let cannot =
        |error: io::Error| Failure::at(format!("cannot draw into {}", directory.display()), &error);
    fs::create_dir_all(directory).map_err(cannot)?;
    let (before, after) = (grid.to_image(), made.data.to_image());
    let (low, high) = before.z_extent_mm().unwrap_or((0.0, 0.0));
    let step_mm = picture::round_step((high - low) / CONTOURS);
    let limit = picture::curvature_limit(&after);
    let mut drawn = Vec::new();
    let mut put = |name: &str, draw: &dyn Fn(&mut dyn io::Write) -> io::Result<()>| {
        let path = directory.join(name);
        write_atomically::<io::Error>(&path, |sink| draw(sink))
            .map_err(|error| Failure::at(format!("cannot draw {}", path.display()), &error))?;
        drawn.push(path);
        Ok::<(), Failure>(())
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
