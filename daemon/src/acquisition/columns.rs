//! A column as the driver gives it and as the journal keeps it: the same words, since neither
//! crate knows the other.

use scan_record::{RawColumn, RawSample};

/// The driver's column as the journal keeps it.
pub(super) fn kept(column: scanner_driver::RawColumn) -> RawColumn {
    RawColumn {
        index: column.index,
        table_counts: column.table_counts,
        dropouts: column.dropouts,
        samples: column
            .samples
            .into_iter()
            .map(|sample| RawSample {
                lateral_counts: sample.lateral_counts,
                range_counts: sample.range_counts,
                intensity: sample.intensity,
                saturated: sample.saturated,
            })
            .collect(),
    }
}

/// The journal's column as the driver gave it.
pub(super) fn measured(column: RawColumn) -> scanner_driver::RawColumn {
    scanner_driver::RawColumn {
        index: column.index,
        table_counts: column.table_counts,
        dropouts: column.dropouts,
        samples: column
            .samples
            .into_iter()
            .map(|sample| scanner_driver::RawSample {
                lateral_counts: sample.lateral_counts,
                range_counts: sample.range_counts,
                intensity: sample.intensity,
                saturated: sample.saturated,
            })
            .collect(),
    }
}
