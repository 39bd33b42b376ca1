//! How far the trim loops of a simulated scan lie from the true outlines, without wire or
//! service: the columns are those that the service would get, bit for bit but for rounding.

use anyhow::{Context, Result, anyhow, bail};
use pipeline::Settings;
use range_image::{Column, Unmonitored};
use reconstruct::model::{Face, Loop, Model};
use scan_files::recommended_pitch_mm;
use sim_scanner::config::SimConfig;
use sim_scanner::scanner::Scanner;
use sim_scanner::source::Source;
use sim_scanner::truth;

use crate::columns::received;

/// Points on outlines are at most this far apart, millimetres.
const SPACING_MM: f64 = 0.05;

/// A face's outer loop against the true outline in the image plane.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceOutline {
    /// Number of the face among those of the simulated solid, from 1.
    pub face: usize,
    /// Greatest distance of the loop from the true outline, pitches.
    pub outward_pitches: f64,
    /// Greatest distance of the true outline from the loop, pitches.
    pub inward_pitches: f64,
    /// Where the greater of the two is, millimetres.
    pub worst_mm: [f64; 2],
    /// Vertices of the loop.
    pub vertices: usize,
    /// Corners of the true outline.
    pub corners: usize,
}

impl FaceOutline {
    /// The greater of the two distances, pitches.
    #[must_use]
    pub fn worst_pitches(&self) -> f64 {
        self.outward_pitches.max(self.inward_pitches)
    }
}

/// All outlines of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlines {
    /// Pitch of the grid, millimetres.
    pub pitch_mm: f64,
    /// One entry for each true face.
    pub faces: Vec<FaceOutline>,
    /// Borders drawn with less smoothing than the others.
    pub unsmoothed_borders: usize,
}

impl Outlines {
    /// The greatest distance of all, pitches.
    #[must_use]
    pub fn worst_pitches(&self) -> f64 {
        let worst = self.faces.iter().map(FaceOutline::worst_pitches);
        worst.fold(0.0, f64::max)
    }
}

/// Scans, reconstructs with the default settings, and compares.
///
/// # Errors
/// When the object has no closed form, a stage fails, or the number of faces is wrong.
pub fn measure(config: &SimConfig) -> Result<Outlines> {
    let source = config.source()?;
    let Source::Simulated { scanner, .. } = &source else {
        bail!("a recording has no true outline");
    };
    let (columns, pitch_mm) = scan(&source, scanner)?;
    let mut settings = Settings::new(pitch_mm);
    settings.regrid.seed = config.seed;
    let (_, outcome) = pipeline::process_columns(&columns, &settings, &Unmonitored)?;
    let result = &outcome.reconstruction;
    Ok(Outlines {
        pitch_mm,
        faces: compare(&result.model, &truth::faces(scanner)?, pitch_mm)?,
        unsmoothed_borders: result.unsmoothed_borders,
    })
}

/// The columns of the scan that the scanner proposes, and the pitch of their grid.
///
/// # Errors
/// When the scanner refuses its own proposal.
pub fn scan(source: &Source, scanner: &Scanner) -> Result<(Vec<Column>, f64)> {
    let plan = source.proposed();
    let accepted = source
        .accept(&plan)
        .map_err(|(reason, _)| anyhow!("the proposed scan is refused: {reason:?}"))?;
    let columns = (0..accepted.columns)
        .map(|index| received(scanner, &source.column(&plan, accepted, 0, index)));
    let counts = f64::from(plan.pitch_counts.unsigned_abs());
    let pitch_mm = recommended_pitch_mm(
        counts * scanner.mechanics.count_mm(),
        f64::from(accepted.spacing_um) * 1e-3,
    );
    Ok((columns.collect(), pitch_mm))
}

fn compare(
    model: &Model,
    truths: &[truth::VisibleFace],
    pitch_mm: f64,
) -> Result<Vec<FaceOutline>> {
    if model.faces.len() != truths.len() {
        bail!("{} faces instead of {}", model.faces.len(), truths.len());
    }
    let mut left: Vec<Vec<[f64; 2]>> = model.faces.iter().map(|f| outer(model, f)).collect();
    let mut sizes: Vec<usize> = model.faces.iter().map(|f| f.outer.coedges.len()).collect();
    truths
        .iter()
        .map(|truth| {
            let outline: Vec<[f64; 2]> = truth.outline_mm.iter().map(|p| [p.x, p.y]).collect();
            let to_middle = |polygon: &[[f64; 2]]| apart(middle(polygon), middle(&outline));
            let nearest = (0..left.len())
                .min_by(|&a, &b| to_middle(&left[a]).total_cmp(&to_middle(&left[b])))
                .context("no face is left")?;
            let (drawn, vertices) = (left.swap_remove(nearest), sizes.swap_remove(nearest));
            let (outward, from) = farthest(&drawn, &outline);
            let (inward, to) = farthest(&outline, &drawn);
            Ok(FaceOutline {
                face: truth.id.face + 1,
                outward_pitches: outward / pitch_mm,
                inward_pitches: inward / pitch_mm,
                worst_mm: if outward > inward { from } else { to },
                vertices,
                corners: truth.corners_mm.len(),
            })
        })
        .collect()
}

/// The outer loop of a face as a closed polygon.
fn outer(model: &Model, face: &Face) -> Vec<[f64; 2]> {
    polygon(model, &face.outer)
}

/// A loop as a closed polygon, millimetres.
#[must_use]
pub fn polygon(model: &Model, around: &Loop) -> Vec<[f64; 2]> {
    let mut polygon = Vec::new();
    for coedge in &around.coedges {
        let path = &model.edges[coedge.edge.0].path;
        // Pieces may differ in length; [`farthest`] fills in on straight stretches.
        let steps = path.arc_length() / SPACING_MM / path.pieces.len() as f64;
        let mut points = path.sampled(steps.ceil().max(8.0) as usize);
        if coedge.reversed {
            points.reverse();
        }
        polygon.extend(points);
    }
    polygon
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn middle(polygon: &[[f64; 2]]) -> [f64; 2] {
    let count = polygon.len() as f64;
    [0, 1].map(|d| polygon.iter().map(|p| p[d]).sum::<f64>() / count)
}

/// Sides that are looked at together, or not at all where all of them are too far away.
const BUNDLE: usize = 32;

/// Neighbouring sides of a polygon, a point of them, and how far they reach from it.
#[derive(Debug, Clone)]
struct Bundle {
    sides: Vec<Side>,
    point: [f64; 2],
    reach: f64,
}

type Side = ([f64; 2], [f64; 2]);

/// A closed polygon that distances are asked of.
#[derive(Debug, Clone)]
pub struct Polygon {
    bundles: Vec<Bundle>,
}

impl Polygon {
    /// Through these points and back to the first.
    #[must_use]
    pub fn new(points: &[[f64; 2]]) -> Self {
        let bundle = |sides: &[Side]| Bundle {
            point: sides[0].0,
            reach: sides
                .iter()
                .map(|side| apart(side.1, sides[0].0))
                .fold(0.0, f64::max),
            sides: sides.to_vec(),
        };
        Self {
            bundles: sides(points).chunks(BUNDLE).map(bundle).collect(),
        }
    }

    /// Distance of a point from the nearest side.
    #[must_use]
    pub fn distance(&self, p: [f64; 2]) -> f64 {
        self.nearest(p).0
    }

    /// The same, positive on the left of that side: inside, where the polygon runs
    /// counter-clockwise. Uncertain where two sides are equally near.
    #[must_use]
    pub fn signed_distance(&self, p: [f64; 2]) -> f64 {
        let (distance, (a, b)) = self.nearest(p);
        let left = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        distance.copysign(left)
    }

    fn nearest(&self, p: [f64; 2]) -> (f64, Side) {
        let mut nearest = (f64::INFINITY, (p, p));
        for bundle in &self.bundles {
            if apart(p, bundle.point) - bundle.reach < nearest.0 {
                for &(c, d) in &bundle.sides {
                    let off = to_side(p, c, d);
                    if off < nearest.0 {
                        nearest = (off, (c, d));
                    }
                }
            }
        }
        nearest
    }
}

fn sides(polygon: &[[f64; 2]]) -> Vec<Side> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().copied().zip(next.copied()).collect()
}

/// Points of the side from `a` to `b`, `a` included and `b` not, at most [`SPACING_MM`] apart.
pub fn along(a: [f64; 2], b: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let steps = (apart(a, b) / SPACING_MM).ceil().max(1.0) as usize;
    (0..steps).map(move |k| {
        let t = k as f64 / steps as f64;
        [0, 1].map(|d| a[d] + t * (b[d] - a[d]))
    })
}

/// Greatest distance of one closed polygon from another, and where it is.
fn farthest(these: &[[f64; 2]], those: &[[f64; 2]]) -> (f64, [f64; 2]) {
    let those = Polygon::new(those);
    let mut worst = (0.0, [0.0; 2]);
    for (a, b) in sides(these) {
        for p in along(a, b) {
            let off = those.distance(p);
            if off > worst.0 {
                worst = (off, p);
            }
        }
    }
    worst
}

fn to_side(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length2 = along[0] * along[0] + along[1] * along[1];
    let t = if length2 > 0.0 {
        (((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    apart(p, [a[0] + t * along[0], a[1] + t * along[1]])
}
