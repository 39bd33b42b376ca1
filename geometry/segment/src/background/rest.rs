//! What is left when the background planes are gone.

use range_image::{RangeImage, RegionMap};

use super::frame::{Frame, SIDES, View};
use super::plane::{Plane, labelled};
use super::{Group, Label};

/// Neighbouring nodes no farther apart than this in z, pitches, touch: a surface that leans
/// 75 degrees away from the camera, the most that scanners see, rises 3.7 pitches a node.
const TOUCHING_PITCHES: f64 = 4.0;
/// Fewer pairs of touching nodes between two regions are chance.
const LEAST_PAIRS: usize = 4;
/// Nodes at the frame from which on a region is cut off by it.
const LEAST_CUT: usize = 4;

/// Height of the rest above the planes, millimetres: of the distances to the nearest plane
/// the one that a twentieth exceeds.
pub(super) fn rise_mm(
    image: &RangeImage,
    map: &RegionMap,
    groups: &[Group],
    behind: impl Fn(Label) -> bool,
) -> f64 {
    let mut heights: Vec<f64> = labelled(image, map)
        .filter(|&(label, _)| !behind(label))
        .map(|(_, [x, y, z])| {
            let distances = groups.iter().map(|g| g.plane.distance_mm(x, y, z));
            distances.fold(f64::INFINITY, f64::min)
        })
        .collect();
    if heights.is_empty() {
        return 0.0;
    }
    let rank = (heights.len() - 1) * 19 / 20;
    *heights.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Side of the square as large as the rectangle around the rest, seen by the camera,
/// millimetres.
pub(super) fn width_mm(image: &RangeImage, map: &RegionMap, behind: impl Fn(Label) -> bool) -> f64 {
    let none = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) = labelled(image, map)
        .filter(|&(label, _)| !behind(label))
        .fold(none, |(low, high), (_, [x, y, _])| {
            (
                [low[0].min(x), low[1].min(y)],
                [high[0].max(x), high[1].max(y)],
            )
        });
    let pitch_mm = image.pitch_mm();
    let side = |k: usize| (high[k] - low[k]).max(0.0) + pitch_mm;
    libm::sqrt(side(0) * side(1))
}

/// Every pair of neighbouring labelled nodes of two regions: labels and z.
fn pairs<'a>(
    image: &'a RangeImage,
    map: &'a RegionMap,
) -> impl Iterator<Item = [(Label, usize, usize, f64); 2]> + 'a {
    let node = move |column: usize, row: usize| {
        let z_mm = image.z_mm(column, row)?;
        let label = map.label(column, row);
        (label != 0).then_some((label, column, row, z_mm))
    };
    (0..image.columns()).flat_map(move |column| {
        (0..image.rows()).flat_map(move |row| {
            [(column + 1, row), (column, row + 1)]
                .into_iter()
                .filter_map(move |(c, r)| Some([node(column, row)?, node(c, r)?]))
                .filter(|[a, b]| a.0 != b.0)
        })
    })
}

/// Of the places where a plane and the rest are neighbours in the image, the share in which
/// the rest comes down to the plane.
pub(super) fn contact_share(
    image: &RangeImage,
    map: &RegionMap,
    plane: &Plane,
    owned: impl Fn(Label) -> bool,
    behind: impl Fn(Label) -> bool,
) -> f64 {
    let near_mm = TOUCHING_PITCHES * image.pitch_mm();
    let (mut met, mut touching) = (0_usize, 0_usize);
    for [a, b] in pairs(image, map) {
        let (mine, other) = if owned(a.0) { (a, b) } else { (b, a) };
        if !owned(mine.0) || behind(other.0) {
            continue;
        }
        met += 1;
        let (_, column, row, z_mm) = other;
        let height_mm = plane.distance_mm(image.x_mm(column), image.y_mm(row), z_mm);
        touching += usize::from(height_mm.abs() <= near_mm);
    }
    touching as f64 / met.max(1) as f64
}

/// Regions of the rest that are apart from its largest body and cut off by a side of the
/// frame that the largest body does not reach, in the order of their labels.
pub(super) fn fixtures(
    image: &RangeImage,
    map: &RegionMap,
    view: &View,
    behind: impl Fn(Label) -> bool,
) -> Vec<Label> {
    let regions = usize::from(map.regions());
    let bodies = bodies(image, map, &behind);
    let counts = map.node_counts();
    let mut nodes = vec![0_usize; regions + 1];
    let mut cut = vec![[0_usize; 4]; regions + 1];
    for label in (1..=map.regions()).filter(|&label| !behind(label)) {
        nodes[bodies[usize::from(label)]] += counts[usize::from(label) - 1];
    }
    let frames = SIDES.map(|side| Frame::at(image, view, side));
    for column in 0..image.columns() {
        for row in 0..image.rows() {
            let label = map.label(column, row);
            if label == 0 || behind(label) {
                continue;
            }
            let cut = &mut cut[bodies[usize::from(label)]];
            for (count, frame) in cut.iter_mut().zip(&frames) {
                *count += usize::from(frame.is_some_and(|f| f.cuts(f.place(column, row))));
            }
        }
    }
    let main = (0..=regions).max_by_key(|&k| (nodes[k], core::cmp::Reverse(k)));
    let Some(main) = main else { return Vec::new() };
    (1..=map.regions())
        .filter(|&label| {
            let body = bodies[usize::from(label)];
            let cut_off = cut[body]
                .iter()
                .zip(cut[main])
                .any(|(&own, mains)| own >= LEAST_CUT && mains == 0);
            !behind(label) && body != main && nodes[body] * 2 < nodes[main] && cut_off
        })
        .collect()
}

/// For each label the least label of the body it belongs to: regions of the rest that touch.
fn bodies(image: &RangeImage, map: &RegionMap, behind: &impl Fn(Label) -> bool) -> Vec<usize> {
    let near_mm = TOUCHING_PITCHES * image.pitch_mm();
    let mut touches = std::collections::BTreeMap::<(Label, Label), usize>::new();
    for [a, b] in pairs(image, map) {
        if !behind(a.0) && !behind(b.0) && (a.3 - b.3).abs() <= near_mm {
            *touches.entry((a.0.min(b.0), a.0.max(b.0))).or_default() += 1;
        }
    }
    let mut body: Vec<usize> = (0..=usize::from(map.regions())).collect();
    let root = |body: &[usize], mut k: usize| {
        while body[k] != k {
            k = body[k];
        }
        k
    };
    for ((a, b), count) in touches {
        if count >= LEAST_PAIRS {
            let (a, b) = (root(&body, a.into()), root(&body, b.into()));
            body[a.max(b)] = a.min(b);
        }
    }
    (0..body.len()).map(|k| root(&body, k)).collect()
}
