//! The planar map: vertices, edges and loops, none of which cross.

use std::collections::BTreeSet;

use nurbs::PiecewiseCubic;
use range_image::{Cancelled, Monitor};

use super::beside::Memory;
use super::cracks::{Chain, CrackMap, Use};
use super::crossing::{Strand, conflicts};
use super::deflect::Drawn;
use super::junctions::{Course, place_junctions};
use super::path;
use super::pins::part;
use super::segments::{Price, Samples, Segment, sharpest};
use super::settle::{Outlines, settle};
use super::smooth::smooth;
use crate::polygon::{distance_to_segment, minus, norm, signed_area};

/// How borders are drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BorderSettings {
    /// Follow the traced border by cubics through thirds, without smoothing.
    pub(crate) literal: bool,
    /// Cosine of the least turn that makes a vertex.
    pub(crate) corner_cosine: f64,
    /// Price of a straight piece in square pitches; a curved one costs more.
    pub(crate) piece_price: f64,
    /// How far a cubic may leave its border before it is divided, pitches (literal only).
    pub(crate) bound: f64,
}

/// An edge of the planar map; lengths in pitches.
#[derive(Debug, Clone)]
pub(crate) struct MapEdge {
    pub(crate) start: usize,
    pub(crate) end: usize,
    /// Piece on the left and on the right; 0 for nothing.
    pub(crate) sides: [u32; 2],
    pub(crate) path: PiecewiseCubic<2>,
    /// Samples have told where it runs.
    pub(crate) is_settled: bool,
    /// It runs in the middle between nodes, as was asked, and stays there.
    pub(crate) is_kept: bool,
}

/// Vertices, edges, and the loops of each piece, outer first; lengths in pitches.
#[derive(Debug, Clone, Default)]
pub(crate) struct PlanarMap {
    pub(crate) vertices: Vec<[f64; 2]>,
    pub(crate) edges: Vec<MapEdge>,
    pub(crate) loops: Vec<Vec<Vec<Use>>>,
    /// Borders drawn with less smoothing because they would have crossed otherwise.
    pub(crate) unsmoothed: usize,
    /// Borders in all.
    pub(crate) borders: usize,
}

/// How closely a border is followed: each level is tried when the one before fails.
const SMOOTH: usize = 0;
const TRACED: usize = 3;

/// The last level at which curved stretches are splines.
const SMOOTHED: usize = 1;

/// Price of a span of a spline, square pitches, and where the samples lie on the border.
const SPAN_PRICE: f64 = 6.0;
const PLACED_SPAN_PRICE: f64 = 0.3;

/// Factor of the price of pieces at each level before [`TRACED`].
const PRICES: [f64; TRACED] = [1.0, 0.2, 0.05];

/// Price of a curved piece against that of a straight one: dear enough that the three
/// sides of a small notch stay sides, cheap enough that a small hole stays round.
const CUBIC_PRICE: f64 = 16.0 / 7.0;

/// Samples of a traced border nearer to its vertices than this do not count, pitches.
const VERTEX_CLEARANCE: f64 = 1.0;

/// A piece at the end of a border of at most this many steps, next to one at least
/// [`BEVEL_RATIO`] times as long, cuts off the tip that the samples have missed.
const BEVEL_STEPS: usize = 5;
const BEVEL_RATIO: usize = 3;

/// Factor of the price of pieces for borders whose samples lie on them: there is no
/// staircase to see past.
const PLACED_PRICE: f64 = 0.01;

/// Farthest the filtered border may lie from the drawn one, pitches. Filtering cuts a
/// right angle by less; single nodes that stick out do not count.
const FARTHEST: f64 = 1.25;
/// The same where samples have told where the drawn one runs: they see more than the nodes do,
/// which may all have strayed in the same place.
const FARTHEST_TOLD: f64 = 2.0;

/// A border with the samples and division its present level asks for.
struct Border<'a> {
    chain: &'a Chain,
    samples: Samples,
    segments: Vec<Segment>,
    level: usize,
    /// Samples are not asked where it runs: it got into another's way where they said.
    as_drawn: bool,
    /// It was asked for as it was traced.
    is_kept: bool,
}

/// Builds the map. `placed[k]`, where given, are better samples of chain `k` than the
/// middles of its cracks.
pub(crate) fn build(
    cracks: &CrackMap,
    placed: &[Option<Vec<[f64; 2]>>],
    outlines: &Outlines,
    settings: &BorderSettings,
    monitor: &dyn Monitor,
) -> Result<PlanarMap, Cancelled> {
    let mut borders: Vec<Border<'_>> = cracks
        .chains
        .iter()
        .enumerate()
        .map(|(k, chain)| {
            let placed = placed.get(k).and_then(Option::as_ref);
            let mut points = placed.unwrap_or(&chain.middles).clone();
            if chain.ends.is_none() {
                let start = sharpest(&points);
                points.rotate_left(start);
                points.push(points[0]);
            }
            let wanted = outlines.levels.get(k).copied().unwrap_or(SMOOTH);
            let mut border = Border {
                chain,
                samples: match placed {
                    Some(_) => Samples::placed(points),
                    None => Samples::new(points),
                },
                segments: Vec::new(),
                level: wanted.min(TRACED),
                as_drawn: false,
                is_kept: wanted >= TRACED,
            };
            border.divide(settings);
            border
        })
        .collect();
    let mut memory = Memory::default();
    loop {
        monitor.check()?;
        let courses: Vec<Course<'_>> = borders.iter().map(Border::course).collect();
        let mut junctions = place_junctions(cracks, &courses);
        let mut drawn: Vec<Option<Vec<PiecewiseCubic<2>>>> = borders
            .iter()
            .map(|b| b.draw(&junctions, settings))
            .collect();
        let mut settled = Vec::new();
        if !settings.literal {
            let mut drawn: Vec<Drawn<'_>> = borders
                .iter()
                .zip(&mut drawn)
                .enumerate()
                .map(|(k, (border, paths))| Drawn {
                    chain: border.chain,
                    paths: paths.as_mut().filter(|_| border.level < TRACED),
                    as_drawn: border.as_drawn,
                    is_step: outlines.steps.get(k) == Some(&true),
                })
                .collect();
            settled = settle(&mut drawn, &mut junctions, outlines, &mut memory, monitor)?;
            part(&mut drawn, &mut junctions, &settled);
        }
        let is_told = |k: usize| settled.get(k).is_some_and(|paths| paths.contains(&true));
        let bad = faults(cracks, &borders, &drawn, &junctions, &is_told);
        // Those that samples have led astray go back first: the others may hold beside them.
        let astray = |k: &usize| !borders[*k].as_drawn && is_told(*k);
        let astray: Vec<usize> = bad.iter().copied().filter(astray).collect();
        let mut raised = !astray.is_empty();
        for &k in &astray {
            borders[k].as_drawn = true;
        }
        for k in bad {
            if astray.is_empty() && borders[k].level < TRACED {
                borders[k].level = if settings.literal {
                    TRACED
                } else {
                    borders[k].level + 1
                };
                borders[k].divide(settings);
                raised = true;
            }
        }
        if !raised {
            return Ok(assemble(cracks, &borders, drawn, junctions, &settled));
        }
    }
}

impl Border<'_> {
    fn course(&self) -> Course<'_> {
        Course {
            chain: self.chain,
            samples: &self.samples,
            segments: &self.segments,
            traced: self.level == TRACED,
        }
    }

    fn divide(&mut self, settings: &BorderSettings) {
        let Some(share) = PRICES.get(self.level) else {
            return;
        };
        let factor = settings.piece_price
            * share
            * if self.samples.placed {
                PLACED_PRICE
            } else {
                1.0
            };
        let price = Price {
            line: factor,
            cubic: factor * CUBIC_PRICE,
        };
        self.segments = self.samples.divide(price);
        if self.chain.ends.is_some() && !settings.literal && self.level <= SMOOTHED {
            let segments = core::mem::take(&mut self.segments);
            let span = share
                * if self.samples.placed {
                    PLACED_SPAN_PRICE
                } else {
                    SPAN_PRICE
                };
            self.segments = smooth(&self.samples, segments, settings.corner_cosine, span);
        }
        if self.chain.ends.is_some() && !settings.literal {
            drop_bevels(&mut self.segments);
        }
    }

    /// Paths between vertices; `None` when one has no length.
    fn draw(
        &self,
        junctions: &[[f64; 2]],
        settings: &BorderSettings,
    ) -> Option<Vec<PiecewiseCubic<2>>> {
        let ends = self.chain.ends.map(|(a, b)| (junctions[a], junctions[b]));
        let points = &self.samples.points;
        if self.level == TRACED || points.len() < 2 {
            // Nothing but the middles of the cracks is sure to cross no other border.
            let middles = &self.chain.middles;
            let (start, end) = match ends {
                Some((start, end)) => (Some(start), Some(end)),
                None => (None, middles.first().copied()),
            };
            let whole: Vec<_> = start
                .into_iter()
                .chain(middles.iter().copied())
                .chain(end)
                .collect();
            return Some(vec![path::polyline(&whole)?]);
        }
        let stretches = path::draw(&self.samples, &self.segments, ends, settings.corner_cosine)?;
        if !settings.literal {
            return Some(stretches);
        }
        // Between the same vertices, the traced border itself.
        let mut cuts = vec![0];
        for stretch in &stretches[..stretches.len() - 1] {
            let corner = stretch.end();
            let after = cuts[cuts.len() - 1] + 1;
            let near = |k: &usize| norm(minus(points[*k], corner));
            let best = (after..points.len() - 1).min_by(|a, b| near(a).total_cmp(&near(b)));
            cuts.push(best?);
        }
        cuts.push(points.len() - 1);
        let mut paths = Vec::new();
        for (cut, stretch) in cuts.windows(2).zip(&stretches) {
            // Samples next to a vertex cut its corner off, or lie beyond it.
            let (start, end) = (stretch.start(), stretch.end());
            let clear = |p: &&[f64; 2]| {
                norm(minus(**p, start)) > VERTEX_CLEARANCE
                    && norm(minus(**p, end)) > VERTEX_CLEARANCE
            };
            let mut run = vec![start];
            run.extend(points[cut[0]..=cut[1]].iter().filter(clear));
            run.push(end);
            paths.push(path::through_thirds(&run, settings.bound)?);
        }
        Some(paths)
    }
}

/// Lets the long pieces at a border's ends run on to its junctions.
fn drop_bevels(segments: &mut Vec<Segment>) {
    let steps = |s: &Segment| s.last - s.first;
    let is_bevel = |end: &Segment, next: &Segment| {
        steps(end) <= BEVEL_STEPS && steps(next) >= BEVEL_RATIO * steps(end)
    };
    if let [end, next, ..] = segments[..]
        && is_bevel(&end, &next)
    {
        segments[1].first = end.first;
        segments.remove(0);
    }
    if let [.., next, end] = segments[..]
        && is_bevel(&end, &next)
    {
        segments.pop();
        if let Some(last) = segments.last_mut() {
            last.last = end.last;
        }
    }
}

/// Ends of a border's stretches, in order: one more than there are stretches.
fn stops(
    border: &Border<'_>,
    stretches: &[PiecewiseCubic<2>],
    junctions: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let mut stops: Vec<[f64; 2]> = stretches.iter().map(PiecewiseCubic::start).collect();
    match border.chain.ends {
        Some((a, b)) => {
            stops[0] = junctions[a];
            stops.push(junctions[b]);
        }
        None => stops.push(stops[0]),
    }
    stops
}

/// Borders that may not stay as they are drawn.
fn faults(
    cracks: &CrackMap,
    borders: &[Border<'_>],
    drawn: &[Option<Vec<PiecewiseCubic<2>>>],
    junctions: &[[f64; 2]],
    is_told: &dyn Fn(usize) -> bool,
) -> BTreeSet<usize> {
    let mut bad = BTreeSet::new();
    let mut strands = Vec::new();
    let mut outlines: Vec<Vec<[f64; 2]>> = Vec::with_capacity(borders.len());
    for (k, (border, stretches)) in borders.iter().zip(drawn).enumerate() {
        let Some(stretches) = stretches else {
            bad.insert(k);
            outlines.push(border.samples.points.clone());
            continue;
        };
        let stops = stops(border, stretches, junctions);
        let mut outline = Vec::new();
        for (n, path) in stretches.iter().enumerate() {
            let strand = Strand::new(k, path, stops[n], stops[n + 1]);
            outline.extend_from_slice(&strand.points);
            strands.push(strand);
        }
        let tips: Vec<Tip> = border
            .chain
            .ends
            .iter()
            .flat_map(|&(a, b)| [a, b])
            .map(|j| Tip {
                place: junctions[j],
                moved: norm(minus(junctions[j], cracks.junctions[j])),
            })
            .collect();
        let farthest = if is_told(k) { FARTHEST_TOLD } else { FARTHEST };
        if border.level < TRACED && strays(&border.samples, &outline, &tips, farthest) {
            bad.insert(k);
        }
        outlines.push(outline);
    }
    for (a, b) in conflicts(&strands) {
        // The border that is still the smoother of the two gives way.
        let least = borders[a].level.min(borders[b].level);
        bad.extend([a, b].into_iter().filter(|&k| borders[k].level == least));
    }
    for uses in cracks.loops.iter().flatten() {
        let mut polygon = Vec::new();
        for &(k, reversed) in uses {
            if reversed {
                polygon.extend(outlines[k].iter().rev());
            } else {
                polygon.extend(outlines[k].iter());
            }
        }
        let (traced, smooth) = (cracks.area(uses), signed_area(&polygon));
        if !(smooth / traced > 0.5 && smooth / traced < 2.0) {
            bad.extend(uses.iter().map(|u| u.0));
        }
    }
    bad
}

/// Where a border ends, and how far that is from where its samples end.
struct Tip {
    place: [f64; 2],
    moved: f64,
}

/// True when a drawn border leaves its samples, those aside that end short of a tip or
/// run past it.
fn strays(samples: &Samples, outline: &[[f64; 2]], tips: &[Tip], farthest: f64) -> bool {
    let mut length = vec![0.0];
    for pair in outline.windows(2) {
        length.push(length[length.len() - 1] + norm(minus(pair[1], pair[0])));
    }
    let (drawn, total) = (
        length[length.len() - 1],
        samples.length[samples.length.len() - 1],
    );
    if !drawn.is_finite() {
        return true;
    }
    let total = total.max(1e-9);
    let reach = 6.0 + 0.1 * drawn;
    let is_near = |point: [f64; 2], near: f64| {
        let from = length
            .partition_point(|&l| l < near - reach)
            .saturating_sub(1);
        let to = length.partition_point(|&l| l <= near + reach);
        outline[from..(to + 1).min(outline.len())]
            .windows(2)
            .any(|s| distance_to_segment(point, s[0], s[1]) <= farthest)
    };
    samples
        .smooth
        .iter()
        .zip(&samples.length)
        .any(|(point, at)| {
            let near = at / total * drawn;
            // Without tips the border is closed, and its end is as near to its start.
            let close = is_near(*point, near)
                || (tips.is_empty()
                    && (is_near(*point, near + drawn) || is_near(*point, near - drawn)));
            let at_tip = |t: &Tip| norm(minus(*point, t.place)) <= t.moved + farthest;
            !close && !tips.iter().any(at_tip)
        })
}

fn assemble(
    cracks: &CrackMap,
    borders: &[Border<'_>],
    drawn: Vec<Option<Vec<PiecewiseCubic<2>>>>,
    junctions: Vec<[f64; 2]>,
    settled: &[Vec<bool>],
) -> PlanarMap {
    let mut map = PlanarMap {
        vertices: junctions.clone(),
        borders: borders.len(),
        ..PlanarMap::default()
    };
    let mut edges_of: Vec<core::ops::Range<usize>> = Vec::with_capacity(borders.len());
    for (k, (border, stretches)) in borders.iter().zip(drawn).enumerate() {
        let stretches = stretches.unwrap_or_default();
        let is_settled = |n: usize| settled.get(k).and_then(|of| of.get(n)) == Some(&true);
        let before = map.edges.len();
        if !stretches.is_empty() {
            let stops = stops(border, &stretches, &junctions);
            let mut ids: Vec<usize> = Vec::with_capacity(stops.len());
            for (n, &stop) in stops.iter().enumerate() {
                let last = n + 1 == stops.len();
                ids.push(match border.chain.ends {
                    Some((a, _)) if n == 0 => a,
                    Some((_, b)) if last => b,
                    None if last => ids[0],
                    _ => {
                        map.vertices.push(stop);
                        map.vertices.len() - 1
                    }
                });
            }
            for (n, path) in stretches.into_iter().enumerate() {
                let sides = [border.chain.left, border.chain.right];
                map.edges.push(MapEdge {
                    start: ids[n],
                    end: ids[n + 1],
                    sides,
                    path,
                    is_settled: is_settled(n),
                    is_kept: border.is_kept,
                });
            }
        }
        map.unsmoothed += usize::from(border.level > SMOOTH);
        edges_of.push(before..map.edges.len());
    }
    map.loops = cracks
        .loops
        .iter()
        .map(|loops| {
            let mut outlined: Vec<(bool, Vec<Use>)> = loops
                .iter()
                .map(|uses| (cracks.area(uses) <= 0.0, expanded(uses, &edges_of)))
                .collect();
            outlined.sort_by_key(|l| l.0);
            outlined.into_iter().map(|l| l.1).collect()
        })
        .collect();
    map
}

/// The edges of a loop of chains.
fn expanded(uses: &[Use], edges_of: &[core::ops::Range<usize>]) -> Vec<Use> {
    let mut edges = Vec::new();
    for &(chain, reversed) in uses {
        let range = edges_of[chain].clone();
        if reversed {
            edges.extend(range.rev().map(|e| (e, true)));
        } else {
            edges.extend(range.map(|e| (e, false)));
        }
    }
    edges
}
