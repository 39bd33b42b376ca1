//! Nodes that the samples around them give to another region.
//!
//! A node's height is that of most samples in its window. Where a face runs out in a tip between
//! two others, most samples of each window are of those, and the tip is lost, some nodes long. Once
//! the shapes of both are known, the samples themselves tell how far each goes.

use nalgebra::Vector3;
use range_image::{Monitor, RangeImage, RegionMap};
use shapes::{Form, Verdict};

use crate::columns::Columns;
use crate::kinds::RegionKind;
use crate::process::PipelineError;

/// Nodes so far from a border are asked at most, nodes.
const REACH: usize = 10;
/// Samples so near to a node tell of it, pitches; the nearer they are, the more they count.
const NEAR: f64 = 1.25;
/// A sample is on a surface within so many root mean squares of that's samples, and clear of it
/// beyond so many: where surfaces go over into each other smoothly none is clear of either.
const ON: f64 = 3.5;
const CLEAR: f64 = 6.0;
/// Root mean squares are taken to be this at least, pitches: of samples without noise they are but
/// rounding.
const LEAST_RMS: f64 = 1e-3;
/// By how much what speaks for a new owner has to outweigh what speaks for the old one.
const OUTWEIGHS: f64 = 1.5;
/// Fewest samples that speak for a new owner.
const LEAST: usize = 2;
/// Cosine of the steepest slope (81 degrees) at which a surface is given nodes: what is steeper takes
/// many patches, and hides from the camera what lies behind it.
const LEAST_FACING: f64 = 0.15;
/// A region keeps so much of its nodes.
const KEPT: f64 = 0.75;

/// A surface that is known, and how far samples lie off it.
struct Surface {
    form: Form,
    rms_mm: f64,
}

impl Surface {
    fn of(kind: &RegionKind, pitch_mm: f64) -> Option<Self> {
        let rms_mm = match &kind.evidence.verdict {
            Verdict::Shape(fit) => fit.rms_mm,
            Verdict::Swept(fit) => fit.rms_mm,
            Verdict::FreeForm | Verdict::Unknown => return None,
        };
        let form = kind.known()?.form;
        Some(Self {
            form,
            rms_mm: rms_mm.max(LEAST_RMS * pitch_mm),
        })
    }
}

/// The image and the regions with the nodes that were given to others, and how many there are.
pub(crate) struct Claimed {
    pub(crate) image: RangeImage,
    pub(crate) regions: RegionMap,
    pub(crate) nodes: usize,
}

/// Gives nodes beside borders to the regions that the samples around them lie on, from border to
/// border, with their heights; `None` where none are. `kinds[k]` is that of region `k + 1`.
///
/// # Errors
/// Cancelled, or the columns cannot be read again.
pub(crate) fn claimed(
    image: &RangeImage,
    regions: &RegionMap,
    kinds: &[RegionKind],
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<Option<Claimed>, PipelineError> {
    let pitch_mm = image.pitch_mm();
    let surfaces = kinds.iter().map(|kind| Surface::of(kind, pitch_mm));
    let surfaces: Vec<Option<Surface>> = surfaces.collect();
    if surfaces.iter().flatten().count() < 2 {
        return Ok(None);
    }
    let claimed = by_surfaces(image, regions, &surfaces, columns, monitor)?;
    Ok((claimed.nodes > 0).then_some(claimed))
}

fn by_surfaces(
    image: &RangeImage,
    regions: &RegionMap,
    surfaces: &[Option<Surface>],
    columns: &dyn Columns,
    monitor: &dyn Monitor,
) -> Result<Claimed, PipelineError> {
    let samples = Samples::beside_borders(image, regions, columns, monitor)?;
    let mut claimed = Claimed {
        image: image.clone(),
        regions: regions.clone(),
        nodes: 0,
    };
    let least: Vec<f64> = regions
        .node_counts()
        .iter()
        .map(|count| KEPT * *count as f64)
        .collect();
    let mut asked: Vec<usize> = samples.band().collect();
    for _ in 0..REACH {
        monitor.check()?;
        let rows = image.rows();
        let mut counts = claimed.regions.node_counts();
        let found: Vec<(usize, u16, f64)> = asked
            .iter()
            .filter_map(|&node| {
                let place = [node / rows, node % rows];
                let (owner, z_mm) = owner(place, image, &claimed.regions, &samples, surfaces)?;
                Some((node, owner, z_mm))
            })
            .collect();
        let mut changed = Vec::new();
        for (node, owner, z_mm) in found {
            let (column, row) = (node / rows, node % rows);
            let before = usize::from(claimed.regions.label(column, row)) - 1;
            if counts[before] as f64 - 1.0 < least[before] {
                continue;
            }
            counts[before] -= 1;
            counts[usize::from(owner) - 1] += 1;
            claimed.regions.set_label(column, row, owner);
            claimed.image.set_z_mm(column, row, Some(z_mm));
            changed.push([column, row]);
        }
        if changed.is_empty() {
            break;
        }
        // Only beside what has changed is there anything new to ask.
        asked = changed
            .iter()
            .flat_map(|place| around(*place, 1, image))
            .map(|[column, row]| column * rows + row)
            .collect();
        asked.sort_unstable();
        asked.dedup();
    }
    let labels = claimed.regions.raw_labels().iter();
    let pairs = labels.zip(regions.raw_labels());
    claimed.nodes = pairs.filter(|(now, before)| now != before).count();
    Ok(claimed)
}

/// The region beside a node to which its samples give it, and its height there.
fn owner(
    place: [usize; 2],
    image: &RangeImage,
    regions: &RegionMap,
    samples: &Samples,
    surfaces: &[Option<Surface>],
) -> Option<(u16, f64)> {
    let label = regions.label(place[0], place[1]);
    let surface = |label: u16| surfaces.get(usize::from(label).checked_sub(1)?)?.as_ref();
    let own = surface(label)?;
    let mut beside: Vec<u16> = next_to(place)
        .map(|[column, row]| regions.label(column, row))
        .filter(|other| *other != label && *other != 0)
        .collect();
    beside.sort_unstable();
    beside.dedup();
    if beside.is_empty() {
        return None;
    }
    let pitch_mm = image.pitch_mm();
    let at_mm = [image.x_mm(place[0]), image.y_mm(place[1])];
    let near: Vec<(f64, Vector3<f64>)> = around(place, 2, image)
        .flat_map(|[column, row]| samples.of(column, row))
        .filter_map(|point_mm| {
            let off = [point_mm.x - at_mm[0], point_mm.y - at_mm[1]].map(|off| off / pitch_mm);
            let weight = 1.0 - libm::hypot(off[0], off[1]) / NEAR;
            (weight > 0.0).then_some((weight, *point_mm))
        })
        .collect();
    let off = |surface: &Surface, point_mm: &Vector3<f64>| {
        surface.form.distance_mm(point_mm).abs() / surface.rms_mm
    };
    let claim = |other: u16| {
        let surface = surface(other)?;
        let (mut speaks_for, mut count, mut against, mut z_mm) = (0.0, 0, 0.0, 0.0);
        for (weight, point_mm) in &near {
            let offs = [off(surface, point_mm), off(own, point_mm)];
            if offs[0] <= ON && offs[1] > CLEAR {
                speaks_for += weight;
                z_mm += weight * point_mm.z;
                count += 1;
            } else if offs[0] > ON && offs[1] <= ON {
                against += weight;
            }
        }
        if count < LEAST || speaks_for <= OUTWEIGHS * against {
            return None;
        }
        let form = &surface.form;
        let z_mm = form.z_mm(at_mm[0], at_mm[1], z_mm / speaks_for)?;
        let facing = form.normal(&Vector3::new(at_mm[0], at_mm[1], z_mm)).z;
        (facing >= LEAST_FACING).then_some((speaks_for, other, z_mm))
    };
    let claims = beside.into_iter().filter_map(claim);
    let best = claims.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
    Some((best.1, best.2))
}

/// The four nodes next to one; those outside of the image have no label.
fn next_to([column, row]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    [
        [column.wrapping_sub(1), row],
        [column + 1, row],
        [column, row.wrapping_sub(1)],
        [column, row + 1],
    ]
    .into_iter()
}

/// The nodes within so many of one, with itself.
fn around(
    [column, row]: [usize; 2],
    reach: usize,
    image: &RangeImage,
) -> impl Iterator<Item = [usize; 2]> + use<> {
    let columns = column.saturating_sub(reach)..(column + reach + 1).min(image.columns());
    let rows = row.saturating_sub(reach)..(row + reach + 1).min(image.rows());
    columns.flat_map(move |c| rows.clone().map(move |r| [c, r]))
}

/// The samples near borders between regions, by the node that they are nearest to.
struct Samples {
    rows: usize,
    /// Of each node, which entry of `points_mm` has its samples, one-based; 0 for none: it is not
    /// near a border.
    entries: Vec<u32>,
    points_mm: Vec<Vec<Vector3<f64>>>,
}

impl Samples {
    fn beside_borders(
        image: &RangeImage,
        regions: &RegionMap,
        columns: &dyn Columns,
        monitor: &dyn Monitor,
    ) -> Result<Self, PipelineError> {
        let mut samples = Self {
            rows: image.rows(),
            entries: band(image, regions),
            points_mm: Vec::new(),
        };
        let count = samples.entries.iter().copied().max().unwrap_or(0);
        samples.points_mm.resize(count as usize, Vec::new());
        let pitch_mm = image.pitch_mm();
        let nearest = |at_mm: f64, first_mm: f64, count: usize| {
            let index = ((at_mm - first_mm) / pitch_mm).round();
            (index >= 0.0 && index < count as f64).then_some(index as usize)
        };
        let mut go_on = Ok(());
        columns
            .visit(&mut |column| {
                let x_mm = column.x_mm();
                if let Some(c) = nearest(x_mm, image.x_mm(0), image.columns()) {
                    for sample in column.samples() {
                        let row = nearest(sample.y_mm, image.y_mm(0), image.rows());
                        let entry = row.and_then(|row| samples.entry(c, row));
                        if let Some(entry) = entry {
                            let point_mm = Vector3::new(x_mm, sample.y_mm, sample.z_mm);
                            samples.points_mm[entry].push(point_mm);
                        }
                    }
                }
                go_on = monitor.check();
                go_on.is_ok()
            })
            .map_err(PipelineError::ReadAgain)?;
        go_on?;
        Ok(samples)
    }

    fn entry(&self, column: usize, row: usize) -> Option<usize> {
        (self.entries[column * self.rows + row] as usize).checked_sub(1)
    }

    fn of(&self, column: usize, row: usize) -> &[Vector3<f64>] {
        let entry = self.entry(column, row);
        entry.map_or(&[], |entry| &self.points_mm[entry])
    }

    /// The nodes near borders.
    fn band(&self) -> impl Iterator<Item = usize> {
        let near = self.entries.iter().enumerate();
        near.filter(|(_, entry)| **entry > 0).map(|(node, _)| node)
    }
}

/// Numbers the nodes within [`REACH`] of a border between two regions from 1 on; 0 for the others.
fn band(image: &RangeImage, regions: &RegionMap) -> Vec<u32> {
    let rows = image.rows();
    let is_border = |place: [usize; 2]| {
        let label = regions.label(place[0], place[1]);
        label != 0
            && next_to(place).any(|[column, row]| {
                let other = regions.label(column, row);
                other != 0 && other != label
            })
    };
    let mut entries = vec![0; image.columns() * rows];
    for column in 0..image.columns() {
        for row in 0..rows {
            if is_border([column, row]) {
                for [column, row] in around([column, row], REACH, image) {
                    entries[column * rows + row] = 1;
                }
            }
        }
    }
    let mut next = 0;
    for entry in entries.iter_mut().filter(|entry| **entry > 0) {
        next += 1;
        *entry = next;
    }
    entries
}

#[cfg(test)]
mod tests {
    use range_image::{Column, Lattice, Sample, Unmonitored};
    use shapes::{Plane, Shape};

    use super::*;
    use crate::columns::InMemory;

    const COUNT: usize = 40;
    const RMS_MM: f64 = 0.05;

    /// A plane z = z0 + slope * x, whose samples lie off it by as much as noise.
    fn plane(z0_mm: f64, slope: f64) -> Option<Surface> {
        let shape = Shape::Plane(Plane {
            point_mm: Vector3::new(0.0, 0.0, z0_mm),
            normal: Vector3::new(-slope, 0.0, 1.0).normalize(),
        });
        Some(Surface {
            form: shape.into(),
            rms_mm: RMS_MM,
        })
    }

    /// What comes of nodes 1 mm apart of two regions when samples say where each is: both are told
    /// by whether they are of the second. Heights are those of `surfaces`.
    fn claims(
        surfaces: &[Option<Surface>; 2],
        heights_mm: [&dyn Fn(f64) -> f64; 2],
        node_is: impl Fn(f64, f64) -> bool,
        sample_is: impl Fn(f64, f64) -> bool,
    ) -> Claimed {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, COUNT, COUNT);
        let mut labels = Vec::new();
        for column in 0..COUNT {
            for row in 0..COUNT {
                let (x, y) = (column as f64, row as f64);
                let region = usize::from(node_is(x, y));
                image.set_z_mm(column, row, Some(heights_mm[region](x)));
                labels.push(region as u16 + 1);
            }
        }
        let column = |i: usize| {
            let x = 0.9 * i as f64;
            let samples = (0..2 * COUNT).map(|k| {
                let y = 0.6 * k as f64;
                let off = ((i * 7 + k * 3) % 5) as f64 / 4.0 - 0.5;
                Sample {
                    y_mm: y,
                    z_mm: heights_mm[usize::from(sample_is(x, y))](x) + 2.0 * RMS_MM * off,
                    intensity: 200,
                }
            });
            Column::new(x, samples.collect())
        };
        let columns: Vec<Column> = (0..COUNT + 4).map(column).collect();
        let scan = InMemory {
            columns: &columns,
            camera_mm: None,
        };
        let regions = RegionMap::new(&image, labels);
        by_surfaces(&image, &regions, surfaces, &scan, &Unmonitored).unwrap()
    }

    /// A wedge from the far end, as wide there as 8 mm to either side, whose tip is at x = 10.
    fn in_wedge(x: f64, y: f64) -> bool {
        (y - 20.0).abs() < (x - 10.0) * 8.0 / 29.0
    }

    #[test]
    fn the_tip_of_a_wedge_is_given_back() {
        let surfaces = [plane(0.0, 0.0), plane(1.0, 0.0)];
        let heights: [&dyn Fn(f64) -> f64; 2] = [&|_| 0.0, &|_| 1.0];
        // Where it is less than four nodes wide, the nodes are those of what lies around it.
        let node_is = |x: f64, y: f64| x > 17.0 && in_wedge(x, y);
        let found = claims(&surfaces, heights, node_is, in_wedge);
        let mut lost = 0;
        for column in 0..COUNT {
            for row in 0..COUNT {
                let (x, y) = (column as f64, row as f64);
                let label = found.regions.label(column, row);
                // The border itself may lie a node to either side.
                let within = in_wedge(x - 1.0, y) && in_wedge(x, y - 0.5) && in_wedge(x, y + 0.5);
                if within {
                    lost += usize::from(label != 2 && x > 12.0);
                } else if !in_wedge(x + 4.0, y) {
                    assert_eq!(label, 1, "{x} {y}");
                }
                let height = if label == 2 { 1.0 } else { 0.0 };
                assert_eq!(found.image.z_mm(column, row), Some(height), "{x} {y}");
            }
        }
        assert_eq!(lost, 0);
        assert!((8..=40).contains(&found.nodes), "{}", found.nodes);
    }

    #[test]
    fn what_is_in_its_place_stays() {
        let surfaces = [plane(0.0, 0.0), plane(1.0, 0.0)];
        let heights: [&dyn Fn(f64) -> f64; 2] = [&|_| 0.0, &|_| 1.0];
        let is = |x: f64, _: f64| x > 20.4;
        assert_eq!(claims(&surfaces, heights, is, is).nodes, 0);
    }

    #[test]
    fn where_surfaces_are_hardly_apart_nothing_is_claimed() {
        // They meet at x = 20, and the labels change four nodes farther on, 0.08 mm apart.
        let surfaces = [plane(0.0, 0.0), plane(-0.4, 0.02)];
        let heights: [&dyn Fn(f64) -> f64; 2] = [&|_| 0.0, &|x| 0.02 * x - 0.4];
        let found = claims(&surfaces, heights, |x, _| x > 24.0, |x, _| x > 20.0);
        assert_eq!(found.nodes, 0);
    }

    #[test]
    fn what_is_not_known_neither_gives_nor_takes() {
        let heights: [&dyn Fn(f64) -> f64; 2] = [&|_| 0.0, &|_| 1.0];
        let node_is = |x: f64, y: f64| x > 17.0 && in_wedge(x, y);
        for surfaces in [[None, plane(1.0, 0.0)], [plane(0.0, 0.0), None]] {
            assert_eq!(claims(&surfaces, heights, node_is, in_wedge).nodes, 0);
        }
    }

    #[test]
    fn a_region_keeps_most_of_its_nodes() {
        // By the samples nothing is of the second region, which has 80 nodes.
        let surfaces = [plane(0.0, 0.0), plane(1.0, 0.0)];
        let heights: [&dyn Fn(f64) -> f64; 2] = [&|_| 0.0, &|_| 1.0];
        let found = claims(&surfaces, heights, |x, _| x > 37.5, |_, _| false);
        assert_eq!(found.nodes, 20);
        assert_eq!(found.regions.node_counts()[1], 60);
    }

    #[test]
    fn steep_surfaces_are_given_no_nodes() {
        let steep = |x: f64| 8.0 * (x - 20.0);
        let surfaces = [plane(0.0, 0.0), plane(-160.0, 8.0)];
        let heights: [&dyn Fn(f64) -> f64; 2] = [&|_| 0.0, &steep];
        let found = claims(&surfaces, heights, |x, _| x > 23.5, |x, _| x > 20.0);
        assert_eq!(found.nodes, 0);
    }

    #[test]
    fn one_sample_alone_gives_no_node_away() {
        // Two strays beside the border, each near nodes that have no other sample.
        let surfaces = [plane(0.0, 0.0), plane(1.0, 0.0)];
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, COUNT, COUNT);
        let mut labels = Vec::new();
        for column in 0..COUNT {
            for row in 0..COUNT {
                let is_second = column > 20;
                image.set_z_mm(column, row, Some(f64::from(u8::from(is_second))));
                labels.push(u16::from(is_second) + 1);
            }
        }
        let columns = [19.9, 20.1].map(|x_mm| {
            let sample = |y_mm: f64| Sample {
                y_mm,
                z_mm: 1.0,
                intensity: 200,
            };
            Column::new(x_mm, vec![sample(10.0 + 40.0 * (x_mm - 19.9))])
        });
        let scan = InMemory {
            columns: &columns,
            camera_mm: None,
        };
        let regions = RegionMap::new(&image, labels);
        let found = by_surfaces(&image, &regions, &surfaces, &scan, &Unmonitored).unwrap();
        assert_eq!(found.nodes, 0);
    }
}
