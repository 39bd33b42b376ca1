//! Parabolas through a few points.

/// A parabola z(u), seen at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    /// z there.
    pub(super) height: f64,
    /// Its derivative.
    pub(super) slope: f64,
    /// Its derivative in the middle of the points, where its second derivative is that of whatever
    /// curve they lie on.
    pub(super) middle_slope: f64,
    /// Its second derivative.
    pub(super) second: f64,
    /// Standard deviations of height, slope and second derivative for noise of 1.
    pub(super) sigmas: [f64; 3],
    /// Of the residuals: their sum of squares by the degrees of freedom.
    pub(super) mean_square: f64,
}

/// The least-squares parabola of points, at `place`; `None` where they lie at fewer than three u.
pub(super) fn parabola(points: &[[f64; 2]], place: f64) -> Option<Fit> {
    let count = points.len();
    if count < 4 {
        return None;
    }
    let middle = points.iter().map(|own| own[0]).sum::<f64>() / count as f64;
    let reach = points
        .iter()
        .map(|own| (own[0] - middle).abs())
        .fold(0.0, f64::max);
    if reach.is_nan() || reach <= 0.0 {
        return None;
    }
    let base = points[0][1];
    let mut powers = [0.0; 5];
    let mut sums = [0.0; 3];
    for &[u, z] in points {
        let t = (u - middle) / reach;
        let mut power = 1.0;
        for (k, own) in powers.iter_mut().enumerate() {
            *own += power;
            if let Some(sum) = sums.get_mut(k) {
                *sum += power * (z - base);
            }
            power *= t;
        }
    }
    let [s0, s1, s2, s3, s4] = powers;
    // The inverse of the normal matrix by its cofactors.
    let c = [
        [s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2],
        [s2 * s3 - s1 * s4, s0 * s4 - s2 * s2, s1 * s2 - s0 * s3],
        [s1 * s3 - s2 * s2, s1 * s2 - s0 * s3, s0 * s2 - s1 * s1],
    ];
    let determinant = s0 * c[0][0] + s1 * c[0][1] + s2 * c[0][2];
    // Of points at two u only it is 0; of evenly spread ones, some hundredths of the cube of count.
    if determinant <= 1e-9 * s0 * s0 * s0 {
        return None;
    }
    let apply = |v: [f64; 3]| {
        [0, 1, 2].map(|k| (c[k][0] * v[0] + c[k][1] * v[1] + c[k][2] * v[2]) / determinant)
    };
    let [a0, a1, a2] = apply(sums);
    let residual = |&[u, z]: &[f64; 2]| {
        let t = (u - middle) / reach;
        let off = z - base - (a0 + t * (a1 + t * a2));
        off * off
    };
    let squares: f64 = points.iter().map(residual).sum();
    let t = (place - middle) / reach;
    let sigma = |v: [f64; 3]| {
        let w = apply(v);
        libm::sqrt((v[0] * w[0] + v[1] * w[1] + v[2] * w[2]).max(0.0))
    };
    Some(Fit {
        height: base + a0 + t * (a1 + t * a2),
        slope: (a1 + 2.0 * t * a2) / reach,
        middle_slope: a1 / reach,
        second: 2.0 * a2 / (reach * reach),
        sigmas: [
            sigma([1.0, t, t * t]),
            sigma([0.0, 1.0, 2.0 * t]) / reach,
            2.0 * sigma([0.0, 0.0, 1.0]) / (reach * reach),
        ],
        mean_square: squares / (count - 3) as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;

    #[test]
    fn a_parabola_is_found_as_it_is() {
        let at = |u: f64| 3.0 - 0.4 * u + 0.05 * u * u;
        let points: Vec<[f64; 2]> = [1.0, 1.4, 2.5, 3.0, 4.2].map(|u| [u, at(u)]).to_vec();
        let fit = parabola(&points, 4.5).unwrap();
        assert!((fit.height - at(4.5)).abs() < 1e-12);
        assert!((fit.slope - (-0.4 + 0.1 * 4.5)).abs() < 1e-12);
        assert!((fit.second - 0.1).abs() < 1e-12 && fit.mean_square < 1e-24);
        assert!(parabola(&points[..3], 1.0).is_none());
        let two = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
        assert!(parabola(&two, 0.0).is_none());
        assert!(parabola(&[[1.0, 0.0]; 5], 0.0).is_none());
    }

    /// What it says of its uncertainty is what noise makes of it.
    #[test]
    fn its_deviations_are_those_of_draws() {
        let mut chance = Chance::new(11, 0);
        let (mut sums, mut sigmas) = ([0.0; 4], [0.0; 3]);
        const DRAWS: usize = 4000;
        for _ in 0..DRAWS {
            let points: Vec<[f64; 2]> = (0..9)
                .map(|k| [0.5 * f64::from(k), chance.normal()])
                .collect();
            let fit = parabola(&points, 4.25).unwrap();
            for (sum, own) in sums.iter_mut().zip([fit.height, fit.slope, fit.second]) {
                *sum += own * own;
            }
            sums[3] += fit.mean_square;
            sigmas = fit.sigmas;
        }
        for (sum, sigma) in sums.iter().zip(sigmas) {
            let drawn = libm::sqrt(sum / DRAWS as f64);
            assert!((drawn / sigma - 1.0).abs() < 0.05, "{drawn} {sigma}");
        }
        assert!((sums[3] / DRAWS as f64 - 1.0).abs() < 0.05);
    }
}
