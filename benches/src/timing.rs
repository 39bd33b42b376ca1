//! Times of two ways to the same end, taken in turns.

use std::hint::black_box;
use std::time::Instant;

/// Turns of which the fastest counts: whatever else the machine does only ever takes time.
const TURNS: usize = 7;

/// Seconds of each way, the fastest of several turns. Turns alternate, so that a machine that
/// slows down slows both.
pub(crate) fn race<A, B>(mut ours: impl FnMut() -> A, mut theirs: impl FnMut() -> B) -> [f64; 2] {
    let mut fastest = [f64::INFINITY; 2];
    for _ in 0..TURNS {
        fastest[0] = fastest[0].min(seconds(&mut ours));
        fastest[1] = fastest[1].min(seconds(&mut theirs));
    }
    fastest
}

/// Seconds of one call.
pub(crate) fn seconds<T>(work: impl FnOnce() -> T) -> f64 {
    let begun = Instant::now();
    black_box(work());
    begun.elapsed().as_secs_f64()
}
