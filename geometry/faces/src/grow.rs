//! From a window to all nodes of its surface.

use shapes::{Fit, Shape};

use crate::field::{Field, Set, count, places};

/// Fewest nodes of a piece.
pub(crate) const FEWEST: usize = 30;
/// Rounds of growing and fitting a shape.
const ROUNDS: usize = 6;
/// Times that the kind of shape may change.
const KINDS: usize = 4;
/// Share of its nodes in which a piece may change and count as settled.
const SETTLED: f64 = 0.01;
/// Nodes at the border of what has grown that may be of the next surface.
const FAR: usize = 2;
/// Samples that rounds are decided by, and the last of them.
const SOME: usize = 500;
const MANY: usize = 1500;
/// Share of the window that the piece must hold in the end.
const KEPT: f64 = 0.7;
/// Neighbours of a hole that must be of the piece for it to be filled, and how many times as far
/// off its nodes may lie.
const FILLED_BY: usize = 6;
const FILLED_OFF: f64 = 3.0;

/// Nodes of one surface.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    /// `None` where it is of no shape.
    pub(crate) fit: Option<Fit>,
    pub(crate) nodes: Set,
}

/// The nodes around a window that are of its surface, where that is of a shape. Only `open`
/// nodes are taken.
pub(crate) fn grow(field: &Field<'_>, open: &[bool], window: &[usize]) -> Option<Piece> {
    grow_from(field, open, window, FAR)
}

/// The same of what others have left over. They have taken what may be of the next surface, so
/// nodes at its border are its own, and in a strip they tell the most of how it bends.
pub(crate) fn grow_left(field: &Field<'_>, open: &[bool], left: &[usize]) -> Option<Piece> {
    grow(field, open, left).or_else(|| grow_from(field, open, left, 0))
}

/// Fits leave out nodes so `far` from the border of what has grown.
fn grow_from(field: &Field<'_>, open: &[bool], window: &[usize], far: usize) -> Option<Piece> {
    let mut nodes = vec![false; field.len()];
    window.iter().for_each(|place| nodes[*place] = open[*place]);
    let mut fit = field.fit(&nodes, far, SOME)?;
    for _ in 0..KINDS {
        for _ in 0..ROUNDS {
            let grown = reached(field, &fit.shape, open, window)?;
            let changed = grown.iter().zip(&nodes).filter(|(a, b)| a != b).count();
            let is_settled = changed as f64 <= SETTLED * count(&grown) as f64;
            nodes = grown;
            if is_settled {
                break;
            }
            fit = fit.again(&field.samples(&nodes, far, SOME), field.area())?;
        }
        // More nodes may tell of another kind.
        let kind = fit.shape.family();
        fit = field.fit(&nodes, far, MANY)?;
        if fit.shape.family() == kind {
            break;
        }
    }
    let nodes = reached(field, &fit.shape, open, window)?;
    let kept = window.iter().filter(|place| nodes[**place]).count();
    (kept as f64 >= KEPT * window.len() as f64).then_some(Piece {
        fit: Some(fit),
        nodes,
    })
}

/// The open nodes near a shape that hang together with a window.
fn reached(field: &Field<'_>, shape: &Shape, open: &[bool], window: &[usize]) -> Option<Set> {
    let is_near = |place: usize, off: f64| open[place] && field.off(shape, place) <= off;
    let near = field.spread(window, |place| is_near(place, 1.0));
    let near = field.opened(&near);
    let near = field.spread(window, |place| near[place]);
    let mut reached = near.clone();
    for place in places(&near).into_iter().flat_map(|p| field.around(p, 1)) {
        let by = || field.around(place, 1).filter(|p| near[*p]).count();
        if !reached[place] && by() >= FILLED_BY && is_near(place, FILLED_OFF) {
            reached[place] = true;
        }
    }
    (count(&reached) >= FEWEST).then_some(reached)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Scan;

    /// A cylinder's strip, six nodes wide.
    #[test]
    fn what_is_left_of_a_fillet_is_a_piece() {
        const RADIUS_MM: f64 = 9.3;
        let scan = Scan::of((6, 200), 0.45, 0.05, |x, _| {
            libm::sqrt(RADIUS_MM * RADIUS_MM - (x - 1.1) * (x - 1.1))
        });
        let left: Vec<usize> = (0..1200).collect();
        let field = Field::new(&scan.image, &scan.observations, &left).unwrap();
        let piece = grow_left(&field, &field.all(), &left).unwrap();
        assert!(count(&piece.nodes) > 1000, "{}", count(&piece.nodes));
        let shape = piece.fit.unwrap().shape;
        assert!(
            matches!(shape, Shape::Cylinder(c) if (c.radius_mm - RADIUS_MM).abs() < 2.0),
            "{shape:?}"
        );
    }
}
