//! The surface that sections are skinned with, and what is told of it.

use nurbs::{BSplineSurface, KnotVector};
use range_image::Monitor;

use crate::basis::{Basis, DEGREE};
use crate::crossing;
use crate::error::SkinError;
use crate::measure::{Deviation, deviations};
use crate::minimal;
use crate::settings::Settings;
use crate::spread::Net;
use crate::stack::Stack;

/// What rounding may add to a tolerance, as a part of it.
const ROUNDING: f64 = 1e-9;

/// Places around at which a surface is looked at for where it crosses itself.
const AROUND: usize = 200;

/// What was done to the sections, or is to be known of the surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Warning {
    /// Sections were put in order.
    #[error("the sections did not come in the order of their heights, and were put in it")]
    Sorted,
    /// Sections were turned.
    #[error("turned, since they ran around the other way: {}", .0.join(", "))]
    Turned(Vec<String>),
    /// The surface crosses itself.
    #[error(
        "the surface crosses itself {where_} near ({:.2}, {:.2}, {:.2}) mm",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    Crossing {
        /// On a section, or between two.
        where_: String,
        /// Where, millimetres.
        place_mm: [f64; 3],
    },
}

/// How many numbers there are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counts {
    /// Knots of each section's own curve (the paper's Table 1); empty where sections have none.
    pub of_sections: Vec<usize>,
    /// Knots around once all sections' are merged (Table 2).
    pub merged: Option<usize>,
    /// Knots around in the end (Table 2).
    pub around: usize,
    /// Control points around a section (Table 2).
    pub points_around: usize,
    /// Rows of control points across sections.
    pub rows: usize,
}

impl Counts {
    /// Control points in all.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points_around * self.rows
    }
}

/// A skinned surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// Around in u, across sections in v, both 0 to 1. A closed one ends in u where it begins.
    pub surface: BSplineSurface,
    /// Whether it is closed around.
    pub is_closed: bool,
    /// Names of the sections, in order.
    pub sections: Vec<String>,
    /// Their parameters across.
    pub heights: Vec<f64>,
    /// How many numbers it has.
    pub counts: Counts,
    /// Of each data point.
    pub deviations: Vec<Deviation>,
    /// Of each data point before knots were removed (Fig. 5 of the paper); empty where none were.
    pub before_mm: Vec<f64>,
    /// What is to be known.
    pub warnings: Vec<Warning>,
}

impl Skin {
    /// The greatest distance of a data point, millimetres.
    #[must_use]
    pub fn most_mm(&self) -> f64 {
        self.deviations
            .iter()
            .map(|own| own.off_mm)
            .fold(0.0, f64::max)
    }

    /// The root mean square of the distances, millimetres.
    #[must_use]
    pub fn rms_mm(&self) -> f64 {
        let squares = self.deviations.iter().map(|own| own.off_mm * own.off_mm);
        (squares.sum::<f64>() / self.deviations.len().max(1) as f64).sqrt()
    }
}

/// By [`crate::Method::Relief`].
pub(crate) fn skin(
    stack: Stack,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Skin, SkinError> {
    let net = minimal::net(&stack, settings, monitor)?;
    let Some(surface) = of_net(&net) else {
        return Err(SkinError::Undetermined {
            section: stack.courses[0].name.clone(),
        });
    };
    let feet: Vec<Vec<f64>> = net.rings.iter().map(|ring| ring.at.clone()).collect();
    let counts = Counts {
        of_sections: Vec::new(),
        merged: None,
        around: surface.u_knots().knots().len(),
        points_around: surface.u_knots().control_count(),
        rows: surface.v_knots().control_count(),
    };
    let asked = (settings.tolerance_mm, monitor);
    finished(stack, surface, (&feet, Vec::new()), counts, asked)
}

/// Measures a surface and looks at it.
pub(crate) fn finished(
    stack: Stack,
    surface: BSplineSurface,
    (feet, before_mm): (&[Vec<f64>], Vec<f64>),
    counts: Counts,
    (tolerance_mm, monitor): (f64, &dyn Monitor),
) -> Result<Skin, SkinError> {
    let deviations = deviations(&surface, &stack, feet, monitor)?;
    // Whatever was found on the way: the surface that is handed out holds the tolerance.
    let is_held = |own: &&Deviation| own.off_mm <= tolerance_mm * (1.0 + ROUNDING);
    if let Some(off) = deviations.iter().find(|own| !is_held(own)) {
        return Err(SkinError::OutOfReach {
            section: stack.courses[off.section].name.clone(),
            reached_mm: off.off_mm,
            tolerance_mm,
        });
    }
    let mut warnings = stack.warnings;
    if stack.is_closed {
        let names: Vec<&str> = stack.courses.iter().map(|course| &*course.name).collect();
        warnings.extend(crossing(&surface, &stack.heights, &names));
    }
    monitor.progress(1.0);
    Ok(Skin {
        surface,
        is_closed: stack.is_closed,
        sections: stack
            .courses
            .into_iter()
            .map(|course| course.name)
            .collect(),
        heights: stack.heights,
        counts,
        deviations,
        before_mm,
        warnings,
    })
}

/// The surface over clamped knots.
fn of_net(net: &Net) -> Option<BSplineSurface> {
    let functions = net.basis.functions();
    let rows: Option<Vec<_>> = net
        .points
        .chunks_exact(functions)
        .map(|row| net.basis.curve(row))
        .collect();
    let rows = rows?;
    let around = rows.first()?.points().len();
    let points = (0..around).flat_map(|i| rows.iter().map(move |row| row.points()[i]));
    let knots = clamped(&net.basis)?;
    BSplineSurface::new(knots, net.across.clone(), points.collect()).ok()
}

fn clamped(basis: &Basis) -> Option<KnotVector> {
    let (first, last) = (basis.breaks[0], basis.breaks[basis.spans()]);
    let knots = [
        vec![first; DEGREE],
        basis.breaks.clone(),
        vec![last; DEGREE],
    ];
    KnotVector::new(DEGREE, knots.concat()).ok()
}

/// The first of the curves around, at the sections and half way between them, that crosses itself.
fn crossing(surface: &BSplineSurface, heights: &[f64], names: &[&str]) -> Option<Warning> {
    let between = heights.windows(2).map(|pair| pair[0].midpoint(pair[1]));
    let on = heights
        .iter()
        .enumerate()
        .map(|(k, height)| (format!("on {}", names[k]), *height));
    let between = between
        .enumerate()
        .map(|(k, height)| (format!("between {} and {}", names[k], names[k + 1]), height));
    on.chain(between).find_map(|(where_, height)| {
        let at = |k: usize| surface.evaluate(k as f64 / AROUND as f64, height);
        let ring: Vec<[f64; 3]> = (0..AROUND).map(at).collect();
        let place_mm = crossing::of_polygon(&ring)?;
        Some(Warning::Crossing { where_, place_mm })
    })
}
