//! Piecewise cubic curves and piecewise bicubic surfaces in power form.

mod convert;
mod curve;
mod power;
mod surface;

/// A curve of cubic pieces in `D` dimensions (IGES entity 112).
///
/// On piece `k`, with `s = t - breaks[k]`, coordinate `d` is
/// `c[0] + c[1] s + c[2] s^2 + c[3] s^3` with `c = pieces[k][d]`.
#[derive(Debug, Clone, PartialEq)]
pub struct PiecewiseCubic<const D: usize> {
    /// Strictly ascending parameters where pieces meet; one more than there are pieces.
    pub breaks: Vec<f64>,
    /// Coefficients of each piece, by coordinate, ascending powers.
    pub pieces: Vec<[[f64; 4]; D]>,
}

/// A function of bicubic patches over a rectangle: the surface `(u, v, z(u, v))` whose
/// parameters are its own x and y (IGES entity 114; Shim & Lee 1995, section V).
///
/// On patch `(i, j)`, with `s = u - u_breaks[i]` and `t = v - v_breaks[j]`, z is the sum
/// over `a`, `b` of `c[b][a] s^a t^b` with `c = patches[i * (v_breaks.len() - 1) + j]`.
/// Units: millimetres throughout.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchSurface {
    /// Strictly ascending breaks in u, that is in x.
    pub u_breaks: Vec<f64>,
    /// Strictly ascending breaks in v, that is in y.
    pub v_breaks: Vec<f64>,
    /// Coefficients of z for each patch, v fastest: `[power of t][power of s]`.
    pub patches: Vec<[[f64; 4]; 4]>,
}

/// Why coefficients do not make a piecewise cubic.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PiecewiseError {
    /// There is no piece.
    #[error("there is no piece: at least two breaks and one piece are needed")]
    Empty,
    /// Breaks and pieces do not match.
    #[error("{breaks} breaks bound {expected} pieces, but there are {pieces}")]
    Count {
        /// Number of breaks given (of the product of intervals for a surface).
        breaks: usize,
        /// Number of pieces they bound.
        expected: usize,
        /// Number of pieces given.
        pieces: usize,
    },
    /// A break is not above the one before it, or not finite.
    #[error("break {index} ({value}) is not finite and above the one before it")]
    Breaks {
        /// Index of the break.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A coefficient is not finite.
    #[error("piece {index} has a coefficient that is not finite")]
    Coefficient {
        /// Index of the piece.
        index: usize,
    },
}

fn check_breaks(breaks: &[f64]) -> Result<(), PiecewiseError> {
    if breaks.len() < 2 {
        return Err(PiecewiseError::Empty);
    }
    for (index, &value) in breaks.iter().enumerate() {
        if !value.is_finite() || (index > 0 && value <= breaks[index - 1]) {
            return Err(PiecewiseError::Breaks { index, value });
        }
    }
    Ok(())
}

/// Index of the piece that holds `t`; the first or last piece beyond the ends.
fn piece_at(breaks: &[f64], t: f64) -> usize {
    let after = breaks.partition_point(|&b| b <= t);
    after.saturating_sub(1).min(breaks.len().saturating_sub(2))
}

/// Value of the derivative of this order of a cubic at `s`.
fn cubic(c: &[f64; 4], s: f64, order: usize) -> f64 {
    match order {
        0 => c[0] + s * (c[1] + s * (c[2] + s * c[3])),
        1 => c[1] + s * (2.0 * c[2] + s * 3.0 * c[3]),
        2 => 2.0 * c[2] + s * 6.0 * c[3],
        3 => 6.0 * c[3],
        _ => 0.0,
    }
}

/// The cubic through four values at 0, h/3, 2h/3 and h (equations 6 and 7 of Shim & Lee
/// 1995 solve for these coefficients in two parameters and in one).
#[must_use]
pub fn cubic_through_thirds(values: [f64; 4], width: f64) -> [f64; 4] {
    let [f0, f1, f2, f3] = values;
    // Newton's divided differences on nodes one third apart, expanded.
    let (d1, d2, d3) = (f1 - f0, f2 - 2.0 * f1 + f0, f3 - 3.0 * f2 + 3.0 * f1 - f0);
    let third = width / 3.0;
    [
        f0,
        (d1 - d2 / 2.0 + d3 / 3.0) / third,
        (d2 / 2.0 - d3 / 2.0) / (third * third),
        d3 / 6.0 / (third * third * third),
    ]
}
