//! Where borders meet.

use super::cracks::{Chain, CrackMap};
use super::segments::{Samples, Segment};
use crate::polygon::{dot, minus, norm};

/// Weight of an outline against a border between faces where they meet.
const OUTLINE_WEIGHT: f64 = 8.0;

/// The same of a crease that the surfaces on its sides have placed.
const PLACED_WEIGHT: f64 = 100.0;

/// Farthest a junction moves from its corner of the lattice, pitches.
const JUNCTION_REACH: f64 = 1.0;

/// The same where the curves that meet there cross at an angle that tells the place: the
/// tip of a sharp corner is missed by the samples, and so by the lattice.
const TIP_REACH: f64 = 5.0;

/// Least ratio of the eigenvalues of the curves' normals for that.
const WELL_CROSSED: f64 = 0.02;

/// Weight of a junction's corner of the lattice.
const HOLD: f64 = 0.5;

/// Rounds in which curves are followed to a junction.
const JUNCTION_ROUNDS: usize = 4;

/// A border as it is divided, before it is drawn.
pub(crate) struct Course<'a> {
    pub(crate) chain: &'a Chain,
    pub(crate) samples: &'a Samples,
    pub(crate) segments: &'a [Segment],
    /// It is followed from crack to crack, and ends on corners of the lattice.
    pub(crate) traced: bool,
}

/// Normal equations of the point nearest to lines.
#[derive(Clone, Copy, Default)]
struct Meeting {
    matrix: [[f64; 2]; 2],
    rhs: [f64; 2],
}

impl Meeting {
    fn add(&mut self, weight: f64, normal: [f64; 2], point: [f64; 2]) {
        let offset = dot(normal, point);
        for i in 0..2 {
            for j in 0..2 {
                self.matrix[i][j] += weight * normal[i] * normal[j];
            }
            self.rhs[i] += weight * normal[i] * offset;
        }
    }

    fn place(&self) -> Option<[f64; 2]> {
        let (m, rhs, det) = (self.matrix, self.rhs, self.determinant());
        (det > 0.0).then(|| {
            [
                (m[1][1] * rhs[0] - m[0][1] * rhs[1]) / det,
                (m[0][0] * rhs[1] - m[1][0] * rhs[0]) / det,
            ]
        })
    }

    fn determinant(&self) -> f64 {
        self.matrix[0][0] * self.matrix[1][1] - self.matrix[0][1] * self.matrix[1][0]
    }

    /// True when the lines cross at an angle that tells the place.
    fn is_well_crossed(&self) -> bool {
        let trace = self.matrix[0][0] + self.matrix[1][1];
        // For a ratio far below 1 this is the ratio of the eigenvalues.
        self.determinant() > WELL_CROSSED * trace * trace
    }
}

/// An end of a border at a junction.
struct Arrival<'a> {
    course: &'a Course<'a>,
    segment: &'a Segment,
    sample: usize,
}

impl Arrival<'_> {
    /// A longer curve is better known, and one that a shift at its end would turn off many
    /// nodes; outlines come before creases, which lose no nodes to nothing.
    fn weight(&self) -> f64 {
        let chain = self.course.chain;
        let outline = chain.left == 0 || chain.right == 0;
        let kind = if self.course.samples.placed {
            PLACED_WEIGHT
        } else if outline {
            OUTLINE_WEIGHT
        } else {
            1.0
        };
        kind * (self.segment.last - self.segment.first) as f64
    }
}

/// Junctions at the point nearest to the curves that meet there, or on their corner of
/// the lattice where a traced border ends.
pub(crate) fn place_junctions(cracks: &CrackMap, courses: &[Course<'_>]) -> Vec<[f64; 2]> {
    let mut arrivals: Vec<Vec<Arrival<'_>>> = Vec::new();
    arrivals.resize_with(cracks.junctions.len(), Vec::new);
    let mut traced = vec![false; cracks.junctions.len()];
    for course in courses {
        let Some((start, end)) = course.chain.ends else {
            continue;
        };
        if course.traced {
            (traced[start], traced[end]) = (true, true);
        }
        let (Some(first), Some(last)) = (course.segments.first(), course.segments.last()) else {
            continue;
        };
        for (junction, segment, sample) in [(start, first, first.first), (end, last, last.last)] {
            arrivals[junction].push(Arrival {
                course,
                segment,
                sample,
            });
        }
    }
    let placed = |(k, &corner): (usize, &[f64; 2])| {
        if traced[k] {
            corner
        } else {
            junction(corner, &arrivals[k])
        }
    };
    cracks.junctions.iter().enumerate().map(placed).collect()
}

fn junction(corner: [f64; 2], arrivals: &[Arrival<'_>]) -> [f64; 2] {
    let mut place = corner;
    for round in 0..JUNCTION_ROUNDS {
        // The corner itself holds the place where nothing else does.
        let mut weighted = Meeting {
            matrix: [[HOLD, 0.0], [0.0, HOLD]],
            rhs: corner.map(|c| HOLD * c),
        };
        let mut crossing = Meeting::default();
        for arrival in arrivals {
            let samples = arrival.course.samples;
            let (point, along) = if round == 0 {
                samples.at(arrival.segment, arrival.sample)
            } else {
                samples.nearest(arrival.segment, arrival.sample, place)
            };
            let normal = [-along[1], along[0]];
            weighted.add(arrival.weight(), normal, point);
            crossing.add(1.0, normal, point);
        }
        let Some(next) = weighted.place() else {
            break;
        };
        let by = minus(next, corner);
        let reach = if crossing.is_well_crossed() {
            TIP_REACH
        } else {
            JUNCTION_REACH
        };
        let share = (reach / norm(by).max(1e-9)).min(1.0);
        place = [0, 1].map(|d| corner[d] + share * by[d]);
    }
    place
}
