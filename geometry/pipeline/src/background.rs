//! What is done about the surroundings of the part, and what is left over.

use core::fmt;
use core::str::FromStr;

use range_image::{RangeImage, RegionMap};
use segment::Background;

/// What is done with a recognised table, back plane or fixture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum BackgroundPolicy {
    /// It gives no faces; the outcome lists it.
    #[default]
    Remove,
    /// Nothing is looked for; every region is a face of the part.
    Keep,
}

impl BackgroundPolicy {
    /// Every policy.
    pub const ALL: [Self; 2] = [Self::Remove, Self::Keep];

    /// As it is spelt in settings and reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Remove => "remove",
            Self::Keep => "keep",
        }
    }
}

impl fmt::Display for BackgroundPolicy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// No such policy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is nothing that can be done with a background; known are remove and keep")]
pub struct UnknownPolicy(pub String);

impl FromStr for BackgroundPolicy {
    type Err = UnknownPolicy;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|policy| policy.as_str() == text);
        known.ok_or_else(|| UnknownPolicy(text.to_owned()))
    }
}

/// What a node of the range image counts as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NodeRole {
    /// It has no value.
    Masked,
    /// It belongs to a region of the part.
    Part,
    /// It belongs to a region of the part without having been measured: a hole was closed.
    Filled,
    /// It belongs to a removed region, or is a scrap in its plane.
    Background,
    /// It belongs to no region.
    Crumb,
}

/// Connected nodes that belong to no region, too few for one or too scattered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crumb {
    /// How many.
    pub nodes: usize,
    /// Their mean place in the part frame, millimetres.
    pub centre_mm: [f64; 3],
}

/// Nodes without a region that lie this near to a background plane are scraps of it,
/// pitches.
const SCRAP_PITCHES: f64 = 1.0;

/// What each node of a background region or without a region counts as, by the image's first
/// division into regions; all others are of the part.
pub(crate) fn roles(image: &RangeImage, map: &RegionMap, background: &Background) -> Vec<NodeRole> {
    let scrap_mm = SCRAP_PITCHES * image.pitch_mm();
    let rows = image.rows().max(1);
    let labels = map.raw_labels().iter().zip(image.raw_z_mm()).enumerate();
    labels
        .map(|(k, (&label, &z))| {
            let scrap =
                || background.holds(image.x_mm(k / rows), image.y_mm(k % rows), z, scrap_mm);
            if z.is_nan() {
                NodeRole::Masked
            } else if label == 0 && scrap() {
                NodeRole::Background
            } else if label == 0 {
                NodeRole::Crumb
            } else if background.region(label).is_some() {
                NodeRole::Background
            } else {
                NodeRole::Part
            }
        })
        .collect()
}

/// The image without the nodes of the background.
pub(crate) fn masked(image: &RangeImage, roles: &[NodeRole]) -> RangeImage {
    let mut part = image.clone();
    let rows = image.rows().max(1);
    for (k, role) in roles.iter().enumerate() {
        if *role == NodeRole::Background {
            part.set_z_mm(k / rows, k % rows, None);
        }
    }
    part
}

/// The crumbs, the largest first.
pub(crate) fn crumbs(image: &RangeImage, roles: &[NodeRole]) -> Vec<Crumb> {
    let rows = image.rows().max(1);
    let is_crumb = |k: usize| roles.get(k) == Some(&NodeRole::Crumb);
    let mut seen = vec![false; roles.len()];
    let mut found = Vec::new();
    let mut stack = Vec::new();
    for start in (0..roles.len()).filter(|&k| is_crumb(k)) {
        if core::mem::replace(&mut seen[start], true) {
            continue;
        }
        stack.push(start);
        let (mut nodes, mut sum) = (0_usize, [0.0; 3]);
        while let Some(k) = stack.pop() {
            let (column, row) = (k / rows, k % rows);
            nodes += 1;
            sum[0] += image.x_mm(column);
            sum[1] += image.y_mm(row);
            sum[2] += image.z_mm(column, row).unwrap_or(0.0);
            let below = (row > 0).then(|| k - 1);
            let above = (row + 1 < rows).then_some(k + 1);
            let left = k.checked_sub(rows);
            for next in [below, above, left, Some(k + rows)].into_iter().flatten() {
                if is_crumb(next) && !core::mem::replace(&mut seen[next], true) {
                    stack.push(next);
                }
            }
        }
        found.push(Crumb {
            nodes,
            centre_mm: sum.map(|sum| sum / nodes as f64),
        });
    }
    // Stable: crumbs of one size stay in the order of their places.
    found.sort_by_key(|crumb| core::cmp::Reverse(crumb.nodes));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Lattice;

    #[test]
    fn crumbs_are_told_by_size_and_place() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 2.0 }, 0, 0, 5, 4);
        let mut labels = vec![0; 20];
        for (column, row, z, label) in [
            (0, 0, 1.0, 1),
            (0, 1, 1.0, 1),
            (2, 1, 5.0, 0),
            (2, 2, 6.0, 0),
            (3, 2, 7.0, 0),
            // Touches the one before cornerwise only.
            (4, 3, 9.0, 0),
        ] {
            image.set_z_mm(column, row, Some(z));
            labels[column * 4 + row] = label;
        }
        let map = RegionMap::new(&image, labels);
        let roles = roles(&image, &map, &Background::default());
        let found = crumbs(&image, &roles);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].nodes, 3);
        let expected = [14.0 / 3.0, 10.0 / 3.0, 6.0];
        for (found, expected) in found[0].centre_mm.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12);
        }
        assert_eq!(found[1].centre_mm, [8.0, 6.0, 9.0]);
        let count = |role| roles.iter().filter(|&&r| r == role).count();
        assert_eq!(count(NodeRole::Part), 2);
        assert_eq!((count(NodeRole::Crumb), count(NodeRole::Masked)), (4, 14));
    }

    #[test]
    fn policies_are_read_as_they_are_spelt() {
        for policy in BackgroundPolicy::ALL {
            assert_eq!(policy.to_string().parse(), Ok(policy));
        }
        let error = "hide".parse::<BackgroundPolicy>().unwrap_err().to_string();
        assert!(error.contains("remove and keep"), "{error}");
    }
}
