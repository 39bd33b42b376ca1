//! What witnesses say of many shapes that are nearly the same.

use super::posterior::Witness;
use super::shape::Shape;

/// Beyond so many widths of the edge a witness is right or wrong, and no more.
const WIDTHS: f64 = 12.0;
/// Shapes that differ by less than so many pitches are nearly the same.
const MARGIN: f64 = 0.15;

/// A logarithm is taken of the product of so many likelihoods, which is far from the least number
/// there is: witnesses are asked some ten thousand times, and logarithms would take the longest.
const AT_ONCE: usize = 16;

impl Witness {
    /// How far on its own side a witness lies that is so far from the outline, millimetres.
    fn inwards_mm(&self, distance_mm: f64) -> f64 {
        let side = if self.inside {
            -distance_mm
        } else {
            distance_mm
        };
        side + self.slack_mm
    }

    /// How likely it says what it says. A logistic edge; beyond some ten widths it is what it is.
    fn likelihood(&self, distance_mm: f64, scale: f64) -> f64 {
        let inwards = self.inwards_mm(distance_mm) * scale;
        if inwards > WIDTHS {
            1.0 - self.doubt
        } else if inwards < -WIDTHS {
            self.doubt
        } else {
            let right = 1.0 / (1.0 + libm::exp(-1.7 * inwards));
            self.doubt + (1.0 - 2.0 * self.doubt) * right
        }
    }
}

/// Logarithm of the likelihood of a shape whose edge is one over the scale wide.
pub(super) fn log_likelihood(shape: &Shape, witnesses: &[Witness], scale: f64) -> f64 {
    let distance_mm = shape.distances();
    witnesses
        .chunks(AT_ONCE)
        .map(|some| {
            let each = some
                .iter()
                .map(|witness| witness.likelihood(distance_mm(witness.place), scale));
            libm::log(each.product())
        })
        .sum()
}

/// Witnesses, parted into those that have to be asked of each shape near to one, and those that say
/// the same of all of them.
#[derive(Debug)]
pub(super) struct Hearing {
    pub(super) all: Vec<Witness>,
    beside: Vec<Witness>,
    /// Logarithm of the likelihood of the others.
    others: f64,
    about: Shape,
    scale: f64,
    margin_mm: f64,
}

impl Hearing {
    pub(super) fn new(all: Vec<Witness>, about: Shape, sharpness_mm: f64, pitch_mm: f64) -> Self {
        let mut hearing = Self {
            all,
            beside: Vec::new(),
            others: 0.0,
            about,
            scale: 1.0 / sharpness_mm,
            margin_mm: MARGIN * pitch_mm,
        };
        hearing.part(about);
        hearing
    }

    /// Parts the witnesses anew where a shape is no longer near to the one they are parted by.
    pub(super) fn follow(&mut self, shape: &Shape) {
        if shape.shift_mm(&self.about) > 0.5 * self.margin_mm {
            self.part(*shape);
        }
    }

    fn part(&mut self, about: Shape) {
        self.about = about;
        self.beside.clear();
        self.others = 0.0;
        let distance_mm = about.distances();
        let reach_mm = WIDTHS / self.scale + self.margin_mm;
        for witness in &self.all {
            let inwards_mm = witness.inwards_mm(distance_mm(witness.place));
            if inwards_mm > reach_mm {
                self.others += libm::log(1.0 - witness.doubt);
            } else if inwards_mm < -reach_mm {
                self.others += libm::log(witness.doubt);
            } else {
                self.beside.push(*witness);
            }
        }
    }

    /// Logarithm of the likelihood of a shape.
    pub(super) fn log_likelihood(&self, shape: &Shape) -> f64 {
        if shape.shift_mm(&self.about) <= self.margin_mm {
            self.others + log_likelihood(shape, &self.beside, self.scale)
        } else {
            log_likelihood(shape, &self.all, self.scale)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::{Circle, Rectangle};
    use super::*;
    use crate::chance::Chance;

    fn witnesses(about: &Shape, dice: &mut Chance) -> Vec<Witness> {
        (0..3000)
            .map(|_| {
                let place = [dice.between(-30.0, 30.0), dice.between(-25.0, 25.0)];
                Witness {
                    place,
                    inside: (about.distance_mm(place) < 0.0) != (dice.unit() < 0.03),
                    doubt: dice.between(0.01, 0.2),
                    slack_mm: dice.between(0.0, 0.1),
                }
            })
            .collect()
    }

    #[test]
    fn near_shapes_and_far_ones_are_as_likely_as_all_witnesses_together_say() {
        let mut dice = Chance::new(5, 0);
        let circle = Shape::Circle(Circle {
            centre_mm: [1.0, -2.0],
            radius_mm: 11.0,
        });
        let rectangle = |walls| {
            Shape::Rectangle(Rectangle {
                angle_rad: 0.3,
                first_mm: [-12.0, 14.0],
                second_mm: [-9.0, 8.0],
                corner_mm: 2.0,
                walls,
            })
        };
        let pitch_mm = 0.4;
        for about in [
            circle,
            rectangle([true; 4]),
            rectangle([true, false, true, true]),
        ] {
            let all = witnesses(&about, &mut dice);
            let hearing = Hearing::new(all.clone(), about, 0.03 * pitch_mm, pitch_mm);
            assert!(hearing.beside.len() * 8 < all.len());
            let (mut near, mut far) = (0, 0);
            for _ in 0..200 {
                let size = pitch_mm * dice.between(0.0, 0.2);
                let mut numbers = about.numbers();
                for (index, number) in numbers.iter_mut().enumerate() {
                    let is_angle = matches!(about, Shape::Rectangle(_)) && index == 0;
                    let way = size * dice.between(-1.0, 1.0);
                    *number += if is_angle { way / 20.0 } else { way };
                }
                let shape = about.with(&numbers).unwrap();
                if shape.shift_mm(&about) <= hearing.margin_mm {
                    near += 1;
                } else {
                    far += 1;
                }
                let distance_mm = shape.distances();
                let plain: f64 = all
                    .iter()
                    .map(|w| libm::log(w.likelihood(distance_mm(w.place), hearing.scale)))
                    .sum();
                assert!((hearing.log_likelihood(&shape) - plain).abs() < 1e-9 * plain.abs());
                // No place is nearer to one and further from the other than they are apart.
                let shift_mm = shape.shift_mm(&about) + 1e-12;
                for Witness { place, .. } in all.iter().copied() {
                    let apart_mm = shape.distance_mm(place) - about.distance_mm(place);
                    assert!(apart_mm.abs() <= shift_mm, "{apart_mm} {shift_mm}");
                }
            }
            assert!(near > 20 && far > 20, "{near} {far}");
        }
    }
}
