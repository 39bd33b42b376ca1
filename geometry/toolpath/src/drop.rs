//! Many places at once.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::cutter::Cutter;
use crate::facet::Contact;
use crate::surface::Surface;

/// Places between two looks at whether the result is still wanted.
const CHUNK: usize = 1024;

/// Lowers a cutter at every place, in parallel; each place has its own answer, whatever the number
/// of threads.
///
/// # Errors
/// [`Cancelled`]
pub fn drop_cutter(
    surface: &Surface,
    cutter: &Cutter,
    places_mm: &[[f64; 2]],
    monitor: &dyn Monitor,
) -> Result<Vec<Option<Contact>>, Cancelled> {
    let mut found = vec![None; places_mm.len()];
    found
        .par_chunks_mut(CHUNK)
        .zip(places_mm.par_chunks(CHUNK))
        .try_for_each(|(found, places)| {
            monitor.check()?;
            for (slot, place) in found.iter_mut().zip(places) {
                *slot = surface.drop_cutter(cutter, *place);
            }
            Ok(())
        })?;
    Ok(found)
}
