//! Candidates to features: centres, dimensions and what they are uncertain by.

use nalgebra::Vector3;

use crate::candidate::{Candidate, Lie};
use crate::class::Class;
use crate::feature::Dimension;
use crate::outline::{Outline, Rectangle, Shape};
use crate::plane::Plane;
use crate::sight::Sight;

/// What is measured of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// See [`crate::feature::Feature::centre_mm`].
    pub centre_mm: Vector3<f64>,
    /// Its standard uncertainty in the plan's axes.
    pub centre_sigma_mm: [f64; 3],
    /// Along its length.
    pub direction: Option<Vector3<f64>>,
    /// Its dimensions.
    pub dimensions: Vec<Dimension>,
    /// See [`crate::feature::Feature::heights_mm`].
    pub heights_mm: (f64, Option<f64>),
    /// Whether it goes through.
    pub through: bool,
    /// What is to be said of it.
    pub warnings: Vec<String>,
}

/// A corner radius counts where it is greater than so many of its uncertainties, and than this
/// share of a pitch.
const CORNER_SIGMAS: f64 = 3.0;
const CORNER_PITCHES: f64 = 1.5;
/// Where more of the witnesses than this contradict the outline, it is none of the shapes known.
const CONTRADICTED: f64 = 0.08;
/// A hollow whose floor lies within so many steps of the table goes through.
const THROUGH_STEPS: f64 = 2.0;

/// Measures a candidate as a feature of a class; `host` is the plane of what it goes into or stands on.
#[must_use]
pub fn measured(
    sight: &Sight<'_>,
    candidate: &Candidate,
    class: Option<Class>,
    host: Option<&Plane>,
    step_mm: f64,
) -> Measured {
    let frame = sight.frame;
    let table = sight.levels.levels[0].plane;
    let floor = candidate
        .levels
        .first()
        .and_then(|level| sight.levels.levels[usize::from(*level)].plane);
    let middle = candidate.outline.shape.middle_mm();
    // Where the axis through the middle meets a plane.
    let on = |plane: &Plane| {
        let mut w = 0.0;
        for _ in 0..3 {
            let at = frame.world([middle[0], middle[1], w]);
            let off = plane.z_mm(at.x, at.y) - at.z;
            w += off * frame.axes[2].z;
        }
        let at = frame.world([middle[0], middle[1], w]);
        (w, plane.sigma_mm(at.x, at.y))
    };
    let mut warnings = Vec::new();
    let own = match (candidate.tip, candidate.bowed) {
        (Some(tip), _) => Some((tip.shoulder_mm, tip.sigma_mm)),
        (None, Some(bowed)) => Some((bowed.end_mm, bowed.sigma_mm)),
        (None, None) => floor.as_ref().map(on),
    };
    let base = match candidate.lie {
        Lie::Body => own.unwrap_or((0.0, 0.0)),
        _ => host.map_or((0.0, 0.0), on),
    };
    let mut through = false;
    let (name, other) = match candidate.lie {
        Lie::Body => ("height", table.as_ref().map(on)),
        Lie::Raised => ("height", own),
        Lie::Hollow => {
            let under = table.as_ref().map(on);
            if let (Some(floor), Some(under)) = (own, under)
                && floor.0 < under.0 + THROUGH_STEPS * step_mm
            {
                through = true;
            }
            ("depth", if through { under } else { own })
        }
    };
    let mut dimensions = of_outline(&candidate.outline, class, sight.field.pitch_mm());
    match other {
        Some(other) => dimensions.push(Dimension {
            name,
            value_mm: (base.0 - other.0).abs(),
            sigma_mm: (base.1 * base.1 + other.1 * other.1).sqrt(),
        }),
        None if candidate.lie == Lie::Body => warnings
            .push("height not measured: no table was seen that the part stands on".to_owned()),
        None => warnings.push("depth not measured: its floor was not seen".to_owned()),
    }
    if candidate.is_cut {
        warnings.push("incomplete: the scan ends in it".to_owned());
    }
    if candidate.outline.contradicted > CONTRADICTED {
        warnings.push(format!(
            "its outline is neither a circle nor a rectangle: {:.0} % of the samples beside it \
             lie on the other side; its dimensions are those of the nearest of these",
            100.0 * candidate.outline.contradicted
        ));
    }
    let is_free = floor.is_some()
        && candidate
            .levels
            .iter()
            .any(|level| !sight.levels.levels[usize::from(*level)].is_plane);
    if let Some(tip) = candidate.tip {
        let angle = 2.0 * (90.0 - libm::atan(tip.slope).to_degrees());
        warnings.push(format!(
            "its bottom is a cone of about {angle:.0} degrees; the depth is that of its edge"
        ));
    } else if candidate.bowed.is_some() {
        warnings.push(match candidate.lie {
            Lie::Hollow => {
                "it goes down to its floor without a wall: its sides are where the floor \
                            meets the face, its depth is the greatest"
                    .to_owned()
            }
            Lie::Body | Lie::Raised => "it goes up to its top without a wall: its sides are where \
                                        that meets the face, its height is the greatest"
                .to_owned(),
        });
    } else if is_free && candidate.lie != Lie::Hollow {
        warnings.push("its top is no plane: heights are those of the plane through it".to_owned());
    } else if is_free {
        warnings
            .push("its floor is no plane: the depth is that of the plane through it".to_owned());
    }
    let (sigma_u, sigma_v) = centre_sigma(&candidate.outline);
    Measured {
        centre_mm: frame.world([middle[0], middle[1], base.0]),
        centre_sigma_mm: [sigma_u, sigma_v, base.1],
        direction: direction(&candidate.outline.shape, class)
            .map(|angle_rad| frame.direction(angle_rad)),
        dimensions,
        heights_mm: (base.0, other.map(|o| o.0)),
        through,
        warnings,
    }
}

/// Which of a rectangle's axes is its length: along the walls of what runs out, else the longer.
pub(crate) fn length_axis(rectangle: &Rectangle, class: Option<Class>) -> usize {
    let [a, b, c, d] = rectangle.walls;
    let [first, second] = rectangle.sizes_mm();
    let longer = usize::from(second > first);
    match class {
        Some(Class::Slot) if (a && b) != (c && d) => usize::from(a && b),
        Some(Class::Step) if (a || b) != (c || d) => usize::from(a || b),
        _ => longer,
    }
}

fn direction(shape: &Shape, class: Option<Class>) -> Option<f64> {
    match shape {
        Shape::Circle(_) => None,
        Shape::Rectangle(rectangle) => {
            let quarters = length_axis(rectangle, class) as f64;
            Some(rectangle.angle_rad + quarters * core::f64::consts::FRAC_PI_2)
        }
    }
}

fn of_outline(outline: &Outline, class: Option<Class>, pitch_mm: f64) -> Vec<Dimension> {
    let variance = |k: usize| outline.covariance[k][k];
    let difference = |a: usize, b: usize| {
        let square = variance(a) + variance(b) - 2.0 * outline.covariance[a][b];
        square.max(0.0).sqrt()
    };
    match outline.shape {
        Shape::Circle(circle) => vec![Dimension {
            name: "diameter",
            value_mm: 2.0 * circle.radius_mm,
            sigma_mm: 2.0 * variance(2).max(0.0).sqrt(),
        }],
        Shape::Rectangle(rectangle) => {
            let sizes = rectangle.sizes_mm();
            let sigmas = [difference(1, 2), difference(3, 4)];
            let long = length_axis(&rectangle, class);
            let mut own = vec![
                Dimension {
                    name: "length",
                    value_mm: sizes[long],
                    sigma_mm: sigmas[long],
                },
                Dimension {
                    name: "width",
                    value_mm: sizes[1 - long],
                    sigma_mm: sigmas[1 - long],
                },
            ];
            let sigma_mm = variance(5).max(0.0).sqrt();
            let least = (CORNER_SIGMAS * sigma_mm).max(CORNER_PITCHES * pitch_mm);
            if rectangle.corner_mm > least {
                own.push(Dimension {
                    name: "corner_radius",
                    value_mm: rectangle.corner_mm,
                    sigma_mm,
                });
            }
            own
        }
    }
}

/// Standard uncertainties of the middle along u and v.
fn centre_sigma(outline: &Outline) -> (f64, f64) {
    let c = &outline.covariance;
    match outline.shape {
        Shape::Circle(_) => (c[0][0].max(0.0).sqrt(), c[1][1].max(0.0).sqrt()),
        Shape::Rectangle(rectangle) => {
            let middle = |a: usize, b: usize| 0.25 * (c[a][a] + c[b][b] + 2.0 * c[a][b]);
            let (along, across) = (middle(1, 2), middle(3, 4));
            let (sin, cos) = libm::sincos(rectangle.angle_rad);
            let u = cos * cos * along + sin * sin * across;
            let v = sin * sin * along + cos * cos * across;
            (u.max(0.0).sqrt(), v.max(0.0).sqrt())
        }
    }
}
