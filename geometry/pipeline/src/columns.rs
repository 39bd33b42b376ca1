//! Columns that can be gone through more than once.

use range_image::Column;
use rayon::prelude::*;
use regrid::Roi;

/// What goes wrong when columns are read again.
pub type ReadAgainError = Box<dyn core::error::Error + Send + Sync>;

/// The columns of a scan, to be gone through as often as needed: the range image says where
/// surfaces are, the samples then say exactly how they run and where they end. They may be in memory
/// or not; they are gone through while another thread makes the model, and once it is made.
pub trait Columns: Sync {
    /// Hands every column to `take`, in their order, until one is refused with `false`.
    ///
    /// # Errors
    /// Whatever prevents it, as where columns are read from a file that has gone.
    fn visit(&self, take: &mut dyn FnMut(&Column) -> bool) -> Result<(), ReadAgainError>;

    /// Where in its own plane a column's rays come from, y and z in millimetres, if that is
    /// known; they run along z otherwise.
    fn camera_mm(&self) -> Option<[f64; 2]> {
        None
    }
}

/// Columns that threads share out among them at a time.
const AT_ONCE: usize = 128;

/// Makes something `of` each column, and hands it to `take` in the order of the columns, until one is
/// refused with `false`.
///
/// # Errors
/// As [`Columns::visit`].
pub(crate) fn each<T: Send>(
    columns: &dyn Columns,
    of: impl Fn(&Column) -> T + Sync,
    mut take: impl FnMut(T) -> bool,
) -> Result<(), ReadAgainError> {
    let mut waiting: Vec<Column> = Vec::with_capacity(AT_ONCE);
    let mut goes_on = true;
    let mut hand_over = |waiting: &mut Vec<Column>| {
        let made: Vec<T> = waiting.par_iter().map(&of).collect();
        waiting.clear();
        made.into_iter().all(&mut take)
    };
    columns.visit(&mut |column| {
        waiting.push(column.clone());
        if waiting.len() == AT_ONCE {
            goes_on = hand_over(&mut waiting);
        }
        goes_on
    })?;
    if goes_on {
        hand_over(&mut waiting);
    }
    Ok(())
}

/// Columns as far as they lie in the region of interest: what lies outside of it is not there.
pub(crate) struct Within<'a> {
    pub(crate) columns: &'a dyn Columns,
    pub(crate) roi: Roi,
}

impl Columns for Within<'_> {
    fn visit(&self, take: &mut dyn FnMut(&Column) -> bool) -> Result<(), ReadAgainError> {
        if self.roi == Roi::default() {
            return self.columns.visit(take);
        }
        let within = |value: f64, (low, high): (f64, f64)| low <= value && value <= high;
        self.columns.visit(&mut |column| {
            let is_there = within(column.x_mm(), self.roi.x_mm);
            let samples = column.samples().iter().filter(|sample| {
                is_there && within(sample.y_mm, self.roi.y_mm) && within(sample.z_mm, self.roi.z_mm)
            });
            take(&Column::new(column.x_mm(), samples.copied().collect()))
        })
    }

    fn camera_mm(&self) -> Option<[f64; 2]> {
        self.columns.camera_mm()
    }
}

/// A whole scan in memory.
#[derive(Debug, Clone, Copy)]
pub struct InMemory<'a> {
    /// Its columns.
    pub columns: &'a [Column],
    /// As [`Columns::camera_mm`].
    pub camera_mm: Option<[f64; 2]>,
}

impl Columns for InMemory<'_> {
    fn visit(&self, take: &mut dyn FnMut(&Column) -> bool) -> Result<(), ReadAgainError> {
        self.columns.iter().all(take);
        Ok(())
    }

    fn camera_mm(&self) -> Option<[f64; 2]> {
        self.camera_mm
    }
}
