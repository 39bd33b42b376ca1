//! Gaps found, decided and closed.

use std::collections::BTreeMap;

use range_image::{Cancelled, Column, Monitor, RangeImage, RegionMap};
use rayon::prelude::*;

use crate::carry::{Given, carried};
use crate::find::{Place, gaps};
use crate::odds::{Evidence, Usual};
use crate::rays::{Depth, Rays, Steps, Tally};
use crate::report::{Cause, Decision, Gap};
use crate::settings::{Mode, Settings};
use crate::shadow::{Sensor, Shadows, Spot};
use crate::sight::Sight;

/// Goes through the columns of a scan, in their order, until one is refused with `false`.
pub type Visit<'a, E> = dyn FnMut(&mut dyn FnMut(&Column) -> bool) -> Result<(), E> + 'a;

/// A range image with gaps closed.
#[derive(Debug, Clone)]
pub struct Closed {
    /// The range image.
    pub image: RangeImage,
    /// Its regions.
    pub regions: RegionMap,
    /// Nodes that were given a value and a region, ascending, as [`RangeImage::raw_z_mm`] has them.
    pub filled: Vec<usize>,
    /// Every gap: what is hidden behind something first, then the others, each by place.
    pub gaps: Vec<Gap>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Closes the gaps of a range image that are no openings; see the [crate].
///
/// `columns` goes through the samples that the image was made of; without it, nodes stand for rays.
///
/// # Errors
/// What `columns` says, or cancelled.
pub fn close<E: From<Cancelled>>(
    sight: &Sight<'_>,
    regions: &RegionMap,
    settings: &Settings,
    columns: Option<&mut Visit<'_, E>>,
    monitor: &dyn Monitor,
) -> Result<Closed, E> {
    let mut work = Work {
        sight,
        settings,
        labels: regions.raw_labels().to_vec(),
        sizes: sizes(regions),
        given: BTreeMap::new(),
        gaps: Vec::new(),
    };
    let first = gaps(sight, &work.labels);
    let keep = work.named(&first, &settings.keep_mm);
    let close = work.named(&first, &settings.close_mm);
    for place in first.iter().filter(|place| keep.names(place)) {
        work.note(place, None, Decision::Kept, Cause::Asked);
    }
    let small: Vec<&Place> = first
        .iter()
        .filter(|place| work.is_small(place) && !keep.names(place) && !close.names(place))
        .collect();
    work.close_hidden(&small, monitor)?;
    let mut rest = gaps(sight, &work.labels);
    rest.retain(|place| !keep.names(place));
    work.close_others(rest, &close, columns, monitor)?;
    let warnings = keep.warnings.into_iter().chain(close.warnings);
    Ok(work.finish(regions, warnings.collect()))
}

/// The gaps that the user named, and what to say where there is none.
struct Named {
    /// A node of each.
    nodes: Vec<usize>,
    warnings: Vec<String>,
}

impl Named {
    fn names(&self, place: &Place) -> bool {
        let mut nodes = self.nodes.iter();
        nodes.any(|node| place.nodes.binary_search(node).is_ok())
    }
}

struct Work<'a> {
    sight: &'a Sight<'a>,
    settings: &'a Settings,
    labels: Vec<u16>,
    /// Nodes of each region as measured, by label.
    sizes: Vec<usize>,
    /// What closed nodes were given.
    given: BTreeMap<usize, Given>,
    gaps: Vec<Gap>,
}

/// Nodes so near to something higher, pitches, are left to its border.
const FOOT: f64 = 1.5;
/// Gaps so narrow between surfaces at a step are the step's, pitches.
const STEP: f64 = 3.0;
/// From this depth on rays are well inside a gap.
const INSIDE: Depth = 2;
/// Fewer rays inside tell nothing alone.
const FEWEST_RAYS: f64 = 6.0;
/// Rings of nodes around a gap whose rays are counted, the border apart: there rays are lost at openings,
/// too.
const RINGS: usize = 5;
/// Rings around what may be hidden in which something seen counts against it.
const SEEN_RINGS: usize = 6;
/// A place names the gap whose nearest node is so near, pitches, or in it.
const NAMED: f64 = 3.0;

/// A gap about to be decided.
struct Case {
    place: Place,
    /// What its nodes are given if it is closed; empty where no surface reaches it.
    given: BTreeMap<usize, Given>,
    /// The regions that reach it, ascending.
    regions: Vec<u16>,
    has_step: bool,
}

impl Work<'_> {
    fn is_small(&self, place: &Place) -> bool {
        place.size() * self.sight.image.pitch_mm() <= self.settings.max_size_mm
    }

    /// The gaps that places name. What is named before stays named, whatever is closed around it: it is
    /// left alone meanwhile.
    fn named(&self, gaps: &[Place], places: &[[f64; 2]]) -> Named {
        let image = self.sight.image;
        let pitch_mm = image.pitch_mm();
        let far = |place: [f64; 2], node: usize| {
            let (column, row) = self.sight.grid().place(node);
            let (x, y) = (image.x_mm(column) - place[0], image.y_mm(row) - place[1]);
            libm::sqrt(x * x + y * y) / pitch_mm
        };
        let mut found = Named {
            nodes: Vec::new(),
            warnings: Vec::new(),
        };
        for place in places {
            let nodes = gaps.iter().flat_map(|gap| &gap.nodes);
            let nearest = nodes
                .map(|node| (far(*place, *node), *node))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
                .filter(|(far, _)| *far <= NAMED);
            match nearest {
                Some((_, node)) => found.nodes.push(node),
                None => found.warnings.push(format!(
                    "there is no hole in the range image near x {}, y {}",
                    place[0], place[1]
                )),
            }
        }
        found
    }

    fn note(
        &mut self,
        place: &Place,
        case: Option<(&Case, Option<Evidence>)>,
        decision: Decision,
        cause: Cause,
    ) {
        let given = case.map(|(case, _)| &case.given);
        let regions = case.map_or_else(
            || place.beside.keys().copied().collect(),
            |(case, _)| case.regions.clone(),
        );
        self.gaps.push(Gap {
            centre_mm: self.sight.centre_mm(&place.nodes, given, place),
            size_mm: place.size() * self.sight.image.pitch_mm(),
            nodes: place.nodes.len(),
            regions,
            decision,
            cause,
            evidence: case.and_then(|(_, evidence)| evidence),
        });
    }

    /// Gives nodes that something higher hides to the surface that it hides.
    fn close_hidden(&mut self, places: &[&Place], monitor: &dyn Monitor) -> Result<(), Cancelled> {
        let sight = self.sight;
        let shadows = Shadows::new(sight, &self.labels);
        let reached: Vec<BTreeMap<u16, BTreeMap<usize, f64>>> = places
            .par_iter()
            .map(|place| carried(sight, &self.labels, place).heights())
            .collect();
        monitor.check()?;
        let sensor = self.sensor(places, &reached, &shadows);
        monitor.check()?;
        for (place, reached) in places.iter().zip(&reached) {
            let mut given = BTreeMap::new();
            for &node in &place.nodes {
                let mut heights: Vec<(f64, u16)> = reached
                    .iter()
                    .filter_map(|(&region, heights)| Some((*heights.get(&node)?, region)))
                    .collect();
                heights.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                let hidden = heights
                    .into_iter()
                    .find(|&(z_mm, _)| shadows.hides(Spot { node, z_mm }, sensor));
                if let Some((z_mm, region)) = hidden {
                    given.insert(node, Given { region, z_mm });
                }
            }
            self.leave_extrapolations(&mut given);
            if given.is_empty() {
                continue;
            }
            let mut regions: Vec<u16> = given.values().map(|own| own.region).collect();
            regions.sort_unstable();
            regions.dedup();
            let nodes: Vec<usize> = given.keys().copied().collect();
            self.gaps.push(Gap {
                centre_mm: sight.centre_mm(&nodes, Some(&given), place),
                size_mm: place.size() * sight.image.pitch_mm(),
                nodes: nodes.len(),
                regions,
                decision: Decision::Closed,
                cause: Cause::Hidden,
                evidence: None,
            });
            self.take(given);
        }
        Ok(())
    }

    /// No surface is carried on to more nodes than there are of it.
    fn leave_extrapolations(&self, given: &mut BTreeMap<usize, Given>) {
        let mut counts: BTreeMap<u16, usize> = BTreeMap::new();
        for own in given.values() {
            *counts.entry(own.region).or_default() += 1;
        }
        given.retain(|_, own| {
            let there = self.sizes.get(usize::from(own.region)).copied();
            counts.get(&own.region).copied() <= there
        });
    }

    fn take(&mut self, given: BTreeMap<usize, Given>) {
        for (node, own) in &given {
            self.labels[*node] = own.region;
        }
        self.given.extend(given);
    }

    /// Where the sensor stands, by what is missing beside steps.
    fn sensor(
        &self,
        places: &[&Place],
        reached: &[BTreeMap<u16, BTreeMap<usize, f64>>],
        shadows: &Shadows<'_>,
    ) -> Option<Sensor> {
        let sight = self.sight;
        let mut missing = Vec::new();
        let mut seen = BTreeMap::new();
        for (place, reached) in places.iter().zip(reached) {
            let mut has_step = false;
            for &node in &place.nodes {
                let heights = reached.values().filter_map(|heights| heights.get(&node));
                let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| {
                    (a.min(*z), b.max(*z))
                });
                if high - low > sight.step_mm {
                    has_step = true;
                    missing.push(Spot { node, z_mm: low });
                }
            }
            if has_step {
                let border = place.beside.values().flatten().copied();
                let around = sight
                    .grid()
                    .rings(border, SEEN_RINGS, |node| self.labels[node] != 0);
                seen.extend(around);
            }
        }
        let seen: Vec<Spot> = seen
            .into_keys()
            .filter_map(|node| {
                let z_mm = sight.point(node)?.z;
                Some(Spot { node, z_mm })
            })
            .collect();
        shadows.sensor(&missing, &seen)
    }

    /// Decides about what nothing hides.
    fn close_others<E: From<Cancelled>>(
        &mut self,
        places: Vec<Place>,
        close: &Named,
        columns: Option<&mut Visit<'_, E>>,
        monitor: &dyn Monitor,
    ) -> Result<(), E> {
        let (small, large): (Vec<Place>, Vec<Place>) = places
            .into_iter()
            .partition(|place| close.names(place) || self.is_small(place));
        let cases: Vec<Case> = small
            .into_par_iter()
            .map(|place| self.case(place, close))
            .collect();
        monitor.check()?;
        let (tallies, usual) = self.counted(&cases, columns, monitor)?;
        for (case, tally) in cases.into_iter().zip(tallies) {
            let evidence = evidence(&case.place, &tally, &usual);
            let (decision, cause) = if case.given.is_empty() {
                let cause = if case.has_step {
                    Cause::Step
                } else {
                    Cause::NoSurface
                };
                (Decision::Kept, cause)
            } else if close.names(&case.place) || self.settings.mode == Mode::All {
                (Decision::Closed, Cause::Asked)
            } else {
                evidence.map_or((Decision::Closed, Cause::NoRay), |own| verdict(&own))
            };
            // Beside every step some nodes belong to neither side.
            if case.given.is_empty() && case.place.beside.len() > 1 && case.place.size() <= STEP {
                continue;
            }
            self.note(&case.place, Some((&case, evidence)), decision, cause);
            if decision == Decision::Closed {
                self.take(case.given);
            }
        }
        for place in large {
            self.note(&place, None, Decision::Kept, Cause::Size);
        }
        Ok(())
    }

    /// What a gap would be given.
    fn case(&self, place: Place, close: &Named) -> Case {
        let all = carried(self.sight, &self.labels, &place);
        let ground = all.ground(self.sight.step_mm);
        let regions = ground.regions().collect();
        let has_step = !ground.higher.is_empty();
        let mut given = if has_step && place.size() <= STEP && !close.names(&place) {
            BTreeMap::new()
        } else {
            ground.given(self.sight, &place)
        };
        let feet: Vec<usize> = ground
            .higher
            .iter()
            .filter_map(|region| place.beside.get(region))
            .flatten()
            .copied()
            .collect();
        let grid = self.sight.grid();
        given.retain(|node, _| feet.iter().all(|foot| grid.distance(*node, *foot) > FOOT));
        self.leave_extrapolations(&mut given);
        Case {
            place,
            given,
            regions,
            has_step,
        }
    }

    /// What the rays tell of each gap, and of the scan.
    fn counted<E: From<Cancelled>>(
        &self,
        cases: &[Case],
        columns: Option<&mut Visit<'_, E>>,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<Tally>, Usual), E> {
        let sight = self.sight;
        let grid = sight.grid();
        let z = self.labels.iter().zip(sight.image.raw_z_mm());
        // Where nothing was measured, nothing is told of how usual it is that rays are lost.
        let mut surface_mm: Vec<f64> = z
            .map(|(label, z)| if *label != 0 { *z } else { f64::NAN })
            .collect();
        let mut tags = vec![None; surface_mm.len()];
        for (index, case) in cases.iter().enumerate() {
            let border = case
                .regions
                .iter()
                .filter_map(|own| case.place.beside.get(own));
            let around = grid.rings(border.flatten().copied(), RINGS, |node| {
                case.regions.contains(&self.labels[node])
            });
            for (node, step) in around {
                if tags[node].is_none() {
                    tags[node] = Some((index as u32, -(step as Depth)));
                }
            }
        }
        for (index, case) in cases.iter().enumerate() {
            for (node, depth) in case.place.nodes.iter().zip(&case.place.depth) {
                if let Some(given) = case.given.get(node) {
                    surface_mm[*node] = given.z_mm;
                    let depth = libm::round(*depth).min(f64::from(Depth::MAX)) as Depth;
                    tags[*node] = Some((index as u32, depth));
                }
            }
        }
        let Some(visit) = columns else {
            return Ok(crate::rays::of_nodes(
                sight,
                &surface_mm,
                &tags,
                cases.len(),
            ));
        };
        let mut steps = Steps::default();
        let mut go_on = Ok(());
        visit(&mut |column| {
            steps.take(sight, column);
            go_on = monitor.check();
            go_on.is_ok()
        })?;
        go_on?;
        let Some(step) = steps.finish() else {
            return Ok(crate::rays::of_nodes(
                sight,
                &surface_mm,
                &tags,
                cases.len(),
            ));
        };
        let mut rays = Rays::new(sight, step, surface_mm, tags, cases.len());
        let mut go_on = Ok(());
        visit(&mut |column| {
            rays.take(column);
            go_on = monitor.check();
            go_on.is_ok()
        })?;
        go_on?;
        Ok(rays.finish())
    }

    fn finish(self, regions: &RegionMap, warnings: Vec<String>) -> Closed {
        let mut image = self.sight.image.clone();
        let rows = image.rows().max(1);
        for (node, own) in &self.given {
            image.set_z_mm(node / rows, node % rows, Some(own.z_mm));
        }
        let regions = if self.given.is_empty() {
            regions.clone()
        } else {
            RegionMap::new(&image, self.labels)
        };
        Closed {
            image,
            regions,
            filled: self.given.into_keys().collect(),
            gaps: self.gaps,
            warnings,
        }
    }
}

/// Nodes by label.
fn sizes(regions: &RegionMap) -> Vec<usize> {
    let mut sizes = vec![0; usize::from(regions.regions()) + 1];
    for label in regions.raw_labels() {
        sizes[usize::from(*label)] += 1;
    }
    sizes
}

/// What rays tell of a gap; `None` where none went there.
fn evidence(place: &Place, tally: &Tally, usual: &Usual) -> Option<Evidence> {
    let mut inside = tally.of(INSIDE..);
    if inside.all() < FEWEST_RAYS {
        inside = tally.of(1..);
    }
    let rings = [tally.of(-1..=-1), tally.of(-2..=-2), tally.of(..=-3)];
    (inside.all() > 0.0).then(|| Evidence::new(inside, &rings, usual, place.size()))
}

fn verdict(evidence: &Evidence) -> (Decision, Cause) {
    if evidence.log_odds_of_chance < 0.0 {
        (Decision::Closed, Cause::Chance)
    } else if evidence.log_odds < 0.0 {
        (Decision::Closed, Cause::Surface)
    } else if evidence.inside.below > evidence.inside.on_surface {
        (Decision::Kept, Cause::Below)
    } else {
        (Decision::Kept, Cause::NoReturn)
    }
}
