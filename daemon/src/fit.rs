//! Whether a grid is of a sensible size for a scan that is read column by column.
//!
//! A single stray point far from the part, or a slip in a setting, would ask for more memory
//! and time than there is.

use std::path::Path;

use pipeline::Extent;
use range_image::Column;
use regrid::{RegridSettings, Roi};

/// What is known so far of a scan's extent, beside the grid it shall have.
#[derive(Debug)]
pub(crate) struct Fit {
    roi: Roi,
    pitch_mm: f64,
    /// Those to come included.
    most_samples: usize,
    extent: Option<Extent>,
}

impl Fit {
    /// Of a scan that has at most so many samples.
    pub(crate) fn new(settings: &RegridSettings, most_samples: usize) -> Self {
        Self {
            roi: settings.roi,
            pitch_mm: settings.pitch_mm,
            most_samples,
            extent: None,
        }
    }

    /// Of a scan that has as many samples as its journal has room for.
    pub(crate) fn of_journal(settings: &RegridSettings, journal: &Path) -> Self {
        let bytes = std::fs::metadata(journal).map_or(0, |metadata| metadata.len());
        let most_samples = usize::try_from(bytes).unwrap_or(usize::MAX) / scan_record::SAMPLE_BYTES;
        Self::new(settings, most_samples)
    }

    /// Takes the next column into account.
    pub(crate) fn add(&mut self, column: &Column) {
        let more = Extent::within(std::slice::from_ref(column), &self.roi);
        self.extent = match (self.extent, more) {
            (Some(extent), Some(more)) => Some(extent.joined(more)),
            (extent, more) => extent.or(more),
        };
    }

    /// The grid is too fine, whatever the columns to come.
    pub(crate) fn is_missed(&self) -> bool {
        self.extent.is_some_and(|extent| {
            let most = self.most_samples.max(extent.samples());
            self.pitch_mm < extent.finest_pitch_among_mm(most)
        })
    }

    /// What is wrong, and what to do, in words that follow the scan's name.
    pub(crate) fn told(&self) -> Option<(String, String)> {
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
