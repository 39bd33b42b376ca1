//! Samples beside a border, as witnesses of which side their rays passed on.
//!
//! A ray that the upper surface stopped lies on the upper side. One that went on lies on the
//! lower side, at the place where it passed the upper surface's height: the lower surface may be
//! hidden for a long way beside a wall, but rays are seen to pass the edge wherever they end. A
//! ray that came back with nothing most likely passed, too, into a shadow.

use range_image::{Column, RangeImage};

use super::posterior::Witness;
use crate::border::Pair;
use crate::levels::Sense;
use crate::plane::Plane;
use crate::ray::{passes, ray};
use crate::sight::Sight;

/// Nodes to either side of the border whose samples are asked.
const REACH: usize = 3;
/// And in the shadow of a wall.
const FURTHEST: usize = 60;
/// Columns beyond the last ones of the scan.
const BEYOND: u32 = 4;
/// Samples within so many deviations of a surface lie on it.
const DEVIATIONS: f64 = 4.5;
/// Further below the upper surface than this it may lie on the wall, just under the edge.
const UNDER_DEVIATIONS: f64 = 2.5;
/// How often a sample is wrong: outliers that lie on a surface by chance, readings of two
/// surfaces at once.
const DOUBT: f64 = 0.03;
/// Between both surfaces lies the wall, or a reading of both at once.
const DOUBT_BETWEEN: f64 = 0.12;
/// Surfaces are near each other where no more than so many slacks part them.
const NEAR_SLACKS: f64 = 4.0;
/// How often a missing sample was on the upper surface nevertheless.
const DOUBT_OF_MISSING: f64 = 0.25;

/// Witnesses beside these pairs. Inside is where the pairs' inner nodes are.
#[must_use]
pub fn witnesses(sight: &Sight<'_>, pairs: &[Pair]) -> Vec<Witness> {
    let zone = Zone::of(sight, pairs);
    let image = &sight.field.image;
    let (first, _) = image.origin();
    let mut found = Vec::new();
    let empty = |x_mm: Option<f64>, beyond: f64| {
        let step = beyond * sight.field.column_pitch_mm;
        Column::new(x_mm.unwrap_or(0.0) + step, Vec::new())
    };
    // Beyond its last columns, too, the scan has none.
    let before =
        (1..=BEYOND).map(|k| empty(sight.columns.first().map(Column::x_mm), -f64::from(k)));
    let behind = (1..=BEYOND).map(|k| empty(sight.columns.last().map(Column::x_mm), f64::from(k)));
    let beyond: Vec<Column> = before.chain(behind).collect();
    for column in sight.columns.iter().chain(&beyond) {
        let at = (column.x_mm() / image.pitch_mm()).round() as i64 - first;
        if !usize::try_from(at).is_ok_and(|at| zone.columns.contains(&at)) {
            continue;
        }
        let pair_at = |y_mm: f64| {
            let at = sight.regions.node(image, column.x_mm(), y_mm)?;
            pairs.get(zone.pair(at)?)
        };
        of_column(sight, column, &pair_at, &mut found);
    }
    found
}

/// Which pair speaks for which node.
struct Zone {
    /// Index of a pair for each node, and its squared distance in nodes.
    node: Vec<(u32, u32)>,
    columns: core::ops::RangeInclusive<usize>,
}

/// No pair.
const NOBODY: u32 = u32::MAX;

impl Zone {
    fn of(sight: &Sight<'_>, pairs: &[Pair]) -> Self {
        let (columns, rows) = (sight.regions.columns, sight.regions.rows);
        let mut nearest = vec![(NOBODY, u32::MAX); columns * rows];
        let (mut low, mut high) = (usize::MAX, 0);
        for (index, pair) in (0_u32..).zip(pairs) {
            let [back, forth] = beyond_shadow(sight, pair);
            for node in [pair.inner, pair.outer] {
                let (column, row) = (node / rows, node % rows);
                for c in column.saturating_sub(REACH)..=(column + REACH).min(columns - 1) {
                    (low, high) = (low.min(c), high.max(c));
                    for r in row.saturating_sub(back)..=(row + forth).min(rows - 1) {
                        let far = c.abs_diff(column).pow(2) + r.abs_diff(row).pow(2);
                        let far = u32::try_from(far).unwrap_or(u32::MAX);
                        let entry = &mut nearest[c * rows + r];
                        if far < entry.1 {
                            *entry = (index, far);
                        }
                    }
                }
            }
        }
        Self {
            node: nearest,
            columns: low..=high.max(low),
        }
    }

    fn pair(&self, node: usize) -> Option<usize> {
        let (index, _) = *self.node.get(node)?;
        (index != NOBODY).then_some(index as usize)
    }
}

/// How many nodes before and behind a pair samples are asked: where a high wall hides the lower surface
/// further than that, up to where it is seen again.
fn beyond_shadow(sight: &Sight<'_>, pair: &Pair) -> [usize; 2] {
    let (upper, lower) = match pair.sense {
        Sense::Falls => (pair.inner, pair.outer),
        Sense::Rises => (pair.outer, pair.inner),
        Sense::Level => return [REACH; 2],
    };
    let image = &sight.field.image;
    let rows = sight.regions.rows;
    let (x_mm, y_mm) = (image.x_mm(upper / rows), image.y_mm(upper % rows));
    let z_mm = |node: usize| height(sight, node, x_mm, y_mm).map(|(z_mm, _)| z_mm);
    let (Some(upper_mm), Some(lower_mm)) = (z_mm(upper), z_mm(lower)) else {
        return [REACH; 2];
    };
    let own = ray(sight.camera_mm, y_mm, upper_mm);
    let hidden_mm = passes(sight.camera_mm, own, lower_mm) - y_mm;
    let hidden = (hidden_mm.abs() / image.pitch_mm()).ceil() as usize;
    if hidden <= REACH + 1 {
        return [REACH; 2];
    }
    let far = (hidden + REACH).min(FURTHEST);
    if hidden_mm < 0.0 {
        [far, REACH]
    } else {
        [REACH, far]
    }
}

fn of_column<'p>(
    sight: &Sight<'_>,
    column: &Column,
    pair_at: &dyn Fn(f64) -> Option<&'p Pair>,
    found: &mut Vec<Witness>,
) {
    let rays = sight.rays_of(column);
    for sample in column.samples() {
        if let Some(pair) = pair_at(sample.y_mm)
            && let Some(side) = Side::of(sight, pair, column.x_mm(), sample.y_mm)
        {
            found.extend(side.told(sight, pair, column.x_mm(), sample));
        }
    }
    missing(sight, column.x_mm(), &rays, pair_at, found);
}

/// Rays that came back with nothing, between those that did and at both ends of the column.
fn missing<'p>(
    sight: &Sight<'_>,
    x_mm: f64,
    rays: &[(f64, f64)],
    pair_at: &dyn Fn(f64) -> Option<&'p Pair>,
    found: &mut Vec<Witness>,
) {
    sight.missing_rays(rays, |ray, near_mm| {
        let guess = passes(sight.camera_mm, ray, near_mm);
        if let Some(pair) = pair_at(guess)
            && let Some(side) = Side::of(sight, pair, x_mm, guess)
        {
            let y_mm = passes(sight.camera_mm, ray, side.upper_mm);
            found.push(side.witness(sight, x_mm, y_mm, false, DOUBT_OF_MISSING));
        }
    });
}

/// The two surfaces beside a pair, at one place.
struct Side {
    upper_mm: f64,
    /// Where the upper surface is no plane and the lower one is, that tells what lies on it.
    lower_mm: Option<f64>,
    within_mm: f64,
    under_mm: f64,
    inner_is_upper: bool,
}

impl Side {
    fn of(sight: &Sight<'_>, pair: &Pair, x_mm: f64, y_mm: f64) -> Option<Self> {
        let inner_is_upper = match pair.sense {
            Sense::Rises => false,
            Sense::Falls => true,
            Sense::Level => return None,
        };
        let (upper, lower) = match inner_is_upper {
            true => (pair.inner, pair.outer),
            false => (pair.outer, pair.inner),
        };
        let (upper_mm, slack_mm) = height(sight, upper, x_mm, y_mm)?;
        let lower_mm = match slack_mm > 0.0 {
            true => height(sight, lower, x_mm, y_mm)
                .filter(|(_, slack_mm)| *slack_mm == 0.0)
                .map(|(z_mm, _)| z_mm),
            false => None,
        };
        Some(Self {
            upper_mm,
            lower_mm,
            within_mm: DEVIATIONS * sight.field.noise_mm + slack_mm,
            under_mm: UNDER_DEVIATIONS * sight.field.noise_mm + slack_mm,
            inner_is_upper,
        })
    }

    /// What a sample says.
    fn told(
        &self,
        sight: &Sight<'_>,
        pair: &Pair,
        x_mm: f64,
        sample: &range_image::Sample,
    ) -> Option<Witness> {
        let camera = sight.camera_mm;
        if let Some(lower_mm) = self.lower_mm {
            return self.told_by_lower(sight, x_mm, sample, lower_mm);
        }
        let above = sample.z_mm - self.upper_mm;
        let own = ray(camera, sample.y_mm, sample.z_mm);
        // Where its ray passed that height: exact, however far the sample strays along it.
        let y_mm = passes(camera, own, self.upper_mm);
        if -self.under_mm <= above && above <= self.within_mm {
            let mut witness = self.witness(sight, x_mm, y_mm, true, DOUBT);
            // A sample of the wall just under the edge looks the same.
            witness.slack_mm = match camera {
                Some(_) => self.under_mm * own.abs(),
                None => 0.0,
            };
            Some(witness)
        } else if above < -self.within_mm {
            let doubt = match self.is_lower(sight, pair, x_mm, sample) {
                true => DOUBT,
                false => DOUBT_BETWEEN,
            };
            Some(self.witness(sight, x_mm, y_mm, false, doubt))
        } else {
            None
        }
    }

    /// As [`Self::told`], by the lower surface: what lies on it is below, what lies as high as the
    /// upper one, or somewhat above the lower where both are near, is not.
    fn told_by_lower(
        &self,
        sight: &Sight<'_>,
        x_mm: f64,
        sample: &range_image::Sample,
        lower_mm: f64,
    ) -> Option<Witness> {
        let camera = sight.camera_mm;
        let own = ray(camera, sample.y_mm, sample.z_mm);
        let passing = passes(camera, own, self.upper_mm);
        let above = sample.z_mm - lower_mm;
        let is_near = self.upper_mm - lower_mm <= NEAR_SLACKS * self.within_mm;
        if above.abs() <= DEVIATIONS * sight.field.noise_mm {
            Some(self.witness(sight, x_mm, passing, false, DOUBT))
        } else if above < 0.0 || sample.z_mm > self.upper_mm + self.within_mm {
            None
        } else if sample.z_mm >= self.upper_mm - self.within_mm {
            Some(self.witness(sight, x_mm, sample.y_mm, true, DOUBT))
        } else if is_near {
            Some(self.witness(sight, x_mm, sample.y_mm, true, DOUBT_BETWEEN))
        } else {
            Some(self.witness(sight, x_mm, passing, false, DOUBT_BETWEEN))
        }
    }

    /// Whether a sample below the upper surface lies on what is below, and not half on both.
    fn is_lower(
        &self,
        sight: &Sight<'_>,
        pair: &Pair,
        x_mm: f64,
        sample: &range_image::Sample,
    ) -> bool {
        let lower = if self.inner_is_upper {
            pair.outer
        } else {
            pair.inner
        };
        match height(sight, lower, x_mm, sample.y_mm) {
            Some((z_mm, slack_mm)) => {
                sample.z_mm <= z_mm + DEVIATIONS * sight.field.noise_mm + slack_mm
            }
            None => true,
        }
    }

    fn witness(
        &self,
        sight: &Sight<'_>,
        x_mm: f64,
        y_mm: f64,
        on_upper: bool,
        doubt: f64,
    ) -> Witness {
        let point = nalgebra::Vector3::new(x_mm, y_mm, self.upper_mm);
        let [u, v, _] = sight.frame.local(point);
        Witness {
            place: [u, v],
            inside: on_upper == self.inner_is_upper,
            doubt,
            slack_mm: 0.0,
        }
    }
}

/// Height of the surface at a node, carried on to a place beside it, and how far it may be off.
fn height(sight: &Sight<'_>, node: usize, x_mm: f64, y_mm: f64) -> Option<(f64, f64)> {
    let region = sight.regions.labels[node];
    let image: &RangeImage = &sight.field.image;
    let at = |plane: &Plane| (plane.z_mm(x_mm, y_mm), 0.0);
    if let Some(surface) = sight.regions.surface(region) {
        if surface.is_plane {
            return Some(at(&surface.plane));
        }
        let z_mm = sight.regions.height_mm(image, node)?;
        let slack = libm::tan(surface.slope_rad.min(1.4)) * image.pitch_mm() * REACH as f64;
        return Some((z_mm, slack));
    }
    match &sight.regions.regions[usize::from(region)] {
        crate::regions::Region::Outside(Some(plane)) => Some(at(plane)),
        _ => None,
    }
}
