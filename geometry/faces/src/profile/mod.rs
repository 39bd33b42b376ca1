//! A region that one profile sweeps, cut where the profile has its breaks.
//!
//! Of a turned shaft or an extruded bar the surface is told by one curve, the profile, and a
//! motion. Averaged along the motion the profile is known to micrometres, far better than any
//! window on the surface tells it, and it can be cut into straight lines and arcs in the best of
//! all ways. So creases of a degree or two, and fillets of a few nodes, come to light that shapes
//! grown from windows would smooth over.
//!
//! ```text
//! normals --> motion --> refined by the samples --> stations (means along the motion)
//!         --> lines and arcs by dynamic programming --> the nodes of each
//! ```
//!
//! Regions that are not such a sweep, but for rims and small features of single shapes, or whose
//! profile is a smooth one as well, are left to others.

mod chain;
mod curve;
mod cut;
mod kept;
mod motion;
mod parted;
mod refine;
mod rounding;
mod smooth;
mod stations;
mod swept;
mod touching;

pub(crate) use kept::Kept;
pub(crate) use parted::Parted;

use range_image::{Cancelled, Monitor};

use crate::field::{Field, count};
use motion::motions;
use swept::Swept;

/// Nodes at the border of a region that may be of the next.
const FAR: usize = 2;
/// Least share of a region that one sweep must explain for the rest to be looked at: rims and small
/// features are left over, where more is the sweep may be no more than near to a free form.
const MOSTLY: f64 = 0.85;

/// The pieces of a region that is one swept profile of several lines and arcs, or is for the most
/// part, and the rest of single shapes; `None` where it is not.
pub(crate) fn split_profile(
    field: &Field<'_>,
    monitor: &dyn Monitor,
) -> Result<Option<Parted>, Cancelled> {
    let all = field.all();
    let mut found: Vec<Swept> = Vec::new();
    for sweep in motions(field, &field.within(&all, FAR)) {
        monitor.check()?;
        found.extend(Swept::of(field, &all, sweep));
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let is_whole = |swept: &&Swept| swept.is_sound() && swept.explains(field, &all, FAR);
    if let Some(swept) = found.iter().find(is_whole) {
        return Ok(Parted::of(field, swept, &all));
    }
    for swept in &found {
        monitor.check()?;
        let on = swept.nodes(field, &all);
        if (count(&on) as f64) < MOSTLY * count(&all) as f64 {
            continue;
        }
        // What it does not explain has no say in where its breaks are.
        let again = Swept::of(field, &on, swept.sweep);
        let again = again.filter(|s| s.is_sound() && s.explains(field, &on, FAR));
        let Some(again) = again else { continue };
        let parted = Parted::of(field, &again, &on);
        if parted.is_some() {
            return Ok(parted);
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::grow::FEWEST;
    use crate::testing::Scan;

    const PITCH_MM: f64 = 0.4;

    /// The pieces of a scan that is one region, as labels column by column.
    fn labels((columns, rows): (usize, usize), z_mm: impl Fn(f64, f64) -> f64) -> Vec<usize> {
        let scan = Scan::of((columns, rows), PITCH_MM, 0.05, z_mm);
        let nodes: Vec<usize> = (0..columns * rows)
            .filter(|node| !scan.image.raw_z_mm()[*node].is_nan())
            .collect();
        let field = Field::new(&scan.image, &scan.observations, &nodes).unwrap();
        let parted = split_profile(&field, &Unmonitored).unwrap();
        let sets = parted.map_or_else(Vec::new, |parted| parted.pieces);
        let mut labels = vec![0; columns * rows];
        for (k, set) in sets.into_iter().enumerate() {
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
    fn what_is_on_a_swept_profile_is_a_piece_of_its_own() {
        // A gentle dome on one half of a roof.
        let roof = |x: f64, y: f64| {
            let over2 = (x - 27.0).powi(2) + (y - 12.0).powi(2);
            let dome = libm::sqrt(400.0 - over2.min(25.0)) - libm::sqrt(375.0);
            -0.2 * (x - 18.0).abs() + dome
        };
        let labels = labels((90, 60), roof);
        assert_eq!(labels.iter().max(), Some(&3));
        are_near(&breaks_mm(&labels, 60), &[18.0, 22.0, 32.0], 0.7);
    }

    #[test]
    fn the_rims_of_a_plate_are_pieces_along_the_profile_and_across() {
        let (cos, sin) = (libm::cos(0.3), libm::sin(0.3));
        let plate = |x: f64, y: f64| {
            let (x, y) = (x - 24.0, y - 21.0);
            let over = |from: f64, half: f64| (from.abs() - half).max(0.0);
            let (x, y) = (over(x * cos + y * sin, 16.0), over(y * cos - x * sin, 12.0));
            let over2 = x * x + y * y;
            if over2 < 9.0 {
                libm::sqrt(3.6 * 3.6 - over2)
            } else {
                f64::NAN
            }
        };
        let labels = labels((120, 105), plate);
        assert_eq!(labels.iter().max(), Some(&5));
    }
}
