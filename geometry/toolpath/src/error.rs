//! Why there is no tool path.

use range_image::Cancelled;

use crate::cutter::Cutter;
use crate::machine::MachineError;

/// Why there is no tool path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ToolpathError {
    /// The caller has lost interest.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The machine's description does not hold together.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// There is nothing to mill.
    #[error("the model has no triangles")]
    Empty,
    /// A coordinate is no number.
    #[error("vertex {vertex} of the model has no finite coordinates")]
    NotFinite {
        /// Its index.
        vertex: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} of the model names vertex {vertex}, of {vertices}")]
    Missing {
        /// Its index.
        triangle: usize,
        /// The vertex that it names.
        vertex: usize,
        /// How many there are.
        vertices: usize,
    },
    /// A setting lies outside its limits.
    #[error("{name} = {value}: must be {must}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// The cutter does not fit the relief.
    #[error(
        "the cutter {cutter} is larger than the relief, which measures {extent_mm:.3} mm along \
         {axis}: choose one of a smaller diameter"
    )]
    TooLarge {
        /// The cutter.
        cutter: Cutter,
        /// Along which axis it is too large.
        axis: char,
        /// How far the relief reaches along it.
        extent_mm: f64,
    },
    /// The stock does not hold what is to be made of it.
    #[error(
        "the stock ends at {axis} = {stock_mm} mm and the surface reaches {surface_mm:.3} mm, \
         {beyond_mm:.3} mm beyond it: enlarge or move stock.{axis}_mm, or move the model"
    )]
    OutsideStock {
        /// Along which axis.
        axis: char,
        /// Where the stock ends.
        stock_mm: f64,
        /// Where the surface does.
        surface_mm: f64,
        /// How far that is beyond.
        beyond_mm: f64,
    },
    /// The cutter would leave the machine's travel.
    #[error(
        "the path leaves the machine's travel along {axis} by {beyond_mm:.3} mm: it needs \
         {needed_mm:.3} mm in machine coordinates, and travel.{axis}_mm ends at {limit_mm} mm; \
         move the model or work_offset_mm"
    )]
    OutsideTravel {
        /// Along which axis.
        axis: char,
        /// Where it would go, machine coordinates.
        needed_mm: f64,
        /// Where the travel ends, machine coordinates.
        limit_mm: f64,
        /// How far that is beyond.
        beyond_mm: f64,
    },
    /// The cutter would go below what it is to cut.
    #[error(
        "the cutter's tip would go {beyond_mm:.3} mm below the stock's bottom at z = {bottom_mm} \
         mm, near x {:.2}, y {:.2} mm: enlarge stock.z_mm downwards",
        at_mm[0], at_mm[1]
    )]
    BelowStock {
        /// Where the stock ends.
        bottom_mm: f64,
        /// How far below.
        beyond_mm: f64,
        /// Where.
        at_mm: [f64; 2],
    },
    /// The cutter would run into a fixture.
    #[error(
        "the cutter {cutter} would hit the fixture `{fixture}` near x {:.2}, y {:.2}, z {:.2} mm: \
         move the fixture or the model, or choose a smaller cutter",
        at_mm[0], at_mm[1], at_mm[2]
    )]
    Fixture {
        /// Its name.
        fixture: String,
        /// The cutter.
        cutter: Cutter,
        /// Where the tip is then.
        at_mm: [f64; 3],
    },
    /// The rapid height is not above everything.
    #[error("safe_z_mm = {safe_z_mm}: must be above {what}, which reaches {top_mm} mm")]
    SafeHeight {
        /// The height for rapids.
        safe_z_mm: f64,
        /// What is higher.
        what: String,
        /// Its top.
        top_mm: f64,
    },
    /// The tool is too short for how deep it would go.
    #[error(
        "the cutter {cutter} would go {depth_mm:.3} mm below {what}, near x {:.2}, y {:.2} mm, and \
         its {key} is {length_mm} mm: {mend}",
        at_mm[0], at_mm[1]
    )]
    TooShort {
        /// The cutter.
        cutter: Cutter,
        /// How deep it would go.
        depth_mm: f64,
        /// Below what.
        what: String,
        /// Where.
        at_mm: [f64; 2],
        /// Which of its lengths is too short.
        key: &'static str,
        /// That length.
        length_mm: f64,
        /// What to do.
        mend: &'static str,
    },
    /// The simulation found a rapid move in material.
    #[error(
        "the simulation found a rapid move {depth_mm:.3} mm deep in material near x {:.2}, y {:.2} \
         mm: rough first, or raise safe_z_mm",
        at_mm[0], at_mm[1]
    )]
    RapidCut {
        /// How deep.
        depth_mm: f64,
        /// Where.
        at_mm: [f64; 2],
    },
    /// The pattern is not for this cutter.
    #[error("constant-scallop passes are for ball cutters, not {0}: choose parallel passes")]
    NeedsBall(Cutter),
    /// The cutter touches the surface nowhere.
    #[error("the cutter {0} can be led over the surface nowhere")]
    Nowhere(Cutter),
    /// More than can be handled.
    #[error("{what}: {wanted} are too many, {most} at most; {mend}")]
    TooMany {
        /// What would be too many.
        what: &'static str,
        /// How many there would be.
        wanted: usize,
        /// How many there may be.
        most: usize,
        /// What to do.
        mend: &'static str,
    },
}
