//! The true part on a grid of its own, which no stage under test knows.

use serde::Serialize;
use sim_scanner::scanner::Scanner;
use sim_scanner::truth::{GraphNode, graph_node};

use crate::part::{Part, TrueEdge};
use crate::surface::vector;

/// The grid over the part.
pub(crate) const COLUMNS: usize = 240;
pub(crate) const ROWS: usize = 256;
/// Nodes so near to another face, or to what is not seen, are not away from edges.
const AWAY: usize = 2;
/// Edges of one face belong so near to what is not seen and to steps, nodes.
const BESIDE: usize = 2;
/// Neighbours that are so far off each other's tangent planes have a step between them.
const STEP_MM: f64 = 0.5;
/// So have those of two faces that share no edge so near by, from the noise on: what stands between
/// them is not seen, and there is nothing in which they could meet.
const LOW_STEP_MM: f64 = 0.05;
/// About a pitch beside, and what a steep face rises over that.
const SHARED_MM: (f64, f64) = (0.5, 1.0);

/// What stands at each node.
pub(crate) struct TruthGrid {
    low_mm: [f64; 2],
    step_mm: [f64; 2],
    nodes: Vec<Option<GraphNode>>,
}

/// Where edges of one face only belong, for judges outside.
#[derive(Debug, Serialize)]
pub(crate) struct Mask {
    low_mm: [f64; 2],
    step_mm: [f64; 2],
    rows: usize,
    cells: String,
}

impl TruthGrid {
    pub(crate) fn new(part: &Part, scanner: &Scanner) -> Self {
        let (low, high) = part.scene.object_extent_mm();
        let mut grid = Self {
            low_mm: [low.x, low.y],
            step_mm: [
                (high.x - low.x) / COLUMNS as f64,
                (high.y - low.y) / ROWS as f64,
            ],
            nodes: Vec::new(),
        };
        grid.nodes = Self::all()
            .map(|(column, row)| {
                let [x, y] = grid.place_mm(column, row);
                graph_node(scanner, x, y)
            })
            .collect();
        grid
    }

    /// All nodes, column by column.
    pub(crate) fn all() -> impl Iterator<Item = (usize, usize)> {
        (0..COLUMNS).flat_map(|column| (0..ROWS).map(move |row| (column, row)))
    }

    pub(crate) fn place_mm(&self, column: usize, row: usize) -> [f64; 2] {
        [
            self.low_mm[0] + (column as f64 + 0.5) * self.step_mm[0],
            self.low_mm[1] + (row as f64 + 0.5) * self.step_mm[1],
        ]
    }

    pub(crate) fn node(&self, column: usize, row: usize) -> Option<&GraphNode> {
        self.nodes.get(column * ROWS + row)?.as_ref()
    }

    fn seen(&self, column: usize, row: usize) -> Option<&GraphNode> {
        self.node(column, row).filter(|node| node.seen)
    }

    /// The nodes around a node and itself.
    fn around(column: usize, row: usize, reach: usize) -> impl Iterator<Item = (usize, usize)> {
        let columns = column.saturating_sub(reach)..(column + reach + 1).min(COLUMNS);
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(ROWS);
        columns.flat_map(move |c| rows.clone().map(move |r| (c, r)))
    }

    /// Whether all nodes around are seen and of the same face.
    pub(crate) fn is_away(&self, column: usize, row: usize) -> bool {
        let Some(own) = self.seen(column, row) else {
            return false;
        };
        let is_inner = |at: usize, end: usize| at >= AWAY && at + AWAY < end;
        let is_own = |(c, r)| self.seen(c, r).is_some_and(|node| node.face == own.face);
        is_inner(column, COLUMNS)
            && is_inner(row, ROWS)
            && Self::around(column, row, AWAY).all(is_own)
    }

    /// Whether the scanner sees both faces within a distance of a point.
    pub(crate) fn sees_both(&self, faces: [usize; 2], point_mm: [f64; 3], reach_mm: f64) -> bool {
        let index = |k: usize, end: usize| {
            let at = libm::floor((point_mm[k] - self.low_mm[k]) / self.step_mm[k]);
            (at.max(0.0) as usize).min(end - 1)
        };
        let (column, row) = (index(0, COLUMNS), index(1, ROWS));
        let near = || {
            Self::around(column, row, 2).filter_map(move |(c, r)| {
                let node = self.seen(c, r)?;
                let [x, y] = self.place_mm(c, r);
                let off = [x - point_mm[0], y - point_mm[1], node.z_mm - point_mm[2]];
                let squared: f64 = off.iter().map(|d| d * d).sum();
                (squared <= reach_mm * reach_mm).then_some(node.face.face)
            })
        };
        faces.iter().all(|face| near().any(|own| own == *face))
    }

    /// Whether there is a step between two nodes: the surfaces are apart where they meet, or do not
    /// meet there in the part itself.
    fn is_step(&self, edges: &[TrueEdge], one: (usize, usize), other: (usize, usize)) -> bool {
        let (Some(a), Some(b)) = (self.seen(one.0, one.1), self.seen(other.0, other.1)) else {
            return true;
        };
        let ([ax, ay], [bx, by]) = (self.place_mm(one.0, one.1), self.place_mm(other.0, other.1));
        let across = nalgebra::Vector3::new(bx - ax, by - ay, b.z_mm - a.z_mm);
        let off = |node: &GraphNode| across.dot(&vector(node.normal)).abs();
        let off_mm = off(a).min(off(b));
        let meet = || {
            let faces = [a.face.face, b.face.face];
            let middle = nalgebra::Vector3::new(ax, ay, a.z_mm) + across / 2.0;
            faces[0] == faces[1]
                || edges
                    .iter()
                    .any(|edge| edge.joins(faces, &middle, SHARED_MM))
        };
        off_mm > STEP_MM || off_mm > LOW_STEP_MM && !meet()
    }

    /// Where edges of one face belong: near what is not seen, near steps, and at the grid's rim.
    pub(crate) fn mask(&self, edges: &[TrueEdge]) -> Mask {
        let mut is_border = vec![false; COLUMNS * ROWS];
        for (column, row) in Self::all() {
            let is_rim = column == 0 || row == 0 || column + 1 == COLUMNS || row + 1 == ROWS;
            let beside = [(column + 1, row), (column, row + 1)];
            let mut inner = beside
                .into_iter()
                .filter(|(c, r)| *c < COLUMNS && *r < ROWS);
            is_border[column * ROWS + row] = is_rim
                || self.seen(column, row).is_none()
                || inner.any(|other| self.is_step(edges, (column, row), other));
        }
        let cell = |(column, row)| {
            let mut near = Self::around(column, row, BESIDE);
            if near.any(|(c, r)| is_border[c * ROWS + r]) {
                '1'
            } else {
                '0'
            }
        };
        Mask {
            low_mm: self.low_mm,
            step_mm: self.step_mm,
            rows: ROWS,
            cells: Self::all().map(cell).collect(),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use sim_scanner::Vec3;
    use sim_scanner::preset::{Overrides, Preset};
    use sim_scanner::scene::{Body, Material, Mesh, MeshFace, Scene};

    /// Two level squares of 20 mm side by side, this much apart in height: face 0 from x = -20
    /// and face 1 above it, from x = 0.
    pub(crate) fn step(height_mm: f64) -> (Part, TruthGrid) {
        let level = |x: f64, z: f64| {
            let at = |u: f64, v: f64| Vec3::new(x + 20.0 * u, 20.0 * v - 10.0, z);
            MeshFace {
                triangles_mm: vec![
                    [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)],
                    [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
                ],
                surface: None,
            }
        };
        let mesh = Mesh::of_faces(&[level(-20.0, 0.0), level(0.0, height_mm)]).unwrap();
        let part = Part {
            seed: 1,
            name: "a step".into(),
            faces: vec![None, None],
            edges: Vec::new(),
            scene: Scene::new(vec![Body::Mesh(Box::new(mesh))], Material::PAPER),
        };
        let setup = Preset::Paper.set_up(part.scene.clone(), &Overrides::default(), 1);
        let (scanner, _) = setup.unwrap();
        let grid = TruthGrid::new(&part, &scanner);
        (part, grid)
    }

    #[test]
    fn nodes_two_from_a_border_are_away() {
        let (_, grid) = step(2.0);
        let half = COLUMNS / 2;
        let away: Vec<usize> = (0..COLUMNS)
            .filter(|c| grid.is_away(*c, ROWS / 2))
            .collect();
        assert!(away.contains(&(half - 3)) && away.contains(&(half + 2)));
        assert!(!away.contains(&(half - 2)) && !away.contains(&(half + 1)));
        assert!(!grid.is_away(1, 100) && grid.is_away(2, 100));
    }

    #[test]
    fn edges_of_one_face_belong_to_steps_and_rims_only() {
        let shared = TrueEdge {
            faces: [0, 1],
            is_smooth: false,
            points_mm: (-20..=20).map(|k| [0.0, f64::from(k) * 0.5, 0.0]).collect(),
        };
        let cell_of = |height_mm: f64, column: usize, edges: &[TrueEdge]| {
            let mask = step(height_mm).1.mask(edges);
            mask.cells.as_bytes()[column * ROWS + ROWS / 2]
        };
        let cell = |height_mm: f64, column: usize| cell_of(height_mm, column, &[]);
        let half = COLUMNS / 2;
        assert_eq!(cell(2.0, half), b'1');
        assert_eq!(cell(2.0, half - 10), b'0');
        assert_eq!(cell(2.0, 1), b'1');
        // What is too low for a step is none.
        assert_eq!(cell(0.04, half), b'0');
        // A low one is one where the faces do not meet in the part.
        assert_eq!(cell(0.3, half), b'1');
        assert_eq!(cell_of(0.3, half, core::slice::from_ref(&shared)), b'0');
    }

    #[test]
    fn both_sides_of_an_edge_are_seen_beside_it_only() {
        let (_, grid) = step(0.1);
        assert!(grid.sees_both([0, 1], [0.0, 3.0, 0.0], 0.5));
        assert!(!grid.sees_both([0, 1], [2.0, 3.0, 0.0], 0.5));
        assert!(!grid.sees_both([0, 1], [0.0, 3.0, 5.0], 0.5));
    }
}
