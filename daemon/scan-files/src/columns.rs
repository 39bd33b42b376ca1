//! From points in any order to columns.

use std::ops::Range;

use crate::error::ScanFileError;
use crate::gather::{Gather, Point};
use crate::lattice::{lattice_counts, lattice_mm};
use crate::spacing::{extent, mean_distance, median, most_frequent};
use crate::{LATTICE_MM, PointColumn, PointSample, PointScan};

/// Points that share one x lie within this share of the pitch.
const SHARED_X_SHARE: u32 = 10;
/// Distances within columns and between them differ at least by this factor.
const DISTANCE_JUMP: u32 = 4;
/// A scan in columns has at least this many points in each, on average.
const LEAST_MEAN_COLUMN: usize = 2;
/// Beyond this ratio of the spacing in a column to the pitch the "columns" are an effect
/// of coordinates written with few decimals.
const GREATEST_ANISOTROPY: u32 = 16;
/// Columns of a cloud are this fraction of the mean distance of its points wide, so that
/// moving a point to its column's x moves it by an eighth of that distance at most.
const CLOUD_BINS: f64 = 4.0;
/// Parts smaller than this in x and y are probably in other units than assumed, mm.
const SMALL_PART_MM: f64 = 2.0;
/// Parts larger than this, likewise: no slide table is so long.
const LARGE_PART_MM: f64 = 10_000.0;
/// A column is at least this many times as high as it is wide.
const COLUMN_SLENDERNESS: u32 = 4;
/// Widths up to this many lattice counts are from rounding, whatever the height.
const ROUNDING_COUNTS: u32 = 100;

/// A run of points, sorted by x, that make one column.
struct Group {
    x: i32,
    members: Range<usize>,
}

pub(crate) fn build(mut gather: Gather<'_>) -> Result<PointScan, ScanFileError> {
    let mut points = std::mem::take(&mut gather.points);
    leave_out_unmeasured(points.len(), &mut gather)?;
    points.sort_unstable();
    let read = points.len();
    points.dedup_by_key(|p| (p.x, p.y, p.z));
    if points.is_empty() {
        return Err(ScanFileError::NoPoints {
            file: gather.file.to_owned(),
        });
    }
    if points.len() < read {
        gather.note(format!(
            "{} of {read} points were repeated and are used once only",
            read - points.len()
        ));
    }
    let (width, height) = extent(&points);
    if width == 0 && height == 0 {
        return Err(ScanFileError::NoExtent {
            file: gather.file.to_owned(),
            points: points.len(),
        });
    }
    let size_mm = f64::from(width.max(height)) * LATTICE_MM;
    let units_suspected = units_suspected(size_mm, gather.options.units.is_some());
    gather.notes.extend(units_suspected.clone());
    let intensity_scale = intensity_scale(&points, &mut gather);
    let Grouping {
        groups,
        pitch,
        cloud_distance,
    } = group(&points, &mut gather);
    let columns: Vec<PointColumn> = groups
        .into_iter()
        .map(|group| column(&mut points, group, intensity_scale))
        .collect();
    let pitch_mm = pitch.map(|counts| f64::from(counts) * LATTICE_MM);
    let spacing_mm = match (cloud_distance, pitch) {
        // In a cloud's columns spacings scatter widely; the density is what is known.
        (Some(distance), Some(bin)) => Some(distance * distance / f64::from(bin) * LATTICE_MM),
        _ => sample_spacing_mm(&columns),
    };
    if pitch_mm.is_none() {
        gather.note("all points share one x: a single column");
    }
    // One of the two exists: the points have an extent in x or in y.
    let fallback_mm = spacing_mm.or(pitch_mm).unwrap_or(1.0);
    Ok(PointScan {
        columns,
        column_pitch_mm: pitch_mm.unwrap_or(fallback_mm),
        sample_spacing_mm: spacing_mm.unwrap_or(fallback_mm),
        notes: gather.notes,
        units_suspected,
    })
}

/// Why the coordinates are probably not in the unit they were taken for, if so.
fn units_suspected(size_mm: f64, unit_given: bool) -> Option<String> {
    if size_mm > LARGE_PART_MM {
        return Some(format!(
            "the points spread over {:.1} m in x or y, which no slide table reaches: check the \
             unit ({}), and leave out single points far away with --roi-x-mm and --roi-y-mm",
            size_mm / 1000.0,
            if unit_given {
                "the one that was given"
            } else {
                "millimetres, unless --units says otherwise"
            }
        ));
    }
    (!unit_given && size_mm < SMALL_PART_MM).then(|| {
        format!(
            "the part is only {size_mm:.3} mm across in x and y, taken as millimetres; if the \
             file is in metres or inches, say so with --units m or --units inch"
        )
    })
}

/// Notes how many points had no measurement; refuses a file that holds mostly such.
fn leave_out_unmeasured(measured: usize, gather: &mut Gather<'_>) -> Result<(), ScanFileError> {
    let Some(first) = gather.first_unmeasured else {
        return Ok(());
    };
    let unmeasured = gather.unmeasured;
    if unmeasured > measured {
        return Err(ScanFileError::Unmeasured {
            file: gather.file.to_owned(),
            unmeasured,
            all: measured + unmeasured,
            first,
        });
    }
    gather.note(format!(
        "{unmeasured} point(s) without a measurement (a coordinate is NaN or infinite) were \
         left out, the first at {first}"
    ));
    Ok(())
}

/// Points put into columns.
struct Grouping {
    groups: Vec<Group>,
    /// `None` for a single column.
    pitch: Option<u32>,
    /// Mean distance of points, if they are a cloud.
    cloud_distance: Option<f64>,
}

fn group(points: &[Point], gather: &mut Gather<'_>) -> Grouping {
    if let Some(bin) = gather.options.column_pitch_mm.and_then(lattice_counts) {
        return Grouping {
            groups: bins(points, bin),
            pitch: Some(bin.unsigned_abs()),
            cloud_distance: None,
        };
    }
    if let Some((groups, pitch)) = shared_x(points) {
        return Grouping {
            groups,
            pitch,
            cloud_distance: None,
        };
    }
    let distance = mean_distance(points);
    let bin = (distance / CLOUD_BINS).round().clamp(10.0, 1e9) as i32;
    gather.note(format!(
        "the points are not in columns of one x each (mean distance {:.3} mm): \
         put into columns {:.4} mm apart",
        distance * LATTICE_MM,
        lattice_mm(bin)
    ));
    Grouping {
        groups: bins(points, bin),
        pitch: Some(bin.unsigned_abs()),
        cloud_distance: Some(distance),
    }
}

/// Columns as the scanner took them, if the points show any.
fn shared_x(points: &[Point]) -> Option<(Vec<Group>, Option<u32>)> {
    // Merging first: values that differ by rounding only would otherwise pass for columns.
    let mut gaps = gaps(points.iter().map(|p| p.x));
    gaps.sort_unstable();
    let jumps = gaps
        .windows(2)
        .filter(|pair| u64::from(pair[1]) >= u64::from(pair[0]) * u64::from(DISTANCE_JUMP))
        .map(|pair| pair[0]);
    for threshold in jumps.chain([0]) {
        let groups = merged(points, threshold);
        let pitch = most_frequent(&mut self::gaps(groups.iter().map(|g| g.x)));
        let tolerance = pitch.unwrap_or(0) / SHARED_X_SHARE;
        let narrow = groups.iter().all(|g| {
            let members = &points[g.members.clone()];
            match (members.first(), members.last()) {
                (Some(first), Some(last)) => last.x.abs_diff(first.x) <= tolerance,
                _ => true,
            }
        });
        let filled = points.len() >= LEAST_MEAN_COLUMN * groups.len();
        if narrow && filled && slender(points, &groups) && plausible(points, &groups, pitch) {
            return Some((groups, pitch));
        }
    }
    None
}

/// Whether most points are in groups of a column's shape. Beside a point that lies far
/// away a whole part would else pass for one column.
fn slender(points: &[Point], groups: &[Group]) -> bool {
    let is_column = |members: &[Point]| {
        let (Some(first), Some(last)) = (members.first(), members.last()) else {
            return true;
        };
        let width = last.x.abs_diff(first.x);
        if width <= ROUNDING_COUNTS {
            return true;
        }
        let low = members.iter().map(|p| p.y).min().unwrap_or(0);
        let high = members.iter().map(|p| p.y).max().unwrap_or(0);
        width <= high.abs_diff(low) / COLUMN_SLENDERNESS
    };
    let inside: usize = groups
        .iter()
        .filter(|group| is_column(&points[group.members.clone()]))
        .map(|group| group.members.len())
        .sum();
    2 * inside >= points.len()
}

fn plausible(points: &[Point], groups: &[Group], pitch: Option<u32>) -> bool {
    let Some(pitch) = pitch else { return true };
    let mut spacings = Vec::with_capacity(points.len());
    let mut heights: Vec<i32> = Vec::new();
    for group in groups {
        heights.clear();
        heights.extend(points[group.members.clone()].iter().map(|p| p.y));
        heights.sort_unstable();
        spacings.extend(gaps(heights.iter().copied()));
    }
    median(&mut spacings).is_none_or(|spacing| spacing / GREATEST_ANISOTROPY <= pitch)
}

/// Distances of neighbouring distinct values, given in ascending order.
fn gaps(sorted: impl Iterator<Item = i32> + Clone) -> Vec<u32> {
    sorted
        .clone()
        .zip(sorted.skip(1))
        .map(|(a, b)| b.abs_diff(a))
        .filter(|&gap| gap > 0)
        .collect()
}

/// Groups of points whose neighbours in x are no farther than the threshold.
fn merged(points: &[Point], threshold: u32) -> Vec<Group> {
    let mut groups = Vec::new();
    let mut start = 0;
    for chunk in points.chunk_by(|a, b| b.x.abs_diff(a.x) <= threshold) {
        // Points are sorted by x, so this is the median x.
        let x = chunk[chunk.len() / 2].x;
        let end = start + chunk.len();
        groups.push(Group {
            x,
            members: start..end,
        });
        start = end;
    }
    groups
}

/// Groups by equal bins in x, centred on multiples of `bin`; each takes its bin's centre
/// as x, or the x that its points share.
fn bins(points: &[Point], bin: i32) -> Vec<Group> {
    let bin = i64::from(bin.max(1));
    let index = |p: &Point| (i64::from(p.x) + bin / 2).div_euclid(bin);
    let mut groups = Vec::new();
    let mut start = 0;
    for chunk in points.chunk_by(|a, b| index(a) == index(b)) {
        let (first, last) = (chunk[0].x, chunk[chunk.len() - 1].x);
        let shared = i64::from(last.abs_diff(first)) <= bin / i64::from(SHARED_X_SHARE);
        let x = if shared {
            chunk[chunk.len() / 2].x
        } else {
            // Bins at the ends of the lattice may have their centre outside of it.
            i32::try_from(index(&chunk[0]) * bin).unwrap_or(first)
        };
        let end = start + chunk.len();
        groups.push(Group {
            x,
            members: start..end,
        });
        start = end;
    }
    groups
}

fn column(points: &mut [Point], group: Group, intensity_scale: f32) -> PointColumn {
    let members = &mut points[group.members];
    members.sort_unstable_by_key(|p| (p.y, p.z, p.x));
    PointColumn {
        x_mm: lattice_mm(group.x),
        samples: members
            .iter()
            .map(|p| PointSample {
                y_mm: lattice_mm(p.y),
                z_mm: lattice_mm(p.z),
                intensity: p
                    .intensity()
                    .map_or(u8::MAX, |value| (value * intensity_scale).round() as u8),
            })
            .collect(),
    }
}

/// Factor from the file's intensities to 0..=255.
fn intensity_scale(points: &[Point], gather: &mut Gather<'_>) -> f32 {
    let greatest = points
        .iter()
        .filter_map(Point::intensity)
        .fold(0.0_f32, f32::max);
    let full = f32::from(u8::MAX);
    if greatest > full {
        gather.note(format!(
            "intensities up to {greatest} were scaled to 0..255"
        ));
        full / greatest
    } else if greatest > 0.0 && greatest <= 1.0 {
        full
    } else {
        1.0
    }
}

/// Median distance in y of neighbouring samples of a column.
fn sample_spacing_mm(columns: &[PointColumn]) -> Option<f64> {
    let mut spacings: Vec<u32> = columns
        .iter()
        .flat_map(|column| column.samples.windows(2))
        .filter_map(|pair| {
            let below = lattice_counts(pair[0].y_mm)?;
            let above = lattice_counts(pair[1].y_mm)?;
            Some(above.abs_diff(below)).filter(|&distance| distance > 0)
        })
        .collect();
    median(&mut spacings).map(|counts| f64::from(counts) * LATTICE_MM)
}
