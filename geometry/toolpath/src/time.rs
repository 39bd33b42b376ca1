//! How long it takes.

use crate::machine::Machine;
use crate::motion::{Operation, Travel};

/// Seconds of a tool change, spindle start included.
const TOOL_CHANGE_S: f64 = 15.0;

/// Lengths and times of an operation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Duration {
    /// Length of moves at a feed, millimetres.
    pub cutting_mm: f64,
    /// Length of rapid moves, millimetres.
    pub rapid_mm: f64,
    /// Time of moves at a feed, seconds.
    pub cutting_s: f64,
    /// Time of rapid moves, seconds.
    pub rapid_s: f64,
    /// Time of changing the tool, seconds.
    pub change_s: f64,
}

impl Duration {
    /// Everything together, seconds.
    #[must_use]
    pub fn total_s(&self) -> f64 {
        self.cutting_s + self.rapid_s + self.change_s
    }
}

/// A stretch of the way with the speed that is wanted on it.
struct Stretch {
    length: f64,
    speed: f64,
    start: [f64; 3],
    end: [f64; 3],
    is_rapid: bool,
}

/// Estimates how long an operation takes. With an acceleration, speeds change at that rate along
/// the way, and at a corner the tool is as fast as the cosine of its angle leaves it; without one,
/// at once.
#[must_use]
pub fn duration(machine: &Machine, operation: &Operation) -> Duration {
    let mut stretches = Vec::with_capacity(operation.moves.len());
    let mut from = operation
        .moves
        .first()
        .map_or([0.0; 3], |first| first.to_mm);
    for step in &operation.moves {
        let length = step.length_mm(from);
        if length > 0.0 {
            let is_rapid = step.travel == Travel::Rapid;
            let per_minute = if is_rapid {
                machine.rapid_mm_per_min
            } else {
                step.feed_mm_per_min
            };
            // Directions at the ends, from the chords there.
            let points = step.points_mm(from, 0.01);
            let first = points.first().copied().unwrap_or(step.to_mm);
            let before = points.len().checked_sub(2).and_then(|k| points.get(k));
            stretches.push(Stretch {
                length,
                speed: per_minute / 60.0,
                start: direction(from, first),
                end: direction(before.copied().unwrap_or(from), step.to_mm),
                is_rapid,
            });
        }
        from = step.to_mm;
    }
    let mut total = Duration {
        change_s: TOOL_CHANGE_S,
        ..Duration::default()
    };
    let junctions = junctions(&stretches, machine.acceleration_mm_per_s2);
    for (k, stretch) in stretches.iter().enumerate() {
        let seconds = match machine.acceleration_mm_per_s2 {
            None => stretch.length / stretch.speed,
            Some(rate) => trapezoid(stretch, junctions[k], junctions[k + 1], rate),
        };
        if stretch.is_rapid {
            total.rapid_mm += stretch.length;
            total.rapid_s += seconds;
        } else {
            total.cutting_mm += stretch.length;
            total.cutting_s += seconds;
        }
    }
    total
}

/// Speeds between stretches, none at both ends.
fn junctions(stretches: &[Stretch], rate: Option<f64>) -> Vec<f64> {
    let mut speeds = vec![0.0; stretches.len() + 1];
    let Some(rate) = rate else { return speeds };
    for (k, pair) in stretches.windows(2).enumerate() {
        let [a, b] = pair else { continue };
        let cosine: f64 = (0..3).map(|i| a.end[i] * b.start[i]).sum();
        speeds[k + 1] = a.speed.min(b.speed) * cosine.max(0.0);
    }
    let after = |speed: f64, length: f64| (speed * speed + 2.0 * rate * length).sqrt();
    for (k, stretch) in stretches.iter().enumerate() {
        speeds[k + 1] = speeds[k + 1].min(after(speeds[k], stretch.length));
    }
    for (k, stretch) in stretches.iter().enumerate().rev() {
        speeds[k] = speeds[k].min(after(speeds[k + 1], stretch.length));
    }
    speeds
}

/// Seconds for a stretch from one speed up and down to another.
fn trapezoid(stretch: &Stretch, from: f64, to: f64, rate: f64) -> f64 {
    let top = (rate * stretch.length + (from * from + to * to) / 2.0).sqrt();
    let top = top.min(stretch.speed).max(from).max(to);
    let ramps = (2.0 * top * top - from * from - to * to) / (2.0 * rate);
    let even = (stretch.length - ramps).max(0.0);
    (2.0 * top - from - to) / rate + even / top
}

fn direction(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let length = crate::motion::distance(a, b).max(1e-12);
    std::array::from_fn(|k| (b[k] - a[k]) / length)
}
