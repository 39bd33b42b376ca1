//! Registration: from where the scan is placed, or from many starts, to the best fit.

use glam::DVec3;
use range_image::{Cancelled, Monitor};

use crate::error::CompareError;
use crate::freedom::{Freedom, PoseUncertainty, freedoms, uncertainty};
use crate::icp::{Course, Fit, feet, icp};
use crate::nominal::Nominal;
use crate::pose::Pose;

/// Points of the last registration.
const FINE_POINTS: usize = 20_000;
/// Points of each start, of those that go on, and of the last of these.
const START_POINTS: usize = 300;
const CHOICE_POINTS: usize = 2_000;
/// Starts are turned about the line of sight by this much from one another, degrees.
const START_STEP_DEG: f64 = 15.0;
/// Of the starts so many go on.
const CHOSEN: usize = 8;
/// A start that lies farther from where the scan was placed must fit better than this share of
/// the nearer ones' cost: a part that looks the same after half a turn is left as it is.
const BETTER: f64 = 0.85;
/// A start as placed is good without looking at others when so many points lie within
/// [`GOOD_NOISES`] of the nominal.
const GOOD_SHARE: f64 = 0.8;
const GOOD_NOISES: f64 = 4.0;

/// How a scan was brought onto the nominal.
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// Takes the scan's frame to the nominal's.
    pub pose: Pose,
    /// Root mean square distance along the normals of the points that took part, each by its
    /// weight, millimetres; `None` as placed.
    pub rms_mm: Option<f64>,
    /// Iterations of the fit that was taken; 0 as placed.
    pub iterations: usize,
    /// Starts that were tried, that as placed among them; 0 as placed.
    pub starts: usize,
    /// Whether the last step was negligible; true as placed.
    pub is_settled: bool,
    /// Share of the nodes that lie near the nominal, 0 to 1.
    pub near_share: f64,
    /// Motions that the measured surfaces leave free. They are left as they were.
    pub free: Vec<Freedom>,
    /// What the noise leaves open of the rest; `None` as placed.
    pub uncertainty: Option<PoseUncertainty>,
}

/// What is known of the scan.
pub(crate) struct Measured<'a> {
    /// The nodes, which outliers do not reach.
    pub(crate) points: &'a [DVec3],
    /// The samples near them, which creases do not bend.
    pub(crate) samples: &'a [DVec3],
    /// Standard deviation of a sample.
    pub(crate) noise_mm: f64,
    /// Farther than this from the nominal a point belongs to something else.
    pub(crate) limit_mm: f64,
}

/// Every so manieth point.
fn thinned(points: &[DVec3], most: usize) -> Vec<DVec3> {
    let mut step = points.len().div_ceil(most).max(1);
    // Odd steps do not divide columns of even lengths, of which they would take rows only.
    step += usize::from(step > 1 && step.is_multiple_of(2));
    points.iter().copied().step_by(step).collect()
}

impl Measured<'_> {
    fn course(&self, nominal: &Nominal) -> Course {
        Course {
            reach_mm: (0.3 * nominal.radius_mm()).max(self.limit_mm),
            least_reach_mm: self.limit_mm,
            least_scale_mm: (0.5 * self.noise_mm).max(1e-9 * nominal.radius_mm()),
            most_iterations: 100,
            settled_mm: (5e-3 * self.noise_mm).max(1e-9 * nominal.radius_mm()),
        }
    }
}

/// The scan as it lies.
pub(crate) fn as_placed(
    nominal: &Nominal,
    measured: &Measured<'_>,
) -> Result<Registration, CompareError> {
    let share = near_share(nominal, measured, measured.points, &Pose::IDENTITY);
    if share <= 0.0 {
        return Err(CompareError::NoOverlap {
            limit_mm: measured.limit_mm,
        });
    }
    Ok(Registration {
        pose: Pose::IDENTITY,
        rms_mm: None,
        iterations: 0,
        starts: 0,
        is_settled: true,
        near_share: share,
        free: Vec::new(),
        uncertainty: None,
    })
}

/// The best fit.
pub(crate) fn best_fit(
    nominal: &Nominal,
    measured: &Measured<'_>,
    least_share: f64,
    monitor: &dyn Monitor,
) -> Result<Registration, CompareError> {
    let course = measured.course(nominal);
    let few = thinned(measured.points, CHOICE_POINTS);
    let mut starts = 1;
    let placed = icp(nominal, &few, Pose::IDENTITY, &course, monitor)?;
    let good_mm = GOOD_NOISES * measured.noise_mm;
    let chosen = if share_within(nominal, &few, &placed.pose, good_mm) >= GOOD_SHARE {
        placed
    } else {
        let (fit, tried) = search(nominal, measured, placed, monitor)?;
        starts += tried;
        fit
    };
    let fine = |points, fit: &Fit| {
        let course = Course {
            reach_mm: (8.0 * fit.rms_mm).max(measured.limit_mm),
            ..course
        };
        icp(nominal, points, fit.pose, &course, monitor)
    };
    let points = thinned(measured.points, FINE_POINTS);
    let of_nodes = fine(&points, &chosen)?;
    let samples = thinned(measured.samples, FINE_POINTS);
    let fit = fine(&samples, &of_nodes)?;
    let share = near_share(nominal, measured, &points, &fit.pose);
    let (Some(equations), true) = (&fit.equations, share >= least_share) else {
        return Err(CompareError::NotRegistered {
            share_percent: 100.0 * share,
            limit_mm: measured.limit_mm,
            starts,
        });
    };
    Ok(Registration {
        pose: fit.pose,
        rms_mm: Some(fit.rms_mm),
        iterations: chosen.iterations + of_nodes.iterations + fit.iterations,
        starts,
        is_settled: fit.is_settled,
        near_share: share,
        free: freedoms(equations),
        uncertainty: Some(uncertainty(equations, measured.noise_mm)),
    })
}

fn share_within(nominal: &Nominal, points: &[DVec3], pose: &Pose, within_mm: f64) -> f64 {
    let near = feet(nominal, points, pose, within_mm);
    near.iter().flatten().count() as f64 / points.len().max(1) as f64
}

fn near_share(nominal: &Nominal, measured: &Measured<'_>, points: &[DVec3], pose: &Pose) -> f64 {
    share_within(nominal, points, pose, measured.limit_mm)
}

/// Mean of the squared distances, none counting more than `most_mm`: low where many points are
/// near, whatever the others do.
fn cost(nominal: &Nominal, points: &[DVec3], pose: &Pose, most_mm: f64) -> f64 {
    let sum: f64 = feet(nominal, points, pose, most_mm)
        .iter()
        .map(|pair| match pair {
            Some((point, foot)) => (*point - foot.point_mm).length_squared(),
            None => most_mm * most_mm,
        })
        .sum();
    sum / points.len().max(1) as f64
}

/// The best of many starts: turned about the line of sight in steps, and shifted so that
/// centroids or middles meet, or left where they are. The one as placed is among them.
fn search(
    nominal: &Nominal,
    measured: &Measured<'_>,
    placed: Fit,
    monitor: &dyn Monitor,
) -> Result<(Fit, usize), Cancelled> {
    let course = measured.course(nominal);
    let few = thinned(measured.points, START_POINTS);
    let coarse_mm = (0.05 * nominal.radius_mm()).max(measured.limit_mm);
    let starts = starts(nominal, measured.points);
    let tried = starts.len();
    let quick = Course {
        reach_mm: nominal.radius_mm(),
        least_reach_mm: coarse_mm,
        most_iterations: 12,
        ..course
    };
    let mut fits = Vec::with_capacity(tried);
    for (index, start) in starts.into_iter().enumerate() {
        let fit = icp(nominal, &few, start, &quick, monitor)?;
        fits.push((cost(nominal, &few, &fit.pose, coarse_mm), index, fit.pose));
        monitor.progress(0.3 * (index + 1) as f64 / tried as f64);
    }
    fits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    fits.truncate(CHOSEN);

    let more = thinned(measured.points, CHOICE_POINTS);
    let fine_mm = (0.02 * nominal.radius_mm()).max(8.0 * measured.noise_mm);
    let middle = centroid(measured.points);
    let mut best = (cost(nominal, &more, &placed.pose, fine_mm), 0.0, placed);
    let mut others = Vec::new();
    for (_, _, pose) in fits {
        let course = Course {
            reach_mm: coarse_mm,
            ..course
        };
        let fit = icp(nominal, &more, pose, &course, monitor)?;
        let away = motion(&fit.pose, middle, nominal.radius_mm());
        others.push((cost(nominal, &more, &fit.pose, fine_mm), away, fit));
    }
    others.sort_by(|a, b| a.1.total_cmp(&b.1));
    for other in others {
        let is_better = other.0 < BETTER * best.0;
        // Where the same minimum was found twice, the better of both is kept.
        let is_same = other.0 < best.0 && (other.1 - best.1).abs() < 1e-3;
        if is_better || is_same {
            best = other;
        }
    }
    Ok((best.2, tried))
}

/// How far a pose moves a scan, in parts of the nominal's size.
fn motion(pose: &Pose, middle: DVec3, radius_mm: f64) -> f64 {
    let turned = DVec3::from_array(pose.rotation_vector_rad()).length();
    let moved = (pose.point(middle) - middle).length();
    turned + moved / radius_mm.max(1e-9)
}

fn centroid(points: &[DVec3]) -> DVec3 {
    points.iter().copied().sum::<DVec3>() / points.len().max(1) as f64
}

fn starts(nominal: &Nominal, points: &[DVec3]) -> Vec<Pose> {
    let middle = centroid(points);
    let bounds = points
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |b, &p| {
            (b.0.min(p), b.1.max(p))
        });
    let box_middle = (bounds.0 + bounds.1) / 2.0;
    // Turning about the line of sight leaves what faces the camera as it is.
    let seen = nominal
        .centroid_seen(DVec3::Z)
        .unwrap_or(nominal.centre_mm());
    let centre = nominal.centre_mm();
    // Of the nominal's box the upper side is what is seen, about as far as its centroid.
    let box_seen = DVec3::new(centre.x, centre.y, seen.z - middle.z + box_middle.z);
    let steps = (360.0 / START_STEP_DEG) as i32;
    let mut starts = Vec::new();
    for step in 0..steps {
        let angle_rad = f64::from(step) * START_STEP_DEG.to_radians();
        let turn = DVec3::Z * angle_rad;
        for (from, to) in [(middle, middle), (middle, seen), (box_middle, box_seen)] {
            starts.push(Pose::about(from, turn, to - from));
        }
    }
    starts
}
