//! Holes of the part's range image closed, where they are no openings.

use gaps::{Closed, Gap, Sight};
use range_image::RangeImage;

use crate::background::{NodeRole, crumbs};
use crate::columns::Columns;
use crate::observer::Observer;
use crate::part::Part;
use crate::process::PipelineError;
use crate::settings::Settings;
use crate::{FillMode, FillSettings, Method};

/// What became of the holes of a range image.
#[derive(Debug, Clone, PartialEq)]
pub struct Filling {
    /// What was asked for.
    pub settings: FillSettings,
    /// Nodes that were given values, ascending, in the order of [`RangeImage::raw_z_mm`].
    pub filled: Vec<usize>,
    /// Every hole, and what was decided about it.
    pub gaps: Vec<Gap>,
}

/// Closes holes of the part, if that is asked for; `warnings` are for the user.
pub(crate) fn fill(
    image: &RangeImage,
    part: &mut Part,
    columns: Option<&dyn Columns>,
    settings: &Settings,
    warnings: &mut Vec<String>,
    observer: &dyn Observer,
) -> Result<Option<Filling>, PipelineError> {
    if settings.fill.mode == FillMode::Off || settings.method() != Method::Relief {
        return Ok(None);
    }
    let sight = Sight {
        image: part.image.as_ref().unwrap_or(image),
        measured: image,
        camera_mm: columns.and_then(Columns::camera_mm),
        step_mm: settings.segment.step_factor * image.pitch_mm(),
        noise_mm: image.noise_mm().unwrap_or(0.0),
    };
    let mut visit = columns.map(|columns| {
        |take: &mut dyn FnMut(&range_image::Column) -> bool| {
            columns.visit(take).map_err(PipelineError::ReadAgain)
        }
    });
    let visit = visit.as_mut().map(|visit| visit as &mut gaps::Visit<'_, _>);
    let closed = gaps::close(&sight, &part.regions, &settings.fill, visit, observer)?;
    let Closed {
        image: filled_image,
        regions,
        filled,
        gaps,
        warnings: told,
    } = closed;
    warnings.extend(told);
    if !filled.is_empty() {
        for node in &filled {
            if let Some(role) = part.roles.get_mut(*node) {
                *role = NodeRole::Filled;
            }
        }
        part.crumbs = crumbs(image, &part.roles);
        part.regions = regions;
        part.image = Some(filled_image);
    }
    Ok(Some(Filling {
        settings: settings.fill.clone(),
        filled,
        gaps,
    }))
}
