//! The face that is really visible over each node.
//!
//! The rule, node by node: the line through the node along z first meets a face of the
//! object; the node is that face's if both laser and sensor see the point from where they
//! stand when the table is at the node's x, the beam does not graze the surface beyond the
//! scanner's limit, and the scan covers the point. Otherwise the node has no label.
//!
//! A region is a connected part of what is visible of one face. Nodes up to [`GAP`] apart are
//! connected, unless there is a step between them, since a regridder may close gaps that
//! narrow. Faces that meet smoothly are one (see [`super::promise`]).
//!
//! Everything comes from the simulator's scene; no code under test has a part in it.

use std::collections::BTreeMap;

use range_image::{Lattice, RangeImage};
use sim_scanner::Vec3;
use sim_scanner::scanner::{Scanner, Sweep};
use sim_scanner::scene::FaceId;
use sim_scanner::truth::graph_node;

use super::LEAST_NODES;

/// Nodes of one face up to so many columns and rows apart are connected.
pub const GAP: usize = 2;
/// A distance between tangent planes that makes a step, millimetres.
pub const STEP_MM: f64 = 1.0;
/// Columns and rows without a label around the object.
const MARGIN: i64 = 40;

/// A point of a face that is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub(super) face: FaceId,
    pub(super) point_mm: Vec3,
    pub(super) normal: Vec3,
}

impl Seen {
    /// How far apart the two surfaces are where they meet: the lesser distance of either
    /// point from the other's tangent plane.
    pub(super) fn step_mm(&self, other: &Self) -> f64 {
        let across = other.point_mm - self.point_mm;
        let here = across.dot(self.normal).abs();
        here.min(across.dot(other.normal).abs())
    }
}

/// The visible faces over a lattice, node by node.
#[derive(Debug, Clone)]
pub(super) struct Faces {
    pub(super) lattice: Lattice,
    pub(super) i_first: i64,
    pub(super) j_first: i64,
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) seen: Vec<Option<Seen>>,
}

impl Faces {
    /// What the scanner sees of its object in a sweep.
    pub(super) fn of(scanner: &Scanner, sweep: &Sweep, lattice: Lattice) -> Self {
        let (low, high) = scanner.scene.object_extent_mm();
        let i_first = lattice.first_at_or_above(low.x) - MARGIN;
        let j_first = lattice.first_at_or_above(low.y) - MARGIN;
        let columns = (lattice.last_at_or_below(high.x) + MARGIN - i_first + 1).max(0) as usize;
        let rows = (lattice.last_at_or_below(high.y) + MARGIN - j_first + 1).max(0) as usize;
        let covered = Covered::by(scanner, sweep);
        let seen = (0..columns)
            .flat_map(|column| (0..rows).map(move |row| (column, row)))
            .map(|(column, row)| {
                let x = lattice.line_mm(i_first + column as i64);
                let y = lattice.line_mm(j_first + row as i64);
                let node = graph_node(scanner, x, y).filter(|node| node.seen)?;
                let point_mm = Vec3::new(x, y, node.z_mm);
                covered.holds(scanner, point_mm).then_some(Seen {
                    face: node.face,
                    point_mm,
                    normal: node.normal,
                })
            })
            .collect();
        Self {
            lattice,
            i_first,
            j_first,
            columns,
            rows,
            seen,
        }
    }

    /// Pairs of nodes beside each other along a column or a row.
    pub(super) fn borders(&self) -> impl Iterator<Item = (&Seen, &Seen)> {
        let right = (0..self.seen.len().saturating_sub(self.rows)).map(|k| (k, k + self.rows));
        let up = (0..self.seen.len().saturating_sub(1))
            .filter(|k| (k + 1) % self.rows != 0)
            .map(|k| (k, k + 1));
        right
            .chain(up)
            .filter_map(|(a, b)| Some((self.seen[a].as_ref()?, self.seen[b].as_ref()?)))
    }

    /// Numbers the connected parts; `same` maps faces that are one to one of them.
    pub(super) fn regions(&self, same: &BTreeMap<FaceId, FaceId>) -> Truth {
        let face = |seen: &Seen| *same.get(&seen.face).unwrap_or(&seen.face);
        let mut labels = vec![0; self.seen.len()];
        let mut regions: Vec<Region> = Vec::new();
        for start in 0..self.seen.len() {
            let Some(first) = self.seen[start].as_ref().filter(|_| labels[start] == 0) else {
                continue;
            };
            let label = u16::try_from(regions.len() + 1).unwrap_or(u16::MAX);
            let mut nodes = 0;
            let mut open = vec![start];
            labels[start] = label;
            while let Some(node) = open.pop() {
                nodes += 1;
                let Some(here) = &self.seen[node] else {
                    continue;
                };
                for other in self.around(node) {
                    let Some(there) = &self.seen[other] else {
                        continue;
                    };
                    let one = face(there) == face(first) && here.step_mm(there) < STEP_MM;
                    if labels[other] == 0 && one {
                        labels[other] = label;
                        open.push(other);
                    }
                }
            }
            regions.push(Region {
                label,
                face: face(first),
                nodes,
            });
        }
        Truth {
            lattice: self.lattice,
            i_first: self.i_first,
            j_first: self.j_first,
            columns: self.columns,
            rows: self.rows,
            labels,
            regions,
        }
    }

    fn around(&self, node: usize) -> impl Iterator<Item = usize> {
        let (column, row) = (node / self.rows, node % self.rows);
        let columns = column.saturating_sub(GAP)..(column + GAP + 1).min(self.columns);
        let rows = row.saturating_sub(GAP)..(row + GAP + 1).min(self.rows);
        columns.flat_map(move |c| rows.clone().map(move |r| c * self.rows + r))
    }
}

/// What a sweep covers: tables positions, beam angles, ranges.
struct Covered {
    x_mm: (f64, f64),
    angle_rad: (f64, f64),
}

impl Covered {
    fn by(scanner: &Scanner, sweep: &Sweep) -> Self {
        let sorted = |a: f64, b: f64| (a.min(b), a.max(b));
        let column = |k| scanner.x_mm(sweep.table_counts(k));
        let sample = |k| scanner.angle_rad(sweep.lateral_counts(k));
        Self {
            x_mm: sorted(column(0), column(sweep.columns.saturating_sub(1))),
            angle_rad: sorted(sample(0), sample(sweep.samples.saturating_sub(1))),
        }
    }

    fn holds(&self, scanner: &Scanner, point_mm: Vec3) -> bool {
        let laser = scanner.optics.laser_mm(point_mm.x);
        let angle = libm::atan2(point_mm.y - laser.y, laser.z - point_mm.z);
        let range = laser.distance(point_mm);
        let (nearest, farthest) = scanner.head.window_mm;
        (self.x_mm.0..=self.x_mm.1).contains(&point_mm.x)
            && (self.angle_rad.0..=self.angle_rad.1).contains(&angle)
            && (nearest..=farthest).contains(&range)
    }
}

/// A connected part of what is visible of a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// Its label.
    pub label: u16,
    /// The face, or one of those that meet smoothly.
    pub face: FaceId,
    /// Number of nodes.
    pub nodes: usize,
}

impl Region {
    /// Whether it is large enough to count.
    #[must_use]
    pub fn counts(&self) -> bool {
        self.nodes >= LEAST_NODES
    }
}

/// The true region over each node of a lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The lattice.
    pub lattice: Lattice,
    /// Lattice index in x of the first column.
    pub i_first: i64,
    /// Lattice index in y of the first row.
    pub j_first: i64,
    /// Number of columns.
    pub columns: usize,
    /// Number of nodes in a column.
    pub rows: usize,
    /// Label of each node, column by column; 0 for none.
    pub labels: Vec<u16>,
    /// The regions by label.
    pub regions: Vec<Region>,
}

impl Truth {
    /// What a scanner sees of its object in a sweep; faces that meet smoothly are several.
    #[must_use]
    pub fn of_scan(scanner: &Scanner, sweep: &Sweep, lattice: Lattice) -> Self {
        Faces::of(scanner, sweep, lattice).regions(&BTreeMap::new())
    }

    /// Whether the region with this label counts.
    #[must_use]
    pub fn counts(&self, label: u16) -> bool {
        let regions = self.regions.get(usize::from(label).wrapping_sub(1));
        regions.is_some_and(Region::counts)
    }

    /// Brings values of another grid's nodes to these nodes. Node (i, j) here is node
    /// (i times `factor.0`, j times `factor.1`) there; `none` stands where there is no such.
    #[must_use]
    pub fn gather<T: Copy>(
        &self,
        image: &RangeImage,
        values: &[T],
        factor: (i64, i64),
        none: T,
    ) -> Vec<T> {
        let (i_origin, j_origin) = image.origin();
        let index = |line: i64, origin: i64, end: usize| {
            usize::try_from(line - origin).ok().filter(|k| *k < end)
        };
        (0..self.columns)
            .flat_map(|column| (0..self.rows).map(move |row| (column, row)))
            .map(|(column, row)| {
                let i = (self.i_first + column as i64) * factor.0;
                let j = (self.j_first + row as i64) * factor.1;
                let column = index(i, i_origin, image.columns());
                let row = index(j, j_origin, image.rows());
                match (column, row) {
                    (Some(c), Some(r)) => values.get(c * image.rows() + r).copied(),
                    _ => None,
                }
                .unwrap_or(none)
            })
            .collect()
    }
}
