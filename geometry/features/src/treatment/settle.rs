//! The section of a treated edge, and where its wall is, by the likelihood of the samples on both
//! sides of the wall: what is steep is hardly seen, so neither is known without the other.

use super::places::Place;
use super::section::{Section, Strays};
use crate::outline::{Circle, Rectangle, Shape};

/// What is known of an edge before its section is.
#[derive(Debug, Clone)]
pub(super) struct Edge {
    /// What is seen of it.
    pub(super) places: Vec<Place>,
    /// The outline as measured.
    pub(super) outline: Shape,
    /// Whether the section lies within the outline.
    pub(super) is_inside: bool,
    /// How far what was seen as the strip reaches from the outline, millimetres.
    pub(super) reach_mm: f64,
    /// How well the outline is known, millimetres: by a normal deviation at feet of walls, and at
    /// broken edges unless the samples say otherwise.
    pub(super) known: Known,
    /// How samples stray.
    pub(super) strays: Strays,
}

/// How the walls of an outline may lie off where they were measured, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Known {
    /// By a normal deviation.
    Normal(f64),
    /// By one with long tails, since the walls were taken for what lies beside them.
    Tailed(f64),
}

impl Known {
    /// Logarithm of how likely a way is, but for what is the same for all.
    fn log_likelihood(self, way_mm: f64) -> f64 {
        match self {
            Self::Normal(sigma) => -0.5 * (way_mm / sigma) * (way_mm / sigma),
            Self::Tailed(sigma) => -libm::log1p((way_mm / sigma) * (way_mm / sigma)),
        }
    }
}

/// The section of an edge that is likeliest among those of one kind.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    pub(super) section: Section,
    pub(super) outline: Shape,
    /// Standard uncertainty of its width or radius, and of its rise, millimetres.
    pub(super) sigmas_mm: [f64; 2],
    /// Covariance of the outline's numbers, see [`Shape::numbers`].
    pub(super) covariance: [[f64; 6]; 6],
    pub(super) log_likelihood: f64,
    /// Numbers that were free.
    pub(super) freedom: usize,
}

impl Settled {
    /// Logarithm of the likelihood, less what its free numbers cost (Schwarz 1978).
    pub(super) fn evidence(&self, samples: usize) -> f64 {
        let cost = self.freedom as f64 * libm::log(samples.max(2) as f64);
        self.log_likelihood - 0.5 * cost
    }
}

/// Which section is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    Arc,
    Slant,
    /// None: the wall meets the face.
    Plain,
}

/// Places by which the search begins, and by which it ends.
const FEW: usize = 700;
const MANY: usize = 6000;
/// The search begins with places across walls so many times as uncertain.
const SOFTER: f64 = 4.0;
/// Widths tried first, shares of the reach.
const WIDTHS: [f64; 10] = [0.3, 0.45, 0.6, 0.75, 0.9, 1.05, 1.25, 1.5, 1.8, 2.2];
/// Slopes of slants tried first.
const SLOPES: [f64; 3] = [0.6, 1.0, 1.7];
/// No section is narrower than this share of the reach.
const NARROWEST: f64 = 0.3;
/// Ways of all walls outwards tried first, shares of the width.
const WAYS: [f64; 9] = [-0.3, -0.15, 0.0, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0];
/// The search's steps: the first as a share of the width, and the least, millimetres.
const FIRST_STEP: f64 = 0.12;
const LEAST_STEP_MM: f64 = 0.001;
/// Sweeps for each step at most.
const SWEEPS: usize = 6;

/// Corners are round from this share of the reach on.
const ROUND_CORNER: f64 = 0.3;
/// How far walls are moved to find the middle of where they may lie, in uncertainties of places
/// across them, and steps on either side.
const AMID_BLURS: f64 = 40.0;
const AMID_STEPS: i32 = 60;

/// Numbers that are searched for: width, slope, turn as a way at the outline's reach, ways outwards of
/// the walls that there are (of a circle: of its radius, then of its centre along u and v).
type Numbers = [f64; 7];
const WIDTH: usize = 0;
const SLOPE: usize = 1;
const TURN: usize = 2;
const WALLS: usize = 3;

impl Edge {
    /// The likeliest section of a form; `None` where there is none to be found.
    pub(super) fn settled(&self, form: Form) -> Option<Settled> {
        let soft = self.thinned(FEW, SOFTER);
        let mut best: Option<(f64, Numbers)> = None;
        let free = self.free(form);
        let widths = if form == Form::Plain {
            &[0.0][..]
        } else {
            &WIDTHS[..]
        };
        for width in widths {
            let slopes = if form == Form::Slant {
                &SLOPES[..]
            } else {
                &[1.0][..]
            };
            for slope in slopes {
                for way in WAYS {
                    let mut numbers = [0.0; 7];
                    numbers[WIDTH] = width * self.reach_mm;
                    numbers[SLOPE] = *slope;
                    let way_mm = way * numbers[WIDTH].max(0.5 * self.reach_mm);
                    self.move_walls(&free, &mut numbers, way_mm);
                    let own = soft.log_likelihood(form, &numbers);
                    if own.is_finite() && best.is_none_or(|(most, _)| own > most) {
                        best = Some((own, numbers));
                    }
                }
            }
        }
        let (_, start) = best?;
        let near = soft.climbed(form, start, LEAST_STEP_MM * 10.0);
        let sharp = self.thinned(MANY, 1.0);
        let numbers = sharp.climbed(form, near, LEAST_STEP_MM);
        let numbers = match form {
            Form::Plain => numbers,
            Form::Arc | Form::Slant => sharp.amid(form, &numbers),
        };
        // Fewer samples say less than all of them do.
        let share = sharp.places.len() as f64 / self.places.len().max(1) as f64;
        sharp.told(form, &numbers, share)
    }

    /// The same by fewer samples, and with places across walls so many times as uncertain.
    fn thinned(&self, most: usize, softer: f64) -> Self {
        let stride = self.places.len().div_ceil(most).max(1);
        Self {
            places: self.places.iter().copied().step_by(stride).collect(),
            strays: Strays {
                blur_mm: softer * self.strays.blur_mm,
                ..self.strays
            },
            ..*self
        }
    }

    /// Which numbers are free.
    fn free(&self, form: Form) -> Vec<usize> {
        let mut free = match form {
            Form::Arc => vec![WIDTH],
            Form::Slant => vec![WIDTH, SLOPE],
            Form::Plain => Vec::new(),
        };
        match self.outline {
            Shape::Circle(_) => free.extend([WALLS, WALLS + 1, WALLS + 2]),
            Shape::Rectangle(own) => {
                free.push(TURN);
                free.extend(
                    (0..4)
                        .filter(|side| own.walls[*side])
                        .map(|side| WALLS + side),
                );
            }
        }
        free
    }

    /// The outline, moved.
    fn moved(&self, numbers: &Numbers) -> Option<Shape> {
        match self.outline {
            Shape::Circle(own) => {
                let radius_mm = own.radius_mm + numbers[WALLS];
                let [u, v] = own.centre_mm;
                let centre_mm = [u + numbers[WALLS + 1], v + numbers[WALLS + 2]];
                (radius_mm > 0.0).then_some(Shape::Circle(Circle {
                    centre_mm,
                    radius_mm,
                }))
            }
            Shape::Rectangle(own) => {
                let sizes = own.sizes_mm();
                let half = 0.5 * sizes[0].max(sizes[1]);
                let angle_rad = own.angle_rad + numbers[TURN] / half;
                // About its middle.
                let turned = Rectangle { angle_rad, ..own };
                let [a, b] = turned.along(own.middle_mm());
                let [w0, w1, w2, w3] = [0, 1, 2, 3].map(|side| numbers[WALLS + side]);
                let first_mm = [a - 0.5 * sizes[0] - w0, a + 0.5 * sizes[0] + w1];
                let second_mm = [b - 0.5 * sizes[1] - w2, b + 0.5 * sizes[1] + w3];
                let moved = Rectangle {
                    first_mm,
                    second_mm,
                    ..turned
                };
                let [first, second] = moved.sizes_mm();
                let least = first.min(second);
                // A corner that is round stays about its middle.
                let further = if own.corner_mm > ROUND_CORNER * self.reach_mm {
                    0.25 * (w0 + w1 + w2 + w3)
                } else {
                    0.0
                };
                (least > 0.0).then_some(Shape::Rectangle(Rectangle {
                    corner_mm: (own.corner_mm + further).max(0.0).min(0.5 * least),
                    ..moved
                }))
            }
        }
    }

    fn section(form: Form, numbers: &Numbers) -> Section {
        match form {
            Form::Arc => Section::Arc(numbers[WIDTH]),
            Form::Slant => Section::Slant(numbers[WIDTH], numbers[SLOPE] * numbers[WIDTH]),
            Form::Plain => Section::Slant(0.0, 0.0),
        }
    }

    fn log_likelihood(&self, form: Form, numbers: &Numbers) -> f64 {
        let is_one = numbers[WIDTH] >= NARROWEST * self.reach_mm && numbers[SLOPE] > 0.0;
        if form != Form::Plain && !is_one {
            return f64::NEG_INFINITY;
        }
        let Some(shape) = self.moved(numbers) else {
            return f64::NEG_INFINITY;
        };
        let section = Self::section(form, numbers);
        let sign = if self.is_inside { -1.0 } else { 1.0 };
        let rise_mm = section.rise_mm();
        let distance_mm = shape.distances();
        let of_places = self.places.iter().map(|own| {
            let distance_mm = sign * distance_mm(own.beside(rise_mm));
            self.strays
                .log_likelihood(section, distance_mm, own.height_mm)
        });
        let ways = numbers[TURN..].iter();
        of_places.sum::<f64>() + ways.map(|way| self.known.log_likelihood(*way)).sum::<f64>()
    }

    /// Moves all walls out of the material that the section is of.
    fn move_walls(&self, free: &[usize], numbers: &mut Numbers, way_mm: f64) {
        let outwards = if self.is_inside { way_mm } else { -way_mm };
        let walls = match self.outline {
            Shape::Circle(_) => 1,
            Shape::Rectangle(_) => 4,
        };
        for index in free
            .iter()
            .filter(|index| (WALLS..WALLS + walls).contains(*index))
        {
            numbers[*index] += outwards;
        }
    }

    /// Climbs along the numbers one by one, with steps that become smaller.
    fn climbed(&self, form: Form, mut numbers: Numbers, least_step_mm: f64) -> Numbers {
        let free = self.free(form);
        let mut best = self.log_likelihood(form, &numbers);
        let mut step_mm = FIRST_STEP * numbers[WIDTH].max(0.5 * self.reach_mm);
        while step_mm > least_step_mm {
            for _ in 0..SWEEPS {
                let before = best;
                for index in &free {
                    // Slopes change what is a width away by as much.
                    let scale = match *index {
                        SLOPE => 1.0 / numbers[WIDTH],
                        _ => 1.0,
                    };
                    for way in [scale * step_mm, -scale * step_mm] {
                        let mut other = numbers;
                        other[*index] += way;
                        let own = self.log_likelihood(form, &other);
                        if own > best {
                            (best, numbers) = (own, other);
                            break;
                        }
                    }
                }
                // Wider, with the walls moved by as much: the face's border stays.
                for way in [step_mm, -step_mm]
                    .into_iter()
                    .filter(|_| form != Form::Plain)
                {
                    let mut other = numbers;
                    other[WIDTH] += way;
                    self.move_walls(&free, &mut other, way);
                    let own = self.log_likelihood(form, &other);
                    if own > best {
                        (best, numbers) = (own, other);
                        break;
                    }
                }
                if best <= before {
                    break;
                }
            }
            step_mm *= 0.5;
        }
        numbers
    }

    /// Numbers moved to the mean of where all walls may lie, together and with the face's border where
    /// it is: between the last samples on the one side of a wall and the first on the other all
    /// places are as likely.
    fn amid(&self, form: Form, numbers: &Numbers) -> Numbers {
        let free = self.free(form);
        let slid = |way: f64| {
            let mut other = *numbers;
            other[WIDTH] += way;
            self.move_walls(&free, &mut other, way);
            other
        };
        let most = self.log_likelihood(form, numbers);
        let (mut sum, mut weights) = (0.0, 0.0);
        for k in -AMID_STEPS..=AMID_STEPS {
            let way = AMID_BLURS * self.strays.blur_mm * f64::from(k) / f64::from(AMID_STEPS);
            let weight = libm::exp(self.log_likelihood(form, &slid(way)) - most);
            sum += weight * way;
            weights += weight;
        }
        slid(if weights > 0.0 { sum / weights } else { 0.0 })
    }

    /// The section with its uncertainties, from the curvature of the likelihood.
    fn told(&self, form: Form, numbers: &Numbers, share: f64) -> Option<Settled> {
        let free = self.free(form);
        let outline = self.moved(numbers)?;
        let covariance = self.covariance(form, numbers, &free) * share;
        let of = |a: usize, b: usize| {
            let place = |index: usize| free.iter().position(|own| *own == index);
            match (place(a), place(b)) {
                (Some(a), Some(b)) => covariance[(a, b)],
                _ => 0.0,
            }
        };
        let [width, slope] = [numbers[WIDTH], numbers[SLOPE]];
        let rise = slope * slope * of(WIDTH, WIDTH)
            + width * width * of(SLOPE, SLOPE)
            + 2.0 * slope * width * of(WIDTH, SLOPE);
        let mut numbers_of_outline = [[0.0; 6]; 6];
        match outline {
            Shape::Circle(_) => {
                let places = [WALLS + 1, WALLS + 2, WALLS];
                for (row, a) in numbers_of_outline.iter_mut().zip(places) {
                    for (value, b) in row.iter_mut().zip(places) {
                        *value = of(a, b);
                    }
                }
            }
            Shape::Rectangle(own) => {
                let signs = [-1.0, 1.0, -1.0, 1.0];
                for a in 0..4 {
                    for b in 0..4 {
                        numbers_of_outline[1 + a][1 + b] =
                            signs[a] * signs[b] * of(WALLS + a, WALLS + b);
                    }
                }
                let sizes = own.sizes_mm();
                let half = 0.5 * sizes[0].max(sizes[1]);
                numbers_of_outline[0][0] = of(TURN, TURN) / (half * half);
            }
        }
        Some(Settled {
            section: Self::section(form, numbers),
            outline,
            sigmas_mm: [of(WIDTH, WIDTH), rise].map(|variance| variance.max(0.0).sqrt()),
            covariance: numbers_of_outline,
            log_likelihood: self.log_likelihood(form, numbers),
            freedom: free.len(),
        })
    }

    /// Inverse of the second derivatives, over the free numbers.
    fn covariance(&self, form: Form, numbers: &Numbers, free: &[usize]) -> nalgebra::DMatrix<f64> {
        let at = |moves: &[(usize, f64)]| {
            let mut other = *numbers;
            for (index, way) in moves {
                other[*index] += way;
            }
            self.log_likelihood(form, &other)
        };
        let centre = at(&[]);
        // So far that the likelihood falls by about 2: where it is a parabola that matters.
        let steps: Vec<f64> = free
            .iter()
            .map(|&index| {
                let mut step = LEAST_STEP_MM;
                while step < 0.3 * self.reach_mm {
                    let fall = 2.0 * centre - at(&[(index, step)]) - at(&[(index, -step)]);
                    if fall.is_nan() || fall >= 4.0 {
                        break;
                    }
                    step *= 1.5;
                }
                step
            })
            .collect();
        let count = free.len();
        let mut hessian = nalgebra::DMatrix::<f64>::zeros(count, count);
        for a in 0..count {
            for b in 0..=a {
                let (i, j, s, t) = (free[a], free[b], steps[a], steps[b]);
                let second = if a == b {
                    (2.0 * centre - at(&[(i, s)]) - at(&[(i, -s)])) / (s * s)
                } else {
                    let (pp, mm) = (at(&[(i, s), (j, t)]), at(&[(i, -s), (j, -t)]));
                    let (pm, mp) = (at(&[(i, s), (j, -t)]), at(&[(i, -s), (j, t)]));
                    (pm + mp - pp - mm) / (4.0 * s * t)
                };
                hessian[(a, b)] = second;
                hessian[(b, a)] = second;
            }
        }
        for a in 0..count {
            hessian[(a, a)] = hessian[(a, a)].max(1e-9);
        }
        let alone = nalgebra::DMatrix::from_fn(count, count, |a, b| {
            if a == b { 1.0 / hessian[(a, a)] } else { 0.0 }
        });
        let inverse = nalgebra::Cholesky::new(hessian).map(|own| own.inverse());
        inverse.unwrap_or(alone)
    }
}
