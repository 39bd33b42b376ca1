//! Evaluation of bicubic patch surfaces.

use super::{PatchSurface, PiecewiseError, check_breaks, cubic, cubic_through_thirds, piece_at};

impl PatchSurface {
    /// A checked surface.
    ///
    /// # Errors
    /// [`PiecewiseError`] when counts do not match, breaks do not ascend or a number is
    /// not finite.
    pub fn new(
        u_breaks: Vec<f64>,
        v_breaks: Vec<f64>,
        patches: Vec<[[f64; 4]; 4]>,
    ) -> Result<Self, PiecewiseError> {
        let surface = Self {
            u_breaks,
            v_breaks,
            patches,
        };
        surface.validate()?;
        Ok(surface)
    }

    /// Patches through values at the points that cut each in thirds, borders included
    /// (Shim & Lee 1995, section V): `value(i, j)` is z at the `i`-th third in u and the
    /// `j`-th in v, `0..=3 M` and `0..=3 N`. Neighbours share the values of their common
    /// border and therefore meet.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn through_thirds(
        u_breaks: Vec<f64>,
        v_breaks: Vec<f64>,
        value: impl Fn(usize, usize) -> f64,
    ) -> Result<Self, PiecewiseError> {
        let columns = u_breaks.len().saturating_sub(1);
        let rows = v_breaks.len().saturating_sub(1);
        let mut patches = Vec::with_capacity(columns * rows);
        for i in 0..columns {
            for j in 0..rows {
                let (width, height) =
                    (u_breaks[i + 1] - u_breaks[i], v_breaks[j + 1] - v_breaks[j]);
                // The system of 16 equations separates: first along u, then along v.
                let mut along_u = [[0.0; 4]; 4];
                for (q, row) in along_u.iter_mut().enumerate() {
                    let mut values = [0.0; 4];
                    for (p, v) in values.iter_mut().enumerate() {
                        *v = value(3 * i + p, 3 * j + q);
                    }
                    *row = cubic_through_thirds(values, width);
                }
                let mut patch = [[0.0; 4]; 4];
                for a in 0..4 {
                    let values = [along_u[0][a], along_u[1][a], along_u[2][a], along_u[3][a]];
                    let along_v = cubic_through_thirds(values, height);
                    for b in 0..4 {
                        patch[b][a] = along_v[b];
                    }
                }
                patches.push(patch);
            }
        }
        Self::new(u_breaks, v_breaks, patches)
    }

    /// Checks what [`Self::new`] checks; for surfaces whose fields were filled by hand.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn validate(&self) -> Result<(), PiecewiseError> {
        check_breaks(&self.u_breaks)?;
        check_breaks(&self.v_breaks)?;
        let expected = (self.u_breaks.len() - 1) * (self.v_breaks.len() - 1);
        if self.patches.len() != expected {
            return Err(PiecewiseError::Count {
                breaks: self.u_breaks.len() * self.v_breaks.len(),
                expected,
                pieces: self.patches.len(),
            });
        }
        let broken = |p: &[[f64; 4]; 4]| p.iter().flatten().any(|c| !c.is_finite());
        match self.patches.iter().position(broken) {
            Some(index) => Err(PiecewiseError::Coefficient { index }),
            None => Ok(()),
        }
    }

    /// First and last u.
    #[must_use]
    pub fn u_domain(&self) -> (f64, f64) {
        ends(&self.u_breaks)
    }

    /// First and last v.
    #[must_use]
    pub fn v_domain(&self) -> (f64, f64) {
        ends(&self.v_breaks)
    }

    /// The patch at column `i`, row `j`.
    #[must_use]
    pub fn patch(&self, i: usize, j: usize) -> Option<&[[f64; 4]; 4]> {
        let rows = self.v_breaks.len().checked_sub(1)?;
        (j < rows).then(|| self.patches.get(i * rows + j)).flatten()
    }

    /// z at `(u, v)`; beyond the rectangle the border patches go on.
    #[must_use]
    pub fn z(&self, u: f64, v: f64) -> f64 {
        self.z_partial(u, v, 0, 0)
    }

    /// The partial derivative of z of order `u_order` in u and `v_order` in v.
    #[must_use]
    pub fn z_partial(&self, u: f64, v: f64, u_order: usize, v_order: usize) -> f64 {
        let (i, j) = (piece_at(&self.u_breaks, u), piece_at(&self.v_breaks, v));
        let patch = &self.patches[i * (self.v_breaks.len() - 1) + j];
        let (s, t) = (u - self.u_breaks[i], v - self.v_breaks[j]);
        cubic(&patch.map(|row| cubic(&row, s, u_order)), t, v_order)
    }

    /// The point `(u, v, z)`.
    #[must_use]
    pub fn evaluate(&self, u: f64, v: f64) -> [f64; 3] {
        [u, v, self.z(u, v)]
    }

    /// The partial derivatives of the point in u and in v.
    #[must_use]
    pub fn partials(&self, u: f64, v: f64) -> ([f64; 3], [f64; 3]) {
        (
            [1.0, 0.0, self.z_partial(u, v, 1, 0)],
            [0.0, 1.0, self.z_partial(u, v, 0, 1)],
        )
    }

    /// The unit normal, on the side of +z.
    #[must_use]
    pub fn normal(&self, u: f64, v: f64) -> [f64; 3] {
        let (p, q) = (self.z_partial(u, v, 1, 0), self.z_partial(u, v, 0, 1));
        let length = (1.0 + p * p + q * q).sqrt();
        [-p / length, -q / length, 1.0 / length]
    }
}

fn ends(breaks: &[f64]) -> (f64, f64) {
    (
        breaks.first().copied().unwrap_or(0.0),
        breaks.last().copied().unwrap_or(0.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(u: f64, v: f64) -> f64 {
        1.0 + u - 2.0 * v + 0.5 * u * u * v - 0.1 * u * u * u * v * v + v * v * v
    }

    fn surface() -> PatchSurface {
        let (u, v) = (vec![-1.0, 0.5, 2.0, 3.5], vec![0.0, 2.0, 4.0]);
        PatchSurface::through_thirds(u, v, |i, j| {
            function(-1.0 + 0.5 * i as f64, 2.0 / 3.0 * j as f64)
        })
        .unwrap()
    }

    #[test]
    fn reproduces_bicubic_functions_and_their_derivatives() {
        let surface = surface();
        for (u, v) in [(-0.9, 0.1), (0.5, 2.0), (1.7, 3.3), (3.5, 4.0)] {
            assert!((surface.z(u, v) - function(u, v)).abs() < 1e-11);
            let du = 1.0 + u * v - 0.3 * u * u * v * v;
            let dv = -2.0 + 0.5 * u * u - 0.2 * u * u * u * v + 3.0 * v * v;
            assert!((surface.z_partial(u, v, 1, 0) - du).abs() < 1e-11);
            assert!((surface.z_partial(u, v, 0, 1) - dv).abs() < 1e-11);
            assert!((surface.z_partial(u, v, 1, 1) - (u - 0.6 * u * u * v)).abs() < 1e-11);
        }
    }

    #[test]
    fn the_normal_is_square_to_both_partials() {
        let surface = surface();
        let (u, v) = (1.2, 0.7);
        let (normal, (du, dv)) = (surface.normal(u, v), surface.partials(u, v));
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        assert!(dot(normal, du).abs() < 1e-14 && dot(normal, dv).abs() < 1e-14);
        assert!(normal[2] > 0.0 && (dot(normal, normal) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn patches_meet_at_their_borders() {
        let rough = |i: usize, j: usize| ((i * 7 + j * 13) % 11) as f64;
        let surface =
            PatchSurface::through_thirds(vec![0.0, 1.5, 3.0], vec![0.0, 1.0], rough).unwrap();
        for step in 0..=20 {
            let v = f64::from(step) / 20.0;
            let left = surface.patch(0, 0).unwrap().map(|row| cubic(&row, 1.5, 0));
            assert!((cubic(&left, v, 0) - surface.z(1.5, v)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_wrong_count_is_refused() {
        let error = PatchSurface::new(vec![0.0, 1.0], vec![0.0, 1.0, 2.0], vec![[[0.0; 4]; 4]]);
        assert!(matches!(
            error,
            Err(PiecewiseError::Count {
                expected: 2,
                pieces: 1,
                ..
            })
        ));
    }
}
