//! The table as it is seen through holes.

use super::pieces::pieces;
use super::{OUTSIDE, Region, Regions, Surface};

/// Regions within so many deviations of it are scraps of it.
const DEVIATIONS: f64 = 3.0;
/// What is seen of it through a hole is less than this share of the part.
const LARGEST: f64 = 0.4;
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
    let part = divided.labels.iter().filter(|l| **l != OUTSIDE).count();
    let outside = |node: usize| divided.labels[node] == OUTSIDE;
    for piece in pieces(divided.columns, divided.rows, &outside, &|_, _| true) {
        let is_open = piece.iter().any(|node| divided.at_frame(*node));
        if is_open || piece.len() as f64 > LARGEST * part as f64 {
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
