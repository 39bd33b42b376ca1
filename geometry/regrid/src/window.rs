//! The columns that the nodes of one grid column may draw on.

use crate::settings::RegridSettings;
use crate::strip::{Strip, lower_median, typical};

/// Within a window the local sample spacing is believed up to this many times the median
/// one, which bounds the area a node has to look at.
const SPACING_LIMIT: f64 = 4.0;
/// It is also believed only up to this many times the spacing for which the pitch would be
/// about right. Where a window holds stray samples alone, their distances say nothing.
const PITCH_LIMIT: f64 = 4.0;
/// A node's window may show samples to be thinner than their distances along columns say,
/// up to this factor.
const WIDENING_LIMIT: f64 = 2.0;

/// Columns within reach of a grid column, and what follows from them for all its nodes.
#[derive(Debug)]
pub(crate) struct Window<'a> {
    /// In ascending x: up to `reach_columns` on each side of the grid column, and one at
    /// its very x.
    pub(crate) strips: &'a [Strip],
    /// Typical distance of neighbouring columns, millimetres.
    pub(crate) column_spacing_mm: f64,
    /// Greatest local sample spacing believed, millimetres.
    pub(crate) greatest_sample_spacing_mm: f64,
    /// How far in y a node's window reaches, millimetres.
    pub(crate) reach_y_mm: f64,
}

impl<'a> Window<'a> {
    /// The window of the columns of which `strips` is a part that goes far enough, in
    /// ascending x. `None` where no plane could be found: fewer than two columns, or no
    /// two samples in any of them.
    pub(crate) fn new(
        strips: &'a [Strip],
        x_mm: f64,
        settings: &RegridSettings,
        scratch: &mut Vec<f64>,
    ) -> Option<Self> {
        let strips = around(strips, settings.reach_columns, x_mm);
        scratch.clear();
        scratch.extend(strips.windows(2).map(|pair| pair[1].x_mm - pair[0].x_mm));
        // In an order that a mirrored scan shares, so that the sum is the same.
        scratch.sort_unstable_by(f64::total_cmp);
        let column_spacing_mm = typical(scratch)?;
        scratch.clear();
        for strip in strips {
            let heights = strip.samples.windows(2).map(|pair| pair[1].0 - pair[0].0);
            scratch.extend(heights.filter(|gap| *gap > 0.0));
        }
        let pitch_mm = settings.pitch_mm;
        let suited_mm = (pitch_mm * pitch_mm / column_spacing_mm)
            .max(pitch_mm)
            .max(column_spacing_mm);
        let limit_mm = PITCH_LIMIT * suited_mm;
        let sample_spacing_mm = lower_median(scratch)?.min(limit_mm);
        Some(Self {
            strips,
            column_spacing_mm,
            greatest_sample_spacing_mm: (SPACING_LIMIT * sample_spacing_mm).min(limit_mm),
            reach_y_mm: settings.reach_columns as f64 * column_spacing_mm.max(sample_spacing_mm),
        })
    }

    /// The unit of support lengths in x and y where samples are this far apart in a column.
    pub(crate) fn spacing(&self, sample_spacing_mm: f64) -> Spacing {
        let mean_mm = (self.column_spacing_mm * sample_spacing_mm).sqrt();
        Spacing {
            mean_mm,
            x_mm: mean_mm.max(self.column_spacing_mm),
            y_mm: mean_mm.max(0.5 * sample_spacing_mm),
        }
    }

    /// The greatest unit that any node of this window may have.
    pub(crate) fn greatest_spacing(&self) -> Spacing {
        self.spacing(self.greatest_sample_spacing_mm)
    }

    /// The spacing widened to this mean one, within the window's limits. Columns made from
    /// a cloud may be full in one place and empty beside it, which distances along the full
    /// ones do not show.
    pub(crate) fn widened(&self, spacing: Spacing, mean_mm: f64) -> Spacing {
        let limit_mm = (WIDENING_LIMIT * spacing.mean_mm).min(self.greatest_spacing().mean_mm);
        let mean_mm = mean_mm.min(limit_mm).max(spacing.mean_mm);
        Spacing {
            mean_mm,
            x_mm: spacing.x_mm.max(mean_mm),
            y_mm: spacing.y_mm.max(mean_mm),
        }
    }
}

/// The strips nearest to this x, up to so many on either side and one at that very x, of strips in
/// ascending x.
pub(crate) fn around(strips: &[Strip], number: usize, x_mm: f64) -> &[Strip] {
    let left = strips.partition_point(|s| s.x_mm < x_mm);
    let right = strips.partition_point(|s| s.x_mm <= x_mm);
    let end = right.saturating_add(number).min(strips.len());
    &strips[left.saturating_sub(number)..end]
}

/// Local spacing of samples, millimetres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spacing {
    /// Side of the square that holds one sample on average.
    pub(crate) mean_mm: f64,
    /// Unit of support lengths in x.
    pub(crate) x_mm: f64,
    /// Unit of support lengths in y.
    pub(crate) y_mm: f64,
}
