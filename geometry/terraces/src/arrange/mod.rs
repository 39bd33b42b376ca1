//! The plan divided into cells by lines and arcs.
//!
//! All curves on one line or circle are handled together: the places where others meet it divide
//! it into edges, so that curves that lie on each other are one edge, whoever drew them.

mod cells;
mod points;

use crate::plan::{P2, Piece, Support, distance};

/// Nearer points are one, millimetres.
pub(crate) const POINT_MM: f64 = 1e-6;
/// Supports whose pieces are nearer to each other are one, millimetres.
const SAME_SUPPORT_MM: f64 = 1e-7;

/// A stretch of a support that divides the plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve {
    pub(crate) support: usize,
    /// Parameters of its ends; ascending, those of circles up to a turn beyond the first.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Its ends.
    pub(crate) ends: [P2; 2],
    /// The loop that it is part of.
    pub(crate) owner: Option<usize>,
    /// Faces that run around an axis may be cut open here.
    pub(crate) is_seam: bool,
}

/// Curves, each on one of the supports.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drawing {
    pub(crate) supports: Vec<Support>,
    pub(crate) curves: Vec<Curve>,
    /// Places at which edges are to be divided: support and parameter.
    pub(crate) cuts: Vec<(usize, f64)>,
}

impl Drawing {
    /// Adds a closed loop.
    pub(crate) fn add_loop(&mut self, pieces: &[Piece], owner: usize) {
        for piece in pieces {
            self.add(piece, Some(owner), false);
        }
    }

    /// Adds a piece.
    pub(crate) fn add(&mut self, piece: &Piece, owner: Option<usize>, is_seam: bool) {
        let support = self.support(piece);
        let on = self.supports[support];
        let (mut ends, mut range) = ([piece.from(), piece.to()], (0.0, 0.0));
        match on {
            Support::Line { .. } => {
                let (a, b) = (on.parameter(ends[0]), on.parameter(ends[1]));
                if b < a {
                    ends.swap(0, 1);
                }
                range = (a.min(b), a.max(b));
            }
            Support::Circle { .. } => {
                let sweep = piece.sweep();
                if sweep < 0.0 {
                    ends.swap(0, 1);
                }
                range.0 = on.parameter(ends[0]);
                range.1 = range.0 + sweep.abs();
            }
        }
        self.curves.push(Curve {
            support,
            from: range.0,
            to: range.1,
            ends,
            owner,
            is_seam,
        });
    }

    /// Adds the part of a line or circle that is near a rectangle.
    pub(crate) fn add_across(&mut self, support: Support, bounds: [P2; 2]) {
        match support {
            Support::Line { .. } => {
                let corners = [0, 1, 2, 3].map(|k| [bounds[k & 1][0], bounds[k >> 1][1]]);
                let along = corners.map(|corner| support.parameter(corner));
                let from = along.into_iter().fold(f64::INFINITY, f64::min);
                let to = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
                let (from, to) = (support.at(from), support.at(to));
                self.add(&Piece::Line { from, to }, None, false);
            }
            Support::Circle { c, r } => {
                let ends = [[c[0] + r, c[1]], [c[0] - r, c[1]]];
                for k in 0..2 {
                    let arc = Piece::Arc {
                        from: ends[k],
                        to: ends[1 - k],
                        center: c,
                        ccw: true,
                    };
                    self.add(&arc, None, false);
                }
            }
        }
    }

    /// The support of a piece: one that is there, if it is the same.
    fn support(&mut self, piece: &Piece) -> usize {
        let own = piece.support();
        let places = [piece.from(), piece.at(0.5), piece.to()];
        let same = |other: &Support| {
            let is_kind = matches!(
                (other, own),
                (Support::Line { .. }, Support::Line { .. })
                    | (Support::Circle { .. }, Support::Circle { .. })
            );
            is_kind
                && places.iter().all(|&p| other.distance(p) < SAME_SUPPORT_MM)
                && alike(other, &own)
        };
        self.supports.iter().position(same).unwrap_or_else(|| {
            self.supports.push(own);
            self.supports.len() - 1
        })
    }
}

/// Circles of short arcs must be alike themselves, too.
fn alike(a: &Support, b: &Support) -> bool {
    match (*a, *b) {
        (Support::Circle { c, r }, Support::Circle { c: d, r: s }) => {
            distance(c, d) < 10.0 * SAME_SUPPORT_MM && (r - s).abs() < 10.0 * SAME_SUPPORT_MM
        }
        _ => true,
    }
}

/// An edge between two vertices, on a support in the sense of its parameter.
#[derive(Debug, Clone)]
pub(crate) struct Edge {
    pub(crate) support: usize,
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) ends: [usize; 2],
    /// Loops that have it, those that have it twice left out.
    pub(crate) owners: Vec<usize>,
    pub(crate) is_seam: bool,
    /// Cells on its left and right.
    pub(crate) cells: [usize; 2],
}

/// An edge and the sense in which it is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Half {
    pub(crate) edge: usize,
    pub(crate) forward: bool,
}

/// A cell: what lies to the left of its loops.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cell {
    pub(crate) loops: Vec<Vec<Half>>,
    /// By loop of the drawing: it is within.
    pub(crate) within: Vec<bool>,
}

/// The divided plan. Cell 0 is what lies outside of everything.
#[derive(Debug, Clone, Default)]
pub(crate) struct Arrangement {
    pub(crate) supports: Vec<Support>,
    pub(crate) vertices: Vec<P2>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) cells: Vec<Cell>,
    /// Edges at each vertex, counter-clockwise, by the half that leaves it.
    pub(crate) around: Vec<Vec<Half>>,
}

/// The cells do not fit together at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Torn {
    pub(crate) at: P2,
}

impl Arrangement {
    /// Divides the plan; `loops` is one more than the highest owner.
    pub(crate) fn new(drawing: &Drawing, loops: usize) -> Result<Self, Torn> {
        let mut plan = points::edges(drawing);
        cells::fill(&mut plan, loops)?;
        Ok(plan)
    }

    /// An edge as a piece in the sense of its parameter.
    pub(crate) fn piece(&self, edge: usize) -> Piece {
        let Edge { support, ends, .. } = self.edges[edge];
        let [from, to] = ends.map(|end| self.vertices[end]);
        match self.supports[support] {
            Support::Line { .. } => Piece::Line { from, to },
            Support::Circle { c, .. } => Piece::Arc {
                from,
                to,
                center: c,
                ccw: true,
            },
        }
    }

    pub(crate) fn half_piece(&self, half: Half) -> Piece {
        let piece = self.piece(half.edge);
        if half.forward {
            piece
        } else {
            piece.reversed()
        }
    }

    /// A point of an edge at a part of its parameter.
    pub(crate) fn on_edge(&self, edge: usize, part: f64) -> P2 {
        let Edge {
            support, from, to, ..
        } = self.edges[edge];
        match part {
            0.0 => self.vertices[self.edges[edge].ends[0]],
            1.0 => self.vertices[self.edges[edge].ends[1]],
            _ => self.supports[support].at(from + part * (to - from)),
        }
    }

    /// The cell to the left of a half.
    pub(crate) fn left(&self, half: Half) -> usize {
        self.edges[half.edge].cells[usize::from(!half.forward)]
    }
}
