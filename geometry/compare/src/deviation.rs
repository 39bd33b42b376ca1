//! Signed distances of nodes and samples from what is seen of the nominal.

use glam::DVec3;
use range_image::{Cancelled, Column, Monitor, RangeImage};
use rayon::prelude::*;

use crate::nominal::Nominal;
use crate::pose::Pose;
use crate::seen::Seen;

/// What a node of the range image is to the nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NodeState {
    /// Nothing was measured there.
    Masked,
    /// Its signed distance along the nominal's normal, millimetres; positive outside.
    Compared(f64),
    /// It lies near the nominal, but at a step or an end of what is seen of it.
    AtEdge,
    /// It lies farther from the nominal than the limit: it belongs to something else.
    Foreign,
}

/// What points are held against.
pub(crate) struct Ground<'a> {
    pub(crate) nominal: &'a Nominal,
    pub(crate) pose: Pose,
    pub(crate) seen: Seen,
    pub(crate) pitch_mm: f64,
    pub(crate) limit_mm: f64,
}

impl Ground<'_> {
    /// What a point of the scan is to the nominal.
    pub(crate) fn state(&self, point: DVec3) -> NodeState {
        let moved = self.pose.point(point);
        let view = self.pose.direction(DVec3::Z);
        let Some(foot) = self.nominal.nearest(moved, view, self.limit_mm) else {
            return NodeState::Foreign;
        };
        let cell = |coordinate: f64| (coordinate / self.pitch_mm).round() as i64;
        let here = self.seen.index(cell(point.x), cell(point.y));
        let Some((index, (z_mm, cosine))) = here.and_then(|n| Some((n, self.seen.at(n)?))) else {
            return NodeState::AtEdge;
        };
        if self.seen.is_edge(index) {
            return NodeState::AtEdge;
        }
        // Near something that is hidden behind what is seen: it is not that which was measured.
        if (point.z - z_mm).abs() * cosine > self.limit_mm + self.pitch_mm {
            return NodeState::Foreign;
        }
        NodeState::Compared((moved - foot.point_mm).dot(foot.normal))
    }
}

/// The states of all nodes, column by column.
pub(crate) fn nodes(
    ground: &Ground<'_>,
    image: &RangeImage,
    monitor: &dyn Monitor,
) -> Result<Vec<NodeState>, Cancelled> {
    let columns: Result<Vec<Vec<NodeState>>, Cancelled> = (0..image.columns())
        .into_par_iter()
        .map(|column| {
            monitor.check()?;
            let x = image.x_mm(column);
            let each = (0..image.rows()).map(|row| match image.z_mm(column, row) {
                Some(z) => ground.state(DVec3::new(x, image.y_mm(row), z)),
                None => NodeState::Masked,
            });
            Ok(each.collect())
        })
        .collect();
    Ok(columns?.into_iter().flatten().collect())
}

/// A sample's place on the lattice, in pitches from the image's first node, and its deviation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    pub(crate) column: f32,
    pub(crate) row: f32,
    pub(crate) deviation_mm: f64,
}

/// The samples' deviations, gathered at their nearest nodes.
pub(crate) struct Residuals {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// Where each node's residuals begin; one more than there are nodes.
    starts: Vec<usize>,
    list: Vec<Residual>,
}

impl Residuals {
    pub(crate) fn new(
        ground: &Ground<'_>,
        image: &RangeImage,
        columns: &[Column],
        monitor: &dyn Monitor,
    ) -> Result<Self, Cancelled> {
        let (x_first, y_first) = (image.x_mm(0), image.y_mm(0));
        let pitch_mm = image.pitch_mm();
        let (width, height) = (image.columns(), image.rows());
        let found: Result<Vec<Vec<(usize, Residual)>>, Cancelled> = columns
            .par_iter()
            .map(|column| {
                monitor.check()?;
                let across = (column.x_mm() - x_first) / pitch_mm;
                let each = column.samples().iter().filter_map(|sample| {
                    let up = (sample.y_mm - y_first) / pitch_mm;
                    let node = node(across, up, width, height)?;
                    // Where there is no node there is no surface, only stray samples.
                    image.z_mm(node / height, node % height)?;
                    let point = DVec3::new(column.x_mm(), sample.y_mm, sample.z_mm);
                    let NodeState::Compared(deviation_mm) = ground.state(point) else {
                        return None;
                    };
                    let residual = Residual {
                        column: across as f32,
                        row: up as f32,
                        deviation_mm,
                    };
                    Some((node, residual))
                });
                Ok(each.collect())
            })
            .collect();
        let mut all: Vec<(usize, Residual)> = found?.into_iter().flatten().collect();
        // Ties by what the residuals hold, so that the order of columns leaves no trace.
        all.sort_by(|(a, ra), (b, rb)| {
            a.cmp(b)
                .then(ra.column.total_cmp(&rb.column))
                .then(ra.row.total_cmp(&rb.row))
                .then(ra.deviation_mm.total_cmp(&rb.deviation_mm))
        });
        let mut starts = vec![0; width * height + 1];
        for (node, _) in &all {
            if let Some(count) = starts.get_mut(node + 1) {
                *count += 1;
            }
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        Ok(Self {
            columns: width,
            rows: height,
            starts,
            list: all.into_iter().map(|(_, residual)| residual).collect(),
        })
    }

    /// The residuals nearest to a node.
    pub(crate) fn of(&self, column: usize, row: usize) -> &[Residual] {
        let node = column * self.rows + row;
        let range = self.starts.get(node).zip(self.starts.get(node + 1));
        range
            .and_then(|(a, b)| self.list.get(*a..*b))
            .unwrap_or(&[])
    }

    /// The deviations of all samples within a radius of a node, in pitches, each with a weight
    /// that falls off as a parabola: means then see what is as wide as the patch best.
    pub(crate) fn around(&self, column: usize, row: usize, radius: f64, into: &mut Vec<[f64; 2]>) {
        into.clear();
        let reach = radius.ceil() as usize + 1;
        let (c, r) = (column as f64, row as f64);
        for near in column.saturating_sub(reach)..(column + reach + 1).min(self.columns) {
            for up in row.saturating_sub(reach)..(row + reach + 1).min(self.rows) {
                for residual in self.of(near, up) {
                    let (dx, dy) = (f64::from(residual.column) - c, f64::from(residual.row) - r);
                    let weight = 1.0 - (dx * dx + dy * dy) / (radius * radius);
                    if weight > 0.0 {
                        into.push([residual.deviation_mm, weight]);
                    }
                }
            }
        }
    }
}

fn node(across: f64, up: f64, width: usize, height: usize) -> Option<usize> {
    let whole = |share: f64, most: usize| {
        let rounded = share.round();
        (rounded >= 0.0 && rounded < most as f64).then_some(rounded as usize)
    };
    Some(whole(across, width)? * height + whole(up, height)?)
}
