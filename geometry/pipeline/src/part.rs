//! The part's own regions, apart from what surrounds it.

use range_image::{RangeImage, RegionMap};
use segment::{Background, View};

use crate::background::{BackgroundPolicy, Crumb, NodeRole, crumbs, masked, roles};
use crate::observer::{Observer, Stage};
use crate::process::PipelineError;
use crate::settings::Settings;

/// The part's regions, and what was left out of them.
#[derive(Debug, Clone)]
pub struct Part {
    /// The range image with the background masked; `None` where there is none.
    pub image: Option<RangeImage>,
    /// The regions of the part.
    pub regions: RegionMap,
    /// What was recognised as no part of the part.
    pub background: Background,
    /// What each node of the range image counts as, in the order of its nodes.
    pub roles: Vec<NodeRole>,
    /// What belongs to no region, the largest first.
    pub crumbs: Vec<Crumb>,
}

/// Divides a range image into the regions of the part, apart from what surrounds it.
///
/// Where a background is found, the part is divided once more without it: how much nodes
/// stray is measured in the image, and a table, smoother than the part that stands on it,
/// would have a say in where the part's faces end.
///
/// # Errors
/// [`PipelineError::NoSurface`], what [`segment::segment`] says, or cancelled.
pub fn divide(
    image: &RangeImage,
    view: &View,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Part, PipelineError> {
    observer.stage(Stage::Segment);
    let regions = segment::segment(image, &settings.segment, observer)?;
    if regions.regions() == 0 {
        return Err(PipelineError::NoSurface {
            nodes: image.valid_nodes(),
            pitch_mm: image.pitch_mm(),
        });
    }
    let background = match settings.background {
        BackgroundPolicy::Remove => segment::background(image, &regions, view),
        BackgroundPolicy::Keep => Background::default(),
    };
    observer.check()?;
    let mut roles = roles(image, &regions, &background);
    let mut part = Part {
        image: None,
        regions,
        background,
        roles: Vec::new(),
        crumbs: Vec::new(),
    };
    if !part.background.regions.is_empty() {
        let alone = masked(image, &roles);
        part.regions = segment::segment(&alone, &settings.segment, observer)?;
        if part.regions.regions() == 0 {
            return Err(PipelineError::NoSurface {
                nodes: alone.valid_nodes(),
                pitch_mm: alone.pitch_mm(),
            });
        }
        for (role, &label) in roles.iter_mut().zip(part.regions.raw_labels()) {
            if matches!(role, NodeRole::Part | NodeRole::Crumb) {
                *role = if label == 0 {
                    NodeRole::Crumb
                } else {
                    NodeRole::Part
                };
            }
        }
        part.image = Some(alone);
    }
    part.crumbs = crumbs(image, &roles);
    part.roles = roles;
    Ok(part)
}
