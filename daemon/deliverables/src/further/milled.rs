//! From triangles to a checked NC program.

use std::io::{self, Write};

use jiff::Timestamp;
use range_image::{Lattice, Monitor, RangeImage};
use serde::{Deserialize, Serialize};
use toolpath::{Header, HeightField, Machine, Plan, Settings, Surface, ToolpathError, Travel};

use crate::picture;

/// Nodes along the longer side of the simulation, and the finest that it is.
const NODES: f64 = 1000.0;
const FINEST_MM: f64 = 0.02;

/// A program that cuts deeper than this, millimetres, is not written.
const MOST_GOUGE_MM: f64 = 0.01;

/// An operation in numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OperationFigures {
    /// `roughing` or `finishing`.
    pub name: String,
    /// Number of its tool.
    pub tool: u32,
    /// Its cutter, such as `ball:6`.
    pub cutter: String,
    /// Turns per minute.
    pub spindle_rpm: f64,
    /// Passes.
    pub passes: usize,
    /// Moves.
    pub moves: usize,
    /// Those of them that are arcs.
    pub arcs: usize,
    /// Length of moves at a feed.
    pub cutting_mm: f64,
    /// Length of rapid moves.
    pub rapid_mm: f64,
    /// Estimated time, tool change included.
    pub time_s: f64,
}

/// What the simulated removal left.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SimulationFigures {
    /// Distance of its nodes.
    pub pitch_mm: f64,
    /// Nodes over the model that are not at its walls.
    pub nodes: usize,
    /// Deepest that it cut below the model.
    pub gouge_mm: f64,
    /// Most that it left on the model.
    pub leftover_mm: f64,
    /// What it left at most on 95 of 100 nodes.
    pub leftover_95_mm: f64,
}

/// Why there is no program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MillError {
    /// There is no path, or it cannot be gone.
    #[error(transparent)]
    Toolpath(#[from] ToolpathError),
    /// The simulation would not see the cutters.
    #[error(
        "pitch_mm = {pitch_mm}: the simulation would not see cutters of radius {radius_mm} mm; \
         choose {} or less", radius_mm / 2.0
    )]
    Coarse {
        /// Distance of its nodes.
        pitch_mm: f64,
        /// The smallest radius.
        radius_mm: f64,
    },
    /// The simulation saw nothing.
    #[error("no place of the model could be simulated; choose a finer simulation")]
    Unseen,
    /// A defect of ours.
    #[error(
        "the simulation cuts {gouge_mm:.4} mm too deep; nothing is written. Please report it with \
         the model and the machine's file"
    )]
    Gouge {
        /// How deep.
        gouge_mm: f64,
    },
}

/// A program that has been simulated, and what came of that.
#[derive(Debug, Clone)]
pub struct Milled {
    /// The operations.
    pub plan: Plan,
    /// What is told of the simulation.
    pub simulation: SimulationFigures,
    /// How far the machined surface lies above the model, at the nodes of the simulation.
    pub above_mm: RangeImage,
}

/// Plans and simulates. `pitch_mm` is the distance of the simulation's nodes; without it, it follows
/// the model's size.
///
/// # Errors
/// Any [`MillError`]; a rapid move into material, or a cut too deep, is a defect of ours and gives no
/// program.
pub fn mill(
    surface: &Surface,
    machine: &Machine,
    settings: &Settings,
    pitch_mm: Option<f64>,
    monitor: &dyn Monitor,
    simulating: &dyn Fn(),
) -> Result<Milled, MillError> {
    let pitch_mm = pitch_mm.unwrap_or_else(|| usual_pitch_mm(surface));
    let cutters = [Some(settings.finish), settings.rough];
    let radii_mm = cutters.into_iter().flatten().map(|c| c.radius_mm());
    let radius_mm = radii_mm.fold(f64::INFINITY, f64::min);
    if pitch_mm > radius_mm / 2.0 {
        return Err(MillError::Coarse {
            pitch_mm,
            radius_mm,
        });
    }
    let plan = toolpath::plan(surface, machine, settings, monitor)?;
    simulating();
    let field = simulated(surface, machine, &plan, pitch_mm, monitor)?;
    let deviations = field.deviations_mm(surface);
    let simulation = measured(&field, &deviations);
    if simulation.nodes == 0 {
        return Err(MillError::Unseen);
    }
    if simulation.gouge_mm > MOST_GOUGE_MM {
        return Err(MillError::Gouge {
            gouge_mm: simulation.gouge_mm,
        });
    }
    Ok(Milled {
        above_mm: image(&field, &deviations),
        plan,
        simulation,
    })
}

impl Milled {
    /// The operations in numbers.
    #[must_use]
    pub fn operations(&self, machine: &Machine) -> Vec<OperationFigures> {
        let of = |operation: &toolpath::Operation| {
            let time = toolpath::duration(machine, operation);
            let arcs = operation.moves.iter();
            let arcs = arcs.filter(|step| matches!(step.travel, Travel::Arc(_)));
            OperationFigures {
                name: operation.name.clone(),
                tool: operation.tool,
                cutter: operation.cutter.to_string(),
                spindle_rpm: operation.spindle_rpm,
                passes: operation.passes,
                moves: operation.moves.len(),
                arcs: arcs.count(),
                cutting_mm: time.cutting_mm,
                rapid_mm: time.rapid_mm,
                time_s: time.total_s(),
            }
        };
        self.plan.operations.iter().map(of).collect()
    }

    /// Writes the NC program of a model.
    ///
    /// # Errors
    /// What the destination says.
    pub fn write(
        &self,
        machine: &Machine,
        title: &str,
        timestamp: Timestamp,
        mut sink: &mut dyn Write,
    ) -> io::Result<()> {
        let header = Header {
            title: title.to_owned(),
            author: format!("relief {}", env!("CARGO_PKG_VERSION")),
            timestamp: timestamp.to_string(),
        };
        toolpath::write(machine, &self.plan.operations, &header, &mut sink)
    }

    /// Draws how far the machined surface lies above the model, as PNG.
    ///
    /// # Errors
    /// What the destination says, and an image that is too large.
    pub fn draw(&self, title: &str, sink: &mut dyn Write) -> io::Result<()> {
        let simulation = &self.simulation;
        let subtitle = format!(
            "machined surface above the model: {:+.4} to {:+.4} mm, 95 % within {:.4} mm",
            -simulation.gouge_mm, simulation.leftover_mm, simulation.leftover_95_mm
        );
        picture::write_machined(&self.above_mm, title, &subtitle, sink)
    }
}

fn usual_pitch_mm(surface: &Surface) -> f64 {
    let [low, high] = surface.bounds_mm();
    let longer = (high[0] - low[0]).max(high[1] - low[1]);
    (longer / NODES).max(FINEST_MM)
}

/// The stock over the surface after all operations; a rapid move into material is a defect of
/// ours, and no program is written then.
fn simulated(
    surface: &Surface,
    machine: &Machine,
    plan: &Plan,
    pitch_mm: f64,
    monitor: &dyn Monitor,
) -> Result<HeightField, ToolpathError> {
    let within = [0, 1].map(|axis| within_mm(surface, machine, plan, axis));
    let field = HeightField::of_stock(&machine.stock, within, pitch_mm)?;
    let removal = field.remove(&plan.operations, monitor)?;
    if removal.rapid_cut_mm > 0.0 {
        return Err(ToolpathError::RapidCut {
            depth_mm: removal.rapid_cut_mm,
            at_mm: removal.rapid_cut_at_mm,
        });
    }
    Ok(removal.field)
}

/// The stock along an axis as far as tools come: beside the model as well.
fn within_mm(surface: &Surface, machine: &Machine, plan: &Plan, axis: usize) -> [f64; 2] {
    let [low, high] = surface.bounds_mm();
    let [from, to] = machine.stock.axis(axis);
    let radii = plan.operations.iter().map(|o| o.cutter.radius_mm());
    let aside = 2.0 * radii.fold(0.0, f64::max);
    [
        (low[axis] - aside).max(from).min(low[axis]),
        (high[axis] + aside).min(to).max(high[axis]),
    ]
}

fn measured(field: &HeightField, deviations: &[Option<f64>]) -> SimulationFigures {
    let mut known: Vec<f64> = deviations.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * known.len().saturating_sub(1) as f64).round() as usize;
        known.get(index).copied().unwrap_or(0.0)
    };
    SimulationFigures {
        pitch_mm: field.pitch_mm,
        nodes: known.len(),
        gouge_mm: (-at(0.0)).max(0.0),
        leftover_mm: at(1.0).max(0.0),
        leftover_95_mm: at(0.95).max(0.0),
    }
}

/// The deviations as an image, for the picture.
fn image(field: &HeightField, deviations: &[Option<f64>]) -> RangeImage {
    let lattice = Lattice {
        pitch_mm: field.pitch_mm,
    };
    let first = |axis: usize| (field.origin_mm[axis] / field.pitch_mm).round() as i64;
    let mut image = RangeImage::masked(lattice, first(0), first(1), field.columns, field.rows);
    for (node, deviation) in deviations.iter().enumerate() {
        image.set_z_mm(node % field.columns, node / field.columns, *deviation);
    }
    image
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use range_image::Unmonitored;

    use super::*;
    use crate::further::MachineFile;

    #[test]
    fn the_stock_is_simulated_beside_the_model_as_far_as_tools_come() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/machine.toml");
        let machine = MachineFile::read(&file).unwrap().machine().unwrap();
        // A level plane in the middle of the stock, that reaches nearly to one of its sides.
        let (x_mm, y_mm, top_mm) = ([-10.0, 39.0], [-8.0, 8.0], machine.stock.z_mm[1] - 2.0);
        let corner = |x: f64, y: f64| [x, y, top_mm];
        let corners = [
            corner(x_mm[0], y_mm[0]),
            corner(x_mm[1], y_mm[0]),
            corner(x_mm[1], y_mm[1]),
            corner(x_mm[0], y_mm[1]),
        ];
        let surface = Surface::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let settings = Settings::finishing("ball:6".parse().unwrap());
        let milled = mill(
            &surface,
            &machine,
            &settings,
            Some(0.2),
            &Unmonitored,
            &|| (),
        )
        .unwrap();
        let image = &milled.above_mm;
        let (first, last) = (image.x_mm(0), image.x_mm(image.columns() - 1));
        // Twice the radius beside the model, and no farther than the stock.
        assert!((first + 16.0).abs() < 0.3, "{first}");
        assert!((last - machine.stock.x_mm[1]).abs() < 0.3, "{last}");
        // Only what is over the model counts.
        assert_eq!(image.z_mm(0, 0), None);
        assert!(
            milled.simulation.leftover_mm < 0.02,
            "{:?}",
            milled.simulation
        );
    }
}
