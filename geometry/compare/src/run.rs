//! The whole comparison.

use glam::DVec3;
use range_image::{Column, Monitor, RangeImage};

use crate::deviation::{Ground, NodeState, Residuals, nodes};
use crate::error::CompareError;
use crate::nominal::Nominal;
use crate::normal::median;
use crate::patches::{Decision, decision, patches};
use crate::regions::{Evidence, Region, regions};
use crate::register::{Measured, Registration, as_placed, best_fit};
use crate::seen::Seen;
use crate::settings::{Alignment, CompareSettings};
use crate::statistics::{Histogram, Statistics, histogram, statistics};

/// Fewest nodes that can be registered and compared.
const LEAST_NODES: usize = 50;
/// Without a tolerance deviations smaller than this share of the noise are not told: scanner and
/// registration have systematic errors of that size.
const SYSTEMATIC: f64 = 0.1;
/// Default of [`CompareSettings::limit_mm`]: at least so much, so many times the noise, so many
/// times the tolerance.
const LIMIT: (f64, f64, f64) = (2.0, 10.0, 3.0);
/// Default of [`CompareSettings::patch_mm`], in distances of samples.
const PATCH_SPACINGS: f64 = 5.5;

/// A scan held against its nominal.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// How it was brought there.
    pub registration: Registration,
    /// Standard deviation of single samples about their surface, millimetres.
    pub noise_mm: f64,
    /// Distance up to which points belong to the nominal, millimetres.
    pub limit_mm: f64,
    /// What each node is to the nominal, column by column as [`RangeImage::raw_z_mm`].
    pub states: Vec<NodeState>,
    /// For each node the number of its region from 1; 0 for none.
    pub labels: Vec<u32>,
    /// Deviations of the nodes compared.
    pub statistics: Statistics,
    /// The same in bins.
    pub histogram: Histogram,
    /// Share of the nodes compared that lie within the tolerance, 0 to 1; `None` without one.
    pub within_share: Option<f64>,
    /// Area of the nominal that the camera can see, square millimetres.
    pub seen_area_mm2: f64,
    /// Share of that which the scan covers, 0 to 1.
    pub covered_share: f64,
    /// Share of the nodes on the nominal, edges apart, that lie beyond the limit from it.
    pub foreign_on_nominal_share: f64,
    /// How significance was decided.
    pub decision: Decision,
    /// What lies significantly beyond the limits, the worst first.
    pub regions: Vec<Region>,
}

impl Comparison {
    /// Whether nothing lies significantly beyond the limits.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.regions.is_empty()
    }

    /// Number of nodes in a state.
    #[must_use]
    pub fn count(&self, is: impl Fn(NodeState) -> bool) -> usize {
        self.states.iter().filter(|state| is(**state)).count()
    }
}

/// Holds a scan against its nominal.
///
/// `image` is the regridded scan, `columns` the samples it was made of (of the region of interest
/// alone). Nodes are registered and say what belongs to the nominal; a node's deviation is the
/// robust mean of the samples around it, and samples decide on what is significant.
/// Deviations are distances along the nominal's normals, positive where there is more material.
/// What is behind others as seen along z, steps and ends of the nominal, and what is farther
/// from it than the limit have no part in them.
///
/// # Errors
/// [`CompareError`]: a setting out of range, too few nodes, another unit, nothing near, no fit,
/// cancellation.
pub fn compare(
    image: &RangeImage,
    columns: &[Column],
    nominal: &Nominal,
    settings: &CompareSettings,
    monitor: &dyn Monitor,
) -> Result<Comparison, CompareError> {
    settings.validate()?;
    let points = points(image);
    if points.len() < LEAST_NODES {
        return Err(CompareError::NothingMeasured {
            nodes: points.len(),
        });
    }
    check_units(&points, nominal)?;
    let pitch_mm = image.pitch_mm();
    let count: usize = columns.iter().map(|column| column.samples().len()).sum();
    let area_mm2 = points.len() as f64 * pitch_mm * pitch_mm;
    let spacing_mm = (area_mm2 / count.max(1) as f64).sqrt();
    let noise_mm = noise(image);
    let tolerance_mm = settings
        .tolerance
        .map_or(0.0, |t| t.upper_mm.abs().max(t.lower_mm.abs()));
    let limit_mm = settings.limit_mm.unwrap_or_else(|| {
        (LIMIT.0)
            .max(LIMIT.1 * noise_mm)
            .max(LIMIT.2 * tolerance_mm)
    });

    let samples = near_nodes(columns, image, limit_mm);
    let measured = Measured {
        points: &points,
        samples: &samples,
        noise_mm,
        limit_mm,
    };
    let registration = match settings.alignment {
        Alignment::AsPlaced => as_placed(nominal, &measured)?,
        Alignment::BestFit => best_fit(nominal, &measured, settings.least_near_share, monitor)?,
    };
    monitor.progress(0.5);
    let pose = registration.pose;
    let ground = Ground {
        nominal,
        pose,
        seen: Seen::new(nominal, &pose, image, spacing_mm, monitor)?,
        pitch_mm,
        limit_mm,
    };
    monitor.progress(0.6);
    let mut states = nodes(&ground, image, monitor)?;
    monitor.progress(0.7);
    let residuals = Residuals::new(&ground, image, columns, monitor)?;
    let smallest_mm = settings.patch_mm.unwrap_or(PATCH_SPACINGS * spacing_mm);
    monitor.progress(0.8);
    let patches = patches(
        &residuals,
        &states,
        pitch_mm,
        (smallest_mm, noise_mm),
        monitor,
    )?;
    // Nodes are bent at creases, by up to several times the noise; means of deviations are not.
    for mean in patches.first().map_or(&[][..], |patches| &patches.means) {
        if let Some(state) = states.get_mut(mean.column * image.rows() + mean.row) {
            *state = NodeState::Compared(mean.mean_mm);
        }
    }
    let deviations: Vec<f64> = states
        .iter()
        .filter_map(|state| match state {
            NodeState::Compared(deviation) => Some(*deviation),
            _ => None,
        })
        .collect();
    let statistics = statistics(&deviations).ok_or(CompareError::NothingCompared)?;
    let limits_mm = settings.tolerance.map_or(
        (-SYSTEMATIC * noise_mm, SYSTEMATIC * noise_mm),
        |tolerance| (tolerance.lower_mm, tolerance.upper_mm),
    );
    let decision = decision(&patches, limits_mm, settings.false_alarm);
    let (regions, labels) = regions(&Evidence {
        image,
        patches: &patches,
        decision: &decision,
        seen: &ground.seen,
        pose: &pose,
    });
    monitor.check()?;
    monitor.progress(1.0);
    let (seen_area_mm2, covered_share) = coverage(&ground, image, &states);
    let within = |t: crate::Tolerance| {
        let inside = deviations
            .iter()
            .filter(|&&d| (t.lower_mm..=t.upper_mm).contains(&d));
        inside.count() as f64 / deviations.len() as f64
    };
    Ok(Comparison {
        noise_mm,
        limit_mm,
        statistics,
        histogram: histogram(&deviations, 1.25 * tolerance_mm),
        within_share: settings.tolerance.map(within),
        seen_area_mm2,
        covered_share,
        foreign_on_nominal_share: foreign_on_nominal(&ground, image, &states),
        registration,
        states,
        labels,
        decision,
        regions,
    })
}

fn points(image: &RangeImage) -> Vec<DVec3> {
    let columns = 0..image.columns();
    columns
        .flat_map(|column| (0..image.rows()).map(move |row| (column, row)))
        .filter_map(|(column, row)| {
            let z = image.z_mm(column, row)?;
            Some(DVec3::new(image.x_mm(column), image.y_mm(row), z))
        })
        .collect()
}

/// The samples that lie near their node, most outliers left out.
fn near_nodes(columns: &[Column], image: &RangeImage, limit_mm: f64) -> Vec<DVec3> {
    let pitch_mm = image.pitch_mm();
    let cell = |coordinate: f64, first: f64| {
        let place = ((coordinate - first) / pitch_mm).round();
        (place >= 0.0).then_some(place as usize)
    };
    let of_column = |column: &Column| -> Vec<DVec3> {
        let x = column.x_mm();
        let near = column.samples().iter().filter_map(|sample| {
            let z = image.z_mm(cell(x, image.x_mm(0))?, cell(sample.y_mm, image.y_mm(0))?)?;
            // On steep faces half a pitch is as much in z.
            let is_near = (sample.z_mm - z).abs() <= limit_mm + pitch_mm;
            is_near.then(|| DVec3::new(x, sample.y_mm, sample.z_mm))
        });
        near.collect()
    };
    columns.iter().flat_map(of_column).collect()
}

/// Standard deviation of samples, as the regridder met it; a thousandth of a pitch at least, so
/// that exact data have a scale, too.
fn noise(image: &RangeImage) -> f64 {
    let mut scales: Vec<f64> = image.qualities().map(|q| f64::from(q.scale_mm)).collect();
    let noise_mm = median(&mut scales);
    let least_mm = 1e-3 * image.pitch_mm();
    if noise_mm.is_finite() {
        noise_mm.max(least_mm)
    } else {
        least_mm
    }
}

/// A nominal much smaller than what was scanned, or a hundred times as large, is in another unit.
fn check_units(points: &[DVec3], nominal: &Nominal) -> Result<(), CompareError> {
    let (low, high) = points
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |b, &p| {
            (b.0.min(p), b.1.max(p))
        });
    let scan_mm = (high - low).length();
    let nominal_mm = 2.0 * nominal.radius_mm();
    let ratio = nominal_mm / scan_mm;
    if (0.125..200.0).contains(&ratio) {
        return Ok(());
    }
    let unit = match ratio {
        r if r >= 200.0 => ", or the scan is not",
        // Half-way between the units' sizes, on a scale of ratios.
        r if r > 0.02 && r < 0.0625 => "; in inches it would fit",
        r if r > 0.0625 => "; in centimetres it would fit",
        r if r > 2e-4 && r < 5e-3 => "; in metres it would fit",
        _ => "",
    };
    Err(CompareError::Units {
        nominal_mm,
        scan_mm,
        unit,
    })
}

/// Area of the nominal that is seen, and the share of it that has a node of the scan near.
fn coverage(ground: &Ground<'_>, image: &RangeImage, states: &[NodeState]) -> (f64, f64) {
    let (i_first, j_first) = image.origin();
    let belongs = |i: i64, j: i64| {
        let column = usize::try_from(i - i_first)
            .ok()
            .filter(|c| *c < image.columns());
        let row = usize::try_from(j - j_first)
            .ok()
            .filter(|r| *r < image.rows());
        let state = column
            .zip(row)
            .and_then(|(c, r)| states.get(c * image.rows() + r));
        matches!(state, Some(NodeState::Compared(_) | NodeState::AtEdge))
    };
    let (mut seen, mut covered) = (0.0, 0.0);
    for (i, j, area) in ground.seen.nodes() {
        seen += area;
        // A node that is masked among others is a dropout; the surface was seen there.
        if (-1..=1).any(|di| (-1..=1).any(|dj| belongs(i + di, j + dj))) {
            covered += area;
        }
    }
    let square = ground.pitch_mm * ground.pitch_mm;
    (seen * square, if seen > 0.0 { covered / seen } else { 0.0 })
}

fn foreign_on_nominal(ground: &Ground<'_>, image: &RangeImage, states: &[NodeState]) -> f64 {
    let (i_first, j_first) = image.origin();
    let (mut on, mut foreign) = (0, 0);
    for (node, state) in states.iter().enumerate() {
        let (column, row) = (node / image.rows(), node % image.rows());
        let seen = &ground.seen;
        let index = seen.index(i_first + column as i64, j_first + row as i64);
        if index.is_none_or(|index| seen.is_edge(index) || seen.at(index).is_none()) {
            continue;
        }
        match state {
            NodeState::Foreign => {
                foreign += 1;
                on += 1;
            }
            NodeState::Compared(_) => on += 1,
            NodeState::Masked | NodeState::AtEdge => {}
        }
    }
    f64::from(foreign) / f64::from(on.max(1))
}
