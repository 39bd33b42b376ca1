//! Patches of surfaces that are known.
//!
//! A model is a graph over the x-y plane, so a known form becomes patches, too: fitted to the
//! form itself at the nodes of its region, and a little beyond for borders to run on.

use nalgebra::Vector3;
use nurbs::{Observation, PatchSurface};
use range_image::RangeImage;
use shapes::{Form, Shape};

use crate::fit::Domain;
use crate::model::FORM_TOLERANCE_MM;
use crate::refine::{self, Demand};
use crate::run::{FAR, Node, SURFACE_MARGIN};

/// Places along each side of its domain that determine a plane, and more.
const PLANE_SIDE: usize = 5;

/// What a fit to a form leaves is no noise: this is far below what is worth a coefficient,
/// square millimetres.
const NO_NOISE_MM2: f64 = 1e-14;

/// Part of the tolerance at which nothing more is refined.
const AIM: f64 = 0.1;

/// Share of the nodes at which the form has to be there, and of those whose neighbours are all of the
/// region: along the border of what ends at a wall nodes are of that.
const MET: f64 = 0.9;
const MET_WITHIN: f64 = 0.98;

/// Around the nodes the form goes on where it faces the camera so squarely at least, of the
/// least squarely that it does at a node: what is steeper needs many patches and bounds nothing.
const LEAST_FACING: f64 = 0.75;

/// Narrowest span, in the distance of the places that the form is fitted at; half of that of a fit to
/// nodes, since nothing is made up between them.
const LEAST_SPAN: f64 = 1.0;

/// Places to a pitch, tried one after the other: narrow rings that end steeply need many.
const FINENESS: [usize; 3] = [1, 2, 4];

/// How far a node may lie off the form along its normal, pitches: what is found farther away is
/// another sheet of it.
const NEAR: f64 = 2.0;

/// Patches of a form over a domain with so many spans along a side at most; `None` where they
/// do not come within [`FORM_TOLERANCE_MM`], or it is not seen at the nodes.
pub(crate) fn patches(
    form: &Form,
    image: &RangeImage,
    nodes: &[Node],
    domain: &Domain,
    most_spans: usize,
) -> Option<PatchSurface> {
    let patches = |fineness: usize| {
        let observations = match form {
            Form::Shape(Shape::Plane(_)) => over(form, domain)?,
            _ => around(form, image, nodes, (domain, fineness))?,
        };
        let demand = Demand {
            tolerance_mm: AIM * FORM_TOLERANCE_MM,
            noise_density_mm2: NO_NOISE_MM2,
            least_span_mm: LEAST_SPAN * image.pitch_mm() / fineness as f64,
            most_spans,
            margin_mm: FAR * image.pitch_mm(),
        };
        let (spline, _) = refine::fit(&observations, domain, &demand).ok()?;
        let surface = spline.to_patches().ok()?;
        is_that(form, &surface, image, nodes).then_some(surface)
    };
    FINENESS.into_iter().find_map(patches)
}

/// Whether a surface is a form at the nodes at which that is, to its tolerance. Of the few at which it
/// is not, which are of a wall beside it, nothing is asked.
fn is_that(form: &Form, surface: &PatchSurface, image: &RangeImage, nodes: &[Node]) -> bool {
    let (mut squares_mm2, mut count) = (0.0, 0.0_f64);
    for node in nodes {
        let (x, y) = (image.x_mm(node.column), image.y_mm(node.row));
        if met(form, (x, y), node.z_mm, image.pitch_mm()).is_some() {
            let off_mm = form.distance_mm(&Vector3::new(x, y, surface.z(x, y)));
            squares_mm2 += off_mm * off_mm;
            count += 1.0;
        }
    }
    count > 0.0 && (squares_mm2 / count).sqrt() <= FORM_TOLERANCE_MM
}

/// z of a form over a place, and the cosine between z and its normal there; `None` where it is
/// not there, or another sheet of it is.
fn met(form: &Form, (x_mm, y_mm): (f64, f64), near_mm: f64, pitch_mm: f64) -> Option<(f64, f64)> {
    let z_mm = form.z_mm(x_mm, y_mm, near_mm)?;
    let facing = form.normal(&Vector3::new(x_mm, y_mm, z_mm)).z;
    ((z_mm - near_mm).abs() * facing <= NEAR * pitch_mm).then_some((z_mm, facing))
}

/// A form that is seen all over a domain, at a few places.
fn over(form: &Form, domain: &Domain) -> Option<Vec<Observation>> {
    let at =
        |(low, high): (f64, f64), k: usize| low + (high - low) * k as f64 / (PLANE_SIDE - 1) as f64;
    let places = (0..PLANE_SIDE).flat_map(|i| (0..PLANE_SIDE).map(move |j| (i, j)));
    places
        .map(|(i, j)| {
            let (u, v) = (at(domain.x_mm, i), at(domain.y_mm, j));
            let value = form.z_mm(u, v, 0.0)?;
            Some(Observation {
                u,
                v,
                value,
                weight: 1.0,
            })
        })
        .collect()
}

/// A form at the nodes of a region, around them as far as borders may run, and between them, at so
/// many places to a pitch. Distances count along the normal.
fn around(
    form: &Form,
    image: &RangeImage,
    nodes: &[Node],
    (domain, fineness): (&Domain, usize),
) -> Option<Vec<Observation>> {
    let margin = SURFACE_MARGIN.ceil() as usize;
    let extent = |of: fn(&Node) -> usize| {
        let all = || nodes.iter().map(of);
        Some((all().min()?, all().max()?))
    };
    let (columns, rows) = (extent(|n| n.column)?, extent(|n| n.row)?);
    let width = columns.1 - columns.0 + 1 + 2 * margin;
    let height = rows.1 - rows.0 + 1 + 2 * margin;
    let x_mm = |i: usize| {
        let column = (columns.0 + i) as f64 - margin as f64;
        image.x_mm(0) + column * image.pitch_mm()
    };
    let y_mm = |j: usize| {
        let row = (rows.0 + j) as f64 - margin as f64;
        image.y_mm(0) + row * image.pitch_mm()
    };
    let pitch_mm = image.pitch_mm();
    // z and weight.
    let mut known: Vec<Option<(f64, f64)>> = vec![None; width * height];
    let mut is_node = vec![false; width * height];
    let place = |node: &Node| (node.column - columns.0 + margin, node.row - rows.0 + margin);
    for node in nodes {
        let (i, j) = place(node);
        is_node[i * height + j] = true;
        known[i * height + j] = met(form, (x_mm(i), y_mm(j)), node.z_mm, pitch_mm);
    }
    let is_within = |node: &&Node| {
        let (i, j) = place(node);
        (i - 1..=i + 1).all(|i| (j - 1..=j + 1).all(|j| is_node[i * height + j]))
    };
    let is_met = |share: f64, nodes: &mut dyn Iterator<Item = &Node>| {
        let (mut all, mut met) = (0.0, 0.0);
        for (i, j) in nodes.map(place) {
            all += 1.0;
            met += f64::from(u8::from(known[i * height + j].is_some()));
        }
        met >= share * all
    };
    if !is_met(MET, &mut nodes.iter()) || !is_met(MET_WITHIN, &mut nodes.iter().filter(is_within)) {
        return None;
    }
    let facings = known.iter().flatten().map(|(_, facing)| *facing);
    let least_facing = LEAST_FACING * facings.fold(1.0, f64::min);
    for _ in 0..margin {
        let mut next = Vec::new();
        for i in 0..width {
            for j in (0..height).filter(|j| known[i * height + j].is_none()) {
                let beside = (i.saturating_sub(1)..(i + 2).min(width))
                    .flat_map(|i| (j.saturating_sub(1)..(j + 2).min(height)).map(move |j| (i, j)));
                let near = beside.filter_map(|(i, j)| known[i * height + j]);
                let near = near.map(|(z_mm, _)| z_mm).reduce(f64::min);
                let found = near.and_then(|near| met(form, (x_mm(i), y_mm(j)), near, pitch_mm));
                if let Some(found) = found.filter(|(_, facing)| *facing >= least_facing) {
                    next.push((i * height + j, found));
                }
            }
        }
        for (place, found) in next {
            known[place] = Some(found);
        }
    }
    let is_within = |(low, high): (f64, f64), at: f64| (low..=high).contains(&at);
    let observation = |(i, j): (usize, usize), (k, l): (usize, usize)| {
        let (mut value, mut facing) = known[i * height + j]?;
        let part = |k: usize| k as f64 * pitch_mm / fineness as f64;
        let (u, v) = (x_mm(i) + part(k), y_mm(j) + part(l));
        if (k, l) != (0, 0) {
            // Only between places at which the form is.
            let beyond = (i + k.min(1), j + l.min(1));
            let is_inside = beyond.0 < width && beyond.1 < height;
            let (there, _) = is_inside.then(|| known[beyond.0 * height + beyond.1])??;
            (value, facing) = met(form, (u, v), value.min(there), pitch_mm)?;
        }
        (is_within(domain.x_mm, u) && is_within(domain.y_mm, v)).then_some(Observation {
            u,
            v,
            value,
            weight: facing * facing,
        })
    };
    let places = (0..width).flat_map(|i| (0..height).map(move |j| (i, j)));
    let between = || (0..fineness).flat_map(|k| (0..fineness).map(move |l| (k, l)));
    let all = places.flat_map(|place| between().map(move |part| (place, part)));
    let all = all.filter_map(|(place, part)| observation(place, part));
    Some(all.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Lattice;
    use shapes::{Shape, Sphere, Torus};

    /// The nodes at which a shape's upper sheet faces the camera so squarely at least.
    fn seen(
        shape: &Form,
        top_mm: f64,
        least_facing: f64,
        is_part: impl Fn(f64, f64) -> bool,
    ) -> (RangeImage, Vec<Node>) {
        let image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -120, -120, 240, 240);
        let places = (0..240).flat_map(|column| (0..240).map(move |row| (column, row)));
        let node = |(column, row)| {
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            let z_mm = shape.z_mm(x, y, top_mm)?;
            let facing = shape.normal(&Vector3::new(x, y, z_mm)).z;
            (is_part(x, y) && z_mm > 0.0 && facing >= least_facing).then_some(Node {
                column,
                row,
                z_mm,
            })
        };
        let nodes = places.filter_map(node).collect();
        (image, nodes)
    }

    fn whole() -> Domain {
        Domain {
            x_mm: (-30.0, 30.0),
            y_mm: (-30.0, 30.0),
        }
    }

    #[test]
    fn a_sphere_becomes_patches_to_the_tolerance() {
        let shape = Form::Shape(Shape::Sphere(Sphere {
            centre_mm: Vector3::zeros(),
            radius_mm: 25.0,
            is_hollow: false,
        }));
        for least_facing in [0.3, 0.6] {
            let (image, nodes) = seen(&shape, 25.0, least_facing, |_, _| true);
            let surface = patches(&shape, &image, &nodes, &whole(), 256).unwrap();
            let worst = nodes.iter().map(|node| {
                let (x, y) = (image.x_mm(node.column), image.y_mm(node.row));
                let exact = (625.0 - x * x - y * y).sqrt();
                (surface.z(x, y) - exact).abs() * exact / 25.0
            });
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 0.03, "{least_facing}: {worst}");
            // Few spans do not do.
            assert!(patches(&shape, &image, &nodes, &whole(), 2).is_none());
        }
    }

    /// A ring of half a tube, a few pitches wide, that is seen to where it is steep. Patches do not
    /// follow it there to a micrometre, but far better than a fit to nodes would.
    #[test]
    fn a_narrow_ring_becomes_patches_of_its_shape() {
        let (radius_mm, tube_mm) = (8.0, 3.0);
        let shape = Form::Shape(Shape::Torus(Torus {
            centre_mm: Vector3::zeros(),
            axis: Vector3::z(),
            radius_mm,
            tube_mm,
            is_hollow: false,
        }));
        let (image, nodes) = seen(&shape, tube_mm, 0.1, |_, _| true);
        let domain = Domain {
            x_mm: (-12.0, 12.0),
            y_mm: (-12.0, 12.0),
        };
        let surface = patches(&shape, &image, &nodes, &domain, 256).unwrap();
        let off = nodes.iter().map(|node| {
            let (x, y) = (image.x_mm(node.column), image.y_mm(node.row));
            let out = libm::sqrt(x * x + y * y) - radius_mm;
            (libm::sqrt(out * out + surface.z(x, y).powi(2)) - tube_mm).powi(2)
        });
        let rms_mm = (off.sum::<f64>() / nodes.len() as f64).sqrt();
        assert!(rms_mm < 0.005, "{rms_mm}");
    }

    /// Beyond its shoulders the descent leads to the lower side of the ring.
    #[test]
    fn another_sheet_of_a_groove_has_no_say() {
        let (radius_mm, tube_mm) = (20.0, 6.0);
        let shape = Form::Shape(Shape::Torus(Torus {
            centre_mm: Vector3::zeros(),
            axis: Vector3::y(),
            radius_mm,
            tube_mm,
            is_hollow: true,
        }));
        // The groove of a pulley: the inner half of the tube, on the side of the camera.
        let exact = |x: f64, y: f64| {
            let out = radius_mm - (tube_mm * tube_mm - y * y).sqrt();
            (out * out - x * x).sqrt()
        };
        let image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -120, -120, 240, 240);
        let places = (0..240).flat_map(|column| (0..240).map(move |row| (column, row)));
        let node = |(column, row)| {
            let z_mm = exact(image.x_mm(column), image.y_mm(row));
            let place = Vector3::new(image.x_mm(column), image.y_mm(row), z_mm);
            (z_mm.is_finite() && shape.normal(&place).z > 0.2).then_some(Node { column, row, z_mm })
        };
        let nodes: Vec<Node> = places.filter_map(node).collect();
        assert!(nodes.len() > 1_000, "{}", nodes.len());
        let found = around(&shape, &image, &nodes, (&whole(), 1)).unwrap();
        assert!(found.len() > nodes.len(), "it goes on a little");
        for o in &found {
            let off = o.value - exact(o.u, o.v);
            assert!(off.abs() < 1e-6, "{}, {}: {}", o.u, o.v, o.value);
        }
    }

    /// A fillet around a boss, and nodes of the wall that it has become, where they are of that.
    fn fillet_and_wall(is_wall: impl Fn(f64, f64) -> bool) -> (Form, RangeImage, Vec<Node>, f64) {
        let (radius_mm, tube_mm) = (11.6, 2.6);
        let shape = Form::Shape(Shape::Torus(Torus {
            centre_mm: Vector3::zeros(),
            axis: Vector3::z(),
            radius_mm,
            tube_mm,
            is_hollow: true,
        }));
        let image = RangeImage::masked(Lattice { pitch_mm: 0.42 }, -60, -60, 120, 120);
        let places = (0..120).flat_map(|column| (0..120).map(move |row| (column, row)));
        let mut of_wall = 0.0;
        let node = |(column, row)| {
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            let beyond = radius_mm - libm::sqrt(x * x + y * y);
            let z_mm = -libm::sqrt((tube_mm * tube_mm - beyond * beyond).max(0.0));
            let is_wall = is_wall(beyond, y);
            of_wall += f64::from(u8::from(is_wall));
            ((0.0..2.5).contains(&beyond) || is_wall).then_some(Node {
                column,
                row,
                z_mm: if is_wall { z_mm + 0.9 } else { z_mm },
            })
        };
        let nodes: Vec<Node> = places.filter_map(node).collect();
        let share = of_wall / nodes.len() as f64;
        (shape, image, nodes, share)
    }

    #[test]
    fn a_few_nodes_of_a_wall_do_not_keep_a_fillet_from_being_one() {
        let domain = Domain {
            x_mm: (-14.0, 14.0),
            y_mm: (-14.0, 14.0),
        };
        // Some, and so many as lie all along its border.
        for (from_mm, shares) in [(7.5, 0.005..0.02), (0.0, 0.03..0.06)] {
            let is_wall = |beyond: f64, y: f64| (2.55..2.75).contains(&beyond) && y > from_mm;
            let (shape, image, nodes, share) = fillet_and_wall(is_wall);
            assert!(shares.contains(&share), "{share}");
            let surface = patches(&shape, &image, &nodes, &domain, 256).unwrap();
            for node in nodes.iter().filter(|node| node.z_mm < -0.9) {
                let (x, y) = (image.x_mm(node.column), image.y_mm(node.row));
                let off_mm = shape.distance_mm(&Vector3::new(x, y, surface.z(x, y)));
                assert!(off_mm.abs() < 0.02, "{x} {y}: {off_mm}");
            }
        }
        // As many within it are of something else.
        let is_other = |beyond: f64, y: f64| (2.6..4.0).contains(&beyond) && y.abs() < 1.3;
        let (shape, image, nodes, share) = fillet_and_wall(is_other);
        assert!((0.02..0.06).contains(&share), "{share}");
        assert!(patches(&shape, &image, &nodes, &domain, 256).is_none());
    }

    #[test]
    fn a_shape_that_is_not_there_is_none() {
        let shape = Form::Shape(Shape::Sphere(Sphere {
            centre_mm: Vector3::zeros(),
            radius_mm: 25.0,
            is_hollow: false,
        }));
        let (image, mut nodes) = seen(&shape, 25.0, 0.5, |_, _| true);
        let many = nodes.len() / 20;
        for node in &mut nodes[..many] {
            node.z_mm += 10.0;
        }
        assert!(patches(&shape, &image, &nodes, &whole(), 256).is_none());
    }
}
