//! A scan that the program was in when it last ended, as far as its columns are kept.

use std::time::Duration;

use scanner_protocol::{Calibration, Identity, ScanPlan, Text};

use super::overlap::Kept;
use crate::error::ScannerError;
use crate::limits::MAX_OVERLAP;
use crate::scanner::{RawColumn, ScanInfo};

/// What the columns of one scan have in common: who measured them, in which counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnSource {
    /// Name of the scanner's model.
    pub model: Text,
    /// Its serial number.
    pub serial: Text,
    /// What its counts mean.
    pub calibration: Calibration,
}

impl ColumnSource {
    /// This scanner, as it is now.
    #[must_use]
    pub fn of(identity: &Identity) -> Self {
        Self {
            model: identity.model.clone(),
            serial: identity.serial.clone(),
            calibration: identity.calibration.clone(),
        }
    }

    /// Why columns of `other` do not belong to those of this one.
    pub(super) fn other_than(&self, other: &Self) -> Option<ScannerError> {
        if (&self.model, &self.serial) != (&other.model, &other.serial) {
            Some(ScannerError::OtherScanner {
                wanted: format!("{} {}", self.model, self.serial),
                found: format!("{} {}", other.model, other.serial),
            })
        } else if self.calibration != other.calibration {
            Some(ScannerError::OtherCalibration)
        } else {
            None
        }
    }
}

/// A scan that the program was in when it last ended. Its columns are gone through once, and
/// only those that are measured again are held.
#[derive(Debug, Clone)]
pub struct InterruptedScan {
    pub(super) source: ColumnSource,
    pub(super) plan: ScanPlan,
    pub(super) info: ScanInfo,
    pub(super) kept: Kept,
    pub(super) columns: u32,
    /// How long, at most, nothing has been measured.
    pub silent: Duration,
    /// Why a person has to say that it may go on, however short the silence.
    pub waits_for: Option<String>,
}

impl InterruptedScan {
    /// One of which no column is kept yet: what it was to be, and what the device said when it
    /// accepted it.
    #[must_use]
    pub fn new(source: ColumnSource, plan: ScanPlan, info: ScanInfo) -> Self {
        Self {
            source,
            plan,
            info,
            kept: Kept::default(),
            columns: 0,
            silent: Duration::ZERO,
            waits_for: None,
        }
    }

    /// Adds the next column that is safe.
    ///
    /// # Errors
    /// [`ScannerError::NotTakenUp`] if it is not the next, or one more than there are.
    pub fn add(&mut self, column: RawColumn) -> Result<(), ScannerError> {
        if column.index != self.columns || self.columns >= self.info.columns {
            return Err(ScannerError::NotTakenUp(format!(
                "column {} cannot be the next of a scan of {} columns, {} of which are kept",
                column.index, self.info.columns, self.columns
            )));
        }
        self.columns += 1;
        self.kept.push(column, MAX_OVERLAP);
        Ok(())
    }

    /// What was asked of the device.
    #[must_use]
    pub fn plan(&self) -> ScanPlan {
        self.plan
    }

    /// What the device said when it accepted the scan.
    #[must_use]
    pub fn info(&self) -> ScanInfo {
        self.info
    }

    /// Columns that are kept.
    #[must_use]
    pub fn columns(&self) -> u32 {
        self.columns
    }
}
