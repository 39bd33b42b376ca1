//! Chamfers, rounds, fillets and countersinks: the slanting strips along the edges of features.

mod owner;
mod places;
mod rim;
mod section;
mod settle;

use std::collections::BTreeMap;

use range_image::{Cancelled, Monitor};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::candidate::{Candidate, Lie};
use crate::levels::Strip;
use crate::outline::Shape;
use crate::sight::Sight;
use owner::owner;
use rim::Rim;
use section::Section;
use settle::{Edge, Form, Settled};

/// What a strip is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A slanting edge that falls away from a face.
    Chamfer,
    /// A rounded one.
    Round,
    /// A rounded foot, that rises from a floor to a wall.
    Fillet,
    /// The cone around a hole.
    Countersink,
}

impl Kind {
    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Chamfer => "chamfer",
            Self::Round => "round",
            Self::Fillet => "fillet",
            Self::Countersink => "countersink",
        }
    }
}

/// A treated edge of a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Treatment {
    /// What it is.
    pub kind: Kind,
    /// Index of the candidate whose edge it is.
    pub of: usize,
    /// Width in the plan, of what slants, or radius, of what is round, millimetres.
    pub size_mm: f64,
    /// Its standard uncertainty.
    pub sigma_mm: f64,
    /// How far it reaches down from the face or up from the floor, millimetres.
    pub rise_mm: f64,
    /// Height of the face or floor that it runs out in, above the plan, millimetres.
    pub level_mm: f64,
    /// Share of its samples that it explains.
    pub score: f64,
}

/// Where a section is told, samples lie within so many standard deviations of it.
const EXPLAINED: f64 = 3.0;
/// Standard uncertainty of widths and of walls that no number of samples falls below, shares of the
/// pitch: neither spots nor edges are as exactly what they are taken for.
const LEAST_SIGMA: f64 = 0.05;
/// A section of which no strip was seen is one where its logarithm of likelihood is greater by so
/// much than without any, it explains so much of what is there, and it is so many pitches wide.
const LEAST_GAIN: f64 = 40.0;
const LEAST_SCORE: f64 = 0.7;
const LEAST_PITCHES: f64 = 3.0;

/// The treatments of rims and feet of candidates, one at most for each. What is steep of a section
/// is hardly seen: the outlines of candidates are moved to where the sections say that walls are.
///
/// # Errors
/// Cancelled.
pub fn treatments(
    sight: &Sight<'_>,
    found: &mut [Candidate],
    monitor: &dyn Monitor,
) -> Result<Vec<Treatment>, Cancelled> {
    let mut groups: BTreeMap<(usize, bool), Vec<Strip>> = BTreeMap::new();
    for strip in &sight.levels.strips {
        if let Some(of) = owner(sight, found, strip) {
            groups.entry((of, strip.falls)).or_default().push(*strip);
        }
    }
    monitor.check()?;
    // Each edge by itself: none depends on how another turned out.
    let as_found: &[Candidate] = found;
    let settled: Vec<(usize, bool, Found)> = (0..2 * as_found.len())
        .into_par_iter()
        .filter_map(|edge| {
            let (of, falls) = (edge / 2, edge % 2 == 1);
            let strips = groups.get(&(of, falls)).map_or(&[][..], Vec::as_slice);
            Some((of, falls, Found::of(sight, as_found, of, falls, strips)?))
        })
        .collect();
    monitor.check()?;
    let mut treated = Vec::new();
    for (of, falls, own) in settled {
        treated.push(own.treatment);
        if falls {
            let least_mm = LEAST_SIGMA * sight.field.pitch_mm();
            moved(&mut found[of], &own.settled, least_mm);
        }
    }
    Ok(treated)
}

/// A treated edge, and its section.
struct Found {
    treatment: Treatment,
    settled: Settled,
}

impl Found {
    fn of(
        sight: &Sight<'_>,
        found: &[Candidate],
        of: usize,
        falls: bool,
        strips: &[Strip],
    ) -> Option<Self> {
        // What has no wall has neither an edge nor a foot of one.
        if found[of].bowed.is_some() {
            return None;
        }
        let of_strips = Rim::of_strips(sight, found, of, strips);
        // The cone that a drill leaves slants like a countersink; of one around such a hole there is a
        // strip.
        let may_hide = !(falls && found[of].tip.is_some());
        let hinted = || {
            may_hide
                .then(|| Rim::hinted(sight, found, of, falls, !strips.is_empty()))
                .flatten()
        };
        let rim = of_strips.or_else(hinted)?;
        let edge = rim.edge(sight, found)?;
        let settled = settled(&edge, falls, of_strips.is_some(), sight.field.pitch_mm())?;
        Some(Self {
            treatment: treatment(sight, &found[of], &rim, &edge, &settled),
            settled,
        })
    }
}

/// The section of an edge; of one without a strip only where there must be one.
fn settled(edge: &Edge, falls: bool, is_strip: bool, pitch_mm: f64) -> Option<Settled> {
    let arc = edge.settled(Form::Arc);
    let slant = falls.then(|| edge.settled(Form::Slant)).flatten();
    let samples = edge.places.len();
    let best = [slant, arc]
        .into_iter()
        .flatten()
        .max_by(|a, b| a.evidence(samples).total_cmp(&b.evidence(samples)))?;
    let is_needed = || {
        let plain = edge.settled(Form::Plain);
        plain.is_none_or(|plain| best.evidence(samples) > plain.evidence(samples) + LEAST_GAIN)
            && explained(edge, &best) >= LEAST_SCORE
            && best.section.width_mm() >= LEAST_PITCHES * pitch_mm
    };
    (is_strip || is_needed()).then_some(best)
}

fn treatment(
    sight: &Sight<'_>,
    candidate: &Candidate,
    rim: &Rim,
    edge: &Edge,
    settled: &Settled,
) -> Treatment {
    let is_hole = matches!(settled.outline, Shape::Circle(_)) && candidate.lie == Lie::Hollow;
    let kind = match (rim.face.falls, settled.section) {
        (false, _) => Kind::Fillet,
        (true, Section::Arc(_)) => Kind::Round,
        (true, Section::Slant(..)) if is_hole => Kind::Countersink,
        (true, Section::Slant(..)) => Kind::Chamfer,
    };
    let middle = settled.outline.middle_mm();
    let at = sight.frame.world([middle[0], middle[1], 0.0]);
    let [own, _] = settled.sigmas_mm;
    let least = LEAST_SIGMA * sight.field.pitch_mm();
    Treatment {
        kind,
        of: rim.of,
        size_mm: settled.section.width_mm(),
        sigma_mm: (own * own + least * least).sqrt(),
        rise_mm: settled.section.rise_mm(),
        level_mm: (rim.face.plane.z_mm(at.x, at.y) - at.z) * sight.frame.axes[2].z,
        score: explained(edge, settled),
    }
}

/// Moves the outline of a candidate to where the section below its face begins.
fn moved(candidate: &mut Candidate, settled: &Settled, least_mm: f64) {
    candidate.outline.shape = settled.outline;
    let free = match settled.outline {
        Shape::Circle(_) => 0..3,
        Shape::Rectangle(_) => 1..5,
    };
    for (a, row) in candidate.outline.covariance.iter_mut().enumerate() {
        for (b, own) in row.iter_mut().enumerate() {
            let value = settled.covariance[a][b];
            if value != 0.0 {
                *own = value;
            }
            if a == b && free.contains(&a) {
                *own += least_mm * least_mm;
            }
        }
    }
}

/// Share of the samples between wall and face that lie on the section.
fn explained(edge: &Edge, settled: &Settled) -> f64 {
    let sign = if edge.is_inside { -1.0 } else { 1.0 };
    let (mut on, mut all) = (0_usize, 0_usize);
    for place in edge.places.iter().filter(|own| own.height_mm.is_finite()) {
        let height = place.height_mm;
        let distance = sign * settled.outline.distance_mm(place.at);
        if (0.0..settled.section.width_mm()).contains(&distance) {
            let (expected, slope) = settled.section.at(distance);
            let sigma = edge.strays.noise_mm + slope * edge.strays.blur_mm;
            all += 1;
            on += usize::from((height - expected).abs() <= EXPLAINED * sigma);
        }
    }
    on as f64 / all.max(1) as f64
}
