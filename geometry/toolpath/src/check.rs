//! Whether surface, cutters and moves fit the stock, the fixtures and the machine.

use crate::cutter::Cutter;
use crate::error::ToolpathError;
use crate::machine::Machine;
use crate::motion::{Operation, Travel};
use crate::settings::Settings;
use crate::surface::Surface;

/// What rounding of the model and of its file may amount to.
const SLACK_MM: f64 = 1e-3;
/// How far chords may lie off arcs.
const CHORD_MM: f64 = 1e-3;
const AXES: [char; 3] = ['x', 'y', 'z'];

/// Before anything is planned.
pub(crate) fn before(
    surface: &Surface,
    machine: &Machine,
    settings: &Settings,
) -> Result<(), ToolpathError> {
    let [low, high] = surface.bounds_mm();
    for cutter in settings.rough.iter().chain([&settings.finish]) {
        machine.tool(cutter)?;
        fits(cutter, low, high)?;
    }
    for axis in 0..3 {
        let [from, to] = machine.stock.axis(axis);
        for (stock_mm, surface_mm, beyond_mm) in [
            (from, low[axis], from - low[axis]),
            (to, high[axis], high[axis] - to),
        ] {
            if beyond_mm > SLACK_MM {
                return Err(ToolpathError::OutsideStock {
                    axis: AXES[axis],
                    stock_mm,
                    surface_mm,
                    beyond_mm,
                });
            }
        }
        // The surface itself must be within reach, whatever the cutter does.
        let offset = machine.work_offset_mm[axis];
        travel(machine, axis, low[axis] + offset)?;
        travel(machine, axis, high[axis] + offset)?;
    }
    let tops = machine
        .fixtures
        .iter()
        .map(|f| (format!("the fixture `{}`", f.name), f.place.z_mm[1]))
        .chain([("the stock".to_owned(), machine.stock.z_mm[1])]);
    for (what, top_mm) in tops {
        if machine.safe_z_mm <= top_mm {
            return Err(ToolpathError::SafeHeight {
                safe_z_mm: machine.safe_z_mm,
                what,
                top_mm,
            });
        }
    }
    Ok(())
}

/// A cutter as wide as the relief cannot shape it.
fn fits(cutter: &Cutter, low: [f64; 3], high: [f64; 3]) -> Result<(), ToolpathError> {
    let extents = [high[0] - low[0], high[1] - low[1]];
    let axis = usize::from(extents[1] < extents[0]);
    let extent_mm = extents[axis];
    if 2.0 * cutter.radius_mm() > extent_mm {
        return Err(ToolpathError::TooLarge {
            cutter: *cutter,
            axis: AXES[axis],
            extent_mm,
        });
    }
    Ok(())
}

fn travel(machine: &Machine, axis: usize, needed_mm: f64) -> Result<(), ToolpathError> {
    let [from, to] = machine.travel.axis(axis);
    for (limit_mm, beyond_mm) in [(from, from - needed_mm), (to, needed_mm - to)] {
        if beyond_mm > 1e-9 {
            return Err(ToolpathError::OutsideTravel {
                axis: AXES[axis],
                needed_mm,
                limit_mm,
                beyond_mm,
            });
        }
    }
    Ok(())
}

/// The moves of an operation.
pub(crate) fn after(machine: &Machine, operation: &Operation) -> Result<(), ToolpathError> {
    let bottom_mm = machine.stock.z_mm[0];
    let mut worst = None;
    let mut from = operation
        .moves
        .first()
        .map_or([0.0; 3], |first| first.to_mm);
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for step in &operation.moves {
        for to in step.points_mm(from, CHORD_MM) {
            for axis in 0..3 {
                low[axis] = low[axis].min(to[axis]);
                high[axis] = high[axis].max(to[axis]);
            }
            let beyond_mm = bottom_mm - to[2];
            if beyond_mm > worst.map_or(SLACK_MM, |(most, _)| most) {
                worst = Some((beyond_mm, to));
            }
            fixtures(machine, &operation.cutter, from, to)?;
            from = to;
        }
        if matches!(step.travel, Travel::Arc(_)) {
            from = step.to_mm;
        }
    }
    for axis in 0..3 {
        for reached in [low[axis], high[axis]] {
            travel(machine, axis, reached + machine.work_offset_mm[axis])?;
        }
    }
    if let Some((beyond_mm, [x, y, _])) = worst {
        return Err(ToolpathError::BelowStock {
            bottom_mm,
            beyond_mm,
            at_mm: [x, y],
        });
    }
    Ok(())
}

/// Whether tools are long enough. What holds a tool may be of any width, so that it must stay above
/// stock and fixtures; cutting edges must be as long as what they cut at once is high.
pub(crate) fn lengths(machine: &Machine, operations: &[Operation]) -> Result<(), ToolpathError> {
    let stock = ("the stock's top".to_owned(), machine.stock.z_mm[1]);
    let fixtures = machine.fixtures.iter();
    let fixtures = fixtures.map(|f| (format!("the fixture `{}`", f.name), f.place.z_mm[1]));
    let (what, top_mm) = fixtures.fold(stock.clone(), |a, b| if b.1 > a.1 { b } else { a });
    for (number, operation) in operations.iter().enumerate() {
        let tool = machine.tool(&operation.cutter)?;
        let ends = operation.moves.iter().map(|step| step.to_mm);
        let lowest = ends.min_by(|a, b| a[2].total_cmp(&b[2]));
        let Some([x, y, z]) = lowest else { continue };
        let short = |key, length_mm: f64, depth_mm: f64, what: &str, mend| {
            if depth_mm <= length_mm + SLACK_MM {
                return Ok(());
            }
            Err(ToolpathError::TooShort {
                cutter: operation.cutter,
                depth_mm,
                what: what.to_owned(),
                at_mm: [x, y],
                key,
                length_mm,
                mend,
            })
        };
        if let Some(reach_mm) = tool.reach_mm {
            let mend = "what holds it would go into that; clamp it longer, or lower what is higher";
            short("reach_mm", reach_mm, top_mm - z, &what, mend)?;
        }
        if let Some(length_mm) = tool.cutting_length_mm
            && number == 0
        {
            let depth_mm = stock.1 - z;
            if operations.len() == 1 {
                let mend = "choose a tool with longer edges, or rough first";
                short("cutting_length_mm", length_mm, depth_mm, &stock.0, mend)?;
            } else {
                let level_mm = tool.step_down_mm.min(depth_mm);
                let mend = "give it a smaller step_down_mm";
                let what = "the level above";
                short("cutting_length_mm", length_mm, level_mm, what, mend)?;
            }
        }
    }
    Ok(())
}

/// A cutter on a straight way against the fixtures, as a cylinder on its tip.
fn fixtures(
    machine: &Machine,
    cutter: &Cutter,
    from: [f64; 3],
    to: [f64; 3],
) -> Result<(), ToolpathError> {
    for fixture in &machine.fixtures {
        let place = &fixture.place;
        let reach = cutter.radius_mm();
        // Where along the way the tip is within the box, grown by the radius, open upwards.
        let limits = [
            (0, place.x_mm[0] - reach, place.x_mm[1] + reach),
            (1, place.y_mm[0] - reach, place.y_mm[1] + reach),
            (2, f64::NEG_INFINITY, place.z_mm[1]),
        ];
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (axis, low, high) in limits {
            let way = to[axis] - from[axis];
            if way == 0.0 {
                if from[axis] <= low || from[axis] >= high {
                    leave = f64::NEG_INFINITY;
                }
                continue;
            }
            let (a, b) = ((low - from[axis]) / way, (high - from[axis]) / way);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        if enter < leave {
            return Err(ToolpathError::Fixture {
                fixture: fixture.name.clone(),
                cutter: *cutter,
                at_mm: std::array::from_fn(|k| from[k] + enter * (to[k] - from[k])),
            });
        }
    }
    Ok(())
}
