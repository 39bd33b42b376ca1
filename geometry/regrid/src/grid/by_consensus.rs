//! A node by consensus: which of the surfaces near it is its own, and whether it reaches there.

use range_image::NodeQuality;

use super::{At, BESIDE, GridWorker, quality};
use crate::consensus::{Around, Conditions, Effort, Side, Surface, WIDTH};
use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::plane::{Fit, Plane};
use crate::settings::SupportSettings;
use crate::support::Place;
use crate::window::Spacing;

/// As few planes are tried as will do, and at most this many times the draws that are set.
const PLANES_PER_DRAW: usize = 16;
/// How many times farther from its surface's samples a node may lie where the line of the
/// edge says on which side it is: half the diagonal of a square of samples.
const SIDE_KNOWN: f64 = 1.18;
/// How many times the radius of support where outliers lie among a surface's samples, and
/// there is a sample wherever one should be: runs of outliers lie in the surface's stead, they
/// do not end it.
const STREWN: f64 = 2.0;
/// Share of samples that are no outliers from which on what lies on no surface tells of another one.
/// Edges cost some, since the differences that tell are those of three samples.
const CLEAN: f64 = 0.95;
/// Least noise believed, in spacings: scans without any are computed ones.
const LEAST_NOISE: f64 = 1e-3;
/// How far strays may widen the radius in which samples support a node.
const THINNER_LIMIT: f64 = 1.6;
/// Distance from the node, in spacings, within which strays are counted.
const STRAY_RADIUS: f64 = 3.0;

impl GridWorker {
    /// z at a node and its quality, or `None` to mask it; its window is in `samples`.
    pub(super) fn by_consensus(
        &mut self,
        at: &At<'_>,
        draws: &mut Draws,
    ) -> Option<(f64, NodeQuality)> {
        let node = at.node;
        let conditions = self.conditions(at);
        let surfaces =
            self.consensus
                .surfaces(&self.samples, &conditions, draws, |wide, windows| {
                    let number = windows * at.neighbours;
                    let wider = self.search.wider(at.window, node.y_mm, number);
                    wide.extend_from_slice(wider);
                });
        self.before = surfaces.first().map(|surface| (node.j, surface.plane));
        let support = &at.settings.support;
        // Between strays the samples that count are thinner than samples are.
        let thinner = thinner(&self.samples, surfaces, at.spacing);
        let widened = SupportSettings {
            radius: support.radius * thinner,
            step_margin: SIDE_KNOWN * support.step_margin * thinner,
            ..*support
        };
        let strewn = SupportSettings {
            radius: STREWN * support.radius,
            step_margin: STREWN * support.radius,
            ..widened
        };
        let around = Around {
            window: at.window,
            surfaces,
            before: None,
            spacing: at.spacing,
            y_mm: node.y_mm,
        };
        surfaces.iter().enumerate().find_map(|(number, surface)| {
            if number > 0 && !surface.spans_columns(&self.samples) {
                return None;
            }
            let fit = Fit {
                plane: surface.plane,
                tolerance: surface.width_mm,
            };
            let agrees = fit.agrees(support.inlier_floor * at.spacing.mean_mm, at.dense);
            // Outliers beyond a silhouette close nothing.
            let closes = |n: &Neighbour| surfaces.iter().any(|other| other.holds(n));
            let mut place = |support: &SupportSettings| {
                let (samples, spacing) = (&self.samples, at.spacing);
                self.surroundings
                    .place(samples, spacing, support, &agrees, closes)
            };
            let (is_among, distance) = match place(&widened) {
                Place::Among => (true, at.outside),
                Place::Beside { distance } => (false, distance.max(at.outside)),
                Place::Alone => return None,
            };
            let mut side = || {
                self.silhouette.side(&around, surface, |wide, windows| {
                    let number = windows * at.neighbours;
                    let wider = self.search.wider(at.window, node.y_mm, number);
                    wide.extend_from_slice(wider);
                })
            };
            let is_near = distance <= support.margin;
            let is_supported = (is_among && is_near)
                || match side() {
                    Side::Inside => distance <= BESIDE,
                    Side::Outside => false,
                    Side::Unknown => is_near,
                    Side::Clear => {
                        let is_first_inside = number == 0 && at.outside == 0.0;
                        is_near || is_first_inside && place(&strewn) == Place::Among
                    }
                };
            let quality = || quality(&self.samples, &fit.plane, |n| surface.holds(n));
            is_supported.then(|| (fit.plane.c + surface.lift_mm, quality()))
        })
    }

    /// Under what the surfaces at a node are looked for.
    fn conditions(&self, at: &At<'_>) -> Conditions {
        let noise = at.node.noise;
        // Samples that support a node may be as far off. Where the columns seem noisier,
        // as when no three samples in a row are free of outliers, the node itself tells;
        // but depths in coarse steps are as far off everywhere.
        let rounding_mm = noise.map_or(0.0, |noise| noise.rounding_mm);
        let floor_mm = at.settings.support.inlier_floor * at.spacing.mean_mm;
        let allowed_mm = (floor_mm / WIDTH).max(rounding_mm);
        let noise_mm = noise.map_or(allowed_mm, |noise| noise.deviation_mm);
        let least_mm = LEAST_NOISE * at.spacing.mean_mm;
        // The plane of the node before, as seen from here.
        let before = self.before.filter(|before| before.0 + 1 == at.node.j);
        let guess = before.map(|(_, plane)| Plane {
            c: plane.c + plane.b * at.settings.pitch_mm,
            ..plane
        });
        Conditions {
            noise_mm: noise_mm.min(allowed_mm).max(least_mm),
            most_noise_mm: allowed_mm.max(4.0 * noise_mm),
            // A window that is not full may be of lone ones.
            strays: !at.dense || noise.is_none_or(|noise| noise.clean_share < 1.0),
            clean: noise.is_some_and(|noise| noise.ordinary_share >= CLEAN),
            spacing: at.spacing,
            effort: Effort {
                most_planes: PLANES_PER_DRAW * at.settings.draws,
                neighbours: at.settings.neighbours,
                guess,
            },
        }
    }
}

/// How many times farther apart the samples on surfaces are than all samples near the node.
fn thinner(window: &[Neighbour], surfaces: &[Surface], spacing: Spacing) -> f64 {
    let radius_mm = STRAY_RADIUS * spacing.mean_mm;
    let near = window
        .iter()
        .take_while(|n| n.distance2 <= radius_mm * radius_mm);
    let (mut all, mut held) = (0_u32, 0_u32);
    for n in near {
        all += 1;
        held += u32::from(surfaces.iter().any(|surface| surface.holds(n)));
    }
    let share = f64::from(all) / f64::from(held.max(1));
    share.sqrt().min(THINNER_LIMIT)
}
