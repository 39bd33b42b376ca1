//! Shapes near a shape, by as many numbers as it is free in.

use nalgebra::{Matrix3, SMatrix, Vector3};
use shapes::{Family, Joint, Measured, Numbers, Shape, Spread};

/// Most free numbers of a shape.
pub(crate) const MOST: usize = 7;

/// Index of each size in [`Told::sizes`].
pub(crate) const RADIUS: usize = 0;
pub(crate) const TUBE: usize = 1;
pub(crate) const HALF_ANGLE: usize = 2;

/// A shape by its numbers; what it does not have is 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Told {
    pub(crate) family: Family,
    pub(crate) direction: Vector3<f64>,
    pub(crate) place: Vector3<f64>,
    pub(crate) sizes: [f64; 3],
}

impl Told {
    pub(crate) fn of(shape: &Shape) -> Self {
        let none = Vector3::zeros();
        let (direction, place, sizes) = match shape {
            Shape::Plane(p) => (p.normal, p.point_mm, [0.0; 3]),
            Shape::Sphere(s) => (none, s.centre_mm, [s.radius_mm, 0.0, 0.0]),
            Shape::Cylinder(c) => (c.axis, c.point_mm, [c.radius_mm, 0.0, 0.0]),
            Shape::Cone(c) => (c.axis, c.apex_mm, [0.0, 0.0, c.half_angle_rad]),
            Shape::Torus(t) => (t.axis, t.centre_mm, [t.radius_mm, t.tube_mm, 0.0]),
        };
        Self {
            family: shape.family(),
            direction,
            place,
            sizes,
        }
    }
}

/// The shapes near one: free numbers are turns of its direction, then shifts of its place in the
/// ways that count, then changes of its sizes.
#[derive(Debug, Clone)]
pub(crate) struct Chart {
    pub(crate) shape: Shape,
    pub(crate) base: Told,
    /// Two unit vectors across the direction, and across each other.
    pub(crate) turns: Vec<Vector3<f64>>,
    shifts: Vec<Vector3<f64>>,
    sizes: &'static [usize],
}

impl Chart {
    pub(crate) fn of(shape: &Shape) -> Self {
        let base = Told::of(shape);
        let turns = match base.family {
            Family::Sphere => Vec::new(),
            _ => across(&base.direction).to_vec(),
        };
        let all = || vec![Vector3::x(), Vector3::y(), Vector3::z()];
        let (shifts, sizes): (_, &[usize]) = match base.family {
            Family::Plane => (vec![base.direction], &[]),
            Family::Sphere => (all(), &[RADIUS]),
            Family::Cylinder => (turns.clone(), &[RADIUS]),
            Family::Cone => (all(), &[HALF_ANGLE]),
            Family::Torus => (all(), &[RADIUS, TUBE]),
        };
        Self {
            shape: *shape,
            base,
            turns,
            shifts,
            sizes,
        }
    }

    /// How many numbers it is free in.
    pub(crate) fn freedom(&self) -> usize {
        self.turns.len() + self.shifts.len() + self.sizes.len()
    }

    /// A step that counts as small in a free number; `unit_mm` is the size of the part.
    pub(crate) fn step(&self, number: usize, unit_mm: f64) -> f64 {
        const STEP: f64 = 1e-6;
        let sizes = self.turns.len() + self.shifts.len();
        let is_angle = number < self.turns.len()
            || number
                .checked_sub(sizes)
                .is_some_and(|k| self.sizes[k] == HALF_ANGLE);
        if is_angle { STEP } else { STEP * unit_mm }
    }

    /// The shape moved by its free numbers.
    pub(crate) fn told(&self, free: &[f64]) -> Told {
        let mut told = self.base;
        let (turns, rest) = free.split_at(self.turns.len());
        let (shifts, sizes) = rest.split_at(self.shifts.len());
        for (way, by) in self.turns.iter().zip(turns) {
            told.direction += way * *by;
        }
        if !turns.is_empty() {
            told.direction.normalize_mut();
        }
        for (way, by) in self.shifts.iter().zip(shifts) {
            told.place += way * *by;
        }
        for (size, by) in self.sizes.iter().zip(sizes) {
            told.sizes[*size] += by;
        }
        told
    }

    /// How far a move turns, radians, and shifts or resizes, millimetres. The apex of a cone may
    /// slide along the axis, which the surface hardly follows.
    pub(crate) fn extent(&self, free: &[f64]) -> (f64, f64) {
        let (turns, rest) = free.split_at(self.turns.len());
        let (shifts, sizes) = rest.split_at(self.shifts.len());
        let norm = |numbers: &[f64]| numbers.iter().map(|n| n * n).sum::<f64>().sqrt();
        let mut turned = libm::atan(norm(turns));
        let mut moved = norm(shifts);
        if self.base.family == Family::Cone {
            let shift = Vector3::from_row_slice(shifts);
            moved = shift.cross(&self.base.direction).norm();
        }
        for (size, by) in self.sizes.iter().zip(sizes) {
            let most = if *size == HALF_ANGLE {
                &mut turned
            } else {
                &mut moved
            };
            *most = most.max(by.abs());
        }
        (turned, moved)
    }

    /// The covariance of the free numbers.
    pub(crate) fn covariance(&self, joint: &Joint) -> SMatrix<f64, MOST, MOST> {
        let mut to = SMatrix::<f64, MOST, 9>::zeros();
        let ways = self.turns.iter().map(|way| (0, *way));
        let ways = ways.chain(self.shifts.iter().map(|way| (3, *way)));
        let mut row = 0;
        for (first, way) in ways {
            to.fixed_view_mut::<1, 3>(row, first)
                .copy_from(&way.transpose());
            row += 1;
        }
        for size in self.sizes {
            to[(row, 6 + size)] = 1.0;
            row += 1;
        }
        let covariance = to * joint * to.transpose();
        0.5 * (covariance + covariance.transpose())
    }

    /// The shape that these numbers tell of; that of the chart where they tell of none.
    pub(crate) fn shape(&self, told: &Told) -> Shape {
        let mut shape = self.shape;
        match &mut shape {
            Shape::Plane(plane) => {
                plane.point_mm = told.place;
                plane.normal = told.direction;
            }
            Shape::Sphere(sphere) => {
                sphere.centre_mm = told.place;
                sphere.radius_mm = told.sizes[RADIUS];
            }
            Shape::Cylinder(cylinder) => {
                cylinder.point_mm = told.place;
                cylinder.axis = told.direction;
                cylinder.radius_mm = told.sizes[RADIUS];
            }
            Shape::Cone(cone) => {
                cone.apex_mm = told.place;
                cone.axis = told.direction;
                cone.half_angle_rad = told.sizes[HALF_ANGLE];
            }
            Shape::Torus(torus) => {
                torus.centre_mm = told.place;
                torus.axis = told.direction;
                torus.radius_mm = told.sizes[RADIUS];
                torus.tube_mm = told.sizes[TUBE];
            }
        }
        shape
    }

    /// The numbers with their uncertainties.
    pub(crate) fn numbers(&self, told: &Told, covariance: &SMatrix<f64, MOST, MOST>) -> Numbers {
        let spread = |ways: &[Vector3<f64>], first: usize| {
            let mut sum = Matrix3::zeros();
            for (i, a) in ways.iter().enumerate() {
                for (j, b) in ways.iter().enumerate() {
                    sum += a * b.transpose() * covariance[(first + i, first + j)];
                }
            }
            Spread { covariance: sum }
        };
        let first = self.turns.len() + self.shifts.len();
        let size = |index: usize| {
            let own = self.sizes.iter().position(|size| *size == index)?;
            Some(Measured {
                value: told.sizes[index],
                deviation: covariance[(first + own, first + own)].max(0.0).sqrt(),
            })
        };
        Numbers {
            radius_mm: size(RADIUS),
            tube_mm: size(TUBE),
            half_angle_rad: size(HALF_ANGLE),
            direction_rad: (!self.turns.is_empty()).then(|| spread(&self.turns, 0)),
            place_mm: spread(&self.shifts, self.turns.len()),
        }
    }

    /// The joint covariance that a covariance of the free numbers makes.
    pub(crate) fn joint(&self, covariance: &SMatrix<f64, MOST, MOST>) -> Joint {
        let mut from = SMatrix::<f64, 9, MOST>::zeros();
        let ways = self.turns.iter().map(|way| (0, *way));
        let ways = ways.chain(self.shifts.iter().map(|way| (3, *way)));
        let mut column = 0;
        for (first, way) in ways {
            from.fixed_view_mut::<3, 1>(first, column).copy_from(&way);
            column += 1;
        }
        for size in self.sizes {
            from[(6 + size, column)] = 1.0;
            column += 1;
        }
        from * covariance * from.transpose()
    }
}

/// Two unit directions across one, and across each other.
pub(crate) fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let mut off = Vector3::zeros();
    off[direction.iamin()] = 1.0;
    let first = direction.cross(&off);
    let first = first / first.norm().max(f64::MIN_POSITIVE);
    [first, direction.cross(&first)]
}
