//! Regridding of a scan that is there as a whole.

use std::sync::Mutex;

use range_image::{Cancelled, Column, GridColumn, Lattice, Monitor, RangeImage, RangeImageBuilder};
use rayon::prelude::*;

use crate::error::RegridError;
use crate::grid::GridWorker;
use crate::regridder::Travel;
use crate::settings::RegridSettings;
use crate::strip::Strip;

/// Most nodes of an image: 2 GiB of values.
const NODE_LIMIT: u64 = 1 << 28;

/// The range image of a whole scan: equal, bit for bit, to what [`crate::Regridder`] gives
/// column by column, for any number of threads ([`RegridSettings::threads`]).
///
/// # Errors
/// [`RegridError`]: a setting out of range, columns that do not go one way, coordinates
/// beyond 25 m, a grid of more than 2^28 nodes, no threads, cancellation.
pub fn regrid(
    columns: impl IntoIterator<Item = Column>,
    settings: &RegridSettings,
    monitor: &dyn Monitor,
) -> Result<RangeImage, RegridError> {
    settings.validate()?;
    let strips = ascending(columns, settings)?;
    check_extent(&strips, settings)?;
    let lattice = Lattice {
        pitch_mm: settings.pitch_mm,
    };
    let mut builder = RangeImageBuilder::new(lattice);
    if let [first, .., last] = strips.as_slice() {
        let mut worker = GridWorker::default();
        let mut margin = |x_mm: f64| worker.margin_mm(&strips, x_mm, settings).unwrap_or(0.0);
        let i_first = lattice.first_at_or_above(first.x_mm - margin(first.x_mm));
        let i_last = lattice.last_at_or_below(last.x_mm + margin(last.x_mm));
        let grid = with_threads(settings.threads, || {
            grid_columns(&strips, i_first, i_last, settings, monitor)
        })??;
        check_size(&grid, settings)?;
        for column in grid {
            builder.push(column);
        }
    }
    monitor.check()?;
    monitor.progress(1.0);
    Ok(builder.finish())
}

/// The strips in ascending x, from columns in either direction.
fn ascending(
    columns: impl IntoIterator<Item = Column>,
    settings: &RegridSettings,
) -> Result<Vec<Strip>, RegridError> {
    let mut strips: Vec<Strip> = Vec::new();
    let mut travel = None;
    for (index, column) in columns.into_iter().enumerate() {
        let strip = Strip::new(&column, settings, index, Vec::new())?;
        if let Some(previous) = strips.last() {
            travel = Some(Travel::check(travel, previous.x_mm, strip.x_mm, index)?);
        }
        strips.push(strip);
    }
    if travel == Some(Travel::Descending) {
        strips.reverse();
    }
    Ok(strips)
}

fn grid_columns(
    strips: &[Strip],
    i_first: i64,
    i_last: i64,
    settings: &RegridSettings,
    monitor: &dyn Monitor,
) -> Result<Vec<GridColumn>, Cancelled> {
    let number = (i_last - i_first + 1).max(0) as usize;
    // Held while reporting, so that the reported share never decreases.
    let done = Mutex::new(0_usize);
    (i_first..=i_last)
        .into_par_iter()
        .map_init(GridWorker::default, |worker, i| {
            monitor.check()?;
            let column = worker.column(strips, i, settings);
            if let Ok(mut done) = done.lock() {
                *done += 1;
                monitor.progress(*done as f64 / number as f64);
            }
            Ok(column)
        })
        .filter_map(Result::transpose)
        .collect()
}

fn check_size(grid: &[GridColumn], settings: &RegridSettings) -> Result<(), RegridError> {
    let low_j = grid.iter().map(|c| c.j_first).min().unwrap_or(0);
    let high_j = grid.iter().map(|c| c.j_first + c.z_mm.len() as i64).max();
    let (Some(first), Some(last), Some(high_j)) = (grid.first(), grid.last(), high_j) else {
        return Ok(());
    };
    let columns = (last.i - first.i).unsigned_abs() + 1;
    let rows = (high_j - low_j).unsigned_abs();
    check_nodes(columns, rows, settings)
}

/// Share of the samples on each side that may be strays, which give no nodes.
const STRAYS: f64 = 0.02;

/// Refuses a grid that will be too large before any of it is computed: one that is too large
/// even without what the outermost samples add.
fn check_extent(strips: &[Strip], settings: &RegridSettings) -> Result<(), RegridError> {
    if check_nodes_of_all(strips, settings).is_ok() {
        return Ok(());
    }
    let mut heights: Vec<f64> = Vec::new();
    let mut places: Vec<f64> = Vec::new();
    for strip in strips {
        heights.extend(strip.samples.iter().map(|s| s.0));
        places.resize(heights.len(), strip.x_mm);
    }
    let nodes = |coordinates: &mut [f64]| {
        coordinates.sort_unstable_by(f64::total_cmp);
        let strays = (STRAYS * coordinates.len() as f64) as usize;
        let middle = coordinates.get(strays..coordinates.len() - strays)?;
        let extent_mm = middle.last()? - middle.first()?;
        Some((extent_mm / settings.pitch_mm) as u64)
    };
    match (nodes(&mut places), nodes(&mut heights)) {
        (Some(columns), Some(rows)) => check_nodes(columns, rows, settings),
        _ => Ok(()),
    }
}

/// The same with all samples, which is soon told: strips and their samples are in order.
fn check_nodes_of_all(strips: &[Strip], settings: &RegridSettings) -> Result<(), RegridError> {
    let (Some(left), Some(right)) = (strips.first(), strips.last()) else {
        return Ok(());
    };
    let heights = |end: fn(&Strip) -> Option<&(f64, f64)>| strips.iter().filter_map(end);
    let low_mm = heights(|s| s.samples.first()).fold(f64::INFINITY, |low, s| low.min(s.0));
    let high_mm = heights(|s| s.samples.last()).fold(f64::NEG_INFINITY, |high, s| high.max(s.0));
    let nodes = |extent_mm: f64| (extent_mm / settings.pitch_mm) as u64;
    check_nodes(
        nodes(right.x_mm - left.x_mm),
        nodes(high_mm - low_mm),
        settings,
    )
}

fn check_nodes(columns: u64, rows: u64, settings: &RegridSettings) -> Result<(), RegridError> {
    if columns.saturating_mul(rows) > NODE_LIMIT {
        return Err(RegridError::TooManyNodes {
            columns,
            rows,
            pitch_mm: settings.pitch_mm,
            limit: NODE_LIMIT,
        });
    }
    Ok(())
}

/// Runs the work on this many threads of its own, 0 for as many as there are processors: on
/// those that others use too, a thread that waits would begin with the work of another job, and
/// only then go on.
///
/// # Errors
/// [`RegridError::Threads`] if so many cannot be had.
pub fn with_threads<T: Send>(
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<T, RegridError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| RegridError::Threads {
            threads,
            reason: e.to_string(),
        })?;
    Ok(pool.install(work))
}
