//! How far the samples of a scan lie from the trimmed faces.

use range_image::{Column, RangeImage, RegionMap};
use reconstruct::{Face, Surface};

/// Places on each piece of a border that make it a polygon.
const PLACES: usize = 8;

/// The samples of a scan against the trimmed faces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Residuals {
    pub(crate) samples: usize,
    /// Samples within three standard deviations of the surface of the face they lie within.
    near: usize,
    /// Squared distances along the normal, for samples within a trimmed face as the camera
    /// sees it, square millimetres.
    squares_mm2: Vec<f64>,
    /// Samples within no face.
    pub(crate) outside: Outside,
}

/// Samples within no face, by the nodes that they are nearest to.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Outside {
    /// Without a value: the samples there agree too little, as on sides seen edge on.
    pub(crate) masked: usize,
    /// Of no region.
    pub(crate) crumbs: usize,
    /// Of regions: the outlines run too tight.
    pub(crate) regions: usize,
}

impl Outside {
    fn add(&mut self, image: &RangeImage, regions: &RegionMap, [x, y]: [f64; 2]) {
        let pitch_mm = image.pitch_mm();
        let nearest = |off_mm: f64, count: usize| {
            let place = (off_mm / pitch_mm).round();
            (place >= 0.0 && place < count as f64).then_some(place as usize)
        };
        let column = nearest(x - image.x_mm(0), image.columns());
        let row = nearest(y - image.y_mm(0), image.rows());
        match column.zip(row) {
            Some((column, row)) if regions.label(column, row) != 0 => self.regions += 1,
            Some((column, row)) if image.z_mm(column, row).is_some() => self.crumbs += 1,
            _ => self.masked += 1,
        }
    }
}

impl Residuals {
    fn add(&mut self, off_mm: f64, sigma_mm: f64) {
        self.samples += 1;
        self.near += usize::from(off_mm.abs() <= 3.0 * sigma_mm);
        self.squares_mm2.push(off_mm * off_mm);
    }

    /// Part of the samples that lie within a face.
    pub(crate) fn coverage(&self) -> f64 {
        self.squares_mm2.len() as f64 / self.samples as f64
    }

    /// Part of those that lie within three standard deviations of its surface.
    pub(crate) fn near_share(&self) -> f64 {
        self.near as f64 / self.squares_mm2.len() as f64
    }

    /// Root mean square distance along the normal.
    pub(crate) fn rms_mm(&self) -> f64 {
        rms(&self.squares_mm2)
    }

    /// The same of this part of all samples, the nearest ones; infinite where fewer lie
    /// within faces.
    pub(crate) fn rms_of_nearest_mm(&self, part: f64) -> f64 {
        let count = (part * self.samples as f64).ceil() as usize;
        let mut squares = self.squares_mm2.clone();
        squares.sort_unstable_by(f64::total_cmp);
        squares.get(..count).map_or(f64::INFINITY, rms)
    }
}

fn rms(squares: &[f64]) -> f64 {
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// A face, its border as a polygon in x and y.
struct Outline<'a> {
    face: &'a Face,
    sides: Vec<[[f64; 2]; 2]>,
    sigma_mm: f64,
}

impl<'a> Outline<'a> {
    fn new(face: &'a Face, sigma_mm: f64) -> Self {
        let mut sides = Vec::new();
        let loops = core::iter::once(&face.outer).chain(&face.inner);
        for curve in loops.flat_map(|l| &l.coedges).map(|c| &c.parameter_curve) {
            for pair in curve.breaks.windows(2) {
                let at = |k: usize| {
                    let share = k as f64 / PLACES as f64;
                    curve.evaluate(pair[0] + share * (pair[1] - pair[0]))
                };
                sides.extend((0..PLACES).map(|k| [at(k), at(k + 1)]));
            }
        }
        Self {
            face,
            sides,
            sigma_mm,
        }
    }

    /// Where the line at this x enters and leaves the face, in turns.
    fn crossings(&self, x: f64) -> Vec<f64> {
        let crossed = self
            .sides
            .iter()
            .filter(|[a, b]| (a[0] <= x) != (b[0] <= x));
        let mut crossings: Vec<f64> = crossed
            .map(|[a, b]| a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]))
            .collect();
        crossings.sort_by(f64::total_cmp);
        crossings
    }

    /// Distance of a sample along the surface's normal.
    fn off_mm(&self, x: f64, y: f64, z: f64) -> f64 {
        let Surface::Patches(surface) = &self.face.surface;
        let [p, q] = [(1, 0), (0, 1)].map(|(u, v)| surface.z_partial(x, y, u, v));
        (z - surface.z(x, y)) / (1.0 + p * p + q * q).sqrt()
    }
}

/// Every sample against the face that it lies within; and the same for each face's region,
/// in the order of the faces, of the samples covered.
pub(crate) fn residuals(
    columns: &[Column],
    image: &RangeImage,
    regions: &RegionMap,
    faces: &[Face],
) -> (Residuals, Vec<Residuals>) {
    let outlines: Vec<Outline<'_>> = faces
        .iter()
        .map(|face| Outline::new(face, noise_mm(image, regions, face.region)))
        .collect();
    let mut each = vec![Residuals::default(); faces.len()];
    let mut uncovered = Residuals::default();
    for column in columns {
        let x = column.x_mm();
        let crossings: Vec<_> = outlines.iter().map(|o| o.crossings(x)).collect();
        for sample in column.samples() {
            let within = |c: &Vec<f64>| c.partition_point(|y| *y <= sample.y_mm) % 2 == 1;
            let Some(k) = crossings.iter().position(within) else {
                uncovered.samples += 1;
                uncovered.outside.add(image, regions, [x, sample.y_mm]);
                continue;
            };
            let off = outlines[k].off_mm(x, sample.y_mm, sample.z_mm);
            each[k].add(off, outlines[k].sigma_mm);
        }
    }
    let mut all = uncovered;
    for one in &each {
        all.samples += one.samples;
        all.near += one.near;
        all.squares_mm2.extend(&one.squares_mm2);
    }
    (all, each)
}

/// The noise of a region's samples, as the regridder met it: the median over the nodes.
fn noise_mm(image: &RangeImage, regions: &RegionMap, label: u16) -> f64 {
    let mut scales = Vec::new();
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            if regions.label(column, row) == label {
                scales.extend(image.quality(column, row).map(|q| f64::from(q.scale_mm)));
            }
        }
    }
    let middle = scales.len() / 2;
    if scales.is_empty() {
        return 0.0;
    }
    *scales.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Lattice;

    #[test]
    fn samples_outside_are_told_by_the_nodes_nearest_to_them() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 2, 4, 3, 1);
        image.set_z_mm(0, 0, Some(1.0));
        image.set_z_mm(1, 0, Some(1.0));
        let regions = RegionMap::new(&image, vec![1, 0, 0]);
        let mut outside = Outside::default();
        // At the three nodes, the last of them without a value, and off the grid.
        for x in [1.2, 1.7, 1.6, 2.0, 9.0, 0.7] {
            outside.add(&image, &regions, [x, 2.1]);
        }
        outside.add(&image, &regions, [1.0, 2.3]);
        let Outside {
            masked,
            crumbs,
            regions,
        } = outside;
        assert_eq!((masked, crumbs, regions), (4, 2, 1));
    }
}
