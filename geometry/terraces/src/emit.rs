//! From joined faces and edges to curves and surfaces in space.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, TAU};

use nurbs::BSplineSurface;

use crate::field::Field;
use crate::height::Height;
use crate::part::{Frame, Part};
use crate::plan::{
    P2, Piece, Support, add, angle, area, distance, dot, left, norm, polar, positive, scale, sub,
};
use crate::regions::{Region, Role};
use crate::shell::{Key, Path, Shell};
use crate::solid::{EdgeUse, Placement, Solid, SolidCurve, SolidEdge, SolidFace, SolidSurface};
use crate::trace;

/// A cap of a sphere that reaches no further than this part of its radius keeps clear of the poles
/// of an axis to its side.
pub(crate) const FLAT_PART: f64 = 0.98;

/// All that a solid is made of.
pub(crate) struct Emit<'a> {
    pub(crate) part: &'a Part,
    pub(crate) heights: &'a [Height],
    pub(crate) regions: &'a [Region],
    pub(crate) field: &'a Field,
    pub(crate) shell: &'a Shell,
}

impl Emit<'_> {
    pub(crate) fn solid(&self) -> Solid {
        let mut vertices = Vec::new();
        let mut numbers: BTreeMap<usize, usize> = BTreeMap::new();
        let mut edges = Vec::new();
        let mut edge_numbers: BTreeMap<usize, usize> = BTreeMap::new();
        for (index, edge) in self.shell.edges.iter().enumerate() {
            if !edge.is_alive {
                continue;
            }
            let ends = edge.ends.map(|end| {
                *numbers.entry(end).or_insert_with(|| {
                    vertices.push(self.part.frame.point(self.vertex(end)));
                    vertices.len() - 1
                })
            });
            edge_numbers.insert(index, edges.len());
            edges.push(SolidEdge {
                ends,
                curve: self.curve(index),
            });
        }
        let mut names: BTreeMap<(usize, Role), usize> = BTreeMap::new();
        let mut faces = Vec::new();
        for (root, runs) in self.shell.loops() {
            let (operation, role) = self.origin(root);
            let count = names.entry((operation, role)).or_default();
            *count += 1;
            let name = self.name(operation, role, *count);
            let (surface, is_outward) = self.surface(root, &runs);
            let mut runs = runs;
            let outer = self.outer(self.shell.faces[root].key, &runs);
            runs.swap(0, outer);
            let number = |of: &usize| {
                let of = self.shell.uses[*of];
                EdgeUse {
                    edge: edge_numbers.get(&of.edge).copied().unwrap_or(usize::MAX),
                    forward: of.forward,
                }
            };
            faces.push(SolidFace {
                name,
                operation,
                role,
                surface,
                is_outward,
                loops: runs
                    .iter()
                    .map(|run| run.iter().map(number).collect())
                    .collect(),
            });
        }
        Solid {
            vertices,
            edges,
            faces,
            volume_mm3: self.volume(),
        }
    }

    fn vertex(&self, index: usize) -> [f64; 3] {
        let vertex = &self.shell.vertices[index];
        let [x, y] = self.field.plan.vertices[vertex.plan];
        [x, y, vertex.z]
    }

    fn placed(&self, origin: [f64; 3], axis: [f64; 3], x: [f64; 3]) -> Placement {
        let frame: &Frame = &self.part.frame;
        Placement {
            origin_mm: frame.point(origin),
            axis: frame.direction(axis),
            x: frame.direction(x),
        }
    }

    fn curve(&self, index: usize) -> SolidCurve {
        let edge = &self.shell.edges[index];
        let Path::Over {
            support,
            from,
            to,
            heights,
            ..
        } = edge.path
        else {
            return SolidCurve::Line;
        };
        let on = &self.field.plan.supports[support];
        let pair = heights.map(|height| &self.heights[height]);
        let known = pair
            .iter()
            .find_map(|height| trace::exact(on, from, to, height));
        match known {
            Some(trace::Exact::Line) => SolidCurve::Line,
            Some(trace::Exact::Round { c, axis, x, a, b }) => {
                let place = self.placed(c, axis, x);
                if (a - b).abs() < 1e-9 {
                    SolidCurve::Circle {
                        place,
                        radius_mm: a,
                    }
                } else {
                    SolidCurve::Ellipse {
                        place,
                        half_axes_mm: [a, b],
                    }
                }
            }
            None => {
                let ends = edge.ends.map(|end| self.vertex(end));
                trace::spline(on, from, to, pair[0], ends, &self.part.frame)
            }
        }
    }

    /// Which operation made a face, and what of it the face is.
    fn origin(&self, face: usize) -> (usize, Role) {
        let of = self.shell.faces[face];
        match of.key {
            Key::Bottom => (0, Role::Bottom),
            Key::Top(surface) => {
                let cell = &self.field.plan.cells[of.source];
                let mut regions = self.regions.iter().enumerate();
                // The last region of that surface around the cell, else the first of the surface.
                let within = regions.clone().rev();
                let mut within = within.filter(|(n, r)| r.height == surface && cell.within[*n]);
                let found = within
                    .next()
                    .or_else(|| regions.find(|(_, r)| r.height == surface));
                found.map_or((0, Role::Floor), |(_, r)| (r.operation, r.role))
            }
            Key::Wall { .. } => {
                let owners = self.field.plan.edges[of.source].owners.iter();
                let region = owners
                    .filter_map(|&owner| self.regions.get(owner))
                    .min_by_key(|r| (r.role != Role::Floor, r.operation));
                (region.map_or(0, |r| r.operation), Role::Wall)
            }
        }
    }

    fn name(&self, operation: usize, role: Role, count: usize) -> String {
        let (of, kind) = match operation
            .checked_sub(1)
            .and_then(|k| self.part.operations.get(k))
        {
            Some(operation) => (&operation.name, operation.kind),
            None => (&self.part.name, crate::part::Kind::Raise),
        };
        let what = match (role, kind) {
            (Role::Floor, crate::part::Kind::Cut) => "floor",
            (Role::Floor, crate::part::Kind::Raise) => "top",
            (Role::Wall, _) => "wall",
            (Role::UpperEdge, _) => "upper edge",
            (Role::LowerEdge, _) => "lower edge",
            (Role::Bottom, _) => "bottom",
        };
        match (role, count) {
            (Role::Wall | Role::UpperEdge | Role::LowerEdge, _) => format!("{of} {what} {count}"),
            (_, 1) => format!("{of} {what}"),
            _ => format!("{of} {what} {count}"),
        }
    }

    /// The pieces of the plan under a loop.
    fn under(&self, run: &[usize]) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for &of in run {
            let of = self.shell.uses[of];
            let edge = &self.shell.edges[of.edge];
            let Path::Over {
                support, from, to, ..
            } = edge.path
            else {
                continue;
            };
            let on = self.field.plan.supports[support];
            let piece = |from: f64, to: f64| match on {
                Support::Line { .. } => Piece::Line {
                    from: on.at(from),
                    to: on.at(to),
                },
                Support::Circle { c, .. } => Piece::Arc {
                    from: on.at(from),
                    to: on.at(to),
                    center: c,
                    ccw: true,
                },
            };
            // Two halves, since one may run all round.
            let middle = 0.5 * (from + to);
            let mut halves = [piece(from, middle), piece(middle, to)];
            if !of.forward {
                halves = [halves[1].reversed(), halves[0].reversed()];
            }
            pieces.extend(halves);
        }
        pieces
    }

    fn outer(&self, key: Key, runs: &[Vec<usize>]) -> usize {
        let size = |run: &Vec<usize>| match key {
            Key::Top(_) => area(&self.under(run)),
            Key::Bottom => -area(&self.under(run)),
            Key::Wall { .. } => run.len() as f64,
        };
        let sizes: Vec<f64> = runs.iter().map(size).collect();
        let all = 0..runs.len();
        all.max_by(|&a, &b| sizes[a].total_cmp(&sizes[b]))
            .unwrap_or(0)
    }

    /// The direction from an axis at which a face around it begins.
    fn begin(&self, axis: P2, runs: &[Vec<usize>]) -> P2 {
        let mut is_used = BTreeMap::new();
        let mut angles = Vec::new();
        let mut seam = None;
        for &of in runs.iter().flatten() {
            let edge = self.shell.uses[of].edge;
            let away = |at: P2| angle(sub(at, axis));
            let is_again = is_used.insert(edge, ()).is_some();
            match self.shell.edges[edge].path {
                Path::Upright { vertex } => {
                    let at = away(self.field.plan.vertices[vertex]);
                    seam = seam.or(is_again.then_some(at));
                }
                Path::Over {
                    support, from, to, ..
                } => {
                    let on = self.field.plan.supports[support];
                    let at = |k: i32| on.at(from + (to - from) * f64::from(k) / 16.0);
                    let far = (0..=16).filter(|&k| distance(at(k), axis) > 1e-4);
                    angles.extend(far.map(|k| away(at(k))));
                    seam = seam.or(is_again.then(|| away(at(8))));
                }
            }
        }
        if let Some(seam) = seam {
            return polar(seam);
        }
        angles.sort_by(f64::total_cmp);
        let next = angles.iter().skip(1).copied();
        let next = next.chain(angles.first().map(|first| first + TAU));
        let gaps = angles.iter().zip(next).map(|(&a, b)| (b - a, a));
        let widest = gaps.max_by(|a, b| a.0.total_cmp(&b.0));
        widest.map_or([1.0, 0.0], |(gap, at)| polar(at + 0.5 * gap))
    }

    /// A face's surface; true if its normal leads outwards.
    fn surface(&self, face: usize, runs: &[Vec<usize>]) -> (SolidSurface, bool) {
        let up = [0.0, 0.0, 1.0];
        let flat = |p: P2| [p[0], p[1], 0.0];
        match self.shell.faces[face].key {
            Key::Bottom => {
                let z = self.part.bottom_mm;
                let place = self.placed([0.0, 0.0, z], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]);
                (SolidSurface::Plane(place), true)
            }
            Key::Wall {
                support,
                material_left,
            } => match self.field.plan.supports[support] {
                Support::Line { p, d } => {
                    // The normal leads to the right of the line if material is on its left.
                    let side = if material_left { -1.0 } else { 1.0 };
                    let n = scale(left(d), side);
                    let place = self.placed(flat(p), flat(n), flat(d));
                    (SolidSurface::Plane(place), true)
                }
                Support::Circle { c, r } => {
                    let x = flat(self.begin(c, runs));
                    let place = self.placed([c[0], c[1], self.part.bottom_mm], up, x);
                    let radius_mm = r;
                    (SolidSurface::Cylinder { place, radius_mm }, material_left)
                }
            },
            Key::Top(surface) => self.top(&self.heights[surface], runs),
        }
    }

    fn top(&self, height: &Height, runs: &[Vec<usize>]) -> (SolidSurface, bool) {
        let up = [0.0, 0.0, 1.0];
        let flat = |p: P2| [p[0], p[1], 0.0];
        match *height {
            Height::Level { z } => {
                let place = self.placed([0.0, 0.0, z], up, [1.0, 0.0, 0.0]);
                (SolidSurface::Plane(place), true)
            }
            Height::Plane { z, slope } => {
                let steep = libm::hypot(1.0, norm(slope));
                let axis = [-slope[0] / steep, -slope[1] / steep, 1.0 / steep];
                let long = libm::hypot(1.0, slope[0]);
                let x = [1.0 / long, 0.0, slope[0] / long];
                (
                    SolidSurface::Plane(self.placed([0.0, 0.0, z], axis, x)),
                    true,
                )
            }
            Height::Cone { c, z, slope } => {
                let far = runs.iter().flatten().map(|&of| {
                    let end = self.shell.start(&self.shell.uses[of]);
                    let [x, y, _] = self.vertex(end);
                    distance([x, y], c)
                });
                let radius_mm = far.fold(0.0, f64::max);
                let origin = [c[0], c[1], z + slope * radius_mm];
                let axis = [0.0, 0.0, slope.signum()];
                let x = flat(self.begin(c, runs));
                let surface = SolidSurface::Cone {
                    place: self.placed(origin, axis, x),
                    radius_mm,
                    half_angle_rad: libm::atan(1.0 / slope.abs()),
                };
                (surface, slope < 0.0)
            }
            Height::Ring {
                c,
                ring,
                z,
                r,
                side,
            } => {
                let is_flat = ring == 0.0 && !self.is_steep(c, r, runs);
                let (axis, x) = if is_flat {
                    // Poles to the sides and the seam over the half that the face does not have:
                    // it needs none of them.
                    ([1.0, 0.0, 0.0], [0.0, 0.0, -side])
                } else {
                    (up, flat(self.begin(c, runs)))
                };
                let place = self.placed([c[0], c[1], z], axis, x);
                let surface = if ring == 0.0 {
                    SolidSurface::Sphere {
                        place,
                        radius_mm: r,
                    }
                } else {
                    SolidSurface::Torus {
                        place,
                        radii_mm: [ring, r],
                    }
                };
                (surface, side > 0.0)
            }
            Height::Bar { p, d, z, r, side } => {
                // Angles count from the half that the face does not have.
                let x = [0.0, 0.0, -side];
                let along = runs.iter().flatten().map(|&of| {
                    let [x, y, _] = self.vertex(self.shell.start(&self.shell.uses[of]));
                    dot(sub([x, y], p), d)
                });
                let first = along.fold(f64::INFINITY, f64::min);
                let [x0, y0] = add(p, scale(d, if first.is_finite() { first } else { 0.0 }));
                let surface = SolidSurface::Cylinder {
                    place: self.placed([x0, y0, z], flat(d), x),
                    radius_mm: r,
                };
                (surface, side > 0.0)
            }
            Height::Spline(ref spline) => {
                let (u, v) = (spline.u_knots(), spline.v_knots());
                let rows = v.control_count();
                let points = spline.points().iter().enumerate().map(|(k, &[z])| {
                    let plan = [u.greville(k / rows), v.greville(k % rows)];
                    self.part.frame.point([plan[0], plan[1], z])
                });
                let made = BSplineSurface::new(u.clone(), v.clone(), points.collect());
                let place = || self.placed([0.0; 3], up, [1.0, 0.0, 0.0]);
                let surface =
                    made.map_or_else(|_| SolidSurface::Plane(place()), SolidSurface::Spline);
                (surface, true)
            }
        }
    }

    /// A face on a sphere reaches near its equator, or is cut open towards its pole.
    fn is_steep(&self, c: P2, r: f64, runs: &[Vec<usize>]) -> bool {
        let mut is_used = BTreeSet::new();
        runs.iter().flatten().any(|&of| {
            let edge = self.shell.uses[of].edge;
            let Path::Over {
                support, from, to, ..
            } = self.shell.edges[edge].path
            else {
                return false;
            };
            let on = self.field.plan.supports[support];
            let at = |k: i32| on.at(from + (to - from) * f64::from(k) / 8.0);
            !is_used.insert(edge) || (0..=8).any(|k| distance(at(k), c) > FLAT_PART * r)
        })
    }

    /// What the flux of each cell's height brings, less the bottom.
    fn volume(&self) -> f64 {
        (1..self.field.plan.cells.len())
            .filter(|&cell| self.field.surface[cell] != 0)
            .map(|cell| cell_volume(self.field, self.heights, cell))
            .sum()
    }
}

/// The volume under a cell.
pub(crate) fn cell_volume(field: &Field, heights: &[Height], cell: usize) -> f64 {
    let height = &heights[field.surface[cell]];
    let bottom = heights[0].at([0.0; 2]);
    let mut sum = 0.0;
    for half in field.plan.cells[cell].loops.iter().flatten() {
        let edge = &field.plan.edges[half.edge];
        let on = field.plan.supports[edge.support];
        let sign = if half.forward { 1.0 } else { -1.0 };
        for pair in stops(&on, edge.from, edge.to, height.axis()).windows(2) {
            let step = 0.5 * (pair[1] - pair[0]);
            for (x, weight) in crate::height::GAUSS {
                let t = pair[0] + step * (1.0 + x);
                let q = on.at(t);
                let [p, r] = height.flux(q);
                let flow = sub([p, r], scale(q, 0.5 * bottom));
                let along = scale(on.tangent(t), on.speed());
                sum += sign * step * weight * (flow[0] * along[1] - flow[1] * along[0]);
            }
        }
    }
    sum
}

/// Parts of an edge over which a rule is accurate: shorter and shorter towards where it is nearest
/// to an axis, on which heights have a kink.
fn stops(on: &Support, from: f64, to: f64, axis: Option<P2>) -> Vec<f64> {
    let parts = match on {
        Support::Line { .. } => 8.0,
        Support::Circle { .. } => ((to - from) / FRAC_PI_2 * 8.0).ceil().max(1.0),
    };
    let even = (0..=parts as usize).map(|k| from + (to - from) * k as f64 / parts);
    let mut stops: Vec<f64> = even.collect();
    if let Some(axis) = axis {
        let foot = match on {
            Support::Line { .. } => on.parameter(axis),
            Support::Circle { .. } => from + positive(on.parameter(axis) - from),
        };
        let near = (0..24).map(|k| libm::pow(0.5, f64::from(k)));
        let near = near.flat_map(|by| [-1.0, 1.0].map(|side| foot + side * by * (to - from)));
        stops.extend(near.chain([foot]).filter(|&t| t > from && t < to));
        stops.sort_by(f64::total_cmp);
    }
    stops
}
