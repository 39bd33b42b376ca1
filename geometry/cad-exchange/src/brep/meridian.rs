//! Rings cut open.
//!
//! A ring lies between two loops that both go around the axis of its surface. Many readers want such
//! a face to have one loop only, that comes from one to the other along the seam of the surface and
//! goes back the same way (OpenCASCADE adds that edge where it misses it). So the seam is turned to
//! a vertex of the one loop, the other gets a vertex there, and an edge along the meridian between
//! them is used twice.

use nalgebra::Vector3;
use nurbs::PiecewiseCubic;
use shapes::Family;

use super::analytic::Analytic;
use super::bend::bent;
use super::carrier::Carrier;
use super::topology::{Strand, Topology, Use};

/// Places of each piece of an edge that are looked at.
const PROBES: usize = 8;

/// A loop is not cut nearer to a vertex than this, millimetres: such short edges trouble readers.
const LEAST_MM: f64 = 0.05;

/// A vertex this near to a meridian, millimetres, is on it.
const ON_MM: f64 = 1e-6;

/// Halvings of the stretch in which an edge crosses a meridian.
const HALVINGS: usize = 60;

/// Widest part of an arc that one cubic stands for, radians: it is off by 2e-6 of the radius.
const WIDEST_RAD: f64 = 0.15;

/// Cuts all rings open that can be, and gives the faces of those that cannot.
pub(super) fn cut_rings(topology: &mut Topology, carriers: &mut [Carrier]) -> Vec<usize> {
    let mut whole = Vec::new();
    for (face, carrier) in carriers.iter_mut().enumerate() {
        let Some(around) = carrier.ring() else {
            continue;
        };
        match Cut::of(topology, face, around) {
            Some(cut) => {
                carrier.turn(cut.towards);
                cut.apply(topology, face, carrier);
            }
            None => whole.push(face),
        }
    }
    whole
}

/// Where a ring is cut.
struct Cut {
    /// Unit vector square to the axis towards the meridian.
    towards: Vector3<f64>,
    /// The loop that has a vertex there, and the place among its uses of that which begins in it.
    from: (usize, usize),
    /// The other loop, the place of the use that meets the meridian, and the parameter of its strand
    /// where it crosses that, unless it begins there.
    to: (usize, usize, Option<f64>),
}

impl Cut {
    /// Where the meridian through a vertex of one loop meets both but once, so that it does not
    /// leave the face between them.
    fn of(topology: &Topology, face: usize, [origin, axis]: [Vector3<f64>; 2]) -> Option<Self> {
        let loops = &topology.uses[face];
        let off = |place: [f64; 3]| {
            let from = Vector3::from(place) - origin;
            from - axis * from.dot(&axis)
        };
        let angle = |towards: &Vector3<f64>, place: [f64; 3]| {
            let off = off(place);
            libm::atan2(towards.cross(&off).dot(&axis), towards.dot(&off))
        };
        let goes_around = |uses: &Vec<Use>| {
            let first = off(start(topology, uses[0]));
            let mut turned = 0.0;
            let mut last = 0.0;
            for (_, _, place) in places(topology, uses) {
                let at = angle(&first, place);
                turned += way(last, at);
                last = at;
            }
            turned.abs() > core::f64::consts::PI
        };
        let around: Vec<usize> = (0..loops.len())
            .filter(|&n| goes_around(&loops[n]))
            .collect();
        let &[one, other] = around.as_slice() else {
            return None;
        };
        let both = [(one, other), (other, one)].into_iter();
        let vertices = both.flat_map(|(a, b)| (0..loops[a].len()).map(move |k| (a, b, k)));
        vertices
            .filter_map(|(a, b, k)| {
                let vertex = start(topology, loops[a][k]);
                let towards = off(vertex).try_normalize(0.0)?;
                let but = |but: [f64; 3]| {
                    move |place: [f64; 3]| {
                        let is_it = (Vector3::from(place) - Vector3::from(but)).norm() < ON_MM;
                        (!is_it).then(|| angle(&towards, place))
                    }
                };
                if !crossings(topology, &loops[a], but(vertex)).is_empty() {
                    return None;
                }
                let is_on = |of: &Use| {
                    let place = start(topology, *of);
                    (angle(&towards, place) * off(place).norm()).abs() < ON_MM
                };
                let from = (a, k);
                if let Some(at) = loops[b].iter().position(is_on) {
                    let met = crossings(topology, &loops[b], but(start(topology, loops[b][at])));
                    let to = (b, at, None);
                    return met.is_empty().then_some(Self { towards, from, to });
                }
                let met = crossings(topology, &loops[b], |place| Some(angle(&towards, place)));
                let &[(at, t)] = met.as_slice() else {
                    return None;
                };
                let (first, last) = topology.edges[loops[b][at].edge].curve.domain();
                let is_clear = (t - first).min(last - t) >= LEAST_MM;
                let to = (b, at, Some(t));
                is_clear.then_some(Self { towards, from, to })
            })
            .next()
    }

    fn apply(&self, topology: &mut Topology, face: usize, carrier: &Carrier) {
        let ((a, k), (b, at, t)) = (self.from, self.to);
        let near = topology.vertex_before(topology.uses[face][a][k]);
        let crossed = topology.uses[face][b][at];
        let halves = t.and_then(|t| topology.edges[crossed.edge].curve.split(t));
        let far = match halves {
            Some((before, after)) => divide(topology, crossed.edge, before, after),
            None => topology.vertex_before(crossed),
        };
        let ends = [near, far].map(|vertex| topology.vertices[vertex]);
        topology.edges.push(Strand {
            ends: [near, far],
            curve: meridian(carrier, ends),
        });
        let seam = |forward: bool| Use {
            edge: topology.edges.len() - 1,
            forward,
        };
        let of = |n: usize, vertex: usize| {
            let uses = &topology.uses[face][n];
            let first = uses
                .iter()
                .position(|of| topology.vertex_before(*of) == vertex);
            let (end, begin) = uses.split_at(first.unwrap_or(0));
            [begin, end].concat()
        };
        let mut joined = of(a, near);
        joined.push(seam(true));
        joined.extend(of(b, far));
        joined.push(seam(false));
        let loops = &mut topology.uses[face];
        loops.remove(a.max(b));
        loops.remove(a.min(b));
        loops.insert(0, joined);
    }
}

/// Makes two edges of one, and gives the vertex between them.
fn divide(
    topology: &mut Topology,
    edge: usize,
    before: PiecewiseCubic<3>,
    after: PiecewiseCubic<3>,
) -> usize {
    topology.vertices.push(before.end());
    let between = topology.vertices.len() - 1;
    let whole = &mut topology.edges[edge];
    let last = core::mem::replace(&mut whole.ends[1], between);
    whole.curve = before;
    topology.edges.push(Strand {
        ends: [between, last],
        curve: after,
    });
    let rest = topology.edges.len() - 1;
    for chain in topology.uses.iter_mut().flatten() {
        divided(chain, edge, rest);
    }
    between
}

/// Puts the two parts of an edge in the place of the whole.
fn divided(chain: &mut Vec<Use>, edge: usize, rest: usize) {
    let parts = |of: &Use| -> Vec<Use> {
        if of.edge != edge {
            return vec![*of];
        }
        let mut parts = vec![*of, Use { edge: rest, ..*of }];
        if !of.forward {
            parts.reverse();
        }
        parts
    };
    *chain = chain.iter().flat_map(parts).collect();
}

/// The shorter way from one angle to another.
fn way(from: f64, to: f64) -> f64 {
    let way = to - from;
    way - core::f64::consts::TAU * libm::round(way / core::f64::consts::TAU)
}

/// Where a loop begins.
fn start(topology: &Topology, of: Use) -> [f64; 3] {
    topology.vertices[topology.vertex_before(of)]
}

/// Places along a loop in its sense of travel, each with that of its use and the parameter of its
/// strand.
fn places<'a>(
    topology: &'a Topology,
    uses: &'a [Use],
) -> impl Iterator<Item = (usize, f64, [f64; 3])> + 'a {
    uses.iter().enumerate().flat_map(|(k, of)| {
        let curve = &topology.edges[of.edge].curve;
        let mut parameters = Vec::new();
        for ends in curve.breaks.windows(2) {
            let at = |n: usize| ends[0] + (ends[1] - ends[0]) * n as f64 / PROBES as f64;
            parameters.extend((0..PROBES).map(at));
        }
        parameters.push(curve.domain().1);
        if !of.forward {
            parameters.reverse();
        }
        let place = move |t: f64| (k, t, curve.evaluate(t));
        parameters.into_iter().map(place)
    })
}

/// Where a loop crosses angle 0: the places of the uses, and the parameters of their strands.
/// Places that have no angle are no crossing.
fn crossings(
    topology: &Topology,
    uses: &[Use],
    angle: impl Fn([f64; 3]) -> Option<f64>,
) -> Vec<(usize, f64)> {
    let all: Vec<_> = places(topology, uses).collect();
    let mut found = Vec::new();
    for pair in all.windows(2) {
        let [(k, t, before), (_, u, after)] = [pair[0], pair[1]];
        let (Some(from), Some(to)) = (angle(before), angle(after)) else {
            continue;
        };
        let is_crossed = (from < 0.0) != (to < 0.0) && (to - from).abs() < core::f64::consts::PI;
        if !is_crossed {
            continue;
        }
        let curve = &topology.edges[uses[k].edge].curve;
        let (mut low, mut high) = (t, u);
        for _ in 0..HALVINGS {
            let middle = low + (high - low) / 2.0;
            match angle(curve.evaluate(middle)) {
                Some(at) if (at < 0.0) == (from < 0.0) => low = middle,
                _ => high = middle,
            }
        }
        found.push((k, low + (high - low) / 2.0));
    }
    found
}

/// The curve of a surface that lies in one half-plane with its axis, between two points of it.
fn meridian(carrier: &Carrier, ends: [[f64; 3]; 2]) -> PiecewiseCubic<3> {
    let curve = match carrier {
        Carrier::Round(round) => Some(arc(round, ends)),
        Carrier::Swept(generated) => generated.meridian(ends),
        Carrier::Plane(_) | Carrier::Spline => None,
    };
    curve.unwrap_or_else(|| straight(ends[0], ends[1]))
}

/// The same of a shape.
fn arc(round: &Analytic, [from, to]: [[f64; 3]; 2]) -> PiecewiseCubic<3> {
    let (origin, axis) = (Vector3::from(round.origin_mm), Vector3::from(round.axis));
    let x = Vector3::from(round.x);
    let (centre, radius_mm) = match round.shape.family() {
        Family::Sphere => (origin, round.lengths_mm[0]),
        Family::Torus => (origin + x * round.lengths_mm[0], round.lengths_mm[1]),
        Family::Plane | Family::Cylinder | Family::Cone => {
            return straight(from, to);
        }
    };
    let angle = |place: [f64; 3]| {
        let out = Vector3::from(place) - centre;
        libm::atan2(out.dot(&axis), out.dot(&x))
    };
    let begin = angle(from);
    let mut swept = way(begin, angle(to));
    // Of a ridge a little more than half a tube may be seen: the face is on the camera's side.
    let (sin, cos) = libm::sincos(begin + swept / 2.0);
    let out = (x * cos + axis * sin).z;
    if (out < 0.0) == round.same_sense {
        swept -= core::f64::consts::TAU * swept.signum();
    }
    let parts = libm::ceil(swept.abs() / WIDEST_RAD).max(1.0) as usize;
    let each = swept / parts as f64;
    let width = radius_mm * each.abs();
    if width.is_nan() || width <= 0.0 {
        return straight(from, to);
    }
    // With this the middle of each piece is on the arc, too.
    let speed = 4.0 * libm::tan(each.abs() / 4.0) / each.abs();
    let mut breaks = vec![0.0];
    let mut pieces = Vec::with_capacity(parts);
    for k in 0..parts {
        let at = |k: usize| {
            let (sin, cos) = libm::sincos(begin + each * k as f64);
            let place = centre + (x * cos + axis * sin) * radius_mm;
            (place, (axis * cos - x * sin) * (speed * each.signum()))
        };
        let ((p, out), (q, into)) = (at(k), at(k + 1));
        pieces.push(core::array::from_fn(|d| {
            let mean = (q[d] - p[d]) / width;
            let second = (3.0 * mean - 2.0 * out[d] - into[d]) / width;
            let third = (out[d] + into[d] - 2.0 * mean) / (width * width);
            [p[d], out[d], second, third]
        }));
        breaks.push(width * (k + 1) as f64);
    }
    bent(&PiecewiseCubic { breaks, pieces }, from, to)
}

fn straight(from: [f64; 3], to: [f64; 3]) -> PiecewiseCubic<3> {
    let length = (Vector3::from(to) - Vector3::from(from)).norm();
    let piece = |d: usize| [from[d], (to[d] - from[d]) / length, 0.0, 0.0];
    PiecewiseCubic {
        breaks: vec![0.0, length],
        pieces: vec![core::array::from_fn(piece)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapes::{Shape, Torus};

    /// A ridge that is seen a little beyond both its sides, and a groove of the same extent.
    #[test]
    fn more_than_half_a_tube_is_cut_on_the_side_that_is_seen() {
        for (is_hollow, up) in [(false, 1.0), (true, -1.0)] {
            let torus = Torus {
                centre_mm: Vector3::zeros(),
                axis: Vector3::z(),
                radius_mm: 10.0,
                tube_mm: 3.0,
                is_hollow,
            };
            let round = Analytic {
                shape: Shape::Torus(torus),
                origin_mm: [0.0; 3],
                axis: [0.0, 0.0, 1.0],
                x: [1.0, 0.0, 0.0],
                lengths_mm: vec![10.0, 3.0],
                angle_rad: None,
                same_sense: !is_hollow,
                is_ring: true,
            };
            let at = |angle: f64| {
                let (sin, cos) = libm::sincos(angle);
                [10.0 + 3.0 * cos, 0.0, 3.0 * up * sin]
            };
            let (from, to) = (at(-0.1), at(core::f64::consts::PI + 0.15));
            let arc = arc(&round, [from, to]);
            arc.validate().unwrap();
            let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|d| (a[d] - b[d]).abs() < 1e-9);
            assert!(near(arc.start(), from) && near(arc.end(), to));
            let (first, last) = arc.domain();
            assert!((last - first - 3.0 * (core::f64::consts::PI + 0.25)).abs() < 1e-9);
            for k in 0..=100 {
                let place = arc.evaluate(first + (last - first) * f64::from(k) / 100.0);
                let off_mm = round.shape.distance_mm(&place.into());
                assert!(off_mm.abs() < 1e-5 && up * place[2] > -0.5, "{place:?}");
            }
        }
    }
}
