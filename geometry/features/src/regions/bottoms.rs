//! The table as it is seen through holes.

use super::{OUTSIDE, Region, Regions, Surface};

/// Regions within so many deviations of it are scraps of it.
const DEVIATIONS: f64 = 3.0;
/// Fewest nodes of a place where it is.
const FEWEST: usize = 9;

/// Gives pieces of the outside that the part encloses a region each: the bottom of a hole that goes
/// through. Smaller ones are a void.
pub(super) fn bottoms(divided: &mut Regions, noise_mm: f64) {
    let table = match divided.regions.first() {
        Some(Region::Outside(table)) => *table,
        _ => None,
    };
    // Scraps of the table are the table.
    let is_table: Vec<bool> = divided
        .regions
        .iter()
        .map(|region| match (region, &table) {
            (Region::Part(surface), Some(table)) => {
                let [x, y] = surface.plane.middle_mm;
                let off = surface.plane.z_mm(x, y) - table.z_mm(x, y);
                off.abs() <= DEVIATIONS * noise_mm
            }
            _ => false,
        })
        .collect();
    for label in &mut divided.labels {
        if is_table[usize::from(*label)] {
            *label = OUTSIDE;
        }
    }
    let mut seen = vec![false; divided.labels.len()];
    for start in 0..divided.labels.len() {
        if seen[start] || divided.labels[start] != OUTSIDE {
            continue;
        }
        seen[start] = true;
        let mut piece = vec![start];
        let mut next = 0;
        let mut is_open = false;
        while next < piece.len() {
            is_open |= divided.at_frame(piece[next]);
            for other in divided.neighbours(piece[next]) {
                if !seen[other] && divided.labels[other] == OUTSIDE {
                    seen[other] = true;
                    piece.push(other);
                }
            }
            next += 1;
        }
        if is_open {
            continue;
        }
        let region = match table.filter(|_| piece.len() >= FEWEST) {
            Some(plane) => Region::Part(Surface {
                nodes: piece.len(),
                plane,
                is_plane: true,
                slope_rad: 0.0,
            }),
            None => Region::Void,
        };
        let label = u16::try_from(divided.regions.len()).unwrap_or(OUTSIDE);
        divided.regions.push(region);
        for node in piece {
            divided.labels[node] = label;
        }
    }
}
