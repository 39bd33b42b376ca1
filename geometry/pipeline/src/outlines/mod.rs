//! Where regions have samples, and where they would have them if they went on.
//!
//! The nodes tell of an outline to half a pitch. The samples beside it, and those that are
//! missing beyond it, tell more: between a column's last sample and the place of the next one
//! lies the outline, in every column that it crosses.

mod lane;
mod nodes;
mod owner;

use range_image::{Column, Monitor, RangeImage, RegionMap};
use reconstruct::OutlineSample;

use crate::columns::{Columns, each};
use crate::process::PipelineError;
use lane::Lane;
pub use nodes::SettledNodes;
pub(crate) use nodes::settle_nodes;
use owner::Owners;
pub(crate) use owner::Removed;

/// Columns to either side of a sample in which a missing one is looked for.
const BESIDE: usize = 2;

/// Samples near outlines beyond which none is told of: so ragged is no part, and to look at all
/// of them would take long.
const MOST: usize = 500_000;

/// The samples beside the outlines of all regions, present and missing; `None` where there are too
/// many of them.
///
/// # Errors
/// Cancelled, or the columns cannot be read again.
pub(crate) fn samples(
    image: &RangeImage,
    regions: &RegionMap,
    removed: Option<Removed<'_>>,
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<OutlineSample>>, PipelineError> {
    let owners = Owners::new(image, regions, removed);
    let mut lanes: Vec<Lane> = Vec::new();
    let mut entries = 0;
    let mut go_on = Ok(());
    let of = |column: &Column| Lane::of(column, &owners);
    each(columns, of, |lane| {
        entries += lane.entries();
        lanes.push(lane);
        go_on = monitor.check();
        go_on.is_ok() && entries <= MOST
    })
    .map_err(PipelineError::ReadAgain)?;
    go_on?;
    if entries > MOST {
        return Ok(None);
    }
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
    Ok(Some(all))
}

#[cfg(test)]
mod tests {
    use range_image::{GridColumn, Lattice, RangeImageBuilder, Sample, Unmonitored};

    use super::*;
    use crate::columns::InMemory;

    /// What is told of a strip of six rows, by so many columns of samples.
    fn told(columns: u32) -> Option<Vec<OutlineSample>> {
        let mut builder = RangeImageBuilder::new(Lattice { pitch_mm: 1.0 });
        for i in 0..100 {
            builder.push(GridColumn {
                i,
                j_first: 0,
                z_mm: vec![5.0; 6],
                quality: Vec::new(),
            });
        }
        let image = builder.finish();
        let regions = RegionMap::new(&image, vec![1; 600]);
        let columns: Vec<Column> = (0..columns)
            .map(|k| {
                let samples = (0..500).map(|n| Sample {
                    y_mm: 0.01 * f64::from(n),
                    z_mm: 5.0,
                    intensity: 200,
                });
                Column::new(99.0 * f64::from(k) / f64::from(columns), samples.collect())
            })
            .collect();
        let scan = InMemory {
            columns: &columns,
            camera_mm: None,
        };
        samples(&image, &regions, None, &scan, &Unmonitored).unwrap()
    }

    #[test]
    fn more_than_can_be_looked_at_tells_nothing() {
        let some = told(20).expect("few enough");
        let missing = |sample: &OutlineSample| sample.seen == reconstruct::Seen::Missing;
        assert!(some.iter().any(missing));
        assert!(told(1_010).is_none());
    }
}
