//! The hole as a trimmed part of its base surface.

use glam::DVec3;
use nurbs::{BSplineCurve, BSplineSurface, KnotVector};
use robust::{Coord, orient2d};

use super::base::{Base, Unseen};

/// Steps of Newton's iteration for the foot of a perpendicular, and when it ends, of the domain.
const MOST_STEPS: usize = 40;
const NEAR: f64 = 1e-12;

/// A hole as a trimmed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimmedPatch {
    /// The hole's number.
    pub hole: usize,
    /// The base surface, bicubic.
    pub surface: BSplineSurface,
    /// Its trims, each closed: the outer one counter-clockwise in the parameter plane, then clockwise
    /// ones around islands. Straight between the loop's points there.
    pub parameter_curves: Vec<BSplineCurve<2>>,
    /// The same in space, cubic between the loop's points.
    pub space_curves: Vec<BSplineCurve<3>>,
    /// Farthest that a vertex of the loop lies off the surface, millimetres.
    pub off_mm: f64,
}

impl TrimmedPatch {
    /// The same with all lengths in space multiplied, as where a mesh was of another unit.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        let places = |own: &[[f64; 3]]| own.iter().map(|p| p.map(|c| c * by)).collect();
        let own = &self.surface;
        let knots = (own.u_knots().clone(), own.v_knots().clone());
        // As many points as before, so that neither fails.
        let surface = BSplineSurface::new(knots.0, knots.1, places(own.points()));
        let curve = |own: &BSplineCurve<3>| {
            let new = BSplineCurve::new(own.knots().clone(), places(own.points()));
            new.unwrap_or_else(|_| own.clone())
        };
        Self {
            hole: self.hole,
            surface: surface.unwrap_or_else(|_| self.surface.clone()),
            parameter_curves: self.parameter_curves.clone(),
            space_curves: self.space_curves.iter().map(curve).collect(),
            off_mm: by * self.off_mm,
        }
    }
}

/// The parameters of a point's foot on a surface (equations 6 and 7), from a first guess.
pub(super) fn foot(surface: &BSplineSurface, place: DVec3, from: [f64; 2]) -> Option<[f64; 2]> {
    let domains = [surface.u_knots().domain(), surface.v_knots().domain()];
    let within = |own: [f64; 2]| [0, 1].map(|k| own[k].clamp(domains[k].0, domains[k].1));
    let scale = (domains[0].1 - domains[0].0).max(domains[1].1 - domains[1].0);
    let [mut u, mut v] = within(from);
    for _ in 0..MOST_STEPS {
        let at = |i, j| DVec3::from_array(surface.partial(u, v, i, j));
        let arm = DVec3::from_array(surface.evaluate(u, v)) - place;
        let (ru, rv) = (at(1, 0), at(0, 1));
        let (f, g) = (ru.dot(arm), rv.dot(arm));
        let cross = ru.dot(rv) + at(1, 1).dot(arm);
        let (fu, gv) = (
            ru.dot(ru) + at(2, 0).dot(arm),
            rv.dot(rv) + at(0, 2).dot(arm),
        );
        let determinant = fu * gv - cross * cross;
        let (du, dv) = (
            (cross * g - gv * f) / determinant,
            (cross * f - fu * g) / determinant,
        );
        if !(du.is_finite() && dv.is_finite()) {
            return None;
        }
        let next = within([u + du, v + dv]);
        let moved = (next[0] - u).abs().max((next[1] - v).abs());
        [u, v] = next;
        if moved <= NEAR * scale {
            return Some([u, v]);
        }
    }
    None
}

/// Loops in the parameter plane of a base surface.
#[derive(Debug, Clone)]
pub(crate) struct Trim {
    pub(crate) loops: Vec<Vec<[f64; 2]>>,
    pub(crate) off_mm: f64,
}

/// Projects loops at right angles onto the base surface.
pub(crate) fn trim(base: &Base, loops: &[Vec<DVec3>]) -> Result<Trim, Unseen> {
    let mut off_mm = 0.0_f64;
    let mut out = Vec::new();
    for own in loops {
        let mut flat = Vec::with_capacity(own.len());
        for &place in own {
            let [u, v] = foot(&base.surface, place, base.seen(place)).ok_or(Unseen::Missed)?;
            let on = DVec3::from_array(base.surface.evaluate(u, v));
            off_mm = off_mm.max(on.distance(place));
            flat.push([u, v]);
        }
        out.push(flat);
    }
    if crosses_itself(&out) {
        return Err(Unseen::Crossed);
    }
    Ok(Trim { loops: out, off_mm })
}

/// Whether sides of loops cross or touch others than those beside them.
fn crosses_itself(loops: &[Vec<[f64; 2]>]) -> bool {
    let at = |p: [f64; 2]| Coord { x: p[0], y: p[1] };
    let mut sides: Vec<([f64; 2], [f64; 2])> = loops
        .iter()
        .flat_map(|own| {
            let next = own.iter().cycle().skip(1);
            own.iter().copied().zip(next.copied())
        })
        .collect();
    // By where they begin from the left, so that only those that overlap there are compared.
    let left = |side: &([f64; 2], [f64; 2])| side.0[0].min(side.1[0]);
    let right = |side: &([f64; 2], [f64; 2])| side.0[0].max(side.1[0]);
    sides.sort_by(|a, b| left(a).total_cmp(&left(b)));
    for (k, &(a, b)) in sides.iter().enumerate() {
        for &(c, d) in sides[k + 1..]
            .iter()
            .take_while(|own| left(own) <= right(&(a, b)))
        {
            if a == c || a == d || b == c || b == d {
                continue;
            }
            let own = orient2d(at(a), at(b), at(c)) * orient2d(at(a), at(b), at(d));
            let other = orient2d(at(c), at(d), at(a)) * orient2d(at(c), at(d), at(b));
            if own <= 0.0 && other <= 0.0 {
                return true;
            }
        }
    }
    false
}

impl Trim {
    /// The trimmed surface for files.
    pub(crate) fn patch(&self, hole: usize, base: &Base) -> Option<TrimmedPatch> {
        let mut patch = TrimmedPatch {
            hole,
            surface: base.surface.clone(),
            parameter_curves: Vec::new(),
            space_curves: Vec::new(),
            off_mm: self.off_mm,
        };
        for own in &self.loops {
            let mut closed = own.clone();
            closed.extend(own.first());
            patch.parameter_curves.push(chain(1, &closed)?);
            let cubic = lifted(&base.surface, &closed);
            patch.space_curves.push(chain(3, &cubic)?);
        }
        Some(patch)
    }
}

/// Points joined by pieces of a degree, a unit of the parameter to each.
fn chain<const D: usize>(degree: usize, points: &[[f64; D]]) -> Option<BSplineCurve<D>> {
    let pieces = (points.len() - 1) / degree;
    let mut knots = vec![0.0];
    for k in 0..=pieces {
        knots.extend(std::iter::repeat_n(k as f64, degree));
    }
    knots.push(pieces as f64);
    BSplineCurve::new(KnotVector::new(degree, knots).ok()?, points.to_vec()).ok()
}

/// Control points of cubics over straight lines in the parameter plane, by their ends and tangents.
fn lifted(surface: &BSplineSurface, closed: &[[f64; 2]]) -> Vec<[f64; 3]> {
    let at = |p: [f64; 2]| DVec3::from_array(surface.evaluate(p[0], p[1]));
    let slope = |p: [f64; 2], along: [f64; 2]| {
        let by = |i, j| DVec3::from_array(surface.partial(p[0], p[1], i, j));
        along[0] * by(1, 0) + along[1] * by(0, 1)
    };
    let mut control = vec![at(closed[0]).to_array()];
    for pair in closed.windows(2) {
        let [p, q] = [pair[0], pair[1]];
        let along = [q[0] - p[0], q[1] - p[1]];
        control.push((at(p) + slope(p, along) / 3.0).to_array());
        control.push((at(q) - slope(q, along) / 3.0).to_array());
        control.push(at(q).to_array());
    }
    control
}
