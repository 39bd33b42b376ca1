//! The nodes of a part of the image, and sets of them.

use std::collections::VecDeque;

use nalgebra::Vector3;
use range_image::RangeImage;
use shapes::{Fit, Sample, Shape, decide};

use crate::observations::Observations;

/// How far a node of a surface may lie off it, in deviations of its samples. A node is the middle
/// of many samples, so this is several times its own deviation.
const NEAR: f64 = 1.0;
/// And besides, of the pitch: what windows round off of surfaces that bend.
const BEND: f64 = 0.02;
/// Samples that are enough to decide by. Where there are fewer away from the border of a set,
/// those nearer to it are taken, too.
const ENOUGH: usize = 120;

/// A set of nodes, by their places in a field.
pub(crate) type Set = Vec<bool>;

/// A rectangle of the image, with the nodes that are looked at.
pub(crate) struct Field<'a> {
    observations: &'a Observations,
    rows: usize,
    columns: usize,
    pitch_mm: f64,
    nodes: Vec<Option<Node>>,
}

/// A node that is looked at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    /// Its index in the image.
    pub(crate) index: usize,
    point_mm: Vector3<f64>,
    /// Deviation of the z of its samples, millimetres.
    deviation_mm: f64,
    bend_mm: f64,
}

impl Node {
    fn may_mm(&self, normal: &Vector3<f64>) -> f64 {
        NEAR * self.deviation_mm * normal.z.abs() + self.bend_mm
    }
}

impl<'a> Field<'a> {
    /// The nodes with these indices in the image, in ascending order, at least one.
    pub(crate) fn new(
        image: &RangeImage,
        observations: &'a Observations,
        nodes: &[usize],
    ) -> Option<Self> {
        let rows = image.rows();
        let low_column = nodes.first()? / rows;
        let columns = nodes.last()? / rows - low_column + 1;
        let row = |node: &usize| node % rows;
        let low_row = nodes.iter().map(row).min()?;
        let height = nodes.iter().map(row).max()? - low_row + 1;
        let mut field = Self {
            observations,
            rows: height,
            columns,
            pitch_mm: image.pitch_mm(),
            nodes: vec![None; columns * height],
        };
        for &index in nodes {
            let (column, row) = (index / rows, index % rows);
            let Some(z_mm) = image.z_mm(column, row) else {
                continue;
            };
            let quality = image.quality(column, row);
            let scale = quality.filter(|quality| quality.inliers > 0);
            let place = (column - low_column) * height + row - low_row;
            field.nodes[place] = Some(Node {
                index,
                point_mm: Vector3::new(image.x_mm(column), image.y_mm(row), z_mm),
                deviation_mm: scale.map_or(0.0, |quality| f64::from(quality.scale_mm)),
                bend_mm: BEND * image.pitch_mm(),
            });
        }
        Some(field)
    }

    /// Places, with or without a node.
    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// Distance of neighbouring nodes, millimetres.
    pub(crate) fn pitch_mm(&self) -> f64 {
        self.pitch_mm
    }

    pub(crate) fn node(&self, place: usize) -> Option<&Node> {
        self.nodes[place].as_ref()
    }

    /// The set of all nodes.
    pub(crate) fn all(&self) -> Set {
        self.nodes.iter().map(Option::is_some).collect()
    }

    /// How far a node lies off a shape, in what it may. Infinite where there is no node.
    pub(crate) fn off(&self, shape: &Shape, place: usize) -> f64 {
        let Some(node) = &self.nodes[place] else {
            return f64::INFINITY;
        };
        let may_mm = node.may_mm(&shape.normal(&node.point_mm));
        shape.distance_mm(&node.point_mm).abs() / may_mm
    }

    /// How far a node may lie off its surface with this unit normal, millimetres.
    pub(crate) fn may_mm(&self, place: usize, normal: &Vector3<f64>) -> Option<f64> {
        self.nodes[place].as_ref().map(|node| node.may_mm(normal))
    }

    /// Places up to so far to either side, as rows and columns go.
    pub(crate) fn around(&self, place: usize, far: usize) -> impl Iterator<Item = usize> + use<> {
        let (column, row) = (place / self.rows, place % self.rows);
        let columns = column.saturating_sub(far)..(column + far + 1).min(self.columns);
        let (low, high) = (row.saturating_sub(far), (row + far + 1).min(self.rows));
        let rows = self.rows;
        columns.flat_map(move |c| (low..high).map(move |r| c * rows + r))
    }

    /// The four places beside one.
    pub(crate) fn beside(&self, place: usize) -> impl Iterator<Item = usize> + use<> {
        let row = place % self.rows;
        let (rows, len) = (self.rows, self.nodes.len());
        let all = [
            (row > 0).then(|| place - 1),
            (row + 1 < rows).then(|| place + 1),
            place.checked_sub(rows),
            (place + rows < len).then(|| place + rows),
        ];
        all.into_iter().flatten()
    }

    /// What hangs together with some places, as far as places may be taken.
    pub(crate) fn spread(&self, from: &[usize], may: impl Fn(usize) -> bool) -> Set {
        let mut seen = vec![false; self.len()];
        let mut found = vec![false; self.len()];
        let mut queue: VecDeque<usize> = from.iter().copied().collect();
        from.iter().for_each(|place| seen[*place] = true);
        while let Some(place) = queue.pop_front() {
            if !may(place) {
                continue;
            }
            found[place] = true;
            for next in self.beside(place) {
                if !seen[next] {
                    seen[next] = true;
                    queue.push_back(next);
                }
            }
        }
        found
    }

    /// The connected parts of a set, in the order of their first places.
    pub(crate) fn parts(&self, set: &[bool]) -> Vec<Set> {
        let labels: Vec<usize> = set.iter().map(|is_in| usize::from(*is_in)).collect();
        let parts = self.alike(&labels).into_iter().filter(|part| set[part[0]]);
        let as_set = |part: Vec<usize>| {
            let mut set = vec![false; labels.len()];
            part.into_iter().for_each(|place| set[place] = true);
            set
        };
        parts.map(as_set).collect()
    }

    /// The nodes of a set that lie so far within: all around them is of it.
    pub(crate) fn within(&self, set: &[bool], far: usize) -> Set {
        let is_within = |place: usize| {
            let (column, row) = (place / self.rows, place % self.rows);
            let fits =
                column >= far && row >= far && column + far < self.columns && row + far < self.rows;
            set[place] && fits && self.around(place, far).all(|p| set[p])
        };
        (0..set.len()).map(is_within).collect()
    }

    /// The nodes of a set that lie no farther than so from another.
    pub(crate) fn near(&self, set: &[bool], other: &[bool], far: usize) -> Set {
        let is_near = |place: usize| set[place] && self.around(place, far).any(|p| other[p]);
        (0..set.len()).map(is_near).collect()
    }

    /// A set without what is narrower than three nodes.
    pub(crate) fn opened(&self, set: &[bool]) -> Set {
        let cores = self.within(set, 1);
        let is_near = |place: usize| set[place] && self.around(place, 1).any(|p| cores[p]);
        (0..set.len()).map(is_near).collect()
    }

    /// At most so many samples of a set, so many nodes from its border if there are enough.
    pub(crate) fn samples(&self, set: &[bool], far: usize, most: usize) -> Vec<Sample> {
        let mut samples = Vec::new();
        for far in (0..=far).rev() {
            let inner = self.within(set, far);
            let nodes = inner.iter().zip(&self.nodes).filter(|(inner, _)| **inner);
            let nodes: Vec<usize> = nodes.filter_map(|(_, n)| Some(n.as_ref()?.index)).collect();
            samples = self.observations.of(&nodes, most);
            if samples.len() >= ENOUGH {
                break;
            }
        }
        samples
    }

    /// The shape that a set's samples speak for, those so far from its border.
    pub(crate) fn fit(&self, set: &[bool], far: usize, most: usize) -> Option<Fit> {
        let samples = self.samples(set, far, most);
        decide(&samples, self.area()).into_fit()
    }

    /// Where a node lies, millimetres.
    pub(crate) fn point_mm(&self, place: usize) -> Option<Vector3<f64>> {
        self.nodes[place].as_ref().map(|node| node.point_mm)
    }

    /// Whether there is a node.
    pub(crate) fn has(&self, place: usize) -> bool {
        self.nodes[place].is_some()
    }

    pub(crate) fn area(&self) -> f64 {
        self.observations.area()
    }

    /// The parts of equal labels that hang together, in the order of their first places.
    pub(crate) fn alike(&self, labels: &[usize]) -> Vec<Vec<usize>> {
        let mut done = vec![false; labels.len()];
        let mut parts = Vec::new();
        for first in 0..labels.len() {
            if done[first] || !self.has(first) {
                continue;
            }
            done[first] = true;
            let mut part = vec![first];
            let mut k = 0;
            while let Some(&place) = part.get(k) {
                for next in self.beside(place) {
                    if !done[next] && self.has(next) && labels[next] == labels[first] {
                        done[next] = true;
                        part.push(next);
                    }
                }
                k += 1;
            }
            parts.push(part);
        }
        parts
    }

    /// The samples at a place.
    pub(crate) fn at(&self, place: usize) -> &[Sample] {
        let node = self.nodes[place].as_ref();
        node.map_or(&[], |node| self.observations.at(node.index))
    }

    /// At most so many samples at these places.
    pub(crate) fn samples_of(&self, places: &[usize], most: usize) -> Vec<Sample> {
        let nodes: Vec<usize> = places
            .iter()
            .filter_map(|p| Some(self.node(*p)?.index))
            .collect();
        self.observations.of(&nodes, most)
    }

    /// All samples at these places.
    pub(crate) fn samples_at(&self, places: impl Iterator<Item = usize>) -> Vec<Sample> {
        let nodes: Vec<usize> = places.filter_map(|p| Some(self.node(p)?.index)).collect();
        self.observations.of(&nodes, usize::MAX)
    }
}

/// Members of a set.
pub(crate) fn places(set: &[bool]) -> Vec<usize> {
    (0..set.len()).filter(|place| set[*place]).collect()
}

pub(crate) fn count(set: &[bool]) -> usize {
    set.iter().filter(|is_in| **is_in).count()
}
