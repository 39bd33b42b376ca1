//! A plane, quadric or quartic over the nodes of a piece.

use pulp::{Arch, Simd, WithSimd};

use super::least_squares::LeastSquares;
use crate::grid::Grid;
use crate::scene::Scene;

/// Terms by degree: u^a v^b.
const POWERS: [(usize, usize); QUARTIC] = [
    (0, 0),
    (1, 0),
    (0, 1),
    (2, 0),
    (1, 1),
    (0, 2),
    (3, 0),
    (2, 1),
    (1, 2),
    (0, 3),
    (4, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 4),
];
const PLANE: usize = 3;
const QUADRIC: usize = 6;
const QUARTIC: usize = 15;
/// Fewer nodes carry no quadric.
const LEAST_QUADRIC_NODES: usize = 24;
/// Fewer nodes carry no quartic.
pub(super) const LEAST_QUARTIC_NODES: usize = 120;
/// F ratio from which more terms are believed.
const LEAST_RATIO: f64 = 8.0;
/// More terms must take away this share of the noise's variance.
const LEAST_GAIN: f64 = 0.15;

/// z over the image's columns and rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surface {
    /// Column and row of the origin.
    origin: [f64; 2],
    /// Nodes to a unit of u and v, so that terms are of like size.
    scale: f64,
    z0_mm: f64,
    terms: [f64; QUARTIC],
    count: usize,
    /// Square sum of what it leaves at its nodes, in squares of millimetres.
    pub(crate) error_mm2: f64,
    /// Its noise over that of the image, at least 1: coarse depths are rougher on surfaces
    /// that face the camera.
    pub(crate) roughness: f64,
}

impl Surface {
    /// Fits a plane, and a quadric or quartic where less leaves clearly more than the noise;
    /// `None` where the nodes are few or lie on a line.
    ///
    /// `roughness` is the surface's noise over that of the image.
    pub(crate) fn fit(scene: &Scene<'_>, nodes: &[u32], roughness: f64) -> Option<Self> {
        let frame = Frame::of(scene, nodes)?;
        let sums = frame.sums::<QUADRIC>(scene, nodes);
        let mut best = frame.surface(&sums, PLANE, roughness)?;
        let noise_mm = roughness * best.noise_mm(scene);
        let variance = noise_mm * noise_mm;
        let gains = |less: &Self, more: &Self| {
            let gain = less.error_mm2 - more.error_mm2;
            let freedom = nodes.len() as f64 - more.count as f64;
            let left = (more.error_mm2 / freedom).max(0.25 * variance);
            let terms = (more.count - less.count) as f64;
            gain > terms * LEAST_RATIO * scene.noise.area_nodes * left
                && gain > LEAST_GAIN * variance * nodes.len() as f64
        };
        if nodes.len() < LEAST_QUADRIC_NODES {
            return Some(best);
        }
        match frame.surface(&sums, QUADRIC, roughness) {
            Some(quadric) if gains(&best, &quadric) => best = quadric,
            _ => return Some(best),
        }
        if nodes.len() >= LEAST_QUARTIC_NODES {
            let sums = frame.sums::<QUARTIC>(scene, nodes);
            if let Some(quartic) = frame.surface(&sums, QUARTIC, roughness)
                && gains(&best, &quartic)
            {
                best = quartic;
            }
        }
        Some(best)
    }

    /// Fits a plane; `None` where the nodes are few or lie on a line.
    pub(crate) fn plane(scene: &Scene<'_>, nodes: &[u32]) -> Option<Self> {
        let frame = Frame::of(scene, nodes)?;
        let sums = frame.sums::<QUADRIC>(scene, nodes);
        frame.surface(&sums, PLANE, 1.0)
    }

    /// Whether a plane leaves nearly as little as a quadric at these nodes.
    pub(crate) fn is_flat(scene: &Scene<'_>, nodes: &[u32], share: f64) -> bool {
        let Some(frame) = Frame::of(scene, nodes) else {
            return false;
        };
        let sums = frame.sums::<QUADRIC>(scene, nodes);
        match (sums.solve(PLANE), sums.solve(QUADRIC)) {
            (Some(plane), Some(quadric)) => quadric.error >= share * plane.error,
            _ => false,
        }
    }

    /// What a quadric leaves at these nodes, in its standard deviations of noise; `None` where
    /// there are too few of them for one.
    pub(super) fn left_by_quadric(scene: &Scene<'_>, nodes: &[u32]) -> Option<f64> {
        if nodes.len() < LEAST_QUADRIC_NODES {
            return None;
        }
        let frame = Frame::of(scene, nodes)?;
        let sums = frame.sums::<QUADRIC>(scene, nodes);
        let quadric = frame.surface(&sums, QUADRIC, 1.0)?;
        let freedom = (nodes.len() - QUADRIC) as f64;
        Some(libm::sqrt(quadric.error_mm2 / freedom) / quadric.noise_mm(scene))
    }

    pub(crate) fn is_plane(&self) -> bool {
        self.count == PLANE
    }

    /// Whether it bends so freely that it cannot be carried on far.
    pub(crate) fn is_quartic(&self) -> bool {
        self.count == QUARTIC
    }

    /// z at a place in columns and rows, millimetres.
    #[inline]
    pub(crate) fn z_mm(&self, column: f64, row: f64) -> f64 {
        let [u, v] = self.place(column, row);
        let [a, b, c, d, e, f, ..] = self.terms;
        let mut z = a + b * u + c * v + d * u * u + e * u * v + f * v * v;
        if self.is_quartic() {
            let (u, v) = (powers(u), powers(v));
            for (term, (a, b)) in self.terms.iter().zip(POWERS).skip(QUADRIC) {
                z += term * u[a] * v[b];
            }
        }
        self.z0_mm + z
    }

    #[inline]
    fn place(&self, column: f64, row: f64) -> [f64; 2] {
        [column - self.origin[0], row - self.origin[1]].map(|at| at / self.scale)
    }

    /// Standard deviation of z to expect at its middle, roughness left aside, millimetres.
    pub(crate) fn noise_mm(&self, scene: &Scene<'_>) -> f64 {
        scene
            .noise
            .on_slope_mm(self.middle_rise_mm(), scene.grid.pitch_mm)
    }

    /// Rise of z per column and per row at its middle, millimetres.
    pub(crate) fn middle_rise_mm(&self) -> [f64; 2] {
        self.rise_mm(self.origin[0], self.origin[1])
    }

    /// How far a node lies off, along z, in standard deviations of its noise there.
    #[inline]
    pub(crate) fn miss(&self, scene: &Scene<'_>, node: usize) -> f64 {
        let (c, r) = scene.grid.column_row(node);
        let (c, r) = (c as f64, r as f64);
        let noise_mm = scene
            .noise
            .on_slope_mm(self.rise_mm(c, r), scene.grid.pitch_mm);
        (scene.grid.z_mm[node] - self.z_mm(c, r)).abs() / (self.roughness * noise_mm)
    }

    /// How far a node lies off the surface, square to it.
    pub(crate) fn distance_mm(&self, scene: &Scene<'_>, node: usize) -> f64 {
        let (c, r) = scene.grid.column_row(node);
        let (c, r) = (c as f64, r as f64);
        let [p, q] = self.rise_mm(c, r).map(|rise| rise / scene.grid.pitch_mm);
        (scene.grid.z_mm[node] - self.z_mm(c, r)).abs() / libm::sqrt(1.0 + p * p + q * q)
    }

    /// Rise of z per column and per row, millimetres.
    #[inline]
    pub(crate) fn rise_mm(&self, column: f64, row: f64) -> [f64; 2] {
        let [u, v] = self.place(column, row);
        let [_, b, c, d, e, f, ..] = self.terms;
        let mut rise = [b + 2.0 * d * u + e * v, c + e * u + 2.0 * f * v];
        if self.is_quartic() {
            let (u, v) = (powers(u), powers(v));
            for (term, (a, b)) in self.terms.iter().zip(POWERS).skip(QUADRIC) {
                rise[0] += term * a as f64 * u[a.saturating_sub(1)] * v[b];
                rise[1] += term * b as f64 * u[a] * v[b.saturating_sub(1)];
            }
        }
        rise.map(|rise| rise / self.scale)
    }
}

/// 1, x, x^2, x^3, x^4.
#[inline(always)]
fn powers(x: f64) -> [f64; 5] {
    let square = x * x;
    [1.0, x, square, square * x, square * square]
}

/// Where the nodes are, so that sums over them keep their digits.
struct Frame {
    origin: [f64; 2],
    scale: f64,
    z0_mm: f64,
}

impl Frame {
    fn of(scene: &Scene<'_>, nodes: &[u32]) -> Option<Self> {
        let grid = &scene.grid;
        let z0_mm = grid.z_mm[*nodes.first()? as usize];
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for &node in nodes {
            let (c, r) = grid.column_row(node as usize);
            for (k, place) in [c, r].into_iter().enumerate() {
                low[k] = low[k].min(place);
                high[k] = high[k].max(place);
            }
        }
        let side = (high[0] - low[0]).max(high[1] - low[1]);
        Some(Self {
            origin: [0, 1].map(|k| 0.5 * (low[k] + high[k]) as f64),
            scale: (0.5 * side as f64).max(1.0),
            z0_mm,
        })
    }

    fn sums<const N: usize>(&self, scene: &Scene<'_>, nodes: &[u32]) -> LeastSquares<N> {
        Arch::new().dispatch(Summed {
            frame: self,
            grid: &scene.grid,
            nodes,
        })
    }

    fn surface<const N: usize>(
        &self,
        sums: &LeastSquares<N>,
        count: usize,
        roughness: f64,
    ) -> Option<Surface> {
        let solution = sums.solve(count)?;
        let mut terms = [0.0; QUARTIC];
        for (term, value) in terms.iter_mut().zip(solution.terms) {
            *term = value;
        }
        Some(Surface {
            origin: self.origin,
            scale: self.scale,
            z0_mm: self.z0_mm,
            terms,
            count,
            error_mm2: solution.error,
            roughness,
        })
    }
}

/// Nodes to be summed up with the lanes that the processor has.
struct Summed<'a, const N: usize> {
    frame: &'a Frame,
    grid: &'a Grid<'a>,
    nodes: &'a [u32],
}

impl<const N: usize> WithSimd for Summed<'_, N> {
    type Output = LeastSquares<N>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> LeastSquares<N> {
        let Self { frame, grid, nodes } = self;
        let mut sums = LeastSquares::new();
        for &node in nodes {
            let (c, r) = grid.column_row(node as usize);
            let u = powers((c as f64 - frame.origin[0]) / frame.scale);
            let v = powers((r as f64 - frame.origin[1]) / frame.scale);
            let mut terms = [0.0; N];
            for (term, (a, b)) in terms.iter_mut().zip(POWERS) {
                *term = u[a] * v[b];
            }
            sums.add(&terms, grid.z_mm[node as usize] - frame.z0_mm, 1.0);
        }
        sums
    }
}
