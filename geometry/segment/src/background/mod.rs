//! What lies behind the part: the table it stands on, a plane behind it, and what is held
//! into the view from outside.
//!
//! A background is known by what the part's own faces do not do all at once:
//!
//! 1. it is a plane, and everything else lies on the camera's side of it, which no face of
//!    a convex part can say of itself;
//! 2. it is cut off by the frame of the scan, along straight lines and on several sides,
//!    while the rest is not: seen from the rest, background lies further out;
//! 3. the rest stands up from it, unlike beads and letters on a plate, and there is a rest:
//!    a scan of planes alone is a scan of a part.
//!
//! Where any of these is missing nothing is taken for background: a face that is kept costs
//! the user a click, one that is lost without need costs a scan. A plate with a tall boss
//! that fills the view looks in every point like a box on a table; it counts as that, and
//! the report says so.

mod frame;
mod plane;
mod rest;

#[cfg(test)]
mod tests;

use core::fmt;

use range_image::{RangeImage, RegionMap};

pub use frame::View;
pub use plane::Plane;

use frame::{Lines, SIDES};
use plane::{Fitted, fit_regions};
use rest::{contact_share, fixtures};

/// Region numbers as nodes carry them; 0 is none.
type Label = u16;

/// What a background region is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BackgroundKind {
    /// A plane on which the part stands.
    Table,
    /// A plane behind the part that does not touch it in view.
    BackPlane,
    /// A body apart from the part that comes into the view from outside: a clamp, the edge
    /// of a table.
    Fixture,
}

impl BackgroundKind {
    /// As it is spelt in reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::BackPlane => "back plane",
            Self::Fixture => "fixture",
        }
    }
}

impl fmt::Display for BackgroundKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A region that is no part of the part.
#[derive(Debug, Clone, PartialEq)]
pub struct BackgroundRegion {
    /// Its label in the map that was looked at.
    pub label: u16,
    /// What it is.
    pub kind: BackgroundKind,
    /// Its nodes.
    pub nodes: usize,
    /// The plane it lies in; `None` for a fixture that is none.
    pub plane: Option<Plane>,
    /// The evidence, a phrase for the user.
    pub why: String,
}

/// What was recognised.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Background {
    /// The regions, in the order of their labels.
    pub regions: Vec<BackgroundRegion>,
    /// What the user should know about things that were not taken for background.
    pub notes: Vec<String>,
}

impl Background {
    /// The region with this label, if it is background.
    #[must_use]
    pub fn region(&self, label: u16) -> Option<&BackgroundRegion> {
        let found = self.regions.binary_search_by_key(&label, |r| r.label);
        found.ok().and_then(|k| self.regions.get(k))
    }

    /// Whether a node that has no region lies in one of the planes, as scraps of a table do.
    #[must_use]
    pub fn holds(&self, x_mm: f64, y_mm: f64, z_mm: f64, within_mm: f64) -> bool {
        let planes = self.regions.iter().filter_map(|r| r.plane.as_ref());
        planes
            .clone()
            .any(|plane| plane.distance_mm(x_mm, y_mm, z_mm).abs() <= within_mm)
    }
}

/// Of the other nodes so many must lie on the camera's side of a background plane.
const LEAST_IN_FRONT: f64 = 0.98;
/// A background plane takes at least this share of all labelled nodes.
const LEAST_SHARE: f64 = 0.02;
/// What is left as the part has at least this share of all labelled nodes.
const LEAST_REST: f64 = 0.03;
/// Of the lines across a side of the frame so many must end in background there.
const LEAST_REACHED: f64 = 0.7;
/// Sides of the frame that background must reach.
const LEAST_SIDES: usize = 3;
/// Of the lines through the rest so many must meet background further out.
const LEAST_ENCLOSED: f64 = 0.9;
/// The part rises by at least this share of its width (the side of a square as large as the
/// rectangle around it). Weld beads and embossed letters stay below a twentieth, the
/// flattest of boxes that anybody would stand on a table above a quarter.
const LEAST_RISE: f64 = 0.15;
/// The part rises by at least so many pitches.
const LEAST_RISE_PITCHES: f64 = 10.0;
/// From this share of contact along the outline on, the part stands on the plane.
const CONTACT: f64 = 0.1;

/// Finds the regions that are background. `view` is what the scanner looked at, as far as
/// that is known.
#[must_use]
pub fn background(image: &RangeImage, map: &RegionMap, view: &View) -> Background {
    let fits = fit_regions(image, map);
    let labelled: usize = fits.iter().map(|fit| fit.nodes).sum();
    if labelled == 0 {
        return Background::default();
    }
    let groups = groups(image, map, &fits, labelled);
    if groups.is_empty() {
        return Background::default();
    }
    let mut owner = vec![0_u16; fits.len() + 1];
    for (k, group) in groups.iter().enumerate() {
        for &label in &group.labels {
            owner[usize::from(label)] = k as Label + 1;
        }
    }
    let behind = |label: Label| owner[usize::from(label)] != 0;
    let planar: usize = groups.iter().map(|g| g.nodes).sum();
    let lines = Lines::new(image, map, view, behind);
    let reached = SIDES.map(|side| lines.reached(side));
    let sides = reached.iter().filter(|&&r| r >= LEAST_REACHED).count();
    let cut_off = sides >= LEAST_SIDES;
    if (labelled - planar) as f64 <= LEAST_REST * labelled as f64 {
        return alone(&groups, cut_off);
    }
    let enclosed = SIDES.map(|side| lines.enclosed(side));
    let around = enclosed.iter().filter(|&&e| e >= LEAST_ENCLOSED).count();
    if !cut_off || around < LEAST_SIDES {
        return Background::default();
    }
    let rise_mm = rest::rise_mm(image, map, &groups, behind);
    let width_mm = rest::width_mm(image, map, behind);
    if rise_mm < LEAST_RISE_PITCHES * image.pitch_mm() || rise_mm < LEAST_RISE * width_mm {
        return low_relief(&groups, rise_mm, width_mm);
    }
    let mut regions = Vec::new();
    for (k, group) in groups.iter().enumerate() {
        let owned = |label: Label| usize::from(owner[usize::from(label)]) == k + 1;
        let contact = contact_share(image, map, &group.plane, owned, behind);
        let kind = if contact >= CONTACT {
            BackgroundKind::Table
        } else {
            BackgroundKind::BackPlane
        };
        let why = why(kind, &lines, owned, rise_mm);
        regions.extend(group.labels.iter().map(|&label| BackgroundRegion {
            label,
            kind,
            nodes: fits[usize::from(label) - 1].nodes,
            plane: Some(group.plane),
            why: why.clone(),
        }));
    }
    for label in fixtures(image, map, view, behind) {
        regions.push(BackgroundRegion {
            label,
            kind: BackgroundKind::Fixture,
            nodes: fits[usize::from(label) - 1].nodes,
            plane: None,
            why: "apart from the part, and cut off by the frame of the scan".to_owned(),
        });
    }
    regions.sort_by_key(|region| region.label);
    Background {
        regions,
        notes: Vec::new(),
    }
}

/// Regions that lie in one plane with everything else before it.
#[derive(Debug, Clone)]
struct Group {
    plane: Plane,
    labels: Vec<Label>,
    nodes: usize,
}

fn groups(image: &RangeImage, map: &RegionMap, fits: &[Fitted], labelled: usize) -> Vec<Group> {
    let mut order: Vec<usize> = (0..fits.len())
        .filter(|&k| fits[k].is_flat && fits[k].nodes as f64 >= LEAST_SHARE * labelled as f64)
        .collect();
    order.sort_by_key(|&k| (core::cmp::Reverse(fits[k].nodes), k));
    let mut taken = vec![false; fits.len()];
    let mut groups = Vec::new();
    for seed in order {
        let Some(plane) = fits[seed].plane.filter(|_| !taken[seed]) else {
            continue;
        };
        let tolerance_mm = plane.tolerance_mm(image.pitch_mm());
        let tally = plane::tally(image, map, &plane, tolerance_mm);
        let alike = |k: usize| k == seed || tally[k].within as f64 >= 0.95 * fits[k].nodes as f64;
        let members: Vec<usize> = (0..fits.len()).filter(|&k| !taken[k] && alike(k)).collect();
        let (mut others, mut in_front) = (0, 0);
        for k in (0..fits.len()).filter(|k| !members.contains(k)) {
            others += fits[k].nodes;
            in_front += fits[k].nodes - tally[k].behind;
        }
        if (in_front as f64) < LEAST_IN_FRONT * others as f64 {
            continue;
        }
        for &k in &members {
            taken[k] = true;
        }
        groups.push(Group {
            plane,
            nodes: members.iter().map(|&k| fits[k].nodes).sum(),
            labels: members.iter().map(|&k| k as Label + 1).collect(),
        });
    }
    groups
}

fn alone(groups: &[Group], cut_off: bool) -> Background {
    // Two planes are a part; one that fills the view may be a table that lost its part.
    let note = (groups.len() == 1 && cut_off).then(|| {
        "one plane fills the view and nothing stands before it; it is taken for the part, not for \
         a table or back plane"
            .to_owned()
    });
    Background {
        regions: Vec::new(),
        notes: note.into_iter().collect(),
    }
}

fn low_relief(groups: &[Group], rise_mm: f64, width_mm: f64) -> Background {
    let labels: Vec<String> = groups
        .iter()
        .flat_map(|g| g.labels.iter().map(u16::to_string))
        .collect();
    let plural = if labels.len() == 1 { "" } else { "s" };
    Background {
        regions: Vec::new(),
        notes: vec![format!(
            "region{plural} {} could be a table or back plane, but what stands before it rises \
             {rise_mm:.1} mm only, on {width_mm:.0} mm; it is kept as a face of the part (a \
             region of interest in z leaves it out)",
            labels.join(", ")
        )],
    }
}

fn why(
    kind: BackgroundKind,
    lines: &Lines<'_>,
    owned: impl Fn(Label) -> bool,
    rise_mm: f64,
) -> String {
    let sides: Vec<&str> = SIDES
        .into_iter()
        .filter(|&side| lines.reached_by(side, &owned) >= 0.2)
        .map(frame::Side::as_str)
        .collect();
    let stands = match kind {
        BackgroundKind::Table => "the part stands on it and",
        _ => "the part stands before it and",
    };
    format!(
        "a plane cut off by the frame of the scan ({}); {stands} rises {rise_mm:.0} mm",
        sides.join(", ")
    )
}
