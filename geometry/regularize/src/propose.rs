//! Which regularities come into question.

use shapes::Family;

use crate::chart::{HALF_ANGLE, RADIUS, TUBE};
use crate::rule::{Mirror, Rule, Size, axes_apart, planes_apart};
use crate::settings::{Grid, ROUND_ANGLES_DEG, Settings};
use crate::state::State;

/// Most pairs whose mirrors are held against each other.
const MOST_PAIRS: usize = 400;
/// Mirrors whose normals are farther apart, radians, or that are farther apart, of the part's
/// size, are not looked at; they are counted.
const MIRRORS_LEAN: f64 = 0.1;
const MIRRORS_APART: f64 = 0.1;
/// Planes whose normals differ by less have no mirror worth the name.
const LEAST_FOLD: f64 = 0.1;

/// Rules of one kind, and how many were tried to find them.
#[derive(Debug, Default)]
pub(crate) struct Proposals {
    /// Each with the half width of its range, where the rule does not know it.
    pub(crate) rules: Vec<(Rule, Option<f64>)>,
    /// Besides these, rules that could not but be far off.
    pub(crate) more: usize,
}

impl Proposals {
    fn all(rules: impl IntoIterator<Item = Rule>) -> Self {
        Self {
            rules: rules.into_iter().map(|rule| (rule, None)).collect(),
            more: 0,
        }
    }
}

impl State {
    fn count(&self) -> usize {
        self.charts.len()
    }

    fn family(&self, shape: usize) -> Family {
        self.charts[shape].base.family
    }

    fn has_direction(&self, shape: usize) -> bool {
        self.family(shape) != Family::Sphere
    }

    fn has_axis(&self, shape: usize) -> bool {
        !matches!(self.family(shape), Family::Plane | Family::Sphere)
    }

    fn is(&self, rule: &Rule) -> bool {
        let standing = self.standing(rule, Some(1.0));
        standing.is_some_and(|standing| standing.is_implied())
    }

    fn pairs(&self, of: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
        let own: Vec<usize> = (0..self.count()).filter(|shape| of(*shape)).collect();
        let each = own.iter().enumerate();
        each.flat_map(|(k, a)| own[k + 1..].iter().map(|b| (*a, *b)))
            .collect()
    }

    /// Directions: each kind by itself.
    pub(crate) fn directions(&self, settings: &Settings) -> Vec<Proposals> {
        let pairs = self.pairs(|shape| self.has_direction(shape));
        let of = |rule: fn(usize, usize) -> Rule| {
            Proposals::all(pairs.iter().map(|(a, b)| rule(*a, *b)))
        };
        let mut all = vec![of(Rule::Aligned), of(Rule::Orthogonal)];
        if settings.angles {
            let angles = ROUND_ANGLES_DEG.into_iter();
            let at = angles
                .flat_map(|angle| pairs.iter().map(move |(a, b)| Rule::AtAngle(*a, *b, angle)));
            all.push(Proposals::all(at));
        }
        if settings.frame {
            let own = || (0..self.count()).filter(|shape| self.has_direction(*shape));
            let each = || own().flat_map(|shape| (0..3).map(move |axis| (shape, axis)));
            all.push(Proposals::all(each().map(|(a, k)| Rule::AlongFrame(a, k))));
            all.push(Proposals::all(each().map(|(a, k)| Rule::AcrossFrame(a, k))));
        }
        all
    }

    /// Places of what has one direction, and of centres.
    pub(crate) fn places(&self) -> Vec<Proposals> {
        let planes = self.parallel(|shape| self.family(shape) == Family::Plane);
        let face_alike = |a: usize, b: usize| {
            let [a, b] = [a, b].map(|shape| self.told(shape).direction);
            a.dot(&b) > 0.0
        };
        let coplanar = planes.into_iter().filter(|(a, b)| face_alike(*a, *b));
        let axes = self.parallel(|shape| self.has_axis(shape));
        let is_ball = |shape: usize| self.family(shape) == Family::Sphere;
        let balls = (0..self.count()).filter(|shape| is_ball(*shape));
        let on_axis = balls.flat_map(|ball| {
            let axes = (0..self.count()).filter(|shape| self.has_axis(*shape));
            axes.map(move |axis| Rule::OnAxis(ball, axis))
        });
        let concentric = self.pairs(is_ball).into_iter();
        vec![
            Proposals::all(coplanar.map(|(a, b)| Rule::Coplanar(a, b))),
            Proposals::all(axes.into_iter().map(|(a, b)| Rule::Coaxial(a, b))),
            Proposals::all(on_axis),
            Proposals::all(concentric.map(|(a, b)| Rule::Concentric(a, b))),
        ]
    }

    /// Pairs that have been found to be of one direction.
    fn parallel(&self, of: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
        let pairs = self.pairs(of).into_iter();
        pairs
            .filter(|(a, b)| self.is(&Rule::Aligned(*a, *b)))
            .collect()
    }

    /// Sizes that shapes have: those of balls that fit, those of rings, half angles.
    fn sizes(&self) -> [Vec<Size>; 3] {
        let mut all = [Vec::new(), Vec::new(), Vec::new()];
        for shape in 0..self.count() {
            match self.family(shape) {
                Family::Plane => {}
                Family::Sphere | Family::Cylinder => all[0].push((shape, RADIUS)),
                Family::Cone => all[2].push((shape, HALF_ANGLE)),
                Family::Torus => {
                    all[0].push((shape, TUBE));
                    all[1].push((shape, RADIUS));
                }
            }
        }
        all
    }

    pub(crate) fn same_sizes(&self) -> Vec<Proposals> {
        let of = |sizes: Vec<Size>| {
            let each = sizes.iter().enumerate();
            let pairs = each.flat_map(|(k, a)| sizes[k + 1..].iter().map(|b| (*a, *b)));
            Proposals::all(pairs.map(|(a, b)| Rule::SameSize(a, b)))
        };
        self.sizes().map(of).into()
    }

    /// Pairs that are mirrored in the plane of another pair, and what lies in such a plane.
    pub(crate) fn symmetric(&self) -> Vec<Proposals> {
        let told: Vec<_> = (0..self.count()).map(|shape| self.told(shape)).collect();
        let planes = self.pairs(|shape| self.family(shape) == Family::Plane);
        let folded = planes.into_iter().filter(|(a, b)| {
            let (a, b) = (told[*a].direction, told[*b].direction);
            (a - b).norm() >= LEAST_FOLD
        });
        let is_cylinder = |shape: usize| self.family(shape) == Family::Cylinder;
        let bores = self.parallel(is_cylinder).into_iter();
        let bores = bores.filter(|(a, b)| axes_apart(&told[*a], &told[*b]).norm() > 0.0);
        let balls = self.pairs(|shape| self.family(shape) == Family::Sphere);
        let round = bores.chain(balls);
        let alike = round.filter(|(a, b)| self.is(&Rule::SameSize((*a, RADIUS), (*b, RADIUS))));
        let pairs: Vec<[usize; 2]> = folded.chain(alike).map(|(a, b)| [a, b]).collect();
        let (mut mirrored, mut centred) = (Proposals::default(), Proposals::default());
        if pairs.len() > MOST_PAIRS {
            return vec![mirrored, centred];
        }
        let middle = told
            .iter()
            .map(|told| told.place)
            .sum::<nalgebra::Vector3<f64>>()
            / told.len().max(1) as f64;
        let at = |shape: usize| told[shape];
        let mirrors: Vec<Mirror> = pairs
            .iter()
            .map(|pair| Mirror::of(&at, *pair, &middle))
            .collect();
        let apart_mm = MIRRORS_APART * self.size_mm;
        for (k, (pair, mirror)) in pairs.iter().zip(&mirrors).enumerate() {
            for (other, own) in pairs[k + 1..].iter().zip(&mirrors[k + 1..]) {
                if pair.iter().any(|shape| other.contains(shape)) {
                    continue;
                }
                let sense = mirror.normal.dot(&own.normal).signum();
                let lean = (own.normal * sense - mirror.normal).norm();
                let off_mm = (own.offset_mm * sense - mirror.offset_mm).abs();
                if lean <= MIRRORS_LEAN && off_mm <= apart_mm {
                    mirrored.rules.push((Rule::Mirrored(*pair, *other), None));
                } else {
                    mirrored.more += 1;
                }
            }
            for (shape, own) in told.iter().enumerate() {
                if own.family == Family::Plane || pair.contains(&shape) {
                    continue;
                }
                let off_mm = mirror.normal.dot(&(own.place - middle)) - mirror.offset_mm;
                let lean = mirror.normal.dot(&own.direction);
                if lean.abs() <= MIRRORS_LEAN && off_mm.abs() <= apart_mm {
                    centred.rules.push((Rule::Centred(*pair, shape), None));
                } else {
                    centred.more += 1;
                }
            }
        }
        vec![mirrored, centred]
    }

    /// Lengths on a grid, millimetres.
    pub(crate) fn round_lengths(&self, grid_mm: Grid) -> Proposals {
        let [balls, rings, _] = self.sizes();
        let mut rules = Vec::new();
        for sizes in [balls, rings] {
            for size in self.unlike(&sizes, Rule::SameSize) {
                let (shape, index) = size;
                let own = self.told(shape).sizes[index];
                rules.extend(grid_mm.nearest(own).map(|target| Rule::Round(size, target)));
            }
        }
        let of = |is: &dyn Fn(usize) -> bool| -> Vec<usize> {
            (0..self.count()).filter(|shape| is(*shape)).collect()
        };
        let planes = of(&|shape| self.family(shape) == Family::Plane);
        let planes = self.unlike(&planes, Rule::Coplanar);
        let axes = of(&|shape| self.has_axis(shape));
        let axes = self.unlike(&axes, Rule::Coaxial);
        let is_parallel = |a: usize, b: usize| self.is(&Rule::Aligned(a, b));
        for (k, a) in planes.iter().enumerate() {
            for b in planes[k + 1..].iter().filter(|b| is_parallel(*a, **b)) {
                let apart_mm = planes_apart(&self.told(*a), &self.told(*b)).abs();
                let target = grid_mm.nearest(apart_mm);
                rules.extend(target.map(|target| Rule::PlanesApart(*a, *b, target)));
            }
        }
        for (k, a) in axes.iter().enumerate() {
            for b in axes[k + 1..].iter().filter(|b| is_parallel(*a, **b)) {
                let apart_mm = axes_apart(&self.told(*a), &self.told(*b)).norm();
                let target = grid_mm.nearest(apart_mm);
                rules.extend(target.map(|target| Rule::AxesApart(*a, *b, target)));
            }
            for b in &planes {
                if self.is(&Rule::Orthogonal(*a, *b)) {
                    let (axis, plane) = (self.told(*a), self.told(*b));
                    let off_mm = (axis.place - plane.place).dot(&plane.direction).abs();
                    let target = grid_mm.nearest(off_mm);
                    rules.extend(target.map(|target| Rule::AxisOffPlane(*a, *b, target)));
                }
            }
        }
        let half = Some(0.5 * grid_mm.pitch());
        Proposals {
            rules: rules.into_iter().map(|rule| (rule, half)).collect(),
            more: 0,
        }
    }

    /// Half angles on a grid, degrees.
    pub(crate) fn round_angles(&self, grid_deg: Grid) -> Proposals {
        let [_, _, angles] = self.sizes();
        let mut rules = Vec::new();
        for size in self.unlike(&angles, Rule::SameSize) {
            let own = self.told(size.0).sizes[size.1].to_degrees();
            let target = grid_deg.nearest(own).map(f64::to_radians);
            rules.extend(target.map(|target| Rule::Round(size, target)));
        }
        let half = Some(0.5 * grid_deg.pitch().to_radians());
        Proposals {
            rules: rules.into_iter().map(|rule| (rule, half)).collect(),
            more: 0,
        }
    }

    /// One of each group that a rule makes one.
    fn unlike<T: Copy>(&self, all: &[T], rule: impl Fn(T, T) -> Rule) -> Vec<T> {
        let mut unlike: Vec<T> = Vec::new();
        for own in all {
            if !unlike.iter().any(|other| self.is(&rule(*other, *own))) {
                unlike.push(*own);
            }
        }
        unlike
    }
}
