//! A region that one profile sweeps, cut where the profile has its breaks.
//!
//! Of a turned shaft or an extruded bar the surface is told by one curve, the profile, and a motion.
//! Averaged along the motion the profile is known to micrometres, far better than any window on the
//! surface tells it, and it can be cut into straight lines and arcs in the best of all ways. So
//! creases of a degree or two, and fillets of a few nodes, come to light that shapes grown from
//! windows would smooth over.
//!
//! ```text
//! normals --> motion --> refined by the samples --> stations (means along the motion)
//!         --> lines and arcs by dynamic programming --> the nodes of each
//! ```
//!
//! Regions that are not such a sweep all over, or whose profile is a smooth one as well, are left
//! to others.

mod chain;
mod curve;
mod cut;
mod kept;
mod motion;
mod refine;
mod rounding;
mod smooth;
mod stations;
mod sweep;

use range_image::{Cancelled, Monitor};
use shapes::Sample;

use crate::compete::{NONE, Pieces};
use crate::field::{Field, Set};
use crate::grow::FEWEST;
use crate::split::NO_CREASE;
use crate::strain::are_strained;
pub(crate) use kept::Kept;

use chain::Chain;
use curve::Curve;
use cut::cuts;
use motion::motions;
use refine::refined;
use rounding::rounded;
use smooth::smooth;
use stations::{Profile, Station};
use sweep::{Motion, Sweep};

/// Nodes at the border of a region that may be of the next.
const FAR: usize = 2;
/// Samples by which the motion is found, and the profile then told, at most.
const SOME: usize = 4000;
const MANY: usize = 40_000;
/// Samples that deviate from the profile by more than this, of what they are said to, are of no
/// sweep.
const MOST_DEVIATION: f64 = 2.0;
/// Least width of a piece, in pitches: what is narrower has hardly a node within.
const LEAST_WIDTH: f64 = 2.5;
/// Bins of the profile to a pitch: breaks are told between nodes.
const BINS: f64 = 2.0;
/// Samples of a bin, where there are enough.
const PER_BIN: f64 = 12.0;
/// What each number costs above its price, as where shapes are told apart.
const CAUTION: f64 = 4.0;

/// A motion and the chain that it sweeps, with what that costs.
struct Swept {
    sweep: Sweep,
    chain: Chain,
    cost: f64,
}

/// The pieces of a region that is one swept profile of several lines and arcs, each in its
/// connected parts; `None` where it is not.
pub(crate) fn split_profile(
    field: &Field<'_>,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<Set>>, Cancelled> {
    let all = field.all();
    let inner = field.within(&all, FAR);
    let many = field.samples(&all, FAR, MANY);
    let some: Vec<Sample> = shapes::spread(many.len(), SOME).map(|k| many[k]).collect();
    let mut best: Option<Swept> = None;
    for sweep in motions(field, &inner) {
        monitor.check()?;
        let swept = swept(field, &inner, sweep, &some, &many);
        best = [best, swept]
            .into_iter()
            .flatten()
            .min_by(|a, b| a.cost.total_cmp(&b.cost));
    }
    Ok(best.and_then(|swept| pieces(field, &swept)))
}

/// The region as what a motion like this sweeps.
fn swept(
    field: &Field<'_>,
    inner: &[bool],
    sweep: Sweep,
    some: &[Sample],
    many: &[Sample],
) -> Option<Swept> {
    let pitch_mm = field.pitch_mm();
    let (sweep, profile) = refined(sweep, some, pitch_mm)?;
    if profile.deviation > MOST_DEVIATION {
        return None;
    }
    let (sweep, _) = refined(sweep, many, pitch_mm)?;
    let profile = Profile::of(&sweep, many, pitch_mm / BINS, PER_BIN)?.held(many);
    let stations: Vec<Station> = profile.stations.iter().flatten().copied().collect();
    let independent = many.len() as f64 / field.area().max(1.0);
    let price = libm::log(independent.max(2.0)) + CAUTION;
    let least_mm = LEAST_WIDTH * pitch_mm;
    let cuts = cuts(&stations, least_mm, price);
    if cuts.len() < 2 {
        return None;
    }
    let chain = Chain::of(&stations, &cuts, least_mm)?;
    let chain = rounded(chain, &stations, price, least_mm);
    let left = chain.left(&stations);
    let cost = left + price * chain.freedom();
    let smooth = smooth(&stations, price, stations.len() / 3);
    if smooth < cost || sweep.motion == Motion::Extrusion && has_gentle(&chain) {
        return None;
    }
    let offs = |samples: &[Sample]| {
        let off = |sample: &Sample| {
            let placed = sweep.place(&sample.point_mm);
            let (off_mm, slope) = chain.off(placed.s_mm, placed.t_mm);
            off_mm / sample.deviation_mm(&placed.normal(slope))
        };
        samples.iter().map(off).collect()
    };
    let strained = are_strained(field, inner, profile.deviation, &offs);
    (!strained).then_some(Swept { sweep, chain, cost })
}

/// Whether flat pieces meet in no crease, be it round: these are parts of a wavy surface.
fn has_gentle(chain: &Chain) -> bool {
    let curves = &chain.curves;
    let is_gentle = |a: &Curve, b: &Curve| match (a, b) {
        (Curve::Line { normal: a, .. }, Curve::Line { normal: b, .. }) => {
            a[0] * b[0] + a[1] * b[1] > NO_CREASE
        }
        _ => false,
    };
    let next = curves.windows(2).any(|pair| is_gentle(&pair[0], &pair[1]));
    let over =
        |three: &[Curve]| matches!(three[1], Curve::Arc { .. }) && is_gentle(&three[0], &three[2]);
    next || curves.windows(3).any(over)
}

/// The nodes of each curve of a chain in connected parts, with those of parts that are too small
/// given to neighbours.
fn pieces(field: &Field<'_>, swept: &Swept) -> Option<Vec<Set>> {
    let label = |place: usize| {
        let point_mm = field.point_mm(place)?;
        Some(swept.chain.at(swept.sweep.place(&point_mm).s_mm))
    };
    let mut labels: Vec<usize> = (0..field.len()).map(|p| label(p).unwrap_or(NONE)).collect();
    for part in field.alike(&labels) {
        if part.len() < FEWEST {
            part.iter().for_each(|place| labels[*place] = NONE);
        }
    }
    let mut pieces = Pieces {
        field,
        labels,
        fits: vec![None; swept.chain.curves.len()],
    };
    pieces.fill();
    let set = |part: Vec<usize>| {
        let mut set = vec![false; field.len()];
        part.into_iter().for_each(|place| set[place] = true);
        set
    };
    let parts = field.alike(&pieces.labels).into_iter();
    let sets: Vec<Set> = parts
        .filter(|part| pieces.labels[part[0]] != NONE)
        .map(set)
        .collect();
    (sets.len() > 1).then_some(sets)
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::field::count;
    use crate::testing::Scan;

    const PITCH_MM: f64 = 0.4;

    /// The pieces of a scan that is one region, as labels column by column.
    fn labels((columns, rows): (usize, usize), z_mm: impl Fn(f64, f64) -> f64) -> Vec<usize> {
        let scan = Scan::of((columns, rows), PITCH_MM, 0.05, z_mm);
        let nodes: Vec<usize> = (0..columns * rows)
            .filter(|node| !scan.image.raw_z_mm()[*node].is_nan())
            .collect();
        let field = Field::new(&scan.image, &scan.observations, &nodes).unwrap();
        let sets = split_profile(&field, &Unmonitored).unwrap();
        let mut labels = vec![0; columns * rows];
        for (k, set) in sets.into_iter().flatten().enumerate() {
            assert!(count(&set) >= FEWEST);
            for place in (0..set.len()).filter(|place| set[*place]) {
                assert_eq!(labels[place], 0);
                labels[place] = k + 1;
            }
        }
        labels
    }

    /// Where the label changes along the columns, in the middle row.
    fn breaks_mm(labels: &[usize], rows: usize) -> Vec<f64> {
        let middle: Vec<usize> = labels
            .iter()
            .skip(rows / 2)
            .step_by(rows)
            .copied()
            .collect();
        let changes = (1..middle.len()).filter(|k| middle[*k] != middle[*k - 1]);
        changes.map(|k| (k as f64 - 0.5) * PITCH_MM).collect()
    }

    fn are_near(found_mm: &[f64], true_mm: &[f64], far_mm: f64) {
        assert_eq!(found_mm.len(), true_mm.len(), "{found_mm:?}");
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < far_mm;
        assert!(
            found_mm.iter().zip(true_mm).all(is_near),
            "{found_mm:?} {true_mm:?}"
        );
    }

    #[test]
    fn a_shaft_is_cut_at_creases_of_two_degrees() {
        // Cylinder, cone, cylinder, about an axis through (0, 14) mm that runs askew.
        let radius_mm = |along: f64| 20.0 - 0.035 * (along - 15.0).clamp(0.0, 16.0);
        let (cos, sin) = (libm::cos(0.05), libm::sin(0.05));
        let shaft = |x: f64, y: f64| {
            let along = x * cos + (y - 14.0) * sin;
            let across = (y - 14.0) * cos - x * sin;
            libm::sqrt(radius_mm(along).powi(2) - across * across)
        };
        let labels = labels((120, 70), shaft);
        are_near(&breaks_mm(&labels, 70), &[15.0, 31.0], 0.5);
    }

    #[test]
    fn a_fillet_of_six_nodes_is_taken_from_a_roof() {
        let radius_mm = 3.0 * PITCH_MM / libm::sin(0.2);
        let roof = |x: f64, y: f64| {
            let from = (x - 12.0 + 0.1 * y).abs() / libm::hypot(1.0, 0.1);
            let on = from.min(3.0 * PITCH_MM);
            libm::sqrt(radius_mm * radius_mm - on * on) - (from - on) * libm::tan(0.2) + 0.05 * y
        };
        let labels = labels((90, 60), roof);
        let middle_mm = 12.0 - 0.1 * 30.0 * PITCH_MM;
        let half_mm = 3.0 * PITCH_MM * libm::hypot(1.0, 0.1);
        let true_mm = [middle_mm - half_mm, middle_mm + half_mm];
        are_near(&breaks_mm(&labels, 60), &true_mm, 1.5 * PITCH_MM);
    }

    #[test]
    fn what_is_turned_about_an_axis_towards_the_scanner_is_cut_by_its_radius() {
        // A flat top, a round shoulder and a cone.
        let disc = |x: f64, y: f64| {
            let radius = libm::hypot(x - 14.0, y - 14.0);
            let over = (radius - 6.0).clamp(0.0, 3.0);
            let slope = 3.0 / libm::sqrt(36.0 - 9.0);
            libm::sqrt(36.0 - over * over) - slope * (radius - 9.0).max(0.0)
        };
        let labels = labels((70, 70), disc);
        let breaks_mm = breaks_mm(&labels, 70);
        are_near(&breaks_mm, &[5.0, 8.0, 20.0, 23.0], 0.8);
    }

    #[test]
    fn one_shape_is_left_whole() {
        let sphere = |x: f64, y: f64| libm::sqrt(900.0 - (x - 10.0).powi(2) - (y - 12.0).powi(2));
        let cylinder = |x: f64, _: f64| libm::sqrt(900.0 - (x - 10.0).powi(2));
        assert!(labels((60, 60), sphere).iter().all(|label| *label == 0));
        assert!(labels((60, 60), cylinder).iter().all(|label| *label == 0));
    }

    #[test]
    fn free_forms_are_left_whole_swept_or_not() {
        let none = |z_mm: &dyn Fn(f64, f64) -> f64| {
            assert!(labels((90, 60), z_mm).iter().all(|label| *label == 0));
        };
        none(&|x, _| libm::sin(0.4 * x));
        none(&|x, _| -0.03 * (x - 18.0) * (x - 18.0));
        none(&|x, y| libm::sin(0.2 * libm::hypot(x - 18.0, y - 12.0)));
        none(&|x, y| libm::sin(0.2 * x) * libm::cos(0.15 * y));
        // Strips that are turned by 2 degrees against each other, as a scanner may see a plate.
        none(&|x, _| 0.1 * x + 0.08 * libm::asin(libm::sin(x / 4.0)));
    }

    #[test]
    fn what_is_no_sweep_all_over_is_left_whole() {
        // A gentle dome on one half of a roof.
        let roof = |x: f64, y: f64| {
            let over2 = (x - 27.0).powi(2) + (y - 12.0).powi(2);
            let dome = libm::sqrt(400.0 - over2.min(25.0)) - libm::sqrt(375.0);
            -0.2 * (x - 18.0).abs() + dome
        };
        assert!(labels((90, 60), roof).iter().all(|label| *label == 0));
    }
}
