//! Piecewise cubic curves and piecewise bicubic surfaces in power form.

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
