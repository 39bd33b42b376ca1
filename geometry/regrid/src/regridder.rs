//! Regridding while the scan runs.

use std::collections::VecDeque;

use range_image::{Column, GridColumn, Lattice};

use crate::error::RegridError;
use crate::grid::GridWorker;
use crate::settings::{RegridSettings, SettingsError};
use crate::strip::Strip;

/// Which way the table goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Travel {
    Ascending,
    Descending,
}

impl Travel {
    /// From one column to the next; an error unless x changes, and the same way as before.
    pub(crate) fn check(
        before: Option<Self>,
        previous_mm: f64,
        x_mm: f64,
        index: usize,
    ) -> Result<Self, RegridError> {
        let now = if x_mm > previous_mm {
            Some(Self::Ascending)
        } else if x_mm < previous_mm {
            Some(Self::Descending)
        } else {
            None
        };
        now.filter(|now| before.is_none_or(|before| before == *now))
            .ok_or(RegridError::NotMonotone {
                index,
                x_mm,
                previous_mm,
            })
    }
}

/// Turns columns into grid columns as they come.
///
/// ```
/// use range_image::{Column, Sample};
/// use regrid::{RegridSettings, Regridder};
///
/// let mut regridder = Regridder::new(RegridSettings::with_pitch(1.0))?;
/// let mut grid = Vec::new();
/// for i in 0..40 {
///     let samples = (0..40).map(|j| Sample { y_mm: f64::from(j), z_mm: 2.0, intensity: 255 });
///     grid.extend(regridder.push(Column::new(f64::from(i), samples.collect()))?);
/// }
/// grid.extend(regridder.finish());
/// assert_eq!(grid.len(), 40);
/// assert!(grid.iter().all(|c| c.z_mm == [2.0; 40]));
/// # Ok::<(), regrid::RegridError>(())
/// ```
#[derive(Debug)]
pub struct Regridder {
    settings: RegridSettings,
    worker: GridWorker,
    /// The columns that nodes to come may need, in ascending x.
    strips: VecDeque<Strip>,
    /// Buffers of columns let go of, for those to come.
    spare: Vec<Vec<(f64, f64)>>,
    travel: Option<Travel>,
    /// Columns handed over so far.
    taken: usize,
    /// Lattice index of the next grid column, once it is known.
    next: Option<i64>,
}

impl Regridder {
    /// A regridder for one scan.
    ///
    /// # Errors
    /// [`SettingsError`] when a setting is out of its range.
    pub fn new(settings: RegridSettings) -> Result<Self, SettingsError> {
        settings.validate()?;
        Ok(Self {
            settings,
            worker: GridWorker::default(),
            strips: VecDeque::new(),
            spare: Vec::new(),
            travel: None,
            taken: 0,
            next: None,
        })
    }

    /// Takes the next column and returns the grid columns that are finished with it, in
    /// the direction of travel. A grid column without any value is not returned.
    ///
    /// Columns without samples count in the reach, so hand them over as well. Samples
    /// outside of the region of interest are ignored.
    ///
    /// # Errors
    /// Columns must come in strictly ascending or strictly descending x, with coordinates
    /// within 25 m. After an error the regridder is as it was before the call.
    pub fn push(&mut self, column: Column) -> Result<Vec<GridColumn>, RegridError> {
        let buffer = self.spare.pop().unwrap_or_default();
        let strip = Strip::new(&column, &self.settings, self.taken, buffer)?;
        if let Some(previous) = self.newest_mm() {
            let travel = Travel::check(self.travel, previous, strip.x_mm, self.taken)?;
            self.travel = Some(travel);
        }
        match self.travel {
            Some(Travel::Descending) => self.strips.push_front(strip),
            Some(Travel::Ascending) | None => self.strips.push_back(strip),
        }
        self.taken += 1;
        Ok(self.advance(false))
    }

    /// The grid columns that are still open at the end of the scan.
    #[must_use]
    pub fn finish(mut self) -> Vec<GridColumn> {
        self.advance(true)
    }

    /// Number of columns kept for nodes to come: what memory depends on. At most twice the
    /// reach and one, however long the scan.
    #[must_use]
    pub fn retained_columns(&self) -> usize {
        self.strips.len()
    }

    /// Number of samples in the columns kept.
    #[must_use]
    pub fn retained_samples(&self) -> usize {
        self.strips.iter().map(|s| s.samples.len()).sum()
    }

    /// Finishes grid columns that no column to come can change, or all of them.
    fn advance(&mut self, all: bool) -> Vec<GridColumn> {
        let mut finished = Vec::new();
        // Without a direction there is one column at most, which spans no plane.
        let Some(travel) = self.travel else {
            return finished;
        };
        let reach = self.settings.reach_columns;
        // In the frame of travel x always ascends.
        let along = |x: f64| match travel {
            Travel::Ascending => x,
            Travel::Descending => -x,
        };
        let lattice = Lattice {
            pitch_mm: self.settings.pitch_mm,
        };
        let Some(newest) = self.newest_mm() else {
            return finished;
        };
        let mut next = match self.next {
            Some(next) => next,
            None => {
                // The first column and those within its reach say how far before it nodes
                // may have a value.
                if self.strips.len() <= reach && !all {
                    return finished;
                }
                let first = self.oldest_mm(travel).unwrap_or(newest);
                let margin = self.margin_mm(first);
                let start = lattice.first_at_or_above(along(first) - margin);
                self.next = Some(start);
                start
            }
        };
        let last = if all {
            let margin = self.margin_mm(newest);
            lattice.last_at_or_below(along(newest) + margin)
        } else {
            i64::MAX
        };
        while next <= last {
            let x_along = lattice.line_mm(next);
            let is_beyond = |s: &&Strip| along(s.x_mm) > x_along;
            if self.strips.iter().filter(is_beyond).count() < reach && !all {
                break;
            }
            let i = match travel {
                Travel::Ascending => next,
                Travel::Descending => -next,
            };
            let strips = self.strips.make_contiguous();
            finished.extend(self.worker.column(strips, i, &self.settings));
            next += 1;
            self.next = Some(next);
        }
        let passed = |s: &&Strip| along(s.x_mm) < lattice.line_mm(next);
        let passed = self.strips.iter().filter(passed).count();
        self.release(travel, passed);
        finished
    }

    /// Lets go of columns out of the reach of all nodes to come, which have passed so many.
    fn release(&mut self, travel: Travel, passed: usize) {
        // One more than the reach, so that the newest column never goes without those
        // within its reach: should it be the last, they tell how far the grid goes.
        let surplus = passed.saturating_sub(self.settings.reach_columns + 1);
        for _ in 0..surplus {
            let oldest = match travel {
                Travel::Ascending => self.strips.pop_front(),
                Travel::Descending => self.strips.pop_back(),
            };
            self.spare.extend(oldest.map(|strip| strip.samples));
        }
    }

    /// x of the column that came last.
    fn newest_mm(&self) -> Option<f64> {
        let newest = match self.travel {
            Some(Travel::Descending) => self.strips.front(),
            Some(Travel::Ascending) | None => self.strips.back(),
        };
        newest.map(|s| s.x_mm)
    }

    /// x of the column that has been kept the longest.
    fn oldest_mm(&self, travel: Travel) -> Option<f64> {
        let oldest = match travel {
            Travel::Ascending => self.strips.front(),
            Travel::Descending => self.strips.back(),
        };
        oldest.map(|s| s.x_mm)
    }

    fn margin_mm(&mut self, x_mm: f64) -> f64 {
        let strips = self.strips.make_contiguous();
        let margin = self.worker.margin_mm(strips, x_mm, &self.settings);
        margin.unwrap_or(0.0)
    }
}
