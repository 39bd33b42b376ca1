//! The classes' sections, each drawn with other sizes and other imperfections.

use super::profile::{Edge, Profile, Wall};
use crate::chance::Chance;
use crate::class::Class;
use crate::code::{End, Form, Sense};

/// What sizes are drawn for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scope {
    pub(super) pitch_mm: f64,
    /// Of the shallowest wall.
    pub(super) least_mm: f64,
}

/// An ideal section and what it is.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub(super) profile: Profile,
    pub(super) ends: [End; 2],
    pub(super) sense: Sense,
    pub(super) form: Form,
}

impl Scope {
    fn depth(&self, chance: &mut Chance) -> f64 {
        let low = self.least_mm.max(2.0 * self.pitch_mm);
        chance.scaled(low, low * 10.0)
    }

    fn width(&self, chance: &mut Chance) -> f64 {
        self.pitch_mm * chance.scaled(10.0, 120.0)
    }

    fn rim(&self, chance: &mut Chance) -> f64 {
        self.pitch_mm * chance.scaled(5.0, 30.0)
    }
}

fn edge(height_mm: f64, largest_share: f64, chance: &mut Chance) -> Edge {
    let size_mm = height_mm * chance.between(0.02, largest_share);
    match chance.below(4) {
        0 => Edge::Chamfer(size_mm),
        1 => Edge::Round(size_mm),
        _ => Edge::Sharp,
    }
}

/// Mostly upright; else drafted, or slanting.
fn wall(height_mm: f64, chance: &mut Chance) -> Wall {
    let off_deg = match chance.below(10) {
        0 => chance.between(25.0, 45.0),
        1..=2 => chance.between(1.0, 12.0),
        _ => 0.0,
    };
    let largest = if chance.happens(0.1) { 0.45 } else { 0.22 };
    Wall {
        run_mm: height_mm * libm::tan(f64::to_radians(off_deg)),
        upper: edge(height_mm, 0.22, chance),
        lower: edge(height_mm, largest, chance),
    }
}

/// Mostly level; else sloping, or free-form.
fn floor(profile: &mut Profile, run_mm: f64, chance: &mut Chance) {
    match chance.below(6) {
        0 => {
            let slope = libm::tan(f64::to_radians(chance.between(-20.0, 20.0)));
            profile.line(run_mm, slope * run_mm);
        }
        1 => {
            profile.waves(run_mm, chance);
        }
        _ => {
            profile.line(run_mm, 0.0);
        }
    }
}

/// Rims are uneven now and then, where two levels meet.
fn other_height(height_mm: f64, scope: &Scope, chance: &mut Chance) -> f64 {
    if chance.happens(0.25) {
        (height_mm * chance.between(0.5, 1.5)).max(scope.least_mm)
    } else {
        height_mm
    }
}

/// The section of one class; blocks for names that are none of them.
pub(super) fn shape(class: Class, scope: &Scope, chance: &mut Chance) -> Shape {
    match class {
        Class::Pocket => hollow(Form::ClosedRectangular, scope, chance),
        Class::Slot => hollow(Form::Open, scope, chance),
        Class::Hole => hollow(Form::Circular, scope, chance),
        Class::Boss => raised(Form::Circular, scope, chance),
        Class::Block => raised(Form::ClosedRectangular, scope, chance),
        Class::Step => step(scope, chance),
        Class::SteppedHole => stepped(scope, chance),
        Class::CountersunkHole => countersunk(scope, chance),
    }
}

fn hollow(form: Form, scope: &Scope, chance: &mut Chance) -> Shape {
    let mut profile = Profile::new();
    let (depth, width) = (scope.depth(chance), scope.width(chance));
    profile.line(scope.rim(chance), 0.0);
    let own = wall(depth, chance);
    profile.wall(-depth, &own);
    let is_nested = form == Form::ClosedRectangular && chance.happens(0.1);
    match form {
        // A drill's point.
        Form::Circular if chance.happens(0.3) => {
            let tip = 0.5 * width * 0.6;
            profile.line(0.5 * width, -tip).line(0.5 * width, tip);
        }
        Form::Circular => {
            profile.line(width, 0.0);
        }
        _ if is_nested => {
            // Something stands on the floor, or goes into it.
            let height = scope.depth(chance).min(0.7 * depth).max(scope.least_mm);
            let sign = if chance.happens(0.5) { 1.0 } else { -1.0 };
            let inner = wall(height, chance);
            profile.line(width, 0.0).wall(sign * height, &inner);
            profile.line(scope.width(chance), 0.0);
            profile.wall(-sign * height, &inner).line(width, 0.0);
        }
        _ => floor(&mut profile, width, chance),
    }
    let height = other_height(depth, scope, chance);
    let own = if chance.happens(0.7) {
        Wall {
            run_mm: own.run_mm * height / depth,
            ..own
        }
    } else {
        wall(height, chance)
    };
    profile.wall(height, &own).line(scope.rim(chance), 0.0);
    let is_cut = form == Form::ClosedRectangular && !is_nested && chance.happens(0.06);
    cut(profile, is_cut, Sense::Concave, form, chance)
}

fn raised(form: Form, scope: &Scope, chance: &mut Chance) -> Shape {
    let mut profile = Profile::new();
    let (height, width) = (scope.depth(chance), scope.width(chance));
    profile.line(scope.rim(chance), 0.0);
    let own = wall(height, chance);
    profile.wall(height, &own);
    let is_nested = form == Form::ClosedRectangular && chance.happens(0.1);
    if is_nested {
        let depth = scope.depth(chance).min(0.7 * height).max(scope.least_mm);
        let inner = wall(depth, chance);
        profile.line(width, 0.0).wall(-depth, &inner);
        profile.line(scope.width(chance), 0.0);
        profile.wall(depth, &inner).line(width, 0.0);
    } else {
        floor(&mut profile, width, chance);
    }
    let depth = other_height(height, scope, chance);
    let own = if chance.happens(0.7) {
        Wall {
            run_mm: own.run_mm * depth / height,
            ..own
        }
    } else {
        wall(depth, chance)
    };
    profile.wall(-depth, &own).line(scope.rim(chance), 0.0);
    let is_cut = !is_nested && chance.happens(0.06);
    cut(profile, is_cut, Sense::Convex, form, chance)
}

/// The scan's border may cut a feature: one wall is missing, and the section is open there.
fn cut(profile: Profile, is_cut: bool, sense: Sense, form: Form, chance: &mut Chance) -> Shape {
    let mut shape = Shape {
        profile,
        ends: [End::Rim; 2],
        sense,
        form,
    };
    if is_cut {
        let corners = &mut shape.profile.corners;
        // Half a floor is left.
        let [low, high] = [0.4, 0.6].map(|share| share * corners[corners.len() - 1][0]);
        let place = chance.between(low, high);
        if let Some(height) = shape.profile.height_mm(place) {
            let corners = &mut shape.profile.corners;
            corners.retain(|corner| corner[0] < place);
            corners.push([place, height]);
            shape.ends[1] = End::Open;
        }
    }
    shape
}

fn step(scope: &Scope, chance: &mut Chance) -> Shape {
    let mut profile = Profile::new();
    let (below, above) = (scope.depth(chance), scope.depth(chance));
    let has_side = chance.happens(0.7);
    if has_side {
        let own = wall(below, chance);
        profile.line(scope.rim(chance), 0.0).wall(below, &own);
    }
    floor(&mut profile, scope.width(chance), chance);
    let own = wall(above, chance);
    profile.wall(above, &own).line(scope.rim(chance), 0.0);
    Shape {
        profile,
        ends: [if has_side { End::Rim } else { End::Open }, End::Rim],
        sense: Sense::Concave,
        form: Form::Open,
    }
}

fn stepped(scope: &Scope, chance: &mut Chance) -> Shape {
    let mut profile = Profile::new();
    let (upper, lower) = (scope.depth(chance), scope.depth(chance));
    let ledge = scope.pitch_mm * chance.scaled(5.0, 25.0);
    let walls = [upper, lower].map(|height| Wall {
        run_mm: 0.0,
        upper: edge(height, 0.15, chance),
        lower: Edge::Sharp,
    });
    profile.line(scope.rim(chance), 0.0).wall(-upper, &walls[0]);
    profile.line(ledge, 0.0).wall(-lower, &walls[1]);
    let width = scope.width(chance);
    if chance.happens(0.2) {
        profile.line(0.5 * width, -0.3 * width);
        profile.line(0.5 * width, 0.3 * width);
    } else {
        profile.line(width, 0.0);
    }
    profile.wall(lower, &walls[1]).line(ledge, 0.0);
    let last = other_height(upper, scope, chance);
    let last_wall = Wall {
        run_mm: 0.0,
        ..walls[0]
    };
    profile.wall(last, &last_wall).line(scope.rim(chance), 0.0);
    Shape {
        profile,
        ends: [End::Rim; 2],
        sense: Sense::Concave,
        form: Form::Circular,
    }
}

fn countersunk(scope: &Scope, chance: &mut Chance) -> Shape {
    let mut profile = Profile::new();
    let lower = scope.depth(chance);
    let slope = libm::tan(f64::to_radians(chance.between(34.0, 60.0)));
    // As deep as to be no chamfer, with some samples on it.
    let cone = (lower * chance.scaled(0.4, 2.0)).max(scope.least_mm.max(5.0 * scope.pitch_mm));
    let own = Wall {
        run_mm: 0.0,
        upper: Edge::Sharp,
        lower: Edge::Sharp,
    };
    let width = scope.width(chance);
    profile.line(scope.rim(chance), 0.0);
    profile.line(cone / slope, -cone).wall(-lower, &own);
    if chance.happens(0.2) {
        profile.line(0.5 * width, -0.3 * width);
        profile.line(0.5 * width, 0.3 * width);
    } else {
        profile.line(width, 0.0);
    }
    profile.wall(lower, &own).line(cone / slope, cone);
    profile.line(scope.rim(chance), 0.0);
    Shape {
        profile,
        ends: [End::Rim; 2],
        sense: Sense::Concave,
        form: Form::Circular,
    }
}
