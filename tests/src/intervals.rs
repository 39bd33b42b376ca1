//! Silhouettes that run along an axis of the grid, and what the samples allow them to be.
//!
//! Columns stand a pitch apart, and so do samples in a column: an outline along one of them lies
//! anywhere between the last that meets the face and the next that does not, and nothing tells
//! where. So it is not held to the truth, but to that interval.

use sim_scanner::Vec3;
use sim_scanner::noise::Kind;
use sim_scanner::scanner::{Scanner, Sweep};
use sim_scanner::scene::Surface;
use sim_scanner::truth::{SampleTruth, VisibleFace};

use crate::outline::{Polygon, along};
use crate::trimming::{is_silhouette, sides};

/// A side that turns from its axis by less than this many degrees runs along it.
const ALONG_DEG: f64 = 1e-6;
/// What lies so near to the corners is theirs, and sides that are shorter than three times this
/// tell nothing; pitches.
const CORNER_PITCHES: f64 = 3.0;

/// A silhouette along an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisSilhouette {
    /// Where it begins and ends, millimetres.
    pub ends_mm: [[f64; 2]; 2],
    /// How wide the interval is that the samples allow, millimetres.
    pub width_mm: f64,
    /// How far the drawn one goes beyond that, millimetres; 0 where it stays inside.
    pub beyond_mm: f64,
    /// Farthest that the drawn one lies from the true one, millimetres.
    pub off_mm: f64,
}

/// What a scan has met, beam by beam.
pub struct Spots {
    /// Columns by ascending x, with what each of their beams met.
    columns: Vec<(f64, Vec<Spot>)>,
}

struct Spot {
    /// Where the beam begins and which way it goes, in the plane of its column.
    from_mm: [f64; 2],
    towards: [f64; 2],
    truth: SampleTruth,
}

impl Spots {
    /// Of a scan.
    #[must_use]
    pub fn of(scanner: &Scanner, sweep: &Sweep) -> Self {
        let mut columns: Vec<(f64, Vec<Spot>)> = (0..sweep.columns)
            .map(|index| {
                let (column, truths) = scanner.column_with_truth(sweep, 0, index);
                let optics = &scanner.optics;
                let beams = column.samples.iter().zip(truths);
                let spots = beams.map(|(sample, truth)| {
                    let (sin, cos) = libm::sincos(scanner.angle_rad(sample.lateral_counts));
                    Spot {
                        from_mm: [optics.camera_y_mm, optics.camera_z_mm],
                        towards: [sin, -cos],
                        truth,
                    }
                });
                (scanner.x_mm(column.table_counts), spots.collect())
            })
            .collect();
        columns.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { columns }
    }

    /// The interval of x in which a face may end that goes to lower or higher x (`sign`), at
    /// heights between `low_mm` and `high_mm`.
    fn columns_allow(
        &self,
        face: &VisibleFace,
        sign: f64,
        low_mm: f64,
        high_mm: f64,
    ) -> Option<[f64; 2]> {
        let meets = |spots: &[Spot]| {
            let mut on_face = spots.iter().filter(|spot| is_there(spot, face));
            on_face.any(|spot| {
                let point = spot.truth.point_mm;
                point.is_some_and(|p| (low_mm..=high_mm).contains(&p.y))
            })
        };
        let mut outwards: Vec<&(f64, Vec<Spot>)> = self.columns.iter().collect();
        if sign < 0.0 {
            outwards.reverse();
        }
        let last = outwards.iter().rposition(|(_, spots)| meets(spots))?;
        Some([outwards[last].0, outwards.get(last + 1)?.0])
    }

    /// The interval of y in which a face may end that goes to lower or higher y (`sign`), in
    /// columns between `low_mm` and `high_mm`: one for all of them, since it ends along a line.
    fn beams_allow(
        &self,
        face: &VisibleFace,
        sign: f64,
        low_mm: f64,
        high_mm: f64,
    ) -> Option<[f64; 2]> {
        let Surface::Plane { normal, offset_mm } = face.surface else {
            return None;
        };
        let (mut inner, mut outer) = (f64::NEG_INFINITY, f64::INFINITY);
        let within = |x_mm: f64| (low_mm..=high_mm).contains(&x_mm);
        for (x_mm, spots) in self.columns.iter().filter(|column| within(column.0)) {
            let upwards = spots[spots.len() - 1].towards[0] > spots[0].towards[0];
            let outwards: Vec<&Spot> = if upwards == (sign > 0.0) {
                spots.iter().collect()
            } else {
                spots.iter().rev().collect()
            };
            if let Some(last) = outwards.iter().rposition(|spot| is_there(spot, face)) {
                inner = inner.max(sign * outwards[last].truth.point_mm?.y);
            }
            let met = |spot: &&Spot| spot.truth.face == Some(face.id);
            let Some(last) = outwards.iter().rposition(met) else {
                continue;
            };
            // Where the next beam would meet the face's plane.
            let next = outwards.get(last + 1)?;
            let [y, z] = next.from_mm;
            let rise = normal.y * next.towards[0] + normal.z * next.towards[1];
            let length = (offset_mm - normal.dot(Vec3::new(*x_mm, y, z))) / rise;
            outer = outer.min(sign * (y + length * next.towards[0]));
        }
        (inner.is_finite() && outer.is_finite()).then_some([sign * inner, sign * outer])
    }
}

/// Light came back from this face, and was read as what it is.
fn is_there(spot: &Spot, face: &VisibleFace) -> bool {
    spot.truth.face == Some(face.id) && spot.truth.kind == Some(Kind::Clean)
}

/// The silhouettes of one face that run along an axis, with the loop drawn around it,
/// counter-clockwise. `faces` are all that are seen.
#[must_use]
pub fn axis_silhouettes(
    drawn: &[[f64; 2]],
    face: &VisibleFace,
    faces: &[VisibleFace],
    spots: &Spots,
    pitch_mm: f64,
) -> Vec<AxisSilhouette> {
    let looped = Polygon::new(drawn);
    let doubled_area: f64 = sides(&face.outline_mm)
        .map(|(a, b)| a.x * b.y - b.x * a.y)
        .sum();
    let turn = doubled_area.signum();
    let margin_mm = CORNER_PITCHES * pitch_mm;
    let mut found = Vec::new();
    for (from, to) in sides(&face.outline_mm) {
        let ends_mm = [[from.x, from.y], [to.x, to.y]];
        let by = [to.x - from.x, to.y - from.y];
        let axis = usize::from(by[1].abs() > by[0].abs());
        let is_along = (by[1 - axis] / by[axis]).abs() < libm::tan(ALONG_DEG.to_radians());
        if !is_along
            || by[axis].abs() < 3.0 * margin_mm
            || !is_silhouette((from + to) / 2.0, face, faces)
        {
            continue;
        }
        let (low_mm, high_mm) = (
            ends_mm[0][axis].min(ends_mm[1][axis]) + margin_mm,
            ends_mm[0][axis].max(ends_mm[1][axis]) - margin_mm,
        );
        let middle = [0, 1].map(|d| (ends_mm[0][d] + ends_mm[1][d]) / 2.0);
        // Outwards is to the right of an outline that runs counter-clockwise.
        let right = if axis == 0 { -by[0] } else { by[1] };
        let sign = turn * right.signum();
        let allowed = if axis == 0 {
            spots.beams_allow(face, sign, low_mm, high_mm)
        } else {
            spots.columns_allow(face, sign, low_mm, high_mm)
        };
        let Some([inner_mm, outer_mm]) = allowed else {
            continue;
        };
        let (mut beyond_mm, mut off_mm) = (0.0_f64, 0.0_f64);
        let is_clear = |p: &[f64; 2]| (low_mm..=high_mm).contains(&p[axis]);
        for point in along(ends_mm[0], ends_mm[1]).filter(is_clear) {
            let off = looped.signed_distance(point);
            let outwards = sign * middle[1 - axis] + off;
            beyond_mm = beyond_mm
                .max(outwards - sign * outer_mm)
                .max(sign * inner_mm - outwards);
            off_mm = off_mm.max(off.abs());
        }
        found.push(AxisSilhouette {
            ends_mm,
            width_mm: (outer_mm - inner_mm).abs(),
            beyond_mm,
            off_mm,
        });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_scanner::config::SimConfig;
    use sim_scanner::preset::Preset;
    use sim_scanner::scene::{Scene, figures};
    use sim_scanner::source::Source;
    use sim_scanner::truth;

    #[test]
    fn an_outline_moved_by_more_than_the_samples_allow_is_beyond() {
        let config = SimConfig::default();
        let Source::Simulated {
            mut scanner,
            proposed,
        } = config.source().unwrap()
        else {
            unreachable!("it is simulated");
        };
        let pose = figures::Pose {
            yaw_rad: 0.0,
            pitch_rad: 0.7,
            roll_rad: 0.0,
        };
        scanner.scene = Scene::new(vec![figures::house_in(pose)], Preset::Paper.material());
        let faces = truth::faces(&scanner).unwrap();
        let spots = Spots::of(&scanner, &proposed);
        let pitch_mm = 0.45;
        let mut seen = 0;
        for face in &faces {
            let exact: Vec<[f64; 2]> = face.outline_mm.iter().map(|p| [p.x, p.y]).collect();
            let of = |by: [f64; 2]| {
                let mut moved = exact.clone();
                for point in &mut moved {
                    *point = [point[0] + by[0], point[1] + by[1]];
                }
                axis_silhouettes(&moved, face, &faces, &spots, pitch_mm)
            };
            for (k, true_one) in of([0.0; 2]).iter().enumerate() {
                seen += 1;
                assert!(true_one.beyond_mm <= 0.0 && true_one.off_mm < 1e-9);
                assert!(true_one.width_mm > 0.0 && true_one.width_mm < 2.0 * pitch_mm);
                let [from, to] = true_one.ends_mm;
                let across = usize::from((to[0] - from[0]).abs() > (to[1] - from[1]).abs());
                for way in [-1.0, 1.0] {
                    let mut by = [0.0; 2];
                    by[across] = way * (true_one.width_mm + 0.1);
                    let moved = &of(by)[k];
                    assert!(moved.beyond_mm > 0.09, "{moved:?}");
                    assert!((moved.off_mm - by[across].abs()).abs() < 1e-6, "{moved:?}");
                }
            }
        }
        assert_eq!(seen, 5);
    }
}
