//! On which side of the line between two surfaces a node lies.

use super::logistic::logistic;
use super::posterior::Posterior;
use super::votes::Cells;

/// A sample of one of the two surfaces, as seen from the node, in local spacings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Labelled {
    pub(crate) u: f64,
    pub(crate) v: f64,
    /// 1 for a sample of the first surface, -1 for one of the second.
    pub(crate) label: f64,
    /// Logarithm of the odds that it is.
    pub(crate) trust: f64,
    /// The same where a spot's width decides.
    pub(crate) trust_beside: f64,
    /// The column it comes from.
    pub(crate) strip: usize,
}

/// Logarithm of the odds that a sample which agrees with one surface alone lies on it.
pub(super) const SEEN: f64 = 6.0;
/// Share of samples on the wrong side up to which the edge is taken for straight.
pub(super) const STRAIGHT: f64 = 0.015;
/// Share of either set on the wrong side beyond which no line separates them.
const MIXED: f64 = 0.4;
/// The nearer samples are one in so many, nearest first. They suffice where they show the
/// node to be this many spacings from the edge, with no more than this share of either set
/// on the wrong side.
const NEARER: usize = 4;
const CLEAR: f64 = 1.2;
const CLEAN: f64 = 0.1;
/// Windows tried, each with half the samples of the one before.
const WINDOWS: usize = 3;
/// Fewer samples tell of no line.
const LEAST_NEARER: usize = 16;
/// Turns of lengthening a line, each with the samples beside the line of the one before.
pub(super) const TURNS: usize = 2;
/// Spacings from a line within which samples on the wrong side may be the line's fault.
pub(super) const BESIDE: f64 = 1.0;
/// Spacings from a line within which samples have a say in where it goes.
pub(super) const LANE: f64 = 4.0;
/// Steepness, per spacing, with which the search for a line begins at a known one.
pub(super) const STEEPNESS: f64 = 1.0;
/// Spacings beyond a line at which a sample is still not on its wrong side.
pub(super) const SLACK: f64 = 0.05;
/// Samples left on the wrong side beside a long line beyond which the edge is bent.
const BENT: usize = 2;
/// Spacings from a sample to those of other columns that may contradict it, and how many
/// times more of them must than speak for it.
const VOTERS: f64 = 2.0;
const OUTVOTED: usize = 3;

/// A line between two sets of samples, with `g^2 + h^2 = 1`: a sample lies `g u + h v + o`
/// spacings from it, on the side of the first set where that is positive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line([f64; 3]);

impl Line {
    pub(super) fn of(raw: [f64; 3]) -> Option<Self> {
        let length = (raw[0] * raw[0] + raw[1] * raw[1]).sqrt();
        (length > 0.0).then(|| Self(raw.map(|value| value / length)))
    }

    /// `g, h, o`.
    pub(super) fn coefficients(&self) -> [f64; 3] {
        self.0
    }

    /// How far along the line a sample lies, in local spacings.
    pub(super) fn along(&self, s: &Labelled) -> f64 {
        self.0[1] * s.u - self.0[0] * s.v
    }

    /// Signed distance of a sample, in local spacings.
    pub(super) fn to(&self, s: &Labelled) -> f64 {
        at(&self.0, s)
    }

    /// The best line between these samples.
    pub(super) fn among(samples: &[Labelled]) -> Option<Self> {
        Self::of(odds(samples, [0.0; 3])?)
    }

    /// The best line between these samples, sought from this one.
    pub(super) fn again(&self, samples: &[Labelled]) -> Option<Self> {
        Self::of(odds(samples, self.0.map(|value| STEEPNESS * value))?)
    }

    /// The mean of the lines near this one, as these samples have it.
    pub(super) fn mean(self, samples: &[Labelled], posterior: &mut Posterior) -> Self {
        let [g, h, o] = self.0;
        posterior.begin();
        for s in samples {
            let across = at(&self.0, s);
            posterior.weigh(s, h * s.u - g * s.v, across);
        }
        // A point at (along, across) lies above where across - offset - slope * along > 0.
        let [offset, slope, _] = posterior.line();
        Self::of([g - slope * h, h + slope * g, o - offset]).unwrap_or(self)
    }

    /// Signed distance of the node, in local spacings.
    pub(crate) fn distance(&self) -> f64 {
        self.0[2]
    }

    /// Whether the node is so near that a better line might put it on the other side.
    pub(crate) fn is_near(&self) -> bool {
        self.distance().abs() <= CLEAR
    }
}

/// The line that separates the two sets best, as far as it matters for the node. It follows
/// from logistic regression over all samples, which come nearest first; where it leaves too
/// many of them on the wrong side, as at a bent edge or a corner, over the nearer half, and
/// so on. `None` where the two sets do not lie apart. Samples that no surface can have are
/// taken out.
pub(crate) fn separate(samples: &mut Vec<Labelled>, posterior: &mut Posterior) -> Option<Line> {
    separate_where(samples, WINDOWS, false, posterior)
}

/// The same of two surfaces of which one may be a strip, with more of the other beyond it or
/// around its end: where all samples do not lie apart, the nearer ones show the near edge. For
/// where hardly any are outliers, so that few samples tell.
pub(crate) fn separate_strip(
    samples: &mut Vec<Labelled>,
    posterior: &mut Posterior,
) -> Option<Line> {
    separate_where(samples, WINDOWS + 1, true, posterior)
}

fn separate_where(
    samples: &mut Vec<Labelled>,
    windows: usize,
    may_be_strip: bool,
    posterior: &mut Posterior,
) -> Option<Line> {
    // Far from the edge the nearer samples tell.
    let near = samples.get(..samples.len() / NEARER)?;
    if let Some(raw) = odds(near, [0.0; 3])
        && let Some(line) = Line::of(raw)
        && !line.is_near()
        && wrong_side(near, &raw).1 <= CLEAN
        && wrong_side(samples, &raw).1 <= MIXED
    {
        return Some(line);
    }
    let mut best = None;
    for window in 0..windows {
        let mut line = odds(samples, [0.0; 3])?;
        let (mut wrong, share) = wrong_side(samples, &line);
        if share > MIXED {
            if !may_be_strip || best.is_some() || samples.len() < 2 * LEAST_NEARER {
                break;
            }
            samples.truncate(samples.len() / 2);
            continue;
        }
        if wrong > 0 && take_out_strays(samples, &line) {
            line = odds(samples, [0.0; 3])?;
            wrong = wrong_side(samples, &line).0;
        }
        best = Some(line);
        if wrong as f64 <= (STRAIGHT * samples.len() as f64).max(1.0) {
            if wrong > 0 {
                // Outliers that agree by chance; the line is better known without.
                samples.retain(|s| s.label * at(&line, s) > 0.0);
                best = odds(samples, [0.0; 3]).or(best);
            }
            break;
        }
        samples.truncate(samples.len() / 2);
        if window + 1 < windows && samples.len() < LEAST_NEARER {
            break;
        }
    }
    Some(Line::of(best?)?.mean(samples, posterior))
}

/// Takes out the samples on the wrong side that samples of other columns, around them,
/// contradict: outliers, of which whole runs along a column may happen to lie on the other
/// surface. Tells whether there were any.
fn take_out_strays(samples: &mut Vec<Labelled>, line: &[f64; 3]) -> bool {
    let is_wrong = |s: &Labelled| s.label * at(line, s) <= 0.0;
    if !samples.iter().any(is_wrong) {
        return false;
    }
    let cells = Cells::of(samples, VOTERS);
    let stray = |s: &Labelled| {
        let [alike, unlike] = cells.around(s);
        OUTVOTED * alike < unlike
    };
    let mut keep: Vec<bool> = Vec::with_capacity(samples.len());
    keep.extend(samples.iter().map(|s| !is_wrong(s) || !stray(s)));
    let before = samples.len();
    let mut keep = keep.into_iter();
    samples.retain(|_| keep.next().unwrap_or(true));
    samples.len() < before
}

/// The line from samples of a wider window, where the edge goes on as straight there: it is
/// the better known the more samples lie along it. `None` where it bends. Of the second set
/// this share may be no evidence at all.
pub(crate) fn lengthen(
    line: &Line,
    doubtful: f64,
    samples: &mut Vec<Labelled>,
    lane: &mut Vec<Labelled>,
    posterior: &mut Posterior,
) -> Option<Line> {
    let mut line = *line;
    take_out_strays(samples, &line.0);
    for _ in 0..TURNS {
        let (mut wrong, mut beside) = (0, 0);
        lane.clear();
        for s in samples.iter() {
            let distance = s.label * at(&line.0, s);
            if distance < -BESIDE {
                wrong += 1;
            } else if distance < LANE {
                beside += usize::from(distance < 0.0);
                lane.push(*s);
            }
        }
        if wrong as f64 > STRAIGHT * samples.len() as f64 {
            return None;
        }
        line = line.again(lane)?;
        if beside == 0 {
            break;
        }
    }
    line = line.mean(lane, posterior);
    let right = |s: &Labelled| s.label * at(&line.0, s) > -SLACK;
    is_followed(lane, doubtful, right).then_some(line)
}

/// Whether so few samples beside a long line are not on the right side of it that the edge
/// is not bent, with this share of the second set being no evidence.
pub(super) fn is_followed(
    lane: &[Labelled],
    doubtful: f64,
    right: impl Fn(&Labelled) -> bool,
) -> bool {
    let (mut first, mut second, mut all_second) = (0, 0, 0);
    for s in lane {
        let wrong = usize::from(!right(s));
        if s.label > 0.0 {
            first += wrong;
        } else {
            second += wrong;
            all_second += 1;
        }
    }
    let spared = (doubtful * f64::from(all_second)) as usize;
    first + second.saturating_sub(spared) <= BENT
}

fn at(line: &[f64; 3], s: &Labelled) -> f64 {
    line[0] * s.u + line[1] * s.v + line[2]
}

/// How many samples lie on the wrong side, and the larger share of both sets.
fn wrong_side(samples: &[Labelled], line: &[f64; 3]) -> (usize, f64) {
    let (mut wrong, mut all) = ([0_usize; 2], [0_usize; 2]);
    for s in samples {
        let set = usize::from(s.label > 0.0);
        all[set] += 1;
        wrong[set] += usize::from(s.label * at(line, s) <= 0.0);
    }
    let share = |set: usize| wrong[set] as f64 / all[set].max(1) as f64;
    (wrong[0] + wrong[1], share(0).max(share(1)))
}

/// `g, h, o` so that `g u + h v + o` is the logarithm of the odds of the first surface,
/// sought from the ones given.
fn odds(samples: &[Labelled], line: [f64; 3]) -> Option<[f64; 3]> {
    logistic(samples, line, |s| [s.u, s.v, 1.0])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A grid of samples around the node, nearest first, within this many spacings; rows of
    /// each column start anywhere. Positive labels where `u` is above the edge's at `v`.
    pub(in crate::consensus) fn grid(radius: f64, edge: impl Fn(f64) -> f64) -> Vec<Labelled> {
        let reach = radius as i32;
        let mut samples = Vec::new();
        for column in -reach..=reach {
            let start = libm::fmod(0.618 * f64::from(column + 100), 1.0);
            for row in -reach..=reach {
                let (u, v) = (f64::from(column) + 0.3, f64::from(row) + start);
                samples.push(Labelled {
                    u,
                    v,
                    label: if u > edge(v) { 1.0 } else { -1.0 },
                    trust: SEEN,
                    trust_beside: SEEN,
                    strip: (column + reach) as usize,
                });
            }
        }
        samples.retain(|s| s.u * s.u + s.v * s.v <= radius * radius);
        samples.sort_by(|s, t| (s.u * s.u + s.v * s.v).total_cmp(&(t.u * t.u + t.v * t.v)));
        samples
    }

    fn distance_to(slope: f64, offset: f64) -> f64 {
        -offset / (1.0 + slope * slope).sqrt()
    }

    #[test]
    fn a_longer_line_is_better_known() {
        let (mut squares, mut squares_long) = (0.0, 0.0);
        for k in 0..40 {
            let (slope, offset) = (0.02 * f64::from(k) + 0.3, 0.02 * f64::from(k) - 0.4);
            let edge = |v: f64| slope * v + offset;
            let line = separate(&mut grid(8.0, edge), &mut Posterior::default()).unwrap();
            let long = lengthen(
                &line,
                0.0,
                &mut grid(16.0, edge),
                &mut Vec::new(),
                &mut Posterior::default(),
            )
            .unwrap();
            let truth = distance_to(slope, offset);
            squares += (line.distance() - truth).powi(2);
            squares_long += (long.distance() - truth).powi(2);
        }
        let rms = |squares: f64| (squares / 40.0).sqrt();
        assert!(rms(squares) < 0.08, "{}", rms(squares));
        let long = rms(squares_long);
        assert!(long < 0.85 * rms(squares), "{long} {}", rms(squares));
    }

    #[test]
    fn a_bent_edge_is_not_lengthened() {
        for (edge, name) in [
            (
                &(|v: f64| 0.3 + 0.4 * v + v * v / 60.0) as &dyn Fn(f64) -> f64,
                "arc",
            ),
            (&|v: f64| 0.3 + 0.4 * v + 0.7 * v.max(0.0), "corner"),
        ] {
            let line = separate(&mut grid(8.0, edge), &mut Posterior::default()).unwrap();
            assert!((line.distance() + 0.3).abs() < 0.4, "{name} {line:?}");
            assert!(
                lengthen(
                    &line,
                    0.0,
                    &mut grid(16.0, edge),
                    &mut Vec::new(),
                    &mut Posterior::default()
                )
                .is_none()
            );
        }
    }

    #[test]
    fn a_run_of_outliers_does_not_move_the_line() {
        let edge = |v: f64| 0.4 + 0.1 * v;
        let mut samples = grid(9.0, edge);
        let run = |s: &&mut Labelled| s.strip == 7 && s.v.abs() < 2.6;
        let mut changed = 0;
        for s in samples.iter_mut().filter(run) {
            assert_eq!(s.label, -1.0);
            s.label = 1.0;
            changed += 1;
        }
        assert!((4..=6).contains(&changed));
        let clean = separate(&mut grid(9.0, edge), &mut Posterior::default()).unwrap();
        let line = separate(&mut samples, &mut Posterior::default()).unwrap();
        assert!(
            (line.distance() - clean.distance()).abs() < 0.05,
            "{line:?}"
        );
    }

    #[test]
    fn the_near_edge_of_a_strip_is_found_with_the_first_set_on_either_side() {
        for width in [2.0, 2.5, 3.0] {
            let strip = |u: f64| u > 0.4 && u < 0.4 + width;
            let mut samples = grid(9.0, |_| 0.0);
            for s in &mut samples {
                s.label = if strip(s.u) { -1.0 } else { 1.0 };
            }
            // Beyond the strip lies a third surface, and behind that the first again.
            samples.retain(|s| s.u < 0.4 + width || s.u > 5.0);
            let line = separate_strip(&mut samples, &mut Posterior::default());
            let distance = line.map(|line| line.distance());
            assert!(
                distance.is_some_and(|d| (d - 0.4).abs() < 0.5),
                "{width}: {distance:?}"
            );
        }
    }

    #[test]
    fn mixed_sets_have_no_line_between_them() {
        let mut samples = grid(9.0, |_| 0.0);
        for (k, s) in samples.iter_mut().enumerate() {
            s.label = if k % 2 == 0 { 1.0 } else { -1.0 };
        }
        assert!(separate(&mut samples, &mut Posterior::default()).is_none());
    }
}
