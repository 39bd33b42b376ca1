//! Straight and bent stretches of a path, and the splines that follow them.

use nurbs::{Basis, KnotVector, PiecewiseCubic};

use super::course::Course;
use super::redraw::redraw;
use crate::polygon::{cross, norm};

/// Straight stretches shorter than this are drawn with what is bent beside them, pitches.
const STRAIGHT: f64 = 8.0;
/// Shortest and longest piece of a bent stretch, pitches.
const SHORTEST: f64 = 5.0;
const LONGEST: f64 = 64.0;
/// Curvature is a mean over so much to either side, since what is drawn between nodes is wavy;
/// pitches.
const MEAN: f64 = 6.0;
/// How closely a settled path is drawn again by fewer pieces, and how much that may change it;
/// pitches.
const PLAIN: f64 = 1e-3;
const SAME: f64 = 0.02;
/// Places at which curvature is taken lie so far apart, pitches.
const STEP: f64 = 0.5;

/// Stretches of a path, by length from its start, pitches.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout {
    /// Where each straight stretch begins and ends, ascending; all else is bent.
    pub(crate) straight: Vec<[f64; 2]>,
    pub(crate) length: f64,
    closed: bool,
    /// Curvature at steps along the path, a mean around each.
    curvature: Vec<f64>,
}

impl Layout {
    /// The stretches of a path as drawn.
    pub(crate) fn of(path: &PiecewiseCubic<2>, closed: bool) -> Self {
        let (first, last) = path.domain();
        let is_straight = |piece: &[[f64; 4]; 2]| piece.iter().all(|c| c[2] == 0.0 && c[3] == 0.0);
        let mut straight: Vec<[f64; 2]> = Vec::new();
        for (piece, ends) in path.pieces.iter().zip(path.breaks.windows(2)) {
            if is_straight(piece) && ends[1] - ends[0] >= STRAIGHT {
                straight.push([ends[0] - first, ends[1] - first]);
            }
        }
        if path.pieces.len() == 1 && path.pieces.iter().all(is_straight) {
            straight = vec![[0.0, last - first]];
        }
        Self {
            straight,
            length: last - first,
            closed,
            curvature: curvature(path),
        }
    }

    /// Whether the whole path is one line.
    pub(crate) fn is_line(&self) -> bool {
        self.straight == [[0.0, self.length]]
    }

    /// The same path as one bent stretch.
    pub(crate) fn without_lines(&self) -> Self {
        Self {
            straight: Vec::new(),
            ..self.clone()
        }
    }

    /// Where each bent stretch begins and ends; one that goes on beyond the end of a closed path
    /// ends behind it.
    pub(crate) fn bent(&self) -> Vec<[f64; 2]> {
        let starts = core::iter::once(0.0).chain(self.straight.iter().map(|s| s[1]));
        let ends = self.straight.iter().map(|s| s[0]).chain([self.length]);
        let mut bent: Vec<[f64; 2]> = starts
            .zip(ends)
            .filter(|(from, to)| to - from > 1e-6)
            .map(|(from, to)| [from, to])
            .collect();
        if let [first, .., last] = bent[..]
            && self.closed
            && first[0] == 0.0
            && last[1] == self.length
        {
            bent.pop();
            bent[0] = [last[0], self.length + first[1]];
        }
        bent
    }

    /// A place of such a stretch on the path.
    pub(crate) fn on_path(&self, along: f64) -> f64 {
        if along > self.length {
            along - self.length
        } else {
            along
        }
    }

    /// Where a place lies in such a stretch, from its start.
    pub(crate) fn within_stretch(&self, along: f64, [from, to]: [f64; 2]) -> Option<f64> {
        [along, along + self.length]
            .into_iter()
            .find(|at| (from..=to).contains(at))
            .map(|at| at - from)
    }

    /// How many ends of a bent stretch go over into a line.
    pub(crate) fn lines_beside(&self, [from, to]: [f64; 2]) -> usize {
        // A closed path goes on across its seam, where a bent stretch ends only at a line; alone it
        // has no ends.
        let goes_on = self.closed && !self.straight.is_empty();
        usize::from(goes_on || from > 0.0) + usize::from(goes_on || to != self.length)
    }

    /// The same path with another of its straight stretches; without it where too little of it
    /// is left.
    pub(crate) fn with(&self, number: usize, stretch: [f64; 2]) -> Self {
        let mut other = self.clone();
        if stretch[1] - stretch[0] >= STRAIGHT {
            other.straight[number] = stretch;
        } else {
            other.straight.remove(number);
        }
        other
    }

    /// The same path with a straight stretch more; `None` if that is too short, or goes on beyond
    /// the end of a closed path.
    pub(crate) fn and(&self, stretch: [f64; 2]) -> Option<Self> {
        let turns = if stretch[0] >= self.length { 1.0 } else { 0.0 };
        let stretch = stretch.map(|at| at - turns * self.length);
        let is_within = stretch[1] <= self.length;
        (is_within && stretch[1] - stretch[0] >= STRAIGHT).then_some(())?;
        let mut other = self.clone();
        let after = self.straight.partition_point(|s| s[0] < stretch[0]);
        other.straight.insert(after, stretch);
        Some(other)
    }

    /// Splines of which one follows the path to `tolerance`, pitches; `None` where that would
    /// be too many numbers.
    pub(crate) fn splines(&self, tolerance: f64, most: usize) -> Option<Splines> {
        let mut breaks = vec![0.0];
        let mut is_line = Vec::new();
        let mut at = 0.0;
        for &[from, to] in &self.straight {
            self.divide([at, from], tolerance, &mut breaks);
            is_line.resize(breaks.len() - 1, false);
            breaks.push(to);
            is_line.push(true);
            at = to;
        }
        self.divide([at, self.length], tolerance, &mut breaks);
        is_line.resize(breaks.len() - 1, false);
        (breaks.len() <= most).then_some(())?;

        Splines::new(breaks, is_line, self.closed)
    }

    /// The path by fewer pieces, with its lines straight to the last digit, and its length as the
    /// parameter; `None` where that would not be the same path.
    pub(crate) fn plainer(&self, path: &PiecewiseCubic<2>) -> Option<PiecewiseCubic<2>> {
        let measure = Measure::of(path);
        let first = path.domain().0;
        let straight = self.straight.iter();
        let layout = Self {
            straight: straight
                .map(|ends| ends.map(|at| measure.length_to(first + at)))
                .collect(),
            length: measure.length(),
            closed: self.closed,
            curvature: curvature(path),
        };
        let splines = layout.splines(PLAIN, path.pieces.len())?;
        let plainer = redraw(|along| path.evaluate(measure.parameter_at(along)), &splines)?;
        let course = Course::of(path);
        let is_same = |place: &[f64; 2]| course.place(path, *place, SAME).is_some();
        let steps = (layout.length / STEP).ceil().max(1.0) as usize;
        let at = |k: usize| plainer.evaluate(layout.length * k as f64 / steps as f64);
        (0..=steps).map(at).all(|p| is_same(&p)).then_some(plainer)
    }

    /// The same stretches, of a path that is known better now.
    pub(crate) fn seen_from(&self, path: &PiecewiseCubic<2>) -> Self {
        Self {
            curvature: curvature(path),
            ..self.clone()
        }
    }

    /// Adds the breaks of a bent stretch: the more, the more it bends.
    fn divide(&self, [from, to]: [f64; 2], tolerance: f64, breaks: &mut Vec<f64>) {
        if to - from < 1e-6 {
            return;
        }
        // A cubic follows an arc over a length `h` to `h^4 curvature^3 / 384`.
        let density = |at: f64| {
            let k = ((at / STEP) as usize).min(self.curvature.len() - 1);
            let bend = libm::fabs(self.curvature[k]);
            libm::pow(bend * bend * bend / (384.0 * tolerance), 0.25)
                .clamp(1.0 / LONGEST, 1.0 / SHORTEST)
        };
        let steps = ((to - from) / STEP).ceil().max(1.0) as usize;
        let width = (to - from) / steps as f64;
        let mut sums = vec![0.0];
        for k in 0..steps {
            sums.push(sums[k] + width * density(from + (k as f64 + 0.5) * width));
        }
        let pieces = sums[steps].ceil().max(1.0);
        let mut next = 1.0;
        for k in 0..steps {
            let goal = sums[steps] * next / pieces;
            if next < pieces && sums[k + 1] >= goal {
                let share = (goal - sums[k]) / (sums[k + 1] - sums[k]);
                breaks.push(from + (k as f64 + share) * width);
                next += 1.0;
            }
        }
        breaks.push(to);
    }
}

/// Lengths along a path.
struct Measure {
    /// Parameters, and the lengths to them.
    steps: Vec<(f64, f64)>,
}

impl Measure {
    fn of(path: &PiecewiseCubic<2>) -> Self {
        let mut steps = vec![(path.domain().0, 0.0)];
        for (k, ends) in path.breaks.windows(2).enumerate() {
            let width = ends[1] - ends[0];
            let count = (width / STEP).ceil().max(2.0) as usize;
            for n in 0..count {
                // Simpson's rule.
                let speed = |share: f64| {
                    let at = width * (n as f64 + share) / count as f64;
                    norm(path.piece_value(k, at, 1))
                };
                let mean = (speed(0.0) + 4.0 * speed(0.5) + speed(1.0)) / 6.0;
                let length = steps[steps.len() - 1].1 + mean * width / count as f64;
                steps.push((ends[0] + width * (n + 1) as f64 / count as f64, length));
            }
        }
        Self { steps }
    }

    fn length(&self) -> f64 {
        self.steps[self.steps.len() - 1].1
    }

    fn length_to(&self, parameter: f64) -> f64 {
        let after = self.steps.partition_point(|s| s.0 <= parameter);
        let after = after.clamp(1, self.steps.len() - 1);
        let ((from, a), (to, b)) = (self.steps[after - 1], self.steps[after]);
        a + (b - a) * ((parameter - from) / (to - from)).clamp(0.0, 1.0)
    }

    fn parameter_at(&self, length: f64) -> f64 {
        let after = self.steps.partition_point(|s| s.1 <= length);
        let after = after.clamp(1, self.steps.len() - 1);
        let ((from, a), (to, b)) = (self.steps[after - 1], self.steps[after]);
        from + (to - from) * ((length - a) / (b - a).max(1e-12)).clamp(0.0, 1.0)
    }
}

/// The mean curvature around places along a path.
fn curvature(path: &PiecewiseCubic<2>) -> Vec<f64> {
    let (first, last) = path.domain();
    let steps = ((last - first) / STEP).ceil().max(1.0) as usize;
    // How far the tangent has turned in all.
    let mut turned = vec![0.0];
    for k in 0..steps {
        let at = (first + (k as f64 + 0.5) * STEP).min(last);
        let (tangent, bend) = (path.derivative(at, 1), path.derivative(at, 2));
        let speed = norm(tangent).max(1e-9);
        turned.push(turned[k] + STEP * cross(tangent, bend) / (speed * speed * speed));
    }
    let reach = (MEAN / STEP) as usize;
    let mean = |k: usize| {
        let (low, high) = (k.saturating_sub(reach), (k + reach + 1).min(steps));
        (turned[high] - turned[low]) / (STEP * (high - low) as f64)
    };
    (0..steps).map(mean).collect()
}

/// Cubic splines over the length of a path: twice differentiable but for the ends of lines.
#[derive(Debug, Clone)]
pub(crate) struct Splines {
    pub(crate) knots: KnotVector,
    pub(crate) breaks: Vec<f64>,
    /// Of each piece between breaks.
    pub(crate) is_line: Vec<bool>,
    pub(crate) closed: bool,
}

/// What is to be zero: a sum over coefficients.
pub(crate) type Condition = Vec<(usize, f64)>;

impl Splines {
    fn new(breaks: Vec<f64>, is_line: Vec<bool>, closed: bool) -> Option<Self> {
        let (first, last) = (*breaks.first()?, *breaks.last()?);
        let mut knots = vec![first; 4];
        for k in 1..breaks.len() - 1 {
            // Where a line ends, a path may begin to bend at once.
            let times = if is_line[k - 1] || is_line[k] { 2 } else { 1 };
            knots.extend(core::iter::repeat_n(breaks[k], times));
        }
        knots.extend([last; 4]);
        Some(Self {
            knots: KnotVector::new(3, knots).ok()?,
            breaks,
            is_line,
            closed,
        })
    }

    /// The same with pieces no longer than this but for lines.
    pub(crate) fn finer(&self, longest: f64) -> Option<Self> {
        let mut breaks = vec![*self.breaks.first()?];
        let mut is_line = Vec::new();
        for (ends, line) in self.breaks.windows(2).zip(&self.is_line) {
            let width = ends[1] - ends[0];
            let pieces = if *line {
                1
            } else {
                (width / longest).ceil().max(1.0) as usize
            };
            for k in 1..=pieces {
                breaks.push(ends[0] + width * k as f64 / pieces as f64);
                is_line.push(*line);
            }
        }
        Self::new(breaks, is_line, self.closed)
    }

    /// Coefficients.
    pub(crate) fn count(&self) -> usize {
        self.knots.control_count()
    }

    /// Pieces between two breaks.
    pub(crate) fn pieces_between(&self, from: f64, to: f64) -> usize {
        let middles = self.breaks.windows(2).map(|e| (e[0] + e[1]) / 2.0);
        middles.filter(|m| *m > from && *m < to).count()
    }

    /// Coefficients that may be chosen.
    pub(crate) fn freedom(&self) -> usize {
        self.count().saturating_sub(self.conditions().len())
    }

    /// The functions that do not vanish at a place, or their derivatives.
    pub(crate) fn at(&self, along: f64, order: usize) -> Basis {
        self.knots.basis_derivative(along, order)
    }

    /// What makes lines straight, and the path close smoothly.
    pub(crate) fn conditions(&self) -> Vec<Condition> {
        let sum = |along: f64, order: usize, scale: f64| -> Condition {
            let basis = self.at(along, order);
            (0..4)
                .map(|k| (basis.first + k, scale * basis.values[k]))
                .collect()
        };
        let mut all = Vec::new();
        for (ends, _) in self.breaks.windows(2).zip(&self.is_line).filter(|l| *l.1) {
            let width = ends[1] - ends[0];
            for share in [0.25, 0.75] {
                all.push(sum(ends[0] + share * width, 2, width * width));
            }
        }
        if self.closed {
            let (first, last) = self.knots.domain();
            let scale = self.breaks[1] - self.breaks[0];
            // Where a line ends or begins, the path may begin to bend at once.
            let is_line = [self.is_line.first(), self.is_line.last()];
            let orders = if is_line.contains(&Some(&true)) { 2 } else { 3 };
            let scales = [1.0, scale, scale * scale].into_iter().take(orders);
            for (order, scale) in scales.enumerate() {
                let mut both = sum(first, order, scale);
                both.extend(sum(last, order, -scale));
                all.push(both);
            }
        }
        all
    }
}
