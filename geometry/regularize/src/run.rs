//! One kind of regularity after the other, the likeliest first.

use nalgebra::SMatrix;
use shapes::Family;

use crate::chance::{discoveries, survival, tail};
use crate::chart::{HALF_ANGLE, MOST, TUBE};
use crate::found::{Kind, Reason, Refused, Regularity, Target};
use crate::propose::Proposals;
use crate::rule::Rule;
use crate::settings::{ANGLE_GRIDS_DEG, Settings};
use crate::state::{Held, Standing, State};
use crate::touch::ways;

/// What is refused is listed where it is off by no more than so many times the bound, or, where
/// others contradict it, by so many standard deviations.
const WORTH_TELLING: f64 = 3.0;

/// How many standard uncertainties neighbours that seem to touch may be off it, as
/// [`Settings::bound`] has it: more than what is sought among all shapes, of which most have no tie.
pub const TANGENT_BOUND: f64 = 4.0;

/// A rule with how it stands.
struct Candidate {
    rule: Rule,
    range: Option<f64>,
    standing: Standing,
}

/// The search under way.
pub(crate) struct Run<'a> {
    pub(crate) state: State,
    settings: &'a Settings,
    labels: &'a [u16],
    /// In step with what is accepted: of tangent surfaces several.
    held: Vec<Vec<Held>>,
    pub(crate) accepted: Vec<Regularity>,
    pub(crate) refused: Vec<Refused>,
}

impl<'a> Run<'a> {
    pub(crate) fn new(state: State, settings: &'a Settings, labels: &'a [u16]) -> Self {
        Self {
            state,
            settings,
            labels,
            held: Vec::new(),
            accepted: Vec::new(),
            refused: Vec::new(),
        }
    }

    pub(crate) fn all(&mut self) {
        let settings = self.settings;
        let directions = self.state.directions(settings);
        self.phase(directions, settings.chance);
        let places = self.state.places();
        self.phase(places, settings.chance);
        let sizes = self.state.same_sizes();
        self.phase(sizes, settings.chance);
        let symmetric = self.state.symmetric();
        self.phase(symmetric, settings.chance);
        // Half of the chance is the coarsest grid's, and half of the rest the next one's.
        let share = |index: usize| settings.chance * 0.5_f64.powi(index as i32 + 1);
        for (index, grid_deg) in ANGLE_GRIDS_DEG.into_iter().enumerate() {
            let angles = self.state.round_angles(grid_deg);
            self.phase(vec![angles], share(index));
        }
        for (index, grid_mm) in settings.round.grids_mm().into_iter().enumerate() {
            let lengths = self.state.round_lengths(grid_mm);
            self.phase(vec![lengths], share(index));
        }
    }

    /// The shapes that rules tie.
    pub(crate) fn tied(&self) -> Vec<usize> {
        let held = self.held.iter().flatten();
        let mut tied: Vec<usize> = held.flat_map(|own| own.rule.shapes()).collect();
        tied.sort_unstable();
        tied.dedup();
        tied
    }

    /// Covariance of a shape as it is now.
    pub(crate) fn covariance(&self, shape: usize) -> SMatrix<f64, MOST, MOST> {
        self.state.covariance(shape)
    }

    fn phase(&mut self, kinds: Vec<Proposals>, share: f64) {
        let mut candidates = Vec::new();
        for proposals in kinds {
            candidates.extend(self.likely(proposals, share));
        }
        candidates.sort_by(|a: &Candidate, b: &Candidate| {
            let odds = b.standing.log_odds.total_cmp(&a.standing.log_odds);
            odds.then_with(|| self.labels_of(&a.rule).cmp(&self.labels_of(&b.rule)))
        });
        let before = self.held.len();
        for candidate in candidates {
            self.try_one(&candidate);
        }
        self.solve_from(before);
    }

    /// Solves for all that holds together; what was accepted last, but for the first so many, is
    /// given up where that leads nowhere.
    fn solve_from(&mut self, before: usize) {
        while self.held.len() > before && !self.state.solve(self.held.iter().flatten()) {
            self.held.pop();
            if let Some(last) = self.accepted.pop() {
                self.refused.push(Refused::of(&last, Reason::Contradicted));
            }
        }
    }

    /// The rules that hold within the bound, and hardly by chance.
    fn likely(&mut self, proposals: Proposals, share: f64) -> Vec<Candidate> {
        let bound = tail(self.settings.bound);
        let mut tried = proposals.more;
        let (mut within, mut beyond) = (Vec::new(), Vec::new());
        for (rule, range) in proposals.rules {
            let Some(standing) = self.state.standing(&rule, range) else {
                continue;
            };
            if standing.is_implied() {
                continue;
            }
            tried += 1;
            let candidate = Candidate {
                rule,
                range,
                standing,
            };
            if candidate.standing.is_contradicted() {
                if candidate.standing.settled_off <= WORTH_TELLING && range.is_none() {
                    self.refuse(&candidate, Reason::Contradicted);
                }
            } else if candidate.standing.p >= bound {
                within.push(candidate);
            } else {
                beyond.push(candidate);
            }
        }
        within.sort_by(|a, b| a.standing.chance.total_cmp(&b.standing.chance));
        let chances: Vec<f64> = within.iter().map(|own| own.standing.chance).collect();
        let found = discoveries(&chances, tried, share);
        for candidate in within.drain(found..) {
            if candidate.range.is_none() {
                self.refuse(&candidate, Reason::MaybeChance);
            }
        }
        let told = tail(WORTH_TELLING * self.settings.bound);
        for candidate in beyond {
            let is_rare = candidate.standing.chance * tried as f64 <= share;
            if candidate.standing.p >= told && is_rare && candidate.range.is_none() {
                self.refuse(&candidate, Reason::TooFar);
            }
        }
        within
    }

    /// Lets a rule hold if what holds already leaves it within the bound.
    fn try_one(&mut self, candidate: &Candidate) {
        let Some(standing) = self.state.standing(&candidate.rule, candidate.range) else {
            return;
        };
        if standing.is_implied() {
            return;
        }
        let candidate = Candidate {
            standing,
            ..*candidate
        };
        let standing = &candidate.standing;
        if standing.is_contradicted() || standing.p < tail(self.settings.bound) {
            return self.refuse(&candidate, Reason::Contradicted);
        }
        let moved = self.state.after(standing);
        if !self.is_within_limits(&moved) {
            return self.refuse(&candidate, Reason::Limit);
        }
        let (turned_rad, moved_mm) = self.extent(&candidate.rule, &moved);
        let (kind, target) = self.kind(&candidate.rule);
        let (off_rad, off_mm) = self.state.off_at_fits(&candidate.rule);
        self.accepted.push(Regularity {
            kind,
            labels: self.labels_of(&candidate.rule),
            target,
            off_rad,
            off_mm,
            deviations: standing.squares.sqrt(),
            freedom: standing.freedom,
            p: standing.p,
            chance: standing.chance,
            turned_rad,
            moved_mm,
        });
        let held = self.state.hold(standing);
        self.held.push(vec![held]);
    }

    /// Makes neighbours touch that go over into each other smoothly, the likeliest first.
    pub(crate) fn touch(&mut self, pairs: &[[usize; 2]]) {
        let before = self.held.len();
        let best = |state: &State, pair: &[usize; 2]| {
            let ways = ways(pair[0], pair[1], &state.charts);
            let found = ways.iter().filter_map(|way| Touching::of(state, way));
            found.max_by(|a, b| a.p.total_cmp(&b.p))
        };
        let found = pairs.iter().filter_map(|pair| best(&self.state, pair));
        let mut found: Vec<Touching> = found.collect();
        found.sort_by(|a, b| {
            let likely = b.p.total_cmp(&a.p);
            likely.then_with(|| self.labels_of(&a.way[0]).cmp(&self.labels_of(&b.way[0])))
        });
        for first in found {
            if first.p < tail(TANGENT_BOUND) {
                self.refused.push(first.refused(self, Reason::TooFar));
                continue;
            }
            let now = Touching::of(&self.state, &first.way);
            let now = now.filter(|now| now.p >= tail(TANGENT_BOUND));
            let Some(now) = now else {
                self.refused.push(first.refused(self, Reason::Contradicted));
                continue;
            };
            if now.held.is_empty() {
                continue;
            }
            if !self.is_within_limits(&now.state.moved) {
                self.refused.push(now.refused(self, Reason::Limit));
                continue;
            }
            let told = now.accepted(self);
            self.accepted.push(told);
            self.held.push(now.held);
            self.state = now.state;
        }
        self.solve_from(before);
    }

    /// By how much the free numbers become others in the shapes of a rule.
    fn extent(&self, rule: &Rule, moved: &[f64]) -> (f64, f64) {
        let (mut turned_rad, mut moved_mm) = (0.0_f64, 0.0_f64);
        for shape in rule.shapes() {
            let [now, then] = [&self.state.moved, moved].map(|all| self.state.of(all, shape));
            let step: Vec<f64> = now.iter().zip(then).map(|(now, then)| then - now).collect();
            let (turned, moved) = self.state.charts[shape].extent(&step);
            turned_rad = turned_rad.max(turned);
            moved_mm = moved_mm.max(moved);
        }
        (turned_rad, moved_mm)
    }

    fn is_within_limits(&self, moved: &[f64]) -> bool {
        self.state.charts.iter().enumerate().all(|(shape, chart)| {
            let own = self.state.of(moved, shape);
            let (turned_rad, moved_mm) = chart.extent(own);
            let sizes = chart.told(own).sizes;
            let is_shape = sizes
                .iter()
                .zip(&chart.base.sizes)
                .all(|(now, before)| *before <= 0.0 || *now > 0.0)
                && sizes[HALF_ANGLE] < core::f64::consts::FRAC_PI_2;
            turned_rad <= self.settings.most_rad && moved_mm <= self.settings.most_mm && is_shape
        })
    }

    fn refuse(&mut self, candidate: &Candidate, reason: Reason) {
        let (kind, target) = self.kind(&candidate.rule);
        let (off_rad, off_mm) = self.state.off_at_fits(&candidate.rule);
        let standing = &candidate.standing;
        self.refused.push(Refused {
            kind,
            labels: self.labels_of(&candidate.rule),
            target,
            off_rad,
            off_mm,
            deviations: standing.squares.sqrt(),
            p: standing.p,
            reason,
        });
    }

    fn labels_of(&self, rule: &Rule) -> Vec<u16> {
        rule.shapes().iter().map(|s| self.labels[*s]).collect()
    }

    /// What a rule is to people: a plane is parallel to an axis that its normal is square to.
    fn kind(&self, rule: &Rule) -> (Kind, Option<Target>) {
        let is_plane = |shape: usize| self.state.charts[shape].base.family == Family::Plane;
        let mm = |value: f64| Some(Target::Millimetres(value));
        match *rule {
            Rule::Aligned(a, b) if is_plane(a) == is_plane(b) => (Kind::Parallel, None),
            Rule::Orthogonal(a, b) if is_plane(a) != is_plane(b) => (Kind::Parallel, None),
            Rule::Aligned(..) | Rule::Orthogonal(..) => (Kind::Perpendicular, None),
            Rule::AtAngle(a, b, degrees) => {
                let told = if is_plane(a) == is_plane(b) {
                    degrees
                } else {
                    90.0 - degrees
                };
                (Kind::Angle, Some(Target::Degrees(told)))
            }
            Rule::AlongFrame(a, axis) if is_plane(a) => (Kind::AcrossFrame(axis), None),
            Rule::AcrossFrame(a, axis) if is_plane(a) => (Kind::AlongFrame(axis), None),
            Rule::AlongFrame(_, axis) => (Kind::AlongFrame(axis), None),
            Rule::AcrossFrame(_, axis) => (Kind::AcrossFrame(axis), None),
            Rule::Coplanar(..) => (Kind::Coplanar, None),
            Rule::Coaxial(..) => (Kind::Coaxial, None),
            Rule::OnAxis(..) => (Kind::OnAxis, None),
            Rule::Concentric(..) => (Kind::Concentric, None),
            Rule::SameSize((_, HALF_ANGLE), _) => (Kind::EqualHalfAngles, None),
            Rule::SameSize(..) => (Kind::EqualRadii, None),
            Rule::Mirrored(..) => (Kind::Symmetric, None),
            Rule::Centred(..) => (Kind::Centred, None),
            Rule::Round((_, HALF_ANGLE), target) => {
                let degrees = Some(Target::Degrees(target.to_degrees()));
                (Kind::RoundHalfAngle, degrees)
            }
            Rule::Round((_, TUBE), target) => (Kind::RoundTubeRadius, mm(target)),
            Rule::Round(_, target) => (Kind::RoundRadius, mm(target)),
            Rule::PlanesApart(_, _, target)
            | Rule::AxesApart(_, _, target)
            | Rule::AxisOffPlane(_, _, target) => (Kind::RoundDistance, mm(target)),
            Rule::TouchesPlane(..)
            | Rule::LiesOnPlane(..)
            | Rule::AxesTouch(..)
            | Rule::MeridiansTouch(..)
            | Rule::AlongSpine(..)
            | Rule::OnSpine(..) => (Kind::Tangent, None),
        }
    }
}

/// Two shapes that are to touch, with what becomes of all if they do.
struct Touching {
    way: Vec<Rule>,
    state: State,
    held: Vec<Held>,
    /// As [`Standing`] has it, of all rules together.
    squares: f64,
    freedom: usize,
    p: f64,
    chance: f64,
}

impl Touching {
    /// `None` where other rules make them not touch.
    fn of(state: &State, way: &[Rule]) -> Option<Self> {
        let mut own = Self {
            way: way.to_vec(),
            state: state.clone(),
            held: Vec::new(),
            squares: 0.0,
            freedom: 0,
            p: 1.0,
            chance: 1.0,
        };
        for rule in way {
            let standing = own.state.standing(rule, None)?;
            if standing.is_contradicted() {
                return None;
            }
            if standing.is_implied() {
                continue;
            }
            own.squares += standing.squares;
            own.freedom += standing.freedom;
            own.chance *= standing.chance;
            let held = own.state.hold(&standing);
            own.held.push(held);
        }
        if own.freedom > 0 {
            own.p = survival(own.squares, own.freedom);
        }
        Some(own)
    }

    /// How far both are off at the fits: angles, radians, and lengths, millimetres.
    fn off(&self) -> (Option<f64>, Option<f64>) {
        let off = |rule: &Rule| self.state.off_at_fits(rule);
        let most = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        let each = self.way.iter().map(off);
        each.fold((None, None), |(rad, mm), own| {
            (most(rad, own.0), most(mm, own.1))
        })
    }

    fn accepted(&self, run: &Run<'_>) -> Regularity {
        let (off_rad, off_mm) = self.off();
        let (turned_rad, moved_mm) = run.extent(&self.way[0], &self.state.moved);
        Regularity {
            kind: Kind::Tangent,
            labels: run.labels_of(&self.way[0]),
            target: None,
            off_rad,
            off_mm,
            deviations: self.squares.sqrt(),
            freedom: self.freedom,
            p: self.p,
            chance: self.chance,
            turned_rad,
            moved_mm,
        }
    }

    fn refused(&self, run: &Run<'_>, reason: Reason) -> Refused {
        Refused::of(&self.accepted(run), reason)
    }
}
