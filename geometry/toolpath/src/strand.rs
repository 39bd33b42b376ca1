//! Strands: what the cutter does without leaving the work.

use crate::motion::{Arc, Move, Plane, Travel};
use crate::trace::{Fineness, Piece, Run, fit, sample};

/// A connected way of the tip.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Strand {
    pub(crate) start: [f64; 3],
    /// Ends of lines and arcs.
    pub(crate) steps: Vec<Step>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    pub(crate) to: [f64; 3],
    pub(crate) arc: Option<Arc>,
}

impl Strand {
    pub(crate) fn end(&self) -> [f64; 3] {
        self.steps.last().map_or(self.start, |step| step.to)
    }

    /// The moves, with feeds along the surface and downwards.
    pub(crate) fn moves(&self, feeds_mm_per_min: [f64; 2]) -> impl Iterator<Item = Move> + '_ {
        let from = std::iter::once(self.start).chain(self.steps.iter().map(|step| step.to));
        from.zip(&self.steps).map(move |(from, step)| Move {
            travel: step.arc.map_or(Travel::Line, Travel::Arc),
            to_mm: step.to,
            feed_mm_per_min: feed_mm_per_min(from, step.to, feeds_mm_per_min),
        })
    }
}

/// The feed from one place to another: that along the surface, but so slow that what of it leads
/// downwards is no faster than the one downwards.
pub(crate) fn feed_mm_per_min(from: [f64; 3], to: [f64; 3], [cut, plunge]: [f64; 2]) -> f64 {
    let drop = from[2] - to[2];
    if drop <= 0.0 {
        return cut;
    }
    let off = [0, 1, 2].map(|d| to[d] - from[d]);
    let length = off.iter().map(|c| c * c).sum::<f64>().sqrt();
    cut.min(plunge * length / drop)
}

/// How strands are drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Drawing {
    pub(crate) fineness: Fineness,
    pub(crate) tolerance_mm: f64,
    pub(crate) arcs: bool,
}

/// Strands along a line of several straight parts, `tip` being the height over a place.
pub(crate) fn along(
    corners: &[[f64; 2]],
    drawing: &Drawing,
    tip: &dyn Fn([f64; 2]) -> Option<f64>,
) -> Vec<Strand> {
    let mut strands: Vec<Strand> = Vec::new();
    for part in corners.windows(2) {
        let &[from, to] = part else { continue };
        let Some(part) = Part::new(from, to) else {
            continue;
        };
        let runs = sample(part.length, &drawing.fineness, &|s| tip(part.place(s)));
        for run in runs {
            let first = part.point(run[0]);
            // What reaches to the corner goes on from there.
            let joined = strands.last_mut().filter(|strand| {
                let end = strand.end();
                run[0][0] == 0.0 && [end[0], end[1]] == [first[0], first[1]]
            });
            match joined {
                Some(strand) => {
                    let start = strand.end()[2];
                    strand.steps.extend(part.steps(&run, start, drawing));
                }
                None => strands.push(Strand {
                    start: first,
                    steps: part.steps(&run, first[2], drawing),
                }),
            }
        }
    }
    strands.retain(|strand| !strand.steps.is_empty());
    strands
}

/// A straight part as seen from above.
struct Part {
    from: [f64; 2],
    to: [f64; 2],
    along: [f64; 2],
    length: f64,
}

impl Part {
    fn new(from: [f64; 2], to: [f64; 2]) -> Option<Self> {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = libm::hypot(dx, dy);
        (length > 1e-9).then(|| Self {
            from,
            to,
            along: [dx / length, dy / length],
            length,
        })
    }

    fn place(&self, s: f64) -> [f64; 2] {
        if s >= self.length {
            return self.to;
        }
        [
            self.from[0] + s * self.along[0],
            self.from[1] + s * self.along[1],
        ]
    }

    fn point(&self, [s, z]: [f64; 2]) -> [f64; 3] {
        let [x, y] = self.place(s);
        [x, y, z]
    }

    /// The plane of arcs along it, and whether they turn counter-clockwise over a hump: along +x
    /// they turn from z to x, along +y from z to y.
    fn plane(&self) -> Option<(Plane, bool)> {
        match self.along {
            [x, 0.0] => Some((Plane::Zx, x > 0.0)),
            [0.0, y] => Some((Plane::Yz, y < 0.0)),
            _ => None,
        }
    }

    fn steps(&self, run: &Run, start: f64, drawing: &Drawing) -> Vec<Step> {
        let plane = self.plane();
        let arcs = drawing.arcs && plane.is_some();
        let pieces = fit(run, start, drawing.tolerance_mm, arcs);
        let step = |piece: Piece| {
            let arc = piece.centre.zip(plane).map(|(centre, (plane, hump))| {
                let is_hump = piece.to[1] > centre[1];
                Arc {
                    plane,
                    counter_clockwise: hump == is_hump,
                    centre_mm: [
                        self.from[0] + centre[0] * self.along[0],
                        self.from[1] + centre[0] * self.along[1],
                        centre[1],
                    ],
                }
            });
            Step {
                to: self.point(piece.to),
                arc,
            }
        };
        pieces.into_iter().map(step).collect()
    }
}
