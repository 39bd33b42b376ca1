//! Regions one or two nodes wide, given to the planes beside them whose part they are.

use range_image::RangeImage;

use super::pieces::neighbours;
use super::surface::Surface;
use super::{NONE, OUTSIDE};

/// A region with fewer nodes that have four neighbours in it is a sliver.
const FEWEST_INSIDE: usize = 5;
/// Nodes within so many deviations of a plane lie on it.
const DEVIATIONS: f64 = 4.5;

/// Gives the nodes of slivers, such as the last row of a face before its edge, to planes beside them
/// that they lie on; the others of a sliver of which most are gone are of no region. Says whether
/// there were some.
pub(super) fn joined(
    image: &RangeImage,
    labels: &mut [u16],
    surfaces: &[Surface],
    noise_mm: f64,
) -> bool {
    let (columns, rows) = (image.columns(), image.rows());
    let mut inside = vec![0_usize; surfaces.len() + 1];
    let mut all = inside.clone();
    for (node, label) in labels.iter().enumerate().filter(|(_, l)| **l != NONE) {
        let around = neighbours(columns, rows, node).filter(|other| labels[*other] == *label);
        let index = usize::from(*label);
        all[index] += 1;
        inside[index] += usize::from(around.count() == 4);
    }
    let is_sliver = |label: u16| {
        let index = usize::from(label);
        label != NONE && label != OUTSIDE && inside[index] < FEWEST_INSIDE
    };
    let mut open: Vec<usize> = (0..labels.len())
        .filter(|node| is_sliver(labels[*node]))
        .collect();
    let mut left = all.clone();
    // Node by node from the planes inwards.
    loop {
        let taken: Vec<(usize, u16)> = open
            .iter()
            .filter_map(|&node| {
                let z_mm = image.z_mm(node / rows, node % rows)?;
                let beside = neighbours(columns, rows, node).map(|other| labels[other]);
                let on = beside
                    .filter(|label| !is_sliver(*label) && *label != OUTSIDE)
                    .filter_map(|label| {
                        let own = surfaces.get(usize::from(label).checked_sub(1)?)?;
                        let at = own
                            .plane
                            .z_mm(image.x_mm(node / rows), image.y_mm(node % rows));
                        let off = (z_mm - at).abs();
                        (own.is_plane && off <= DEVIATIONS * noise_mm).then_some((label, off))
                    });
                let (label, _) = on.min_by(|a, b| a.1.total_cmp(&b.1))?;
                Some((node, label))
            })
            .collect();
        if taken.is_empty() {
            break;
        }
        for &(node, label) in &taken {
            left[usize::from(labels[node])] -= 1;
            labels[node] = label;
        }
        open.retain(|node| is_sliver(labels[*node]));
    }
    for &node in &open {
        let label = usize::from(labels[node]);
        if 2 * left[label] < all[label] {
            labels[node] = NONE;
        }
    }
    left != all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;
    use range_image::Lattice;

    fn level(z_mm: f64) -> Surface {
        let plane = Plane {
            middle_mm: [0.0; 2],
            values: nalgebra::Vector3::new(z_mm, 0.0, 0.0),
            covariance: nalgebra::Matrix3::zeros(),
            rms_mm: 0.05,
            samples: 100,
            share: 1.0,
        };
        Surface {
            nodes: 100,
            plane,
            is_plane: true,
            slope_rad: 0.0,
        }
    }

    /// A face at 0 in the columns 0 to 5, a floor at -2 in 6 to 9, each up to the row 8; what lies in
    /// row 9 is region 3, of the given heights.
    fn image(last_row_mm: &dyn Fn(usize) -> f64) -> (RangeImage, Vec<u16>) {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 0, 0, 10, 10);
        let mut labels = Vec::new();
        for column in 0..10 {
            for row in 0..10 {
                let (label, z_mm) = match (column, row) {
                    (_, 9) => (3, last_row_mm(column)),
                    (0..6, _) => (1, 0.0),
                    _ => (2, -2.0),
                };
                image.set_z_mm(column, row, Some(z_mm));
                labels.push(label);
            }
        }
        (image, labels)
    }

    #[test]
    fn the_last_row_of_two_faces_goes_to_each() {
        let (image, mut labels) = image(&|column| if column < 6 { 0.1 } else { -2.1 });
        let surfaces = [level(0.0), level(-2.0), level(-1.0)];
        assert!(joined(&image, &mut labels, &surfaces, 0.05));
        for column in 0..10 {
            assert_eq!(labels[column * 10 + 9], if column < 6 { 1 } else { 2 });
        }
    }

    #[test]
    fn a_row_of_its_own_stays_and_what_is_left_of_another_does_not() {
        let surfaces = [level(0.0), level(-2.0), level(-1.0)];
        let (own, mut labels) = image(&|_| -1.0);
        let before = labels.clone();
        assert!(!joined(&own, &mut labels, &surfaces, 0.05));
        assert_eq!(labels, before);
        let (mixed, mut labels) = image(&|column| if column == 8 { -1.0 } else { 0.0 });
        assert!(joined(&mixed, &mut labels, &surfaces, 0.05));
        // Up to the odd node the row is the face's, node by node.
        assert_eq!(labels[79], 1);
        assert_eq!([labels[89], labels[99]], [NONE; 2]);
    }
}
