//! Simulated columns without the wire: those that the service would get, bit for bit but for
//! rounding.

use range_image::Sample;
use sim_scanner::scanner::{Column, Scanner};

/// A simulated column as the host sees it: samples without a return are not there.
#[must_use]
pub fn received(scanner: &Scanner, column: &Column) -> range_image::Column {
    let samples = column.samples.iter().filter(|sample| !sample.no_return);
    let samples = samples.map(|sample| {
        let point = scanner.reported_point_mm(column, sample);
        Sample {
            y_mm: point.y,
            z_mm: point.z,
            intensity: sample.intensity,
        }
    });
    range_image::Column::new(scanner.x_mm(column.table_counts), samples.collect())
}
