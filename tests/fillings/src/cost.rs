//! What an implicit surface costs by the number of its points.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::time::Instant;

use anyhow::Result;
use fill::{FitSettings, Implicit, Kernel, Sample, Solver};
use glam::DVec3;

use crate::common::{Shape, uniform};

const COUNTS: [usize; 6] = [500, 1000, 2000, 4000, 10_000, 20_000];
/// Most points that are eliminated at once: the next would take minutes.
const MOST_ELIMINATED: usize = 4000;
/// The hole, and how far its surroundings reach from its middle, millimetres.
const HOLE_MM: f64 = 10.0;
const FAR_MM: f64 = 22.0;
const PLACES: usize = 500;
const SEED: u64 = 104;

/// Points around a hole on top of the torus, nearest to it as dense as they are far from it.
fn samples(count: usize, uniform: &mut impl FnMut() -> f64) -> Vec<Sample> {
    let on = |uniform: &mut dyn FnMut() -> f64| {
        let (u, v) = (TAU * uniform(), TAU * uniform());
        let (su, cu) = libm::sincos(u);
        let (sv, cv) = libm::sincos(v);
        let r = crate::common::RING + crate::common::TUBE * cv;
        DVec3::new(r * cu, r * su, crate::common::TUBE * sv)
    };
    let centre = DVec3::new(crate::common::RING, 0.0, crate::common::TUBE);
    let mut samples = Vec::with_capacity(count);
    while samples.len() < count {
        let place_mm = on(uniform);
        let far = place_mm.distance(centre);
        if (HOLE_MM..FAR_MM).contains(&far) {
            samples.push(Sample {
                place_mm,
                normal: Shape::Torus.off(place_mm).1,
                reach_mm: far - HOLE_MM,
            });
        }
    }
    samples
}

/// Root mean square distance to the torus of places in the hole brought onto the surface.
fn rms_mm(own: &Implicit, uniform: &mut impl FnMut() -> f64) -> f64 {
    let (mut squares, mut found) = (0.0, 0);
    for _ in 0..PLACES {
        let (sin, cos) = libm::sincos(TAU * uniform());
        let far = 0.9 * HOLE_MM * uniform().sqrt();
        let flat = DVec3::new(
            crate::common::RING + far * cos,
            far * sin,
            crate::common::TUBE,
        );
        let (off, normal) = Shape::Torus.off(flat);
        if let Some(at) = own.foot(flat - off * normal, HOLE_MM) {
            let off = Shape::Torus.off(at).0;
            squares += off * off;
            found += 1;
        }
    }
    if found < PLACES {
        return f64::NAN;
    }
    (squares / found as f64).sqrt()
}

pub(crate) fn table(page: &mut String) -> Result<()> {
    writeln!(page, "\n## What a fit costs\n")?;
    writeln!(
        page,
        "Random points around a hole of {} mm in a torus (seed {SEED}), as many as stand in the first \
         column. By levels: {} of them at once, the rest by levels of compact support. At once: all by \
         elimination with pivots, as the paper has it, up to what can be waited for. Root mean square of \
         {PLACES} places in the hole, micrometres, and time on this machine, seconds.\n",
        2.0 * HOLE_MM,
        FitSettings::default().most_centres
    )?;
    writeln!(
        page,
        "| points | by levels, s | rms, um | thin plate at once, s | rms, um |"
    )?;
    writeln!(page, "| ---: | ---: | ---: | ---: | ---: |")?;
    for count in COUNTS {
        let mut random = uniform(SEED);
        let samples = samples(count, &mut random);
        let fitted = |settings: FitSettings| -> Result<(f64, f64)> {
            let begun = Instant::now();
            let own = Implicit::fit(&samples, 2.0 * HOLE_MM, &settings)?;
            let time_s = begun.elapsed().as_secs_f64();
            Ok((time_s, 1000.0 * rms_mm(&own, &mut uniform(SEED + 1))))
        };
        let (levels_s, levels_um) = fitted(FitSettings::default())?;
        write!(page, "| {count} | {levels_s:.2} | {levels_um:.3} |")?;
        if count <= MOST_ELIMINATED {
            let (time_s, rms_um) = fitted(FitSettings {
                kernel: Kernel::ThinPlate,
                solver: Solver::Elimination,
                ..FitSettings::default()
            })?;
            writeln!(page, " {time_s:.2} | {rms_um:.3} |")?;
        } else {
            writeln!(page, " | |")?;
        }
    }
    Ok(())
}
