//! The part rebuilt from its features: a block, with what was recognised cut into it and raised on
//! it, as [`terraces`] makes a solid of it.

use terraces::{Floor, Frame, Operation, Outline, OutlineError, Part, Piece, Treatment};

use crate::candidate::Lie;
use crate::feature::{Bottom, Feature};
use crate::outline::{Rectangle, Shape};
use crate::recognise::Recognition;
use crate::treatment::Kind;

/// Why there is no part.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RebuildError {
    /// No block among the features.
    #[error("there is no block that the others could be cut into")]
    NoBlock,
    /// An outline that is none.
    #[error("{class} {id}: {error}")]
    Outline {
        /// Class of the feature.
        class: String,
        /// Its number.
        id: u32,
        /// What is wrong.
        error: OutlineError,
    },
}

/// A part, and what had to be assumed for it.
#[derive(Debug, Clone)]
pub struct Rebuilt {
    /// The part.
    pub part: Part,
    /// What is not measured, for the user.
    pub assumed: Vec<String>,
}

/// What runs out is cut this far beyond where it ends, millimetres, so that no skin is left.
pub(crate) const BEYOND_MM: f64 = 1.0;
/// Least height of a block under its deepest floor, and share of its length, where no table was
/// seen.
const LEAST_UNDER_MM: f64 = 2.0;
const UNDER_SHARE: f64 = 0.05;

/// The part that the features describe.
///
/// # Errors
/// No block, or an outline that is none.
pub fn rebuilt(recognition: &Recognition) -> Result<Rebuilt, RebuildError> {
    let features = &recognition.features;
    let block = features.iter().find(|f| f.lie == Some(Lie::Body));
    let block = block.ok_or(RebuildError::NoBlock)?;
    let mut assumed = Vec::new();
    let top_mm = block.heights_mm.0;
    let bottom_mm = block.heights_mm.1.unwrap_or_else(|| {
        let lowest = features.iter().filter_map(lowest_mm).fold(top_mm, f64::min);
        let length = block.dimension("length").map_or(0.0, |d| d.value_mm);
        assumed.push(
            "the block's bottom, which was not seen, lies under its deepest floor".to_owned(),
        );
        lowest - LEAST_UNDER_MM.max(UNDER_SHARE * length)
    });
    let edges = Edges::of(features, block, &mut assumed);
    let mut part = Part::new(outline(block, 0.0, edges.is_sharp)?, top_mm, bottom_mm);
    let frame = &recognition.frame;
    part.frame = Frame {
        origin_mm: frame.origin_mm.into(),
        x: frame.axes[0].into(),
        z: frame.axes[2].into(),
    };
    part.upper = edges.upper;
    for feature in features.iter().filter(|f| f.id != block.id) {
        let name = format!("{} {}", feature.class, feature.id);
        let edges = Edges::of(features, feature, &mut assumed);
        let operation = match feature.lie {
            Some(Lie::Hollow) => {
                let outline = outline(feature, BEYOND_MM, edges.is_sharp)?;
                Operation::cut(name, outline, floor(feature, &mut assumed))
            }
            Some(Lie::Raised) => {
                let z_mm = feature.heights_mm.1.unwrap_or(feature.heights_mm.0);
                let outline = outline(feature, 0.0, edges.is_sharp)?;
                Operation::raise(name, outline, Floor::Level { z_mm })
            }
            Some(Lie::Body) | None => continue,
        };
        part.operations.push(Operation {
            upper: edges.upper,
            lower: edges.lower,
            ..operation
        });
    }
    Ok(Rebuilt { part, assumed })
}

/// Where a feature ends at its deepest; `None` where that was not seen.
fn lowest_mm(feature: &Feature) -> Option<f64> {
    let end_mm = feature.heights_mm.1?;
    Some(match (&feature.bottom, feature.outline) {
        (Bottom::Tip(slope), Shape::Circle(circle)) => end_mm - slope * circle.radius_mm,
        // A surface lies within the hull of its control points.
        (Bottom::FreeForm(surface), _) => {
            let heights = surface.points().iter().map(|[z_mm]| *z_mm);
            heights.fold(end_mm, f64::min)
        }
        _ => end_mm,
    })
}

fn floor(feature: &Feature, assumed: &mut Vec<String>) -> Floor {
    if feature.through {
        return Floor::Through;
    }
    let level = |z_mm: f64| Floor::Level { z_mm };
    match (&feature.bottom, feature.heights_mm.1) {
        (_, None) => {
            assumed.push(format!(
                "{} {} goes through: its floor was not seen",
                feature.class, feature.id
            ));
            Floor::Through
        }
        (Bottom::Level | Bottom::Unseen, Some(z_mm)) => level(z_mm),
        (Bottom::Tip(slope), Some(rim_mm)) => match feature.outline {
            Shape::Circle(_) => Floor::Tip {
                rim_mm,
                angle_rad: core::f64::consts::PI - 2.0 * libm::atan(*slope),
            },
            Shape::Rectangle(_) => level(rim_mm),
        },
        (Bottom::FreeForm(surface), Some(_)) if covers(surface, feature) => {
            Floor::FreeForm(surface.clone())
        }
        // Edits may have moved its walls.
        (Bottom::FreeForm(_), Some(z_mm)) => {
            assumed.push(format!(
                "{} {} has a level floor: the one that was measured does not reach its walls",
                feature.class, feature.id
            ));
            level(z_mm)
        }
    }
}

/// Whether a floor reaches under all that is cut.
fn covers(surface: &nurbs::BSplineSurface<1>, feature: &Feature) -> bool {
    let (low, high) = feature.outline.extent();
    // Corners move along both axes.
    let reach_mm = core::f64::consts::SQRT_2 * BEYOND_MM;
    let domains = [surface.u_knots().domain(), surface.v_knots().domain()];
    domains.iter().enumerate().all(|(axis, (first, last))| {
        *first <= low[axis] - reach_mm && high[axis] + reach_mm <= *last
    })
}

/// The treated edges of a feature, as its corners allow.
struct Edges {
    upper: Option<Treatment>,
    lower: Option<Treatment>,
    /// Whether its corners are taken to be sharp.
    is_sharp: bool,
}

/// Of a corner's radius, how wide an edge in it may be.
const IN_CORNER: f64 = 0.95;

impl Edges {
    fn of(features: &[Feature], feature: &Feature, assumed: &mut Vec<String>) -> Self {
        let mut own = Self {
            upper: upper(features, feature.id),
            lower: lower(features, feature.id),
            is_sharp: false,
        };
        let Shape::Rectangle(rectangle) = feature.outline else {
            return own;
        };
        // Those within the outline, whose corners become narrower.
        let within = match feature.lie {
            Some(Lie::Hollow) => &own.lower,
            _ => &own.upper,
        };
        let Some(edge) = within else {
            return own;
        };
        if width_mm(edge) <= IN_CORNER * rectangle.corner_mm {
            return own;
        }
        // A small radius that is not told is that of a sharp corner between two samples. One that is
        // told costs less of the surface than an edge that is made narrower all around.
        own.is_sharp = true;
        if feature.dimension("corner_radius").is_some() {
            assumed.push(format!(
                "{} {}: its corners are made sharp, since its treated edge is wider than they are \
                 round",
                feature.class, feature.id
            ));
        }
        own
    }
}

fn width_mm(edge: &Treatment) -> f64 {
    match edge {
        Treatment::Round { radius_mm } => *radius_mm,
        Treatment::Chamfer { width_mm, .. } => *width_mm,
    }
}

/// The treated edge at the top of a feature's wall.
fn upper(features: &[Feature], of: u32) -> Option<Treatment> {
    treated(
        features,
        of,
        &[Kind::Chamfer, Kind::Countersink, Kind::Round],
    )
}

/// And at its foot.
fn lower(features: &[Feature], of: u32) -> Option<Treatment> {
    treated(features, of, &[Kind::Fillet])
}

fn treated(features: &[Feature], of: u32, kinds: &[Kind]) -> Option<Treatment> {
    let feature = features.iter().find(|f| {
        f.lie.is_none() && f.parent == Some(of) && kinds.iter().any(|k| k.as_str() == f.class)
    })?;
    let value = |name: &str| feature.dimension(name).map(|d| d.value_mm);
    if let Some(radius_mm) = value("radius") {
        return Some(Treatment::Round { radius_mm });
    }
    let height_mm = (feature.heights_mm.0 - feature.heights_mm.1?).abs();
    let width_mm = match feature.outline {
        Shape::Circle(circle) => {
            value("width").or_else(|| Some(0.5 * value("diameter")? - circle.radius_mm))
        }
        Shape::Rectangle(_) => value("width"),
    }?;
    let is_one = width_mm > 0.0 && height_mm > 0.0;
    is_one.then_some(Treatment::Chamfer {
        width_mm,
        height_mm,
    })
}

/// The outline of a feature; sides at which it runs out are moved outwards.
fn outline(feature: &Feature, beyond_mm: f64, is_sharp: bool) -> Result<Outline, RebuildError> {
    let made = match feature.outline {
        Shape::Circle(circle) => Outline::circle(circle.centre_mm, circle.radius_mm),
        Shape::Rectangle(own) => {
            let corner_mm = if is_sharp { 0.0 } else { own.corner_mm };
            Outline::new(pieces(&Rectangle { corner_mm, ..own }, beyond_mm))
        }
    };
    made.map_err(|error| RebuildError::Outline {
        class: feature.class.clone(),
        id: feature.id,
        error,
    })
}

/// Corners with a smaller radius than this are sharp, millimetres, unless it is measured.
const SHARP_MM: f64 = 0.3;

fn pieces(own: &Rectangle, beyond_mm: f64) -> Vec<Piece> {
    let moved = |side: usize| if own.walls[side] { 0.0 } else { beyond_mm };
    let first = [own.first_mm[0] - moved(0), own.first_mm[1] + moved(1)];
    let second = [own.second_mm[0] - moved(2), own.second_mm[1] + moved(3)];
    // Counter-clockwise, from the corner at the greater end of both axes; each with the ways in
    // which its arc is entered and left.
    let corners = [
        ([1, 1], [0.0, -1.0], [-1.0, 0.0]),
        ([0, 1], [1.0, 0.0], [0.0, -1.0]),
        ([0, 0], [0.0, 1.0], [1.0, 0.0]),
        ([1, 0], [-1.0, 0.0], [0.0, 1.0]),
    ];
    let mut pieces: Vec<Piece> = Vec::new();
    let mut ends = Vec::new();
    for ([a, b], back, on) in corners {
        let corner = [first[a], second[b]];
        let is_round = own.walls[a] && own.walls[2 + b] && own.corner_mm > SHARP_MM;
        let radius = if is_round { own.corner_mm } else { 0.0 };
        let along = |way: [f64; 2]| [corner[0] + radius * way[0], corner[1] + radius * way[1]];
        let centre = [
            corner[0] + radius * (back[0] + on[0]),
            corner[1] + radius * (back[1] + on[1]),
        ];
        ends.push((
            own.place(along(back)),
            own.place(along(on)),
            own.place(centre),
            is_round,
        ));
    }
    for (k, (enter, leave, center, is_round)) in ends.iter().enumerate() {
        if *is_round {
            pieces.push(Piece::Arc {
                from: *enter,
                to: *leave,
                center: *center,
                ccw: true,
            });
        }
        let next = ends[(k + 1) % ends.len()].0;
        let far = (next[0] - leave[0]).abs() + (next[1] - leave[1]).abs();
        if far > 1e-6 {
            pieces.push(Piece::Line {
                from: *leave,
                to: next,
            });
        }
    }
    pieces
}
