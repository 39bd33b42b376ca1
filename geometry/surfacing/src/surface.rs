//! From a grid to surfaces with a report, step by step.

use core::ops::Range;

use nurbs::BSplineSurface;
use range_image::{Monitor, Unmonitored};
use reconstruct::Model;

use crate::axis::{Axis, Breaks};
use crate::character::{CharacterLine, LineKind, grid_lines, split_at_creases};
use crate::error::SurfaceError;
use crate::fairing::{FairingReport, fair};
use crate::fit;
use crate::grid::{FEWEST_NODES, HeightGrid};
use crate::knots::derivative::breaks_of;
use crate::knots::{
    JumpThresholds, Knots, Placement, derivative, longest_sections, polyline, uniform,
};
use crate::optimal;
use crate::parted::{Lines, Parted, parted};
use crate::problem::Problem;
use crate::within::fit_within;

/// Trimmed pieces must take no more than this share of the control points that pieces along the grid
/// do, and do so without doubt at this share of what one surface is estimated to take: then that need
/// not be made.
const PAYS: f64 = 0.75;
const CLEARLY_PAYS: f64 = 0.2;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Greatest distance in z between surface and data points, millimetres. The surface keeps
    /// to it with optimal knots, and with uniform ones as far as doubled spans of two nodes and
    /// more can; the polyline's vertices are found with it; derivative knots do not look at it.
    pub tolerance_mm: f64,
    /// How knots are placed.
    pub placement: Placement,
    /// For knots where derivatives break. Raised where noise asks for more.
    pub thresholds: JumpThresholds,
    /// Greatest distance by which fairing may move a data point, millimetres; `None`: no
    /// fairing.
    pub fair_mm: Option<f64>,
    /// Whether, with optimal knots, pieces may be trimmed at lines across the grid where that pays
    /// ([`Made::trimmed`]); else the knots follow such lines.
    pub may_trim: bool,
}

impl Settings {
    /// Optimal knots for a tolerance, without fairing; trimmed where that pays.
    #[must_use]
    pub fn new(tolerance_mm: f64) -> Self {
        Self {
            tolerance_mm,
            placement: Placement::Optimal,
            thresholds: JumpThresholds::default(),
            fair_mm: None,
            may_trim: true,
        }
    }

    /// Says what is out of range.
    ///
    /// # Errors
    /// [`SurfaceError`].
    pub fn validate(&self) -> Result<(), SurfaceError> {
        let length = |what: &'static str, value_mm: f64| {
            if value_mm > 0.0 && value_mm <= 1000.0 {
                Ok(())
            } else {
                Err(SurfaceError::Setting { what, value_mm })
            }
        };
        length("the tolerance", self.tolerance_mm)?;
        self.fair_mm
            .map_or(Ok(()), |bound| length("the bound of fairing", bound))?;
        self.thresholds.validate()
    }
}

/// A surface over a part of the grid that no step crosses: over all of its nodes, or over those of a
/// region with an outline of its own, trimmed by that ([`Made::trimmed`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// The surface, over x and y in millimetres.
    pub surface: BSplineSurface,
    /// Its inner knots, in nodes from the first of its columns and rows.
    pub knots: Knots,
    /// Columns of the grid that it covers.
    pub columns: Range<usize>,
    /// Rows of the grid that it covers.
    pub rows: Range<usize>,
}

impl Piece {
    /// The piece cut on its creases; the parts meet there exactly.
    #[must_use]
    pub fn parts(&self) -> Vec<BSplineSurface> {
        split_at_creases(&self.surface)
    }
}

/// Figures of a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceReport {
    /// How knots were placed.
    pub placement: Placement,
    /// Control points of all pieces.
    pub control_points: usize,
    /// Control points along x and y of each piece.
    pub of_pieces: Vec<[usize; 2]>,
    /// Greatest distance in z of a data point, after fairing, millimetres.
    pub max_mm: f64,
    /// Root mean square of these distances, millimetres.
    pub rms_mm: f64,
    /// Data points.
    pub nodes: usize,
    /// Of these, how many lie within the tolerance.
    pub within_tolerance: usize,
    /// Noise of the data before fairing, one standard deviation, millimetres.
    pub noise_mm: f64,
    /// Character lines along the grid that were found.
    pub lines: Vec<CharacterLine>,
    /// Where trimmed pieces meet.
    pub trimmed: Option<Lines>,
    /// What fairing did, if it was asked for.
    pub fairing: Option<FairingReport>,
}

impl SurfaceReport {
    fn new(placement: Placement, lines: Vec<CharacterLine>) -> Self {
        Self {
            placement,
            control_points: 0,
            of_pieces: Vec::new(),
            max_mm: 0.0,
            rms_mm: 0.0,
            nodes: 0,
            within_tolerance: 0,
            noise_mm: 0.0,
            lines,
            trimmed: None,
            fairing: None,
        }
    }
}

/// Surfaces, and what they were made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Made {
    /// One, or several that steps part.
    pub pieces: Vec<Piece>,
    /// The pieces with their trims, one face for each connected part of a piece, where character
    /// lines run across the grid; then the surfaces of [`Self::pieces`] go on beyond their nodes.
    pub trimmed: Option<Model>,
    /// The data points after fairing.
    pub data: HeightGrid,
    /// Data minus surface at each node, millimetres; NaN where masked. Column by column.
    pub deviations_mm: Vec<f64>,
    /// Figures.
    pub report: SurfaceReport,
}

/// Part of an operation's progress.
pub(crate) struct Part<'a> {
    pub(crate) monitor: &'a dyn Monitor,
    pub(crate) from: f64,
    pub(crate) size: f64,
}

impl Monitor for Part<'_> {
    fn is_cancelled(&self) -> bool {
        self.monitor.is_cancelled()
    }

    fn progress(&self, fraction: f64) {
        self.monitor.progress(self.from + self.size * fraction);
    }
}

/// Makes the surface.
///
/// # Errors
/// [`SurfaceError`]: settings out of range, a tolerance that cannot be reached, or
/// cancelled.
pub fn make(
    grid: &HeightGrid,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Made, SurfaceError> {
    settings.validate()?;
    let noise_mm = grid.noise_mm();
    let (mut data, mut fairing) = (grid.clone(), None);
    let mut from = 0.0;
    if let Some(bound_mm) = settings.fair_mm {
        let part = Part {
            monitor,
            from,
            size: 0.3,
        };
        let (z_mm, report) = fair(grid, bound_mm, &part)?;
        data = grid.with_z(z_mm)?;
        fairing = Some(report);
        from = 0.3;
    }
    let may_trim = settings.may_trim && settings.placement == Placement::Optimal;
    let part = |share: f64, size: f64| Part {
        monitor,
        from: from + (1.0 - from) * share,
        size: (1.0 - from) * size,
    };
    let parted = match may_trim {
        true => parted(&data, settings.tolerance_mm, &part(0.0, 0.5))?,
        false => None,
    };
    let mut is_clear = false;
    // Pieces along the grid may be as few.
    if let Some(found) = &parted
        && grid_lines(&data, settings.tolerance_mm).is_empty()
    {
        let estimate = optimal::estimate(&data, settings.tolerance_mm, monitor)?;
        is_clear = found.control_points as f64 <= CLEARLY_PAYS * estimate as f64;
    }
    let mut made = match parted {
        Some(found) if is_clear => of_parted(data, found, settings),
        parted => match (parted, whole(&data, settings, &part(0.5, 0.5))) {
            (_, Err(SurfaceError::Cancelled(cancelled))) => return Err(cancelled.into()),
            (Some(found), Err(_)) => of_parted(data, found, settings),
            (Some(found), Ok(whole)) if pays(&found, &whole.report) => {
                of_parted(data, found, settings)
            }
            (_, whole) => whole?,
        },
    };
    made.report.noise_mm = noise_mm;
    made.report.fairing = fairing;
    monitor.progress(1.0);
    Ok(made)
}

fn pays(parted: &Parted, whole: &SurfaceReport) -> bool {
    parted.control_points as f64 <= PAYS * whole.control_points as f64
}

/// In pieces that lines in any direction bound.
fn of_parted(data: HeightGrid, parted: Parted, settings: &Settings) -> Made {
    let lines = grid_lines(&data, settings.tolerance_mm);
    let mut report = SurfaceReport::new(settings.placement, lines);
    report.control_points = parted.control_points;
    let counts = |piece: &Piece| [&piece.knots.u, &piece.knots.v].map(Breaks::control_count);
    report.of_pieces = parted.pieces.iter().map(counts).collect();
    report.trimmed = Some(parted.lines);
    let mut sum_of_squares = 0.0;
    for off in parted.deviations_mm.iter().filter(|off| !off.is_nan()) {
        report.nodes += 1;
        report.max_mm = report.max_mm.max(off.abs());
        report.within_tolerance += usize::from(off.abs() <= settings.tolerance_mm);
        sum_of_squares += off * off;
    }
    report.rms_mm = (sum_of_squares / report.nodes.max(1) as f64).sqrt();
    Made {
        pieces: parted.pieces,
        trimmed: Some(parted.model),
        data,
        deviations_mm: parted.deviations_mm,
        report,
    }
}

/// One surface, or several that lines along the grid part.
fn whole(
    data: &HeightGrid,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Made, SurfaceError> {
    let lines = grid_lines(data, settings.tolerance_mm);
    let blocks = blocks(data, settings, &lines);
    let mut deviations_mm = vec![f64::NAN; data.raw_z_mm().len()];
    let mut pieces = Vec::new();
    let mut report = SurfaceReport::new(settings.placement, lines);
    let mut sum_of_squares = 0.0;
    let size = 1.0 / blocks.len().max(1) as f64;
    for (number, (columns, rows)) in blocks.into_iter().enumerate() {
        let part = Part {
            monitor,
            from: size * number as f64,
            size,
        };
        let Some(block) = data.block(columns.clone(), rows.clone()) else {
            continue;
        };
        let mut problem = Problem::new(&block, settings.tolerance_mm, &part);
        let knots = placed(&mut problem, &block, settings, &part)?;
        let (u, v) = (
            Axis::new(&knots.u).ok_or(SurfaceError::Singular)?,
            Axis::new(&knots.v).ok_or(SurfaceError::Singular)?,
        );
        let fitted = match settings.placement {
            Placement::Optimal => fit_within(&problem, &u, &v, &part)?.fit,
            _ => problem.fit_axes(&u, &v),
        };
        monitor.check()?;
        if settings.placement == Placement::Optimal && fitted.score.max > settings.tolerance_mm {
            return Err(out_of_reach(&problem, fitted.score.max));
        }
        let z = fit::values(&u, &v, &fitted.coefficients);
        for (n, z) in z.iter().enumerate() {
            let (i, j) = (n / block.rows(), n % block.rows());
            let at = (columns.start + i) * data.rows() + rows.start + j;
            deviations_mm[at] = data.raw_z_mm()[at] - z;
        }
        report.control_points += knots.control_points();
        report
            .of_pieces
            .push([knots.u.control_count(), knots.v.control_count()]);
        report.max_mm = report.max_mm.max(fitted.score.max);
        report.nodes += block.valid_nodes();
        report.within_tolerance += fitted.score.within;
        sum_of_squares += fitted.score.sum_of_squares;
        pieces.push(Piece {
            surface: in_space(&block, &knots, &fitted.coefficients)?,
            knots,
            columns,
            rows,
        });
    }
    report.rms_mm = (sum_of_squares / report.nodes.max(1) as f64).sqrt();
    Ok(Made {
        pieces,
        trimmed: None,
        data: data.clone(),
        deviations_mm,
        report,
    })
}

/// The least-squares surface with given knots over the whole grid, and its greatest and root
/// mean square distance from the data in z, millimetres.
///
/// # Errors
/// [`SurfaceError::Singular`] when the nodes do not hold the knots.
pub fn fit_with(
    grid: &HeightGrid,
    knots: &Knots,
) -> Result<(BSplineSurface, f64, f64), SurfaceError> {
    let problem = Problem::new(grid, 1.0, &Unmonitored);
    let fitted = problem.fit(knots).ok_or(SurfaceError::Singular)?;
    let surface = in_space(grid, knots, &fitted.coefficients)?;
    let mean = fitted.score.sum_of_squares / grid.valid_nodes().max(1) as f64;
    Ok((surface, fitted.score.max, mean.sqrt()))
}

fn placed(
    problem: &mut Problem,
    block: &HeightGrid,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Knots, SurfaceError> {
    Ok(match settings.placement {
        Placement::Uniform => uniform::place(problem, monitor)?,
        Placement::Polyline => polyline::place(block, settings.tolerance_mm),
        Placement::Derivative => derivative::place(block, &raised(block, settings)),
        Placement::Optimal => {
            let mut fixed = [Vec::new(), Vec::new()];
            for line in grid_lines(block, settings.tolerance_mm) {
                if line.kind == LineKind::Crease {
                    fixed[usize::from(!line.is_at_x)].extend([line.at; 3]);
                }
            }
            optimal::place(problem, &fixed, optimal::MOST_VISITS, monitor)?
        }
    })
}

fn raised(grid: &HeightGrid, settings: &Settings) -> JumpThresholds {
    settings.thresholds.above_noise(grid.noise_mm())
}

/// Columns and rows between steps. With optimal knots these are the steps all along a grid
/// line; with derivative knots those of the reference sections, where Table 1 asks for four
/// knots, with which a cubic falls apart. Other placements know of none.
fn blocks(
    data: &HeightGrid,
    settings: &Settings,
    lines: &[CharacterLine],
) -> Vec<(Range<usize>, Range<usize>)> {
    let (mut at_x, mut at_y): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    match settings.placement {
        Placement::Optimal => {
            for line in lines.iter().filter(|line| line.kind == LineKind::Step) {
                if line.is_at_x { &mut at_x } else { &mut at_y }.push(line.at);
            }
        }
        Placement::Derivative => {
            let (xz, yz) = longest_sections(data);
            let thresholds = raised(data, settings);
            for (section, at) in [(xz, &mut at_x), (yz, &mut at_y)] {
                let breaks = breaks_of(&section.z_mm, &thresholds);
                at.extend(breaks.iter().filter(|b| b.order == 0).map(|b| b.at));
            }
        }
        Placement::Uniform | Placement::Polyline => {}
    }
    let columns = between(&at_x, data.columns());
    let rows = between(&at_y, data.rows());
    columns
        .iter()
        .flat_map(|i| rows.iter().map(move |j| (i.clone(), j.clone())))
        .collect()
}

/// Ranges of nodes between places; a range of fewer nodes than a cubic needs is joined to the
/// one before.
fn between(places: &[f64], nodes: usize) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for place in places {
        let end = place.ceil() as usize;
        if end >= start + FEWEST_NODES && end + FEWEST_NODES <= nodes {
            ranges.push(start..end);
            start = end;
        }
    }
    ranges.push(start..nodes);
    ranges
}

fn out_of_reach(problem: &Problem, reached: f64) -> SurfaceError {
    let every = problem.fit(&optimal::every_node(problem));
    SurfaceError::OutOfReach {
        tolerance_mm: problem.tolerance,
        best_mm: every.map_or(reached, |every| every.score.max.min(reached)),
    }
}

/// Coefficients of z as a surface in space: x and y of a control point are the averages of
/// its knots, so that the surface's x and y are its parameters.
pub(crate) fn in_space(
    grid: &HeightGrid,
    knots: &Knots,
    coefficients: &[f64],
) -> Result<BSplineSurface, SurfaceError> {
    let vector = |breaks: &Breaks, first: f64| {
        breaks
            .knot_vector(first, grid.pitch_mm())
            .ok_or(SurfaceError::Singular)
    };
    let u = vector(&knots.u, grid.x_mm(0))?;
    let v = vector(&knots.v, grid.y_mm(0))?;
    let rows = v.control_count();
    let points = coefficients
        .iter()
        .enumerate()
        .map(|(n, &z)| [u.greville(n / rows), v.greville(n % rows), z])
        .collect();
    BSplineSurface::new(u, v, points).map_err(|_| SurfaceError::Singular)
}
