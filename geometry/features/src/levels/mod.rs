//! Levels: floors, tops and unseen hollows, each with the slanting strips along its edges.

mod bow;
mod contact;
mod strips;

use range_image::RangeImage;

use crate::plane::Plane;
use crate::regions::{OUTSIDE, Region, Regions};

pub use bow::Bow;
pub use contact::Sense;
pub(crate) use contact::sense;

/// The index of what surrounds the part.
pub const AROUND: u16 = 0;

/// A floor or a top with what runs along its edges.
#[derive(Debug, Clone)]
pub struct Level {
    /// Its regions, those of the floor first.
    pub regions: Vec<u16>,
    /// How many of them are the floor's: more than one where several bow together.
    pub floors: usize,
    /// Plane of the floor; `None` where none is seen.
    pub plane: Option<Plane>,
    /// Whether the floor is one.
    pub is_plane: bool,
    /// Nodes of all.
    pub nodes: usize,
    /// Of a floor that a plane beside it runs on in without a wall, which way it goes from there.
    pub bow: Option<Bow>,
}

impl Level {
    /// The regions of its floor.
    #[must_use]
    pub fn floor(&self) -> &[u16] {
        self.regions.get(..self.floors).unwrap_or_default()
    }

    /// Whether its floor was seen.
    #[must_use]
    pub fn is_seen(&self) -> bool {
        self.plane.is_some()
    }
}

/// Every node with its level.
#[derive(Debug, Clone)]
pub struct Levels {
    /// Columns of the grid.
    pub columns: usize,
    /// Rows of the grid.
    pub rows: usize,
    /// Index into `levels`, column by column.
    pub labels: Vec<u16>,
    /// The first is what surrounds the part.
    pub levels: Vec<Level>,
    /// The slanting strips, with the level that they are part of.
    pub strips: Vec<Strip>,
}

/// A slanting strip along the edge of a floor or a top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// The region.
    pub region: u16,
    /// Whose edge it runs along.
    pub level: u16,
    /// Whether it falls from that, as a chamfer does, or rises, as a fillet does.
    pub falls: bool,
}

/// Levels of the regions.
#[must_use]
pub fn levels(image: &RangeImage, regions: &Regions, step_mm: f64) -> Levels {
    let contacts = contact::contacts(image, regions, step_mm);
    let slants = |region| strips::leans(regions, region, bow::LEAST_SLOPE_RAD);
    let bows = bow::bows(image, regions, &contacts, step_mm, &slants);
    let host = strips::hosts(image, regions, &contacts, &bows);
    let mut of_region = vec![u16::MAX; regions.regions.len()];
    let mut levels = Vec::new();
    for (index, region) in regions.regions.iter().enumerate() {
        if host[index].is_some() {
            continue;
        }
        of_region[index] = u16::try_from(levels.len()).unwrap_or(u16::MAX);
        let (plane, is_plane) = match region {
            Region::Part(surface) => (Some(surface.plane), surface.is_plane),
            Region::Outside(plane) => (*plane, plane.is_some()),
            Region::Void => (None, false),
        };
        levels.push(Level {
            regions: vec![u16::try_from(index).unwrap_or(u16::MAX)],
            floors: 1,
            plane,
            is_plane,
            nodes: 0,
            bow: bows[index].map(|part| part.bow),
        });
    }
    let mut strips = Vec::new();
    for (index, host) in host.iter().enumerate() {
        if let Some((to, falls)) = *host {
            let level = of_region[usize::from(to)];
            of_region[index] = level;
            let region = u16::try_from(index).unwrap_or(u16::MAX);
            let own = &mut levels[usize::from(level)];
            if bows[index].is_some() {
                own.regions.insert(own.floors, region);
                own.floors += 1;
                // However plane its sides are.
                own.is_plane = false;
                continue;
            }
            own.regions.push(region);
            strips.push(Strip {
                region,
                level,
                falls,
            });
        }
    }
    let labels: Vec<u16> = regions
        .labels
        .iter()
        .map(|region| of_region[usize::from(*region)])
        .collect();
    for label in &labels {
        levels[usize::from(*label)].nodes += 1;
    }
    debug_assert_eq!(of_region[usize::from(OUTSIDE)], AROUND);
    Levels {
        columns: regions.columns,
        rows: regions.rows,
        labels,
        levels,
        strips,
    }
}
