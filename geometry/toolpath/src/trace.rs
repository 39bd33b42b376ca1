//! How high the tip goes along a line: samples so close that nothing between them matters, and
//! straight lines and arcs within a corridor on top of them.
//!
//! The corridor reaches from the samples upwards by the tolerance. A path within it goes nowhere
//! below a sample: it leaves material rather than taking too much.

use crate::arc::arc_from;

/// How closely a line is sampled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fineness {
    /// Greatest distance of samples, millimetres.
    pub(crate) step_mm: f64,
    /// Least distance.
    pub(crate) least_mm: f64,
    /// How far the middle between two samples, and the quarters, may be off their lines.
    pub(crate) wobble_mm: f64,
}

impl Fineness {
    /// What is hidden from samples is narrower than their distance. A cutter with a corner of radius
    /// `r` is lifted by `e` over a width of `sqrt(8 r e)` at least, so that samples as close as that
    /// miss no more than `e`.
    pub(crate) fn of(corner_mm: f64, wobble_mm: f64, least_mm: f64) -> Self {
        Self {
            step_mm: (8.0 * corner_mm * wobble_mm).sqrt().clamp(0.02, 1.0),
            least_mm,
            wobble_mm,
        }
    }
}

/// Samples along a line where the tip has a height: way along it, height. The way does not
/// decrease; where it stands still the height jumps.
pub(crate) type Run = Vec<[f64; 2]>;

/// A piece of the path, from where the one before ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// Way along the line, and height, where it ends.
    pub(crate) to: [f64; 2],
    /// Centre of the arc that it is.
    pub(crate) centre: Option<[f64; 2]>,
}

/// Samples a line of this length, `tip` being the height at a way along it, where there is one.
pub(crate) fn sample(
    length_mm: f64,
    fineness: &Fineness,
    tip: &dyn Fn(f64) -> Option<f64>,
) -> Vec<Run> {
    let count = (length_mm / fineness.step_mm).ceil().max(1.0) as usize;
    let mut runs: Vec<Run> = Vec::new();
    let mut last: Option<(f64, Option<f64>)> = None;
    for k in 0..=count {
        let s = length_mm * k as f64 / count as f64;
        let z = tip(s);
        match (last, z) {
            (Some((from, Some(low))), Some(high)) => {
                if let Some(run) = runs.last_mut() {
                    refine([from, low], [s, high], fineness, tip, run);
                }
            }
            (Some((from, None)), Some(high)) => {
                let (edge, low) = border((s, high), from, fineness, tip);
                let mut run = vec![[edge, low]];
                if edge < s {
                    refine([edge, low], [s, high], fineness, tip, &mut run);
                }
                runs.push(run);
            }
            (None, Some(high)) => runs.push(vec![[s, high]]),
            (Some((from, Some(low))), None) => {
                let (edge, high) = border((from, low), s, fineness, tip);
                if let Some(run) = runs.last_mut()
                    && edge > from
                {
                    refine([from, low], [edge, high], fineness, tip, run);
                }
            }
            _ => {}
        }
        last = Some((s, z));
    }
    runs
}

/// Where heights end between a place that has one and one that has none.
fn border(
    (mut inside, mut height): (f64, f64),
    mut outside: f64,
    fineness: &Fineness,
    tip: &dyn Fn(f64) -> Option<f64>,
) -> (f64, f64) {
    while (outside - inside).abs() > fineness.least_mm {
        let middle = f64::midpoint(inside, outside);
        match tip(middle) {
            Some(z) => (inside, height) = (middle, z),
            None => outside = middle,
        }
    }
    (inside, height)
}

/// Adds what lies between two samples, and the second.
fn refine(
    a: [f64; 2],
    b: [f64; 2],
    fineness: &Fineness,
    tip: &dyn Fn(f64) -> Option<f64>,
    run: &mut Run,
) {
    if b[0] - a[0] <= fineness.least_mm {
        // A wall: it is climbed before, and descended behind.
        if (b[1] - a[1]).abs() > fineness.wobble_mm {
            run.push(if b[1] > a[1] {
                [a[0], b[1]]
            } else {
                [b[0], a[1]]
            });
        }
        run.push(b);
        return;
    }
    // A gap narrower than the samples' distance is bridged.
    let between = |p: [f64; 2], q: [f64; 2]| {
        let s = f64::midpoint(p[0], q[0]);
        [s, tip(s).unwrap_or(p[1].max(q[1]))]
    };
    let is_off = |p: [f64; 2], m: [f64; 2], q: [f64; 2]| {
        (m[1] - f64::midpoint(p[1], q[1])).abs() > fineness.wobble_mm
    };
    let middle = between(a, b);
    if !is_off(a, middle, b) {
        // Where a hollow turns into a hump, the middle alone may be on the line.
        let quarters = [between(a, middle), between(middle, b)];
        if !is_off(a, quarters[0], middle) && !is_off(middle, quarters[1], b) {
            run.extend([quarters[0], middle, quarters[1], b]);
            return;
        }
    }
    refine(a, middle, fineness, tip, run);
    refine(middle, b, fineness, tip, run);
}

/// Lines, and arcs if wanted, through the corridor on top of a run, from a height at its start.
pub(crate) fn fit(run: &[[f64; 2]], start: f64, tolerance_mm: f64, arcs: bool) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let Some(&[first, _]) = run.first() else {
        return pieces;
    };
    let (mut at, mut here) = (0, [first, start]);
    while at + 1 < run.len() {
        let next = run[at + 1];
        if next[0] <= here[0] {
            // Straight up or down.
            let to = [here[0], next[1]];
            if to != here {
                pieces.push(Piece { to, centre: None });
            }
            (at, here) = (at + 1, to);
            continue;
        }
        let (mut end, mut piece) = line_from(run, at, here, tolerance_mm);
        if arcs && let Some((far, arc)) = arc_from(run, at, here, end, tolerance_mm) {
            (end, piece) = (far, arc);
        }
        pieces.push(piece);
        (at, here) = (end, piece.to);
    }
    pieces
}

/// The longest line through the corridor.
fn line_from(run: &[[f64; 2]], at: usize, here: [f64; 2], tolerance_mm: f64) -> (usize, Piece) {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut found = (at + 1, run[at + 1]);
    for (k, &[s, z]) in run.iter().enumerate().skip(at + 1) {
        let way = s - here[0];
        if k > at + 1 && s <= run[k - 1][0] {
            break;
        }
        low = low.max((z - here[1]) / way);
        high = high.min((z + tolerance_mm - here[1]) / way);
        if low > high {
            break;
        }
        found = (k, [s, (here[1] + low * way).max(z)]);
    }
    let (end, to) = found;
    (end, Piece { to, centre: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn height(pieces: &[Piece], start: [f64; 2], s: f64) -> f64 {
        let mut from = start;
        for piece in pieces {
            if s <= piece.to[0] && s >= from[0] && piece.to[0] > from[0] {
                return match piece.centre {
                    None => {
                        let share = (s - from[0]) / (piece.to[0] - from[0]);
                        from[1] + share * (piece.to[1] - from[1])
                    }
                    Some([cs, cz]) => {
                        let radius = libm::hypot(from[0] - cs, from[1] - cz);
                        let rise = (radius * radius - (s - cs) * (s - cs)).max(0.0).sqrt();
                        if from[1] + piece.to[1] > 2.0 * cz {
                            cz + rise
                        } else {
                            cz - rise
                        }
                    }
                };
            }
            from = piece.to;
        }
        from[1]
    }

    #[test]
    fn a_path_stays_in_its_corridor_and_takes_few_pieces() {
        let fineness = Fineness::of(3.0, 2e-4, 1e-4);
        // A hump, a hollow and a slope.
        let tip = |s: f64| Some(3.0 * libm::sin(s / 4.0) + 0.1 * s);
        let runs = sample(40.0, &fineness, &tip);
        assert_eq!(runs.len(), 1);
        let mut counts = Vec::new();
        for arcs in [false, true] {
            let pieces = fit(&runs[0], runs[0][0][1], 0.004, arcs);
            for k in 0..=40_000 {
                let s = f64::from(k) / 1000.0;
                let above = height(&pieces, runs[0][0], s) - tip(s).unwrap();
                assert!((-3e-4..=0.0043).contains(&above), "{arcs} {s}: {above}");
            }
            counts.push(pieces.len());
        }
        assert!(counts[0] < 130, "{counts:?}");
        assert!(counts[1] * 2 < counts[0], "{counts:?}");
    }

    #[test]
    fn a_hollow_that_turns_into_a_hump_is_not_cut_off() {
        let fineness = Fineness::of(2.0, 2e-4, 1e-4);
        // Between two samples the curve crosses their line in the middle.
        let step = 10.0 / (10.0 / fineness.step_mm).ceil();
        let tip = |s: f64| {
            let inner = (s - 50.0 * step) / step;
            let wave = if (0.0..=1.0).contains(&inner) {
                -0.002 * libm::sin(core::f64::consts::TAU * inner)
            } else {
                0.0
            };
            Some(s + wave)
        };
        let run = &sample(10.0, &fineness, &tip)[0];
        let pieces = fit(run, 0.0, 0.001, false);
        for k in 0..=100 {
            let s = step * (50.0 + f64::from(k) / 100.0);
            let above = height(&pieces, [0.0, 0.0], s) - tip(s).unwrap();
            assert!(above > -3e-4, "{s}: {above}");
        }
    }

    #[test]
    fn walls_are_climbed_before_them_and_gaps_end_runs() {
        let fineness = Fineness::of(0.0, 2e-4, 1e-4);
        let tip = |s: f64| match s {
            s if s < 3.0 => Some(0.0),
            s if s < 5.0 => Some(2.0),
            s if s < 7.0 => None,
            _ => Some(1.0),
        };
        let runs = sample(10.0, &fineness, &tip);
        assert_eq!(runs.len(), 2);
        let pieces = fit(&runs[0], 0.0, 0.01, true);
        let wall = pieces.windows(2).find(|w| w[0].to[0] == w[1].to[0]);
        let [foot, top] = wall.unwrap() else { panic!() };
        assert_eq!((foot.to[1], top.to[1]), (0.0, 2.0));
        assert!(foot.to[0] < 3.0 && foot.to[0] > 2.9998, "{foot:?}");
        assert!((runs[0].last().unwrap()[0] - 5.0).abs() < 2e-4);
        assert!((runs[1][0][0] - 7.0).abs() < 2e-4);
    }
}
