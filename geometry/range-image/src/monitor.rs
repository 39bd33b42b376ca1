//! How a long computation reports progress and learns that it is no longer wanted.

/// What a long operation is handed by its caller.
pub trait Monitor: Sync {
    /// True once the caller has lost interest; asked often, so it must be cheap.
    fn is_cancelled(&self) -> bool;

    /// Told the share that is done, 0 to 1, never decreasing within one operation.
    fn progress(&self, fraction: f64);

    /// `Err` once cancelled, for use with `?`.
    ///
    /// # Errors
    /// [`Cancelled`] when [`Monitor::is_cancelled`] is true.
    fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }
}

/// Runs to the end and tells nobody.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unmonitored;

impl Monitor for Unmonitored {
    fn is_cancelled(&self) -> bool {
        false
    }

    fn progress(&self, _fraction: f64) {}
}

/// The operation was given up because its caller asked for that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;
