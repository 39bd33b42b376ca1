//! Strands joined to one sequence of moves: over the surface where they are near each other,
//! else up, over and down again.

use crate::motion::{Move, distance};
use crate::strand::{Drawing, Strand, along, feed_mm_per_min};

/// Rapids end so far above material, millimetres.
const APPROACH_MM: f64 = 1.0;
/// A ramp descends by this share of its length: 3 degrees.
const RAMP: f64 = 0.0524;
/// Least length of a ramp for the cutter's radius; where there is less room it plunges.
const LEAST_RAMP: f64 = 0.5;

/// How a tool gets from one strand to the next.
pub(crate) struct Links<'a> {
    pub(crate) safe_z_mm: f64,
    /// Feeds along the surface and downwards.
    pub(crate) feeds_mm_per_min: [f64; 2],
    /// Strands farther apart than this are not linked over the surface.
    pub(crate) most_mm: f64,
    pub(crate) drawing: Drawing,
    /// Least safe height of the tip.
    pub(crate) tip: &'a dyn Fn([f64; 2]) -> Option<f64>,
}

impl Links<'_> {
    /// Adds strands whose material is no higher than `top_mm`. With a `ramp` of some radius, the
    /// tool enters along the strand and not straight down.
    pub(crate) fn add(
        &self,
        moves: &mut Vec<Move>,
        strands: &[Strand],
        top_mm: f64,
        ramp: Option<f64>,
    ) {
        let mut is_first = true;
        for strand in strands {
            let here = moves.last().map(|last| last.to_mm);
            // What was cut before lies higher or lower: it is entered anew.
            let linked = here
                .filter(|_| !is_first)
                .and_then(|here| self.over(here, strand.start));
            match linked {
                Some(link) => moves.extend(link),
                None => self.enter(moves, strand, top_mm, ramp),
            }
            moves.extend(strand.moves(self.feeds_mm_per_min));
            is_first = false;
        }
    }

    /// Up to where it may go anywhere.
    pub(crate) fn retract(&self, moves: &mut Vec<Move>) {
        if let Some(last) = moves.last()
            && last.to_mm[2] < self.safe_z_mm
        {
            let [x, y, _] = last.to_mm;
            moves.push(Move::rapid([x, y, self.safe_z_mm]));
        }
    }

    fn over(&self, from: [f64; 3], to: [f64; 3]) -> Option<Vec<Move>> {
        let apart = distance([from[0], from[1], 0.0], [to[0], to[1], 0.0]);
        if apart > self.most_mm {
            return None;
        }
        let ends = [[from[0], from[1]], [to[0], to[1]]];
        let mut moves = Vec::new();
        let mut at = from;
        if apart > 1e-9 {
            let strands = along(&ends, &self.drawing, self.tip);
            let [strand] = &strands[..] else { return None };
            let end = strand.end();
            let whole =
                [strand.start[0], strand.start[1]] == ends[0] && [end[0], end[1]] == ends[1];
            // A link that climbs far is quicker, and safer, in the air.
            let climbs = strand
                .steps
                .iter()
                .any(|s| s.to[2] > from[2].max(to[2]) + apart);
            if !whole || climbs {
                return None;
            }
            if strand.start != from {
                let feed = feed_mm_per_min(from, strand.start, self.feeds_mm_per_min);
                moves.push(Move::line(strand.start, feed));
            }
            moves.extend(strand.moves(self.feeds_mm_per_min));
            at = end;
        }
        if at != to {
            moves.push(Move::line(
                to,
                feed_mm_per_min(at, to, self.feeds_mm_per_min),
            ));
        }
        Some(moves)
    }

    fn enter(&self, moves: &mut Vec<Move>, strand: &Strand, top_mm: f64, ramp: Option<f64>) {
        let [cut, plunge] = self.feeds_mm_per_min;
        let [x, y, z] = strand.start;
        self.retract(moves);
        moves.push(Move::rapid([x, y, self.safe_z_mm]));
        let near = (top_mm.max(z) + APPROACH_MM).min(self.safe_z_mm);
        if near < self.safe_z_mm {
            moves.push(Move::rapid([x, y, near]));
        }
        let down = ramp.and_then(|radius| ramped(strand, top_mm + 0.1, radius));
        match down {
            Some(points) => {
                moves.push(Move::line([x, y, top_mm + 0.1], plunge));
                moves.extend(points.into_iter().map(|point| Move::line(point, cut)));
            }
            None => moves.push(Move::line(strand.start, plunge)),
        }
    }
}

/// A way down along the straight beginning of a strand and back to its start, never below it.
fn ramped(strand: &Strand, from_mm: f64, radius: f64) -> Option<Vec<[f64; 3]>> {
    let start = strand.start;
    let depth = from_mm - start[2];
    let wanted = depth / RAMP / 2.0;
    let mut out = Vec::new();
    let (mut way, mut at) = (0.0, start);
    for step in &strand.steps {
        if step.arc.is_some() || way >= wanted {
            break;
        }
        let mut to = step.to;
        let length = distance([at[0], at[1], 0.0], [to[0], to[1], 0.0]);
        if way + length > wanted && length > 0.0 {
            let share = (wanted - way) / length;
            to = std::array::from_fn(|k| at[k] + share * (to[k] - at[k]));
        }
        way += length.min(wanted - way);
        out.push((way, to));
        at = to;
    }
    if way < LEAST_RAMP * radius || out.is_empty() || depth <= 0.0 {
        return None;
    }
    // As many times to and fro as it takes at this slope.
    let rounds = (depth / (2.0 * way * RAMP)).ceil().clamp(1.0, 50.0) as usize;
    let total = 2.0 * way * rounds as f64;
    let height = |travelled: f64| from_mm - depth * (travelled / total).min(1.0);
    let mut points = Vec::new();
    for round in 0..rounds {
        let before = 2.0 * way * round as f64;
        let mut add = |[x, y, z]: [f64; 3], travelled: f64| {
            points.push([x, y, z.max(height(travelled))]);
        };
        for (w, point) in &out {
            add(*point, before + w);
        }
        for (w, point) in out.iter().rev().skip(1) {
            add(*point, before + 2.0 * way - w);
        }
        add(start, before + 2.0 * way);
    }
    Some(points)
}
