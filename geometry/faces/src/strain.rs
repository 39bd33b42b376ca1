//! Shapes that are no more than near to what they are fitted to.

use shapes::{Fit, Sample};

use crate::field::Field;

/// Blocks of nodes that are looked at, to either side of their middle, and fewest samples of one.
const BLOCKS: [usize; 2] = [2, 5];
const FEWEST: usize = 8;
/// Standard errors by which a block lies off a shape if it is of another.
const STRAYED: f64 = 4.0;
/// Samples count as off up to so many deviations.
const MOST_OFF: f64 = 3.0;
/// A shape about which samples deviate by more than this is one of no surface, and says nothing of
/// their noise.
const MOST_DEVIATION: f64 = 2.0;
/// Blocks off that make a set one of several surfaces.
const MOST_STRAYED: usize = 2;

/// Whether neighbouring samples of a set lie to one side of a shape together, in several places.
pub(crate) fn is_strained(field: &Field<'_>, fit: &Fit, set: &[bool]) -> bool {
    let offs = |samples: &[Sample]| fit.offs(samples).collect();
    are_strained(field, set, fit.deviation(), &offs)
}

/// The same of any surface that tells how far samples lie off it, and deviate, in their standard
/// deviations.
pub(crate) fn are_strained(
    field: &Field<'_>,
    set: &[bool],
    deviation: f64,
    offs: &dyn Fn(&[Sample]) -> Vec<f64>,
) -> bool {
    let strayed = |half: &usize| strayed(field, set, *half, deviation, offs);
    BLOCKS
        .iter()
        .map(strayed)
        .any(|count| count >= MOST_STRAYED)
}

/// Blocks of nodes whose samples lie off a surface in their mean.
fn strayed(
    field: &Field<'_>,
    set: &[bool],
    half: usize,
    deviation: f64,
    offs: &dyn Fn(&[Sample]) -> Vec<f64>,
) -> usize {
    let step = 2 * half + 1;
    let mut strayed = 0;
    for column in (half..field.columns()).step_by(step) {
        for row in (half..field.rows()).step_by(step) {
            let place = column * field.rows() + row;
            let block = field.around(place, half).filter(|place| set[*place]);
            let samples = field.samples_at(block);
            if samples.len() >= FEWEST {
                let offs = offs(&samples).into_iter();
                let offs = offs.map(|off| off.clamp(-MOST_OFF, MOST_OFF));
                let mean = offs.sum::<f64>() / samples.len() as f64;
                let chance = deviation.min(MOST_DEVIATION) / (samples.len() as f64).sqrt();
                strayed += usize::from(mean.abs() > STRAYED * chance);
            }
        }
    }
    strayed
}
