//! Columns that can be gone through more than once.

use range_image::Column;

/// What goes wrong when columns are read again.
pub type ReadAgainError = Box<dyn core::error::Error + Send + Sync>;

/// The columns of a scan, to be gone through as often as needed: the range image says where
/// surfaces are, the samples then say exactly how they run. They may be in memory or not; they
/// are gone through while another thread makes the model.
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
