//! From the columns of a scan to the tree of features of the part.

use range_image::{Cancelled, Column, Monitor, RangeImage};
use segment::SegmentError;

use crate::arrangement::{Pattern, patterns};
use crate::candidate::{Candidate, Lie, Top, candidates, frame_of, top};
use crate::chance::Chance;
use crate::class::Class;
use crate::code::{Attributes, Form, Sense, code, written};
use crate::feature::{Bottom, Dimension, Feature};
use crate::field::{FieldError, field};
use crate::floor::{curve, free_form};
use crate::frame::Frame;
use crate::levels::{AROUND, Levels, levels};
use crate::measure::measured;
use crate::network::Classifier;
use crate::outline::Shape;
use crate::regions::{OUTSIDE, Region, least_step_mm, regions};
use crate::section::section;
use crate::sight::Sight;
use crate::treatment::{Kind, Treatment, treatments};

/// Class of what the network has no answer for.
pub const UNKNOWN: &str = "unknown";

/// Who tells the classes.
#[derive(Debug, Clone, Copy)]
pub enum Teller<'a> {
    /// The network.
    Network(&'a Classifier),
    /// Chance, by this seed: what remains of the results when the network does not decide.
    Chance(&'a Classifier, u64),
}

/// What the caller may choose.
#[derive(Debug, Clone, Copy)]
pub struct Settings<'a> {
    /// Who tells the classes.
    pub teller: Teller<'a>,
    /// Seed of the random walks over outlines.
    pub seed: u64,
    /// Smaller features than this, in pitches across, are left out; at least 3.
    pub least_pitches: f64,
}

impl Settings<'_> {
    /// Usual least size of features, pitches across.
    pub const USUAL_PITCHES: f64 = 6.0;
}

/// What was recognised.
#[derive(Debug, Clone)]
pub struct Recognition {
    /// Features, the block first, parents before what they hold.
    pub features: Vec<Feature>,
    /// Equal holes in rows and on circles.
    pub patterns: Vec<Pattern>,
    /// The plan: its third axis is the features' axis.
    pub frame: Frame,
    /// The range image that they were found in.
    pub image: RangeImage,
    /// Standard deviation of z of samples, millimetres.
    pub noise_mm: f64,
    /// Distance of samples, millimetres.
    pub pitch_mm: f64,
    /// What the user should know of the scan as a whole.
    pub notes: Vec<String>,
}

/// Why nothing was recognised.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecogniseError {
    /// No range image.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// No regions.
    #[error("segmentation: {0}")]
    Segment(#[from] SegmentError),
    /// Regions, but no face that a part could have as its top.
    #[error(
        "no surface was found that could be the top of a part; features are cut into or stand on \
         a face that the camera looks at"
    )]
    NoTop,
    /// The caller gave up.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Recognises the features of the part in a scan. Columns are in the order of their x; rays of a
/// column come from `camera_mm` (y and z), or run along z where it is not known.
///
/// # Errors
/// [`RecogniseError`].
pub fn recognise(
    columns: &[Column],
    camera_mm: Option<[f64; 2]>,
    settings: &Settings<'_>,
    monitor: &dyn Monitor,
) -> Result<Recognition, RecogniseError> {
    let mut field = field(columns, camera_mm, monitor)?;
    let step_mm = least_step_mm(&field);
    let mut regions = regions(&mut field, columns, monitor)?;
    let mut levels = levels(&field.image, &regions, step_mm);
    let top = top(&regions, &levels, step_mm).ok_or(RecogniseError::NoTop)?;
    if is_above(&levels, &top) {
        // No part hangs under its table: what was taken for it is something else.
        levels.levels[usize::from(AROUND)].plane = None;
        levels.levels[usize::from(AROUND)].is_plane = false;
        regions.regions[usize::from(OUTSIDE)] = Region::Outside(None);
        let note =
            "what surrounds the part lies higher than its top, and is not taken for the table";
        regions.notes.push(note.to_owned());
    }
    let frame = frame_of(&top);
    let sight = Sight {
        columns,
        camera_mm,
        field: &field,
        regions: &regions,
        levels: &levels,
        frame: &frame,
    };
    let least = settings.least_pitches;
    let mut found = candidates(&sight, &top, step_mm, settings.seed, least, monitor)?;
    if found.first().is_none_or(|first| first.lie != Lie::Body) {
        return Err(RecogniseError::NoTop);
    }
    let treated = treatments(&sight, &mut found, monitor)?;
    let order = nested(&found);
    let mut features: Vec<Feature> = Vec::with_capacity(order.len());
    let mut ids: Vec<Option<u32>> = vec![None; found.len()];
    for (index, parent) in order {
        monitor.check()?;
        let candidate = &found[index];
        let id = u32::try_from(features.len()).unwrap_or(u32::MAX);
        ids[index] = Some(id);
        let parent_id = parent.and_then(|p| ids[p]);
        features.push(feature(&sight, candidate, settings, step_mm, id, parent_id));
    }
    for treatment in treated {
        let id = u32::try_from(features.len()).unwrap_or(u32::MAX);
        let Some(parent) = ids[treatment.of] else {
            continue;
        };
        let Some(of) = features.iter().find(|f| f.id == parent) else {
            continue;
        };
        let own = edge(&sight, &treatment, of, id);
        features.push(own);
    }
    let patterns = patterns(&features);
    Ok(Recognition {
        patterns,
        features,
        frame,
        noise_mm: field.noise_mm,
        pitch_mm: field.pitch_mm(),
        notes: regions.notes,
        image: field.image,
    })
}

/// Whether what was taken for the table lies above the part's top.
fn is_above(levels: &Levels, top: &Top) -> bool {
    let [x_mm, y_mm] = top.plane.middle_mm;
    let table = levels.levels[usize::from(AROUND)].plane;
    table.is_some_and(|table| table.z_mm(x_mm, y_mm) >= top.plane.z_mm(x_mm, y_mm))
}

/// Candidates with their parents, parents first.
fn nested(found: &[Candidate]) -> Vec<(usize, Option<usize>)> {
    let holder = |level: u16| found.iter().position(|c| c.levels.contains(&level));
    let parents: Vec<usize> = found
        .iter()
        .map(|candidate| holder(candidate.host).unwrap_or(0))
        .collect();
    let mut order = vec![(0, None)];
    let mut placed = vec![false; found.len()];
    placed[0] = true;
    let mut next = 0;
    while next < order.len() {
        let (parent, _) = order[next];
        for child in 1..found.len() {
            if !placed[child] && parents[child] == parent && child != parent {
                placed[child] = true;
                order.push((child, Some(parent)));
            }
        }
        next += 1;
    }
    // What holds each other in a ring stands on the block.
    for child in (1..found.len()).filter(|child| !placed[*child]) {
        order.push((child, Some(0)));
    }
    order
}

fn feature(
    sight: &Sight<'_>,
    candidate: &Candidate,
    settings: &Settings<'_>,
    step_mm: f64,
    id: u32,
    parent: Option<u32>,
) -> Feature {
    let mut warnings = Vec::new();
    let form = form(candidate);
    let sense = match candidate.lie {
        Lie::Hollow => Sense::Concave,
        Lie::Body | Lie::Raised => Sense::Convex,
    };
    let digits = section(sight, candidate).map(|cut| code(&cut.section(sight)));
    let (class, score) = match &digits {
        None => {
            warnings.push("no section of it could be made".to_owned());
            (UNKNOWN.to_owned(), 0.0)
        }
        Some(digits) => {
            let attributes = Attributes {
                code: digits.clone(),
                sense,
                form,
            };
            told(settings.teller, &attributes, id, &mut warnings)
        }
    };
    let class = by_place(class, candidate.lie, parent);
    let known = Class::named(&class);
    let host = sight.levels.levels[usize::from(candidate.host)].plane;
    let own = measured(sight, candidate, known, host.as_ref(), step_mm);
    warnings.extend(own.warnings);
    for vague in own
        .dimensions
        .iter()
        .filter(|d| d.sigma_mm > sight.field.pitch_mm())
    {
        warnings.push(format!(
            "its {} is known to {:.1} mm only: too little of its border was seen",
            vague.name, vague.sigma_mm
        ));
    }
    let bottom = bottom(sight, candidate, own.heights_mm.1);
    let curve = match bottom {
        Bottom::FreeForm(_) => curve(sight, candidate),
        Bottom::Level | Bottom::Unseen | Bottom::Tip(_) => None,
    };
    Feature {
        id,
        parent,
        class,
        score,
        code: digits.as_deref().map(written).unwrap_or_default(),
        centre_mm: own.centre_mm,
        centre_sigma_mm: own.centre_sigma_mm,
        axis: sight.frame.axes[2],
        direction: own.direction,
        dimensions: own.dimensions,
        outline: candidate.outline.shape,
        heights_mm: own.heights_mm,
        lie: Some(candidate.lie),
        bottom,
        curve,
        through: own.through,
        warnings,
        is_edited: false,
    }
}

/// A block and a boss are told by their outlines in Table 2, and by what they stand on otherwise: a
/// block on a face of the part is a boss with straight sides, and a round body is still the body.
fn by_place(class: String, lie: Lie, parent: Option<u32>) -> String {
    let is = |own: Class| class == own.as_str();
    match lie {
        // Rings and cones are features of their own, on the hole or of its edge.
        Lie::Hollow if is(Class::CountersunkHole) || is(Class::SteppedHole) => {
            Class::Hole.as_str().to_owned()
        }
        Lie::Raised if is(Class::Block) && parent.is_some() => Class::Boss.as_str().to_owned(),
        Lie::Body if is(Class::Boss) => Class::Block.as_str().to_owned(),
        _ => class,
    }
}

/// Form of the outline, attribute (B) of Table 2.
fn form(candidate: &Candidate) -> Form {
    match candidate.outline.shape {
        Shape::Circle(_) => Form::Circular,
        Shape::Rectangle(rectangle) if rectangle.walls == [true; 4] => Form::ClosedRectangular,
        Shape::Rectangle(_) => Form::Open,
    }
}

fn told(
    teller: Teller<'_>,
    attributes: &Attributes,
    id: u32,
    warnings: &mut Vec<String>,
) -> (String, f64) {
    match teller {
        Teller::Network(network) => {
            let verdict = network.classify(attributes);
            match verdict.doubt {
                None => (verdict.class, verdict.score),
                Some(doubt) => {
                    warnings.push(format!(
                        "of no class that the network knows ({}; nearest: {})",
                        doubt.as_str(),
                        verdict.class
                    ));
                    (UNKNOWN.to_owned(), verdict.score)
                }
            }
        }
        Teller::Chance(network, seed) => {
            let classes = network.classes();
            let drawn = Chance::new(seed, u64::from(id)).below(classes.len());
            let class = classes.get(drawn).cloned();
            (class.unwrap_or_else(|| UNKNOWN.to_owned()), 0.0)
        }
    }
}

/// A treated edge as a feature of its own.
fn edge(sight: &Sight<'_>, treatment: &Treatment, of: &Feature, id: u32) -> Feature {
    let mut dimensions = Vec::new();
    let mut add = |name, value_mm, sigma_mm| {
        dimensions.push(Dimension {
            name,
            value_mm,
            sigma_mm,
        });
    };
    match (treatment.kind, of.outline) {
        (Kind::Countersink, Shape::Circle(circle)) => {
            let own = of.dimension("diameter").map_or(0.0, |d| d.sigma_mm);
            let sigma = (own * own + 4.0 * treatment.sigma_mm * treatment.sigma_mm).sqrt();
            add(
                "diameter",
                2.0 * (circle.radius_mm + treatment.size_mm),
                sigma,
            );
            add("depth", treatment.rise_mm, treatment.sigma_mm);
        }
        (Kind::Fillet | Kind::Round, _) => add("radius", treatment.size_mm, treatment.sigma_mm),
        (Kind::Chamfer | Kind::Countersink, _) => {
            add("width", treatment.size_mm, treatment.sigma_mm);
        }
    }
    let local = sight.frame.local(of.centre_mm);
    let end = match treatment.kind {
        Kind::Fillet => treatment.level_mm + treatment.rise_mm,
        _ => treatment.level_mm - treatment.rise_mm,
    };
    Feature {
        id,
        parent: Some(of.id),
        class: treatment.kind.as_str().to_owned(),
        score: treatment.score,
        code: String::new(),
        centre_mm: sight.frame.world([local[0], local[1], treatment.level_mm]),
        centre_sigma_mm: of.centre_sigma_mm,
        axis: of.axis,
        direction: of.direction,
        dimensions,
        outline: of.outline,
        heights_mm: (treatment.level_mm, Some(end)),
        lie: None,
        bottom: Bottom::Level,
        curve: None,
        through: false,
        warnings: Vec::new(),
        is_edited: false,
    }
}

/// What a candidate ends in.
fn bottom(sight: &Sight<'_>, candidate: &Candidate, end_mm: Option<f64>) -> Bottom {
    let is_plane = candidate
        .levels
        .first()
        .is_some_and(|level| sight.levels.levels[usize::from(*level)].is_plane);
    match (candidate.tip, end_mm) {
        (Some(tip), _) => Bottom::Tip(tip.slope),
        (None, None) => Bottom::Unseen,
        (None, Some(_)) if is_plane || candidate.lie == Lie::Body => Bottom::Level,
        (None, Some(_)) => free_form(sight, candidate).map_or(Bottom::Level, Bottom::FreeForm),
    }
}
