//! Whether a grid is of a sensible size for a scan that is read column by column.
//!
//! A single stray point far from the part, or a slip in a setting, would ask for more memory
//! and time than there is.

use std::path::Path;

use pipeline::Extent;
use range_image::Column;
use regrid::{RegridSettings, Roi};

/// What is known so far of a scan's extent, beside the grid it shall have.
pub(super) struct Fit {
    roi: Roi,
    pitch_mm: f64,
    /// As many as the journal has room for.
    most_samples: usize,
    extent: Option<Extent>,
}

impl Fit {
    pub(super) fn new(settings: &RegridSettings, journal: &Path) -> Self {
        let bytes = std::fs::metadata(journal).map_or(0, |metadata| metadata.len());
        Self {
            roi: settings.roi,
            pitch_mm: settings.pitch_mm,
            most_samples: usize::try_from(bytes).unwrap_or(usize::MAX) / scan_record::SAMPLE_BYTES,
            extent: None,
        }
    }

    /// Takes the next column into account.
    pub(super) fn add(&mut self, column: &Column) {
        let more = Extent::within(std::slice::from_ref(column), &self.roi);
        self.extent = match (self.extent, more) {
            (Some(extent), Some(more)) => Some(extent.joined(more)),
            (extent, more) => extent.or(more),
        };
    }

    /// The grid is too fine, whatever the columns to come.
    pub(super) fn is_missed(&self) -> bool {
        self.extent.is_some_and(|extent| {
            let most = self.most_samples.max(extent.samples());
            self.pitch_mm < extent.finest_pitch_among_mm(most)
        })
    }

    /// What is wrong, and what to do, in words that follow the scan's name.
    pub(super) fn told(&self) -> Option<(String, String)> {
        let extent = self.extent?;
        let [width, height] = extent.sides_mm();
        let error = format!(
            "a grid of {} mm is too fine for its {} samples, which spread over {width:.1} x \
             {height:.1} mm",
            self.pitch_mm,
            extent.samples()
        );
        let hint = format!(
            "if single points lie far from the part, leave them out with regrid.roi_x_mm and \
             regrid.roi_y_mm; else rerun the scan with regrid.pitch_mm={} or more",
            extent.finest_pitch_mm()
        );
        Some((error, hint))
    }
}
