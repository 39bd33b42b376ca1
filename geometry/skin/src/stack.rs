//! Sections brought to one order, one sense and one start.

use crate::crossing;
use crate::error::SkinError;
use crate::section::Section;
use crate::settings::{Method, Settings};
use crate::space::{along, area_vector, distance, dot, lengths, middle, minus, norm, times};
use crate::surface::Warning;

/// Places along a section at which it is compared with its neighbour.
const SAMPLES: usize = 128;

/// Sections nearer to each other than this part of the usual distance lie at one height.
const ONE_HEIGHT: f64 = 0.01;

/// Sections whose parameters differ by less lie on each other.
const SAME_HEIGHT: f64 = 1e-9;

/// What is across another section by less than this part of their distance is noise.
const ACROSS: f64 = 0.25;

/// An open section runs the other way if that brings it so much nearer to its neighbour, as the
/// mean of squares; it has no sense if neither way does.
const OTHER_WAY: f64 = 0.7;

/// Directions from end to end tell a sense where they are no shorter than this part of their
/// sections, and have an angle with this cosine.
const LEAST_CHORD: f64 = 0.02;
const CLEAR: f64 = 0.5;

/// Least area of a closed section, in squares of its length (a circle has 0.08).
const LEAST_AREA: f64 = 1e-4;

/// Sections are parallel planes if across these they spread by no more than this part of what they
/// do along them; and parallel lines, if along the second direction by no more than this.
const FLAT: f64 = 0.2;
const LINES: f64 = 1e-3;

/// A section with the parameters of its points.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Course {
    pub(crate) name: String,
    /// From its start on.
    pub(crate) points: Vec<[f64; 3]>,
    /// Of each point: 0 at the start, and 1 at the end, or where a closed one is at its start again.
    pub(crate) at: Vec<f64>,
}

impl Course {
    /// Places at even parts of its length from its start on, which may be before its first point.
    fn samples(&self, is_closed: bool) -> Vec<[f64; 3]> {
        let before = if is_closed { 1.0 - self.at[0] } else { 0.0 };
        samples(&self.points, is_closed, before)
    }
}

/// Sections in order, that run the same way and begin beside each other.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stack {
    pub(crate) courses: Vec<Course>,
    /// Parameter of each section, 0 to 1.
    pub(crate) heights: Vec<f64>,
    pub(crate) is_closed: bool,
    pub(crate) warnings: Vec<Warning>,
}

/// A section on its way there.
struct Loose {
    name: String,
    points: Vec<[f64; 3]>,
    center: [f64; 3],
    is_directed: bool,
}

impl Stack {
    pub(crate) fn of(sections: &[Section], settings: &Settings) -> Result<Self, SkinError> {
        if sections.len() < 2 {
            return Err(SkinError::TooFewSections(sections.len()));
        }
        let mut loose = Vec::with_capacity(sections.len());
        for section in sections {
            let points = section.distinct()?;
            loose.push(Loose {
                name: section.name.clone(),
                center: middle(&points),
                points,
                is_directed: section.is_directed,
            });
        }
        let is_closed = all_alike(sections)?;
        let mut warnings = Vec::new();
        let axis = order(&mut loose, is_closed, &mut warnings)?;
        if is_closed {
            for own in &loose {
                if let Some(place_mm) = crossing::of_polygon(&own.points) {
                    return Err(SkinError::CrossingItself {
                        section: own.name.clone(),
                        place_mm,
                    });
                }
            }
        }
        let turned = turn(&mut loose, is_closed, settings)?;
        if !turned.is_empty() {
            warnings.push(Warning::Turned(turned));
        }
        let courses = started(&loose, is_closed, settings.method);
        passed(&courses, &loose, is_closed, axis)?;
        let heights = heights(&courses, is_closed);
        if let Some(k) = heights
            .windows(2)
            .position(|pair| pair[1] - pair[0] < SAME_HEIGHT)
        {
            return Err(SkinError::Branching {
                first: courses[k].name.clone(),
                second: courses[k + 1].name.clone(),
            });
        }
        Ok(Self {
            heights,
            courses,
            is_closed,
            warnings,
        })
    }
}

/// Whether all are closed; an error where some are and some are not.
fn all_alike(sections: &[Section]) -> Result<bool, SkinError> {
    let first = |is_closed: bool| sections.iter().find(|own| own.is_closed == is_closed);
    match (first(false), first(true)) {
        (Some(open), Some(closed)) => Err(SkinError::OpenAmongClosed {
            open: open.name.clone(),
            closed: closed.name.clone(),
        }),
        (open, _) => Ok(open.is_none()),
    }
}

/// Puts sections in the order of their heights if they are not in it; gives the direction in which
/// they are stacked. Sections that are not parallel, as those of a pipe that bends, keep the order
/// in which they came.
fn order(
    loose: &mut [Loose],
    is_closed: bool,
    warnings: &mut Vec<Warning>,
) -> Result<[f64; 3], SkinError> {
    let (first, last) = farthest_pair(loose);
    let between = minus(loose[last].center, loose[first].center);
    let Some(axis) = common_normal(loose, between) else {
        return Ok(times(between, 1.0 / norm(between).max(f64::MIN_POSITIVE)));
    };
    let height = |own: &Loose| dot(own.center, axis);
    let gaps = |loose: &[Loose]| -> Vec<f64> {
        let pairs = loose.windows(2);
        pairs
            .map(|pair| height(&pair[1]) - height(&pair[0]))
            .collect()
    };
    let mut steps = gaps(loose);
    let is_ordered = |sign: f64| steps.iter().all(|step| sign * step >= 0.0);
    if !is_ordered(1.0) && !is_ordered(-1.0) {
        loose.sort_by(|a, b| height(a).total_cmp(&height(b)));
        warnings.push(Warning::Sorted);
        steps = gaps(loose);
    }
    let mut sizes: Vec<f64> = steps.iter().map(|step| step.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes[sizes.len() / 2].max(sizes[sizes.len() - 1] * ONE_HEIGHT);
    let same = steps
        .iter()
        .position(|step| step.abs() <= ONE_HEIGHT * usual);
    // Open sections may lie beside each other in one plane.
    if let Some(k) = same.filter(|_| is_closed) {
        return Err(SkinError::Branching {
            first: loose[k].name.clone(),
            second: loose[k + 1].name.clone(),
        });
    }
    let upwards = steps.iter().sum::<f64>();
    Ok(times(axis, if upwards < 0.0 { -1.0 } else { 1.0 }))
}

/// The unit normal of sections that are parallel: across it they spread least. Of parallel lines the
/// direction in which they are beside each other.
fn common_normal(loose: &[Loose], between: [f64; 3]) -> Option<[f64; 3]> {
    let mut spread = nalgebra::Matrix3::<f64>::zeros();
    for own in loose {
        for place in &own.points {
            let off = nalgebra::Vector3::from(minus(*place, own.center));
            spread += off * off.transpose() / own.points.len() as f64;
        }
    }
    let found = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| found.eigenvalues[*a].total_cmp(&found.eigenvalues[*b]));
    let [least, middle, most] = order.map(|k| found.eigenvalues[k].max(0.0).sqrt());
    let direction =
        |k: usize| -> [f64; 3] { found.eigenvectors.column(order[k]).into_owned().into() };
    let axis = if middle <= LINES * most {
        let along = direction(2);
        minus(between, times(along, dot(along, between)))
    } else if least <= FLAT * middle {
        direction(0)
    } else {
        return None;
    };
    let length = norm(axis);
    // The sign of an eigenvector is anybody's.
    let sign = if dot(axis, between) < 0.0 { -1.0 } else { 1.0 };
    (length > 0.0).then(|| times(axis, sign / length))
}

/// The two sections whose middles are the farthest from each other, in a sweep and one back.
fn farthest_pair(loose: &[Loose]) -> (usize, usize) {
    let farthest = |from: usize| {
        let off = |k: &usize| distance(loose[*k].center, loose[from].center);
        (0..loose.len())
            .max_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or(from)
    };
    let last = farthest(0);
    (farthest(last), last)
}

/// Turns sections to the sense of the first; gives the names of those that were.
fn turn(
    loose: &mut [Loose],
    is_closed: bool,
    settings: &Settings,
) -> Result<Vec<String>, SkinError> {
    let mut turned = Vec::new();
    for k in 1..loose.len() {
        let (before, own) = (&loose[k - 1], &loose[k]);
        let is_same = if before.is_directed && own.is_directed {
            Some(true)
        } else if is_closed {
            same_around(before, own)
        } else {
            same_along(before, own)
        };
        let error = |hint: &'static str| SkinError::Sense {
            section: own.name.clone(),
            reference: before.name.clone(),
            hint,
        };
        let Some(is_same) = is_same else {
            return Err(error(if is_closed {
                "it encloses hardly any area; give its points in their order around it"
            } else {
                "both its ends are as near to either end; give all sections from the same side"
            }));
        };
        if is_same {
            continue;
        }
        if !settings.turn_sections {
            return Err(error("turn it, or let sections be turned"));
        }
        let own = &mut loose[k];
        own.points.reverse();
        turned.push(own.name.clone());
    }
    Ok(turned)
}

/// Whether two closed sections run around the same way.
fn same_around(before: &Loose, own: &Loose) -> Option<bool> {
    let [a, b] = [before, own].map(|of| area_vector(&of.points));
    let is_thin = [(before, a), (own, b)].iter().any(|(of, area)| {
        let around = lengths(&of.points, true);
        let length = around[around.len() - 1];
        norm(*area) / 2.0 < LEAST_AREA * length * length
    });
    (!is_thin).then(|| dot(a, b) > 0.0)
}

/// Whether two open sections run the same way: by the directions from end to end, or where these
/// tell nothing by how near to each other the sections are.
fn same_along(before: &Loose, own: &Loose) -> Option<bool> {
    let chord = |of: &Loose| minus(of.points[of.points.len() - 1], of.points[0]);
    let is_long = |of: &Loose| {
        let lengths = lengths(&of.points, false);
        norm(chord(of)) >= LEAST_CHORD * lengths[lengths.len() - 1]
    };
    let (a, b) = (chord(before), chord(own));
    let cosine = dot(a, b) / (norm(a) * norm(b));
    if is_long(before) && is_long(own) && cosine.abs() >= CLEAR {
        return Some(cosine > 0.0);
    }
    let [a, b] = [before, own].map(|of| samples(&of.points, false, 0.0));
    let off = |b: &mut dyn Iterator<Item = &[f64; 3]>| -> f64 {
        let both = a.iter().zip(b);
        both.map(|(a, b)| distance(*a, *b))
            .map(|off| off * off)
            .sum()
    };
    let (same, other) = (off(&mut b.iter()), off(&mut b.iter().rev()));
    if other < OTHER_WAY * same {
        Some(false)
    } else if same < OTHER_WAY * other {
        Some(true)
    } else {
        (cosine.abs() >= CLEAR).then_some(cosine > 0.0)
    }
}

/// Places at even parts of the length, from a share of it on.
fn samples(points: &[[f64; 3]], is_closed: bool, start: f64) -> Vec<[f64; 3]> {
    let lengths = lengths(points, is_closed);
    let whole = lengths[lengths.len() - 1];
    let parts = if is_closed { SAMPLES } else { SAMPLES - 1 };
    let share = |k: usize| {
        let share = start + k as f64 / parts as f64;
        if is_closed {
            share - share.floor()
        } else {
            share.min(1.0)
        }
    };
    (0..SAMPLES)
        .map(|k| along(points, &lengths, share(k) * whole))
        .collect()
}

/// Sections with their parameters: shares of their lengths, closed ones from a start on that is
/// beside that of the section before, so that the surface is twisted as little as may be.
fn started(loose: &[Loose], is_closed: bool, method: Method) -> Vec<Course> {
    let mut start = 0.0;
    let mut before: Option<(Vec<[f64; 3]>, [f64; 3])> = None;
    let mut courses = Vec::with_capacity(loose.len());
    for own in loose {
        if let Some((samples, center)) = before.as_ref().filter(|_| is_closed) {
            start = seam(own, samples, *center);
        }
        let lengths = lengths(&own.points, is_closed);
        let whole = lengths[lengths.len() - 1];
        if is_closed && method == Method::Jo {
            // The paper's curves begin with a data point.
            let off = |k: &usize| {
                let off = (lengths[*k] / whole - start).abs();
                off.min(1.0 - off)
            };
            let nearest = (0..own.points.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
            start = lengths[nearest.unwrap_or(0)] / whole;
        }
        before = Some((samples(&own.points, is_closed, start), own.center));
        let share = |k: usize| {
            let share = lengths[k] / whole - start;
            if is_closed {
                share - share.floor()
            } else {
                share
            }
        };
        let mut order: Vec<(f64, [f64; 3])> = own
            .points
            .iter()
            .enumerate()
            .map(|(k, point)| (share(k), *point))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (at, points) = order.into_iter().unzip();
        courses.push(Course {
            name: own.name.clone(),
            points,
            at,
        });
    }
    courses
}

/// The share of a closed section's length at which it is to begin.
fn seam(own: &Loose, before: &[[f64; 3]], center: [f64; 3]) -> f64 {
    let around = samples(&own.points, true, 0.0);
    let off = |shift: usize| -> f64 {
        let both = before.iter().enumerate();
        both.map(|(k, place)| {
            let other = minus(around[(k + shift) % SAMPLES], own.center);
            let off = distance(minus(*place, center), other);
            off * off
        })
        .sum()
    };
    let best = (0..SAMPLES)
        .min_by(|a, b| off(*a).total_cmp(&off(*b)))
        .unwrap_or(0);
    // Between samples by the parabola through three of them.
    let [low, own_off, high] = [SAMPLES - 1, 0, 1].map(|by| off((best + by) % SAMPLES));
    let bend = low + high - 2.0 * own_off;
    let by = if bend > 0.0 {
        (low - high) / (2.0 * bend)
    } else {
        0.0
    };
    let start = (best as f64 + by.clamp(-0.5, 0.5)) / SAMPLES as f64;
    start - start.floor()
}

/// An error where one section passes through the next.
fn passed(
    courses: &[Course],
    loose: &[Loose],
    is_closed: bool,
    axis: [f64; 3],
) -> Result<(), SkinError> {
    for (k, pair) in courses.windows(2).enumerate() {
        let between = minus(loose[k + 1].center, loose[k].center);
        let up = if is_closed {
            let normal = area_vector(&loose[k].points);
            times(normal, 1.0 / norm(normal).max(f64::MIN_POSITIVE))
        } else {
            axis
        };
        let up = times(up, if dot(up, between) < 0.0 { -1.0 } else { 1.0 });
        // Place by place from the common start, so that sections may be wavy as long as both are.
        let [a, b] = [0, 1].map(|side| {
            let course = &pair[side];
            course.samples(is_closed)
        });
        let both = a.iter().zip(&b);
        let above: Vec<f64> = both.map(|(a, b)| dot(minus(*b, *a), up)).collect();
        let usual = above.iter().map(|gap| gap.abs()).sum::<f64>() / above.len() as f64;
        let is_beyond = |sign: f64| above.iter().any(|gap| sign * gap > ACROSS * usual);
        if is_beyond(1.0) && is_beyond(-1.0) {
            return Err(SkinError::Crossing {
                first: pair[0].name.clone(),
                second: pair[1].name.clone(),
            });
        }
    }
    Ok(())
}

/// Parameters of the sections: sums of the roots of their distances (centripetal; Lee 1989), the
/// means over places along them.
fn heights(courses: &[Course], is_closed: bool) -> Vec<f64> {
    let samples: Vec<_> = courses
        .iter()
        .map(|course| course.samples(is_closed))
        .collect();
    let mut heights = vec![0.0; courses.len()];
    let mut told = 0.0;
    for place in 0..SAMPLES {
        let roots = samples
            .windows(2)
            .map(|pair| distance(pair[0][place], pair[1][place]).sqrt());
        let sums: Vec<f64> = roots
            .scan(0.0, |sum, root| {
                *sum += root;
                Some(*sum)
            })
            .collect();
        // Where all of them have one place, as a fan has, nothing is told.
        let whole = sums[sums.len() - 1];
        if whole > 0.0 {
            told += 1.0;
            for (height, sum) in heights.iter_mut().skip(1).zip(&sums) {
                *height += sum / whole;
            }
        }
    }
    heights
        .iter_mut()
        .for_each(|height| *height /= f64::max(told, 1.0));
    if let Some(last) = heights.last_mut() {
        *last = 1.0;
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Open sections that fan out from a line of common points, and are evenly apart beyond it.
    #[test]
    fn where_sections_have_common_points_nothing_is_told_of_their_heights() {
        let course = |k: usize| {
            let place = |j: usize| {
                let out = if j < 8 { 0.0 } else { 3.0 * k as f64 };
                [j as f64, out, 0.0]
            };
            Course {
                name: String::new(),
                points: (0..16).map(place).collect(),
                at: (0..16).map(|j| j as f64 / 15.0).collect(),
            }
        };
        let courses: Vec<Course> = (0..5).map(course).collect();
        let heights = heights(&courses, false);
        for (k, height) in heights.iter().enumerate() {
            assert!((height - 0.25 * k as f64).abs() < 0.02, "{heights:?}");
        }
    }

    /// Open sections farther and farther from each other, but for their last points.
    #[test]
    fn heights_are_those_all_along_and_not_at_an_end() {
        let course = |k: usize| {
            let out = 0.5 * (k * k) as f64;
            let place = |j: usize| [j as f64, if j == 15 { k as f64 } else { out }, 0.0];
            Course {
                name: String::new(),
                points: (0..16).map(place).collect(),
                at: (0..16).map(|j| j as f64 / 15.0).collect(),
            }
        };
        let courses: Vec<Course> = (0..4).map(course).collect();
        // Roots of 0.5, 1.5 and 2.5, but for what the ends add.
        let roots = [0.0, 0.5, 1.5, 2.5].map(f64::sqrt);
        let whole: f64 = roots.iter().sum();
        let mut expected = 0.0;
        for (height, root) in heights(&courses, false).iter().zip(roots) {
            expected += root / whole;
            // By the last points alone it would be 0.33 and 0.67.
            assert!((height - expected).abs() < 0.04, "{height} {expected}");
        }
    }
}
