//! Patches of surfaces that are known.
//!
//! A model is a graph over the x-y plane, so a known shape becomes patches, too: fitted to the
//! shape itself at the nodes of its region, and a little beyond for borders to run on.

use nurbs::{Observation, PatchSurface};
use range_image::RangeImage;
use shapes::Shape;

use crate::fit::Domain;
use crate::model::SHAPE_TOLERANCE_MM;
use crate::refine::{self, Demand};
use crate::run::{Node, SURFACE_MARGIN};

/// Places along each side of its domain that determine a plane, and more.
const PLANE_SIDE: usize = 5;

/// What a fit to a shape leaves is no noise: this is far below what is worth a coefficient,
/// square millimetres.
const NO_NOISE_MM2: f64 = 1e-14;

/// Narrowest span, pitches; half of that of a fit to nodes, since nothing is made up between
/// them.
const LEAST_SPAN: f64 = 1.0;

/// Most spans along a side.
const MOST_SPANS: usize = 256;

/// Patches of a shape over a domain; `None` where it is not seen at most of the nodes.
pub(crate) fn patches(
    shape: &Shape,
    image: &RangeImage,
    nodes: &[Node],
    domain: &Domain,
) -> Option<PatchSurface> {
    let observations = match shape {
        Shape::Plane(_) => over(shape, domain)?,
        _ => around(shape, image, nodes)?,
    };
    let demand = Demand {
        tolerance_mm: SHAPE_TOLERANCE_MM,
        noise_density_mm2: NO_NOISE_MM2,
        least_span_mm: LEAST_SPAN * image.pitch_mm(),
        most_spans: MOST_SPANS,
    };
    let spline = refine::fit(&observations, domain, &demand).ok()?;
    spline.to_patches().ok()
}

/// A shape that is seen all over a domain, at a few places.
fn over(shape: &Shape, domain: &Domain) -> Option<Vec<Observation>> {
    let at =
        |(low, high): (f64, f64), k: usize| low + (high - low) * k as f64 / (PLANE_SIDE - 1) as f64;
    let places = (0..PLANE_SIDE).flat_map(|i| (0..PLANE_SIDE).map(move |j| (i, j)));
    places
        .map(|(i, j)| {
            let (u, v) = (at(domain.x_mm, i), at(domain.y_mm, j));
            let value = shape.z_mm(u, v, 0.0)?;
            Some(Observation {
                u,
                v,
                value,
                weight: 1.0,
            })
        })
        .collect()
}

/// A shape at the nodes of a region, and around them as far as borders may run.
fn around(shape: &Shape, image: &RangeImage, nodes: &[Node]) -> Option<Vec<Observation>> {
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
    let mut z_mm = vec![f64::NAN; width * height];
    let mut met = 0;
    for node in nodes {
        let (i, j) = (node.column - columns.0 + margin, node.row - rows.0 + margin);
        if let Some(z) = shape.z_mm(x_mm(i), y_mm(j), node.z_mm) {
            z_mm[i * height + j] = z;
            met += 1;
        }
    }
    if 2 * met < nodes.len() {
        return None;
    }
    for _ in 0..margin {
        let mut next = Vec::new();
        for i in 0..width {
            for j in (0..height).filter(|j| z_mm[i * height + j].is_nan()) {
                let beside = (i.saturating_sub(1)..(i + 2).min(width))
                    .flat_map(|i| (j.saturating_sub(1)..(j + 2).min(height)).map(move |j| (i, j)));
                let known = beside.map(|(i, j)| z_mm[i * height + j]);
                let near = known.filter(|z| !z.is_nan()).reduce(f64::min);
                if let Some(z) = near.and_then(|near| shape.z_mm(x_mm(i), y_mm(j), near)) {
                    next.push((i * height + j, z));
                }
            }
        }
        for (place, z) in next {
            z_mm[place] = z;
        }
    }
    let seen = (0..width).flat_map(|i| (0..height).map(move |j| (i, j)));
    let seen = seen.filter(|(i, j)| !z_mm[i * height + j].is_nan());
    let observation = |(i, j): (usize, usize)| Observation {
        u: x_mm(i),
        v: y_mm(j),
        value: z_mm[i * height + j],
        weight: 1.0,
    };
    Some(seen.map(observation).collect())
}
