//! Shapes that outlines are taken for: circles and rectangles with rounded corners.

use core::f64::consts::SQRT_2;

/// An outline in the plan, millimetres and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A circle.
    Circle(Circle),
    /// A rectangle.
    Rectangle(Rectangle),
}

/// A circle in the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Its centre.
    pub centre_mm: [f64; 2],
    /// Its radius.
    pub radius_mm: f64,
}

/// A rectangle in the plan, turned by an angle; its sides lie at a distance from the origin along
/// its own axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Angle of its first axis from u towards v.
    pub angle_rad: f64,
    /// Where its sides lie along the first axis, the lesser first.
    pub first_mm: [f64; 2],
    /// And along the second, a quarter turn further.
    pub second_mm: [f64; 2],
    /// Radius of the corners between two walls.
    pub corner_mm: f64,
    /// Which sides are walls: at `first_mm[0]`, `first_mm[1]`, `second_mm[0]`, `second_mm[1]`.
    /// At the others it runs out.
    pub walls: [bool; 4],
}

impl Rectangle {
    /// A place of the plan along the axes.
    #[must_use]
    pub fn along(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.angle_rad);
        [u * cos + v * sin, v * cos - u * sin]
    }

    /// The place of the plan at distances along the axes.
    #[must_use]
    pub fn place(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.angle_rad);
        [a * cos - b * sin, a * sin + b * cos]
    }

    /// Its sizes along its axes, millimetres.
    #[must_use]
    pub fn sizes_mm(&self) -> [f64; 2] {
        [
            self.first_mm[1] - self.first_mm[0],
            self.second_mm[1] - self.second_mm[0],
        ]
    }

    /// Its middle in the plan.
    #[must_use]
    pub fn middle_mm(&self) -> [f64; 2] {
        self.place([
            0.5 * (self.first_mm[0] + self.first_mm[1]),
            0.5 * (self.second_mm[0] + self.second_mm[1]),
        ])
    }

    /// Signed distance of a place, negative inside.
    #[must_use]
    pub fn distance_mm(&self, place: [f64; 2]) -> f64 {
        let (sin, cos) = libm::sincos(self.angle_rad);
        self.distance_by(place, sin, cos)
    }

    /// Its corners in the plan, as if they were sharp.
    fn corners(&self) -> [[f64; 2]; 4] {
        let (sin, cos) = libm::sincos(self.angle_rad);
        [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(first, second)| {
            let [a, b] = [self.first_mm[first], self.second_mm[second]];
            [a * cos - b * sin, a * sin + b * cos]
        })
    }

    fn distance_by(&self, [u, v]: [f64; 2], sin: f64, cos: f64) -> f64 {
        let [a, b] = [u * cos + v * sin, v * cos - u * sin];
        let half = self.sizes_mm().map(|size| 0.5 * size);
        let a = a - self.first_mm[0] - half[0];
        let b = b - self.second_mm[0] - half[1];
        let is_wall = self.walls[usize::from(a > 0.0)] && self.walls[2 + usize::from(b > 0.0)];
        let corner = if is_wall { self.corner_mm } else { 0.0 };
        let over = [a.abs() - half[0] + corner, b.abs() - half[1] + corner];
        let outer = over.map(|o| o.max(0.0));
        (outer[0] * outer[0] + outer[1] * outer[1]).sqrt() + over[0].max(over[1]).min(0.0) - corner
    }
}

impl Shape {
    /// Tells signed distances of places, negative inside; for many places of one shape.
    pub fn distances(&self) -> impl Fn([f64; 2]) -> f64 + '_ {
        let (sin, cos) = match self {
            Self::Circle(_) => (0.0, 1.0),
            Self::Rectangle(rectangle) => libm::sincos(rectangle.angle_rad),
        };
        move |place| match self {
            Self::Circle(circle) => {
                let [u, v] = place;
                let [du, dv] = [u - circle.centre_mm[0], v - circle.centre_mm[1]];
                (du * du + dv * dv).sqrt() - circle.radius_mm
            }
            Self::Rectangle(rectangle) => rectangle.distance_by(place, sin, cos),
        }
    }

    /// Signed distance of one place, negative inside.
    #[must_use]
    pub fn distance_mm(&self, place: [f64; 2]) -> f64 {
        self.distances()(place)
    }

    /// By how much no signed distance differs between two shapes of one kind, millimetres.
    #[must_use]
    pub fn shift_mm(&self, other: &Self) -> f64 {
        let apart = |one: [f64; 2], other: [f64; 2]| {
            let [du, dv] = [one[0] - other[0], one[1] - other[1]];
            (du * du + dv * dv).sqrt()
        };
        match (self, other) {
            (Self::Circle(one), Self::Circle(other)) => {
                apart(one.centre_mm, other.centre_mm) + (one.radius_mm - other.radius_mm).abs()
            }
            (Self::Rectangle(one), Self::Rectangle(other)) => {
                // Borders of sharp rectangles are nowhere further apart than their corners. The
                // middle of a round lies a diagonal away from its corner and turns with it.
                let furthest = (one.corners().into_iter().zip(other.corners()))
                    .map(|(one, other)| apart(one, other))
                    .fold(0.0, f64::max);
                let corner_mm = one.corner_mm.max(other.corner_mm);
                let turn_rad = (one.angle_rad - other.angle_rad).abs();
                furthest
                    + SQRT_2 * corner_mm * turn_rad
                    + (SQRT_2 - 1.0) * (one.corner_mm - other.corner_mm).abs()
            }
            _ => f64::INFINITY,
        }
    }

    /// The box around it along u and v: least and greatest, millimetres.
    #[must_use]
    pub fn extent(&self) -> ([f64; 2], [f64; 2]) {
        match self {
            Self::Circle(circle) => {
                let [u, v] = circle.centre_mm;
                let r = circle.radius_mm;
                ([u - r, v - r], [u + r, v + r])
            }
            Self::Rectangle(own) => {
                let mut low = [f64::INFINITY; 2];
                let mut high = [f64::NEG_INFINITY; 2];
                for a in own.first_mm {
                    for b in own.second_mm {
                        let place = own.place([a, b]);
                        for axis in 0..2 {
                            low[axis] = low[axis].min(place[axis]);
                            high[axis] = high[axis].max(place[axis]);
                        }
                    }
                }
                (low, high)
            }
        }
    }

    /// Its middle in the plan.
    #[must_use]
    pub fn middle_mm(&self) -> [f64; 2] {
        match self {
            Self::Circle(circle) => circle.centre_mm,
            Self::Rectangle(rectangle) => rectangle.middle_mm(),
        }
    }

    /// Its numbers: centre and radius, or angle, sides and corner radius.
    #[must_use]
    pub fn numbers(&self) -> [f64; 6] {
        match self {
            Self::Circle(c) => [c.centre_mm[0], c.centre_mm[1], c.radius_mm, 0.0, 0.0, 0.0],
            Self::Rectangle(r) => [
                r.angle_rad,
                r.first_mm[0],
                r.first_mm[1],
                r.second_mm[0],
                r.second_mm[1],
                r.corner_mm,
            ],
        }
    }

    /// How many of [`Self::numbers`] count.
    #[must_use]
    pub fn freedom(&self) -> usize {
        match self {
            Self::Circle(_) => 3,
            Self::Rectangle(_) => 6,
        }
    }

    /// The same kind of shape with other numbers; `None` where they make none.
    #[must_use]
    pub fn with(&self, numbers: &[f64; 6]) -> Option<Self> {
        match self {
            Self::Circle(_) => (numbers[2] > 0.0).then_some(Self::Circle(Circle {
                centre_mm: [numbers[0], numbers[1]],
                radius_mm: numbers[2],
            })),
            Self::Rectangle(before) => {
                let shape = Rectangle {
                    angle_rad: numbers[0],
                    first_mm: [numbers[1], numbers[2]],
                    second_mm: [numbers[3], numbers[4]],
                    corner_mm: numbers[5],
                    walls: before.walls,
                };
                let [a, b] = shape.sizes_mm();
                let fits = a > 0.0 && b > 0.0 && 2.0 * shape.corner_mm <= a.min(b);
                (fits && shape.corner_mm >= 0.0).then_some(Self::Rectangle(shape))
            }
        }
    }
}
