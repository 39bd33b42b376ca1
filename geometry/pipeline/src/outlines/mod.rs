//! Where regions have samples, and where they would have them if they went on.
//!
//! The nodes tell of an outline to half a pitch. The samples beside it, and those that are
//! missing beyond it, tell more: between a column's last sample and the place of the next one
//! lies the outline, in every column that it crosses.

mod lane;
mod nodes;
mod owner;

use range_image::{Monitor, RangeImage, RegionMap};
use reconstruct::OutlineSample;

use crate::columns::Columns;
use crate::process::PipelineError;
use lane::Lane;
pub use nodes::SettledNodes;
pub(crate) use nodes::settle_nodes;
use owner::Owners;

/// Columns to either side of a sample in which a missing one is looked for.
const BESIDE: usize = 2;

/// The samples beside the outlines of all regions, present and missing.
///
/// # Errors
/// Cancelled, or the columns cannot be read again.
pub(crate) fn samples(
    image: &RangeImage,
    regions: &RegionMap,
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<Vec<OutlineSample>, PipelineError> {
    let owners = Owners::new(image, regions);
    let mut lanes: Vec<Lane> = Vec::new();
    let mut go_on = Ok(());
    columns
        .visit(&mut |column| {
            lanes.push(Lane::of(column, &owners));
            go_on = monitor.check();
            go_on.is_ok()
        })
        .map_err(PipelineError::ReadAgain)?;
    go_on?;
    lanes.sort_by(|a, b| a.x_mm.total_cmp(&b.x_mm));
    let mut all = Vec::new();
    for (k, lane) in lanes.iter().enumerate() {
        monitor.check()?;
        lane.tell(&mut all);
        let before = (1..=BESIDE).map_while(|step| k.checked_sub(step));
        let after = k + 1..(k + 1 + BESIDE).min(lanes.len());
        let sides: [&mut dyn Iterator<Item = usize>; 2] = [&mut { before }, &mut { after }];
        for side in sides {
            lane.tell_missing(&mut side.map(|beside| &lanes[beside]), &mut all);
        }
    }
    Ok(all)
}
