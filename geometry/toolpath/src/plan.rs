//! The whole road from a surface to the moves of its tools.

use range_image::Monitor;
use rayon::prelude::*;

use crate::check;
use crate::error::ToolpathError;
use crate::field::Field;
use crate::link::Links;
use crate::machine::Machine;
use crate::mend::{Mend, Mended};
use crate::motion::{Move, Operation};
use crate::parallel;
use crate::quantize::quantized;
use crate::rough::Rough;
use crate::scallop;
use crate::settings::{Pattern, Settings};
use crate::strand::{Drawing, Strand, along};
use crate::surface::Surface;
use crate::trace::Fineness;

/// Share of the cusps' height that may come from tips that are higher than they could be.
const SHARE_OF_CUSP: f64 = 0.04;
/// How far between samples the tip may be off their line: a fifth of a micrometre.
const WOBBLE_MM: f64 = 2e-4;
/// Samples beside a wall are this close.
const LEAST_MM: f64 = 1e-4;
/// Passes farther apart than this many steps are linked in the air.
const LINKED_STEPS: f64 = 4.0;

/// The moves of all tools, and what is worth knowing of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// In the order in which they are made: roughing, if any, and finishing.
    pub operations: Vec<Operation>,
    /// What is odd about them, in words.
    pub notes: Vec<String>,
}

/// More lines of roughing, and more places of finishing passes on level ground, are not planned:
/// they would be gigabytes of moves.
const MOST_LINES: usize = 1_000_000;
const MOST_PLACES: usize = 50_000_000;

/// Plans the milling of a surface on a machine.
///
/// # Errors
/// [`ToolpathError`]
pub fn plan(
    surface: &Surface,
    machine: &Machine,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Plan, ToolpathError> {
    machine.validate()?;
    settings.validate()?;
    check::before(surface, machine, settings)?;
    let mut notes = Vec::new();
    let mut operations = Vec::new();
    if let Some(cutter) = settings.rough {
        let part = Part::new(monitor, 0.0, 0.3);
        let rough = Rough {
            surface,
            grown: cutter.grown(settings.allowance_mm),
            allowance_mm: settings.allowance_mm,
            step_down_mm: machine.tool(&cutter)?.step_down_mm,
            step_over_mm: machine.tool(&cutter)?.step_over_mm,
            top_mm: machine.stock.z_mm[1],
            arcs: settings.arcs,
        };
        operations.push(roughing(machine, cutter, &rough, &part)?);
    }
    let from = if settings.rough.is_some() { 0.3 } else { 0.0 };
    let part = Part::new(monitor, from, 1.0);
    let (finish, told) = finishing(surface, machine, settings, &part)?;
    notes.extend(told);
    operations.push(finish);
    for operation in &operations {
        check::after(machine, operation)?;
    }
    check::lengths(machine, &operations)?;
    monitor.progress(1.0);
    Ok(Plan { operations, notes })
}

fn operation(
    machine: &Machine,
    cutter: crate::Cutter,
    name: &str,
    passes: usize,
    moves: &[Move],
    tip: &dyn Fn([f64; 2]) -> Option<f64>,
) -> Result<Operation, ToolpathError> {
    let tool = machine.tool(&cutter)?;
    Ok(Operation {
        name: name.to_owned(),
        tool: tool.number,
        cutter,
        spindle_rpm: machine.spindle_rpm(tool),
        coolant: machine.coolant,
        moves: quantized(moves, machine.decimals, tip),
        passes,
    })
}

fn roughing(
    machine: &Machine,
    cutter: crate::Cutter,
    rough: &Rough<'_>,
    monitor: &dyn Monitor,
) -> Result<Operation, ToolpathError> {
    let lines = rough.lines();
    if lines > MOST_LINES {
        return Err(ToolpathError::TooMany {
            what: "lines of roughing",
            wanted: lines,
            most: MOST_LINES,
            mend: "give the tool a larger step_down_mm or step_over_mm",
        });
    }
    let levels = rough.levels(monitor)?;
    let feeds_mm_per_min = machine.feeds_mm_per_min(machine.tool(&cutter)?);
    let mut moves = Vec::new();
    let mut passes = 0;
    for level in &levels {
        monitor.check()?;
        let tip = |at: [f64; 2]| rough.tip(at).map(|z| z.max(level.height_mm));
        let links = Links {
            safe_z_mm: machine.safe_z_mm,
            feeds_mm_per_min,
            most_mm: 1.5 * rough.step_over_mm,
            drawing: rough.drawing(),
            tip: &tip,
        };
        links.add(
            &mut moves,
            &level.strands,
            level.above_mm,
            Some(cutter.radius_mm()),
        );
        links.retract(&mut moves);
        passes += level.strands.len();
    }
    operation(machine, cutter, "roughing", passes, &moves, &|_| None)
}

fn finishing(
    surface: &Surface,
    machine: &Machine,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<(Operation, Vec<String>), ToolpathError> {
    let cutter = settings.finish;
    let field = Field::new(surface, cutter, settings.angle_deg);
    // What the corridor adds to cusps is taken from them, half of it: it adds all or nothing.
    let tolerance_mm = settings
        .tolerance_mm
        .min(SHARE_OF_CUSP * settings.scallop_mm);
    // So is what rounding of heights adds.
    let unit_mm = 1.0 / crate::post::scale(machine.decimals);
    let cusp_mm =
        settings.scallop_mm - (tolerance_mm + unit_mm.min(0.1 * settings.scallop_mm)) / 2.0;
    let drawing = Drawing {
        fineness: Fineness::of(cutter.corner_mm(), WOBBLE_MM, LEAST_MM),
        tolerance_mm,
        arcs: settings.arcs,
    };
    let places = field.places(cusp_mm, drawing.fineness.step_mm);
    if places > MOST_PLACES {
        return Err(ToolpathError::TooMany {
            what: "places of finishing passes",
            wanted: places,
            most: MOST_PLACES,
            mend: "choose a larger scallop",
        });
    }
    let ways = Part::new(monitor, 0.0, 0.4);
    let found = match settings.pattern {
        Pattern::Parallel => {
            let [from, to] = field.s;
            let line = |t: &f64| vec![field.place(from, *t), field.place(to, *t)];
            let across_mm = parallel::passes(&field, cusp_mm, &ways)?;
            across_mm.map(|across_mm| across_mm.iter().map(line).collect())
        }
        Pattern::Scallop => scallop::passes(&field, cusp_mm, &ways)?,
    };
    let lines: Vec<Vec<[f64; 2]>> = found.ok_or(ToolpathError::Nowhere(cutter))?;
    let ways = Part::new(monitor, 0.4, 0.6);
    let tip = |at: [f64; 2]| field.tip(at);
    let drawn: Result<Vec<Vec<Strand>>, ToolpathError> = (0..lines.len())
        .into_par_iter()
        .map(|k| {
            ways.check()?;
            let mut line = lines[k].clone();
            if k % 2 == 1 {
                line.reverse();
            }
            Ok(along(&line, &drawing, &tip))
        })
        .collect();
    let drawn = drawn?;
    let passes = drawn.iter().filter(|strands| !strands.is_empty()).count();
    let mut strands: Vec<Strand> = drawn.into_iter().flatten().collect();
    if strands.is_empty() {
        return Err(ToolpathError::Nowhere(cutter));
    }
    let touching = |at: [f64; 2]| surface.drop_cutter(&cutter, at).map(|contact| contact.z_mm);
    let level_mm = crate::cusp::level_step_mm(&cutter, cusp_mm).max(1e-3);
    let mend = Mend {
        field: &field,
        drawing,
        scallop_mm: settings.scallop_mm,
        level_mm,
        slope_mm: crate::cusp::slope_step_mm(&cutter, cusp_mm),
        decimals: machine.decimals,
        tip: &touching,
    };
    let mended = mend.mended(&strands, &Part::new(monitor, 0.6, 1.0))?;
    let links = Links {
        safe_z_mm: machine.safe_z_mm,
        feeds_mm_per_min: machine.feeds_mm_per_min(machine.tool(&cutter)?),
        most_mm: LINKED_STEPS * level_mm.max(0.1),
        drawing,
        tip: &touching,
    };
    let notes = told(&mended);
    let passes = passes + mended.strands.len();
    strands.extend(mended.strands);
    let mut moves = Vec::new();
    links.add(&mut moves, &strands, machine.stock.z_mm[1], None);
    links.retract(&mut moves);
    let finish = operation(machine, cutter, "finishing", passes, &moves, &touching)?;
    Ok((finish, notes))
}

/// What is worth knowing of cusps, in words.
fn told(mended: &Mended) -> Vec<String> {
    let left = mended.left_mm.map(|(cusp_mm, [x, y])| {
        format!(
            "a cusp of {cusp_mm:.4} mm is left near x {x:.2}, y {y:.2} mm, more than the scallop asks \
             for: no pass reaches it"
        )
    });
    let coarse = mended.coarse_mm.map(|[apart_mm, wanted_mm]| {
        format!(
            "cusps were measured on lines {apart_mm:.3} mm apart, not {wanted_mm:.3} mm: there are too \
             many for so small a scallop, and between them cusps may be higher; choose a larger \
             scallop, or mill the model in parts"
        )
    });
    left.into_iter().chain(coarse).collect()
}

/// A part of the whole, whose progress is a part of that of the whole.
struct Part<'a> {
    whole: &'a dyn Monitor,
    from: f64,
    to: f64,
}

impl<'a> Part<'a> {
    fn new(whole: &'a dyn Monitor, from: f64, to: f64) -> Self {
        Self { whole, from, to }
    }
}

impl Monitor for Part<'_> {
    fn is_cancelled(&self) -> bool {
        self.whole.is_cancelled()
    }

    fn progress(&self, fraction: f64) {
        let share = fraction.clamp(0.0, 1.0);
        self.whole
            .progress(self.from + share * (self.to - self.from));
    }
}
