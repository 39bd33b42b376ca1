//! Planes through regions, and which nodes lie in them, before or behind them.

use range_image::{RangeImage, RegionMap};

/// A plane seen from the camera's side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal towards the camera (z positive).
    pub normal: [f64; 3],
    /// Distance from the origin along the normal, millimetres.
    pub offset_mm: f64,
    /// Root mean square distance of the nodes it was fitted to, outliers left out,
    /// millimetres.
    pub rms_mm: f64,
}

impl Plane {
    /// Signed distance of a point, positive on the camera's side, millimetres.
    #[must_use]
    pub fn distance_mm(&self, x_mm: f64, y_mm: f64, z_mm: f64) -> f64 {
        let [a, b, c] = self.normal;
        a * x_mm + b * y_mm + c * z_mm - self.offset_mm
    }

    /// How far a node may lie off the plane and still belong to it, millimetres.
    pub(super) fn tolerance_mm(&self, pitch_mm: f64) -> f64 {
        pitch_mm.max(4.0 * self.rms_mm)
    }
}

/// A region and the plane through it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted {
    pub(super) nodes: usize,
    pub(super) plane: Option<Plane>,
    /// Whether the plane describes the region.
    pub(super) is_flat: bool,
}

/// How the nodes of a region lie to a plane.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    /// Within the tolerance.
    pub(super) within: usize,
    /// Farther off, away from the camera.
    pub(super) behind: usize,
}

/// Nodes farther off than so many root mean squares are left out of the next fit.
const OUTLYING: f64 = 3.0;
/// A flat region has its root mean square below this many pitches.
const FLAT_PITCHES: f64 = 0.3;
/// Of a flat region so many nodes survive as no outliers.
const FLAT_SHARE: f64 = 0.9;

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: f64,
    mean: [f64; 3],
    /// Of products of deviations: xx, xy, yy, xz, yz, zz.
    products: [f64; 6],
}

impl Sums {
    fn add(&mut self, p: [f64; 3]) {
        // Welford's update: places far from the origin cost no digits.
        self.n += 1.0;
        let before = [0, 1, 2].map(|k| p[k] - self.mean[k]);
        for (mean, off) in self.mean.iter_mut().zip(before) {
            *mean += off / self.n;
        }
        let after = [0, 1, 2].map(|k| p[k] - self.mean[k]);
        for (sum, (i, j)) in
            self.products
                .iter_mut()
                .zip([(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)])
        {
            *sum += before[i] * after[j];
        }
    }

    /// The least-squares plane z(x, y); `None` where nodes are few or lie on a line.
    fn plane(&self) -> Option<Plane> {
        let [xx, xy, yy, xz, yz, zz] = self.products;
        let determinant = xx * yy - xy * xy;
        if self.n < 3.0 || determinant <= 1e-9 * (xx * yy).max(f64::MIN_POSITIVE) {
            return None;
        }
        let p = (xz * yy - yz * xy) / determinant;
        let q = (yz * xx - xz * xy) / determinant;
        let left = (zz - p * xz - q * yz).max(0.0);
        let length = libm::sqrt(1.0 + p * p + q * q);
        let normal = [-p / length, -q / length, 1.0 / length];
        let offset_mm = (0..3).map(|k| normal[k] * self.mean[k]).sum();
        Some(Plane {
            normal,
            offset_mm,
            rms_mm: libm::sqrt(left / self.n) / length,
        })
    }
}

/// Every node of a region: its label and place.
pub(super) fn labelled<'a>(
    image: &'a RangeImage,
    map: &'a RegionMap,
) -> impl Iterator<Item = (u16, [f64; 3])> + 'a {
    let rows = image.rows().max(1);
    let nodes = map.raw_labels().iter().zip(image.raw_z_mm()).enumerate();
    nodes
        .filter(|(_, (label, z))| **label != 0 && !z.is_nan())
        .map(move |(k, (&label, &z))| (label, [image.x_mm(k / rows), image.y_mm(k % rows), z]))
}

/// A plane through each region; entry k is region k + 1.
pub(super) fn fit_regions(image: &RangeImage, map: &RegionMap) -> Vec<Fitted> {
    let nodes = map.node_counts();
    let mut sums = vec![Sums::default(); nodes.len()];
    for (label, p) in labelled(image, map) {
        sums[usize::from(label) - 1].add(p);
    }
    let mut planes: Vec<Option<Plane>> = sums.iter().map(Sums::plane).collect();
    // A few nodes that belong to a neighbour would tilt the plane of a large region by more
    // than its noise does.
    for _ in 0..2 {
        sums.fill(Sums::default());
        for (label, p) in labelled(image, map) {
            let k = usize::from(label) - 1;
            let limit_mm = |plane: &Plane| OUTLYING * plane.rms_mm + 1e-9;
            if planes[k].is_some_and(|f| f.distance_mm(p[0], p[1], p[2]).abs() <= limit_mm(&f)) {
                sums[k].add(p);
            }
        }
        planes = sums.iter().map(Sums::plane).collect();
    }
    let fitted = nodes.into_iter().zip(planes).zip(sums);
    fitted
        .map(|((nodes, plane), sums)| Fitted {
            nodes,
            plane,
            is_flat: sums.n >= FLAT_SHARE * nodes as f64
                && plane.is_some_and(|plane| plane.rms_mm <= FLAT_PITCHES * image.pitch_mm()),
        })
        .collect()
}

/// How the nodes of each region lie to a plane.
pub(super) fn tally(
    image: &RangeImage,
    map: &RegionMap,
    plane: &Plane,
    tolerance_mm: f64,
) -> Vec<Tally> {
    let mut tally = vec![Tally::default(); usize::from(map.regions())];
    for (label, [x, y, z]) in labelled(image, map) {
        let entry = &mut tally[usize::from(label) - 1];
        let distance_mm = plane.distance_mm(x, y, z);
        if distance_mm.abs() <= tolerance_mm {
            entry.within += 1;
        } else if distance_mm < 0.0 {
            entry.behind += 1;
        }
    }
    tally
}
