//! Ink and oil: patches of a surface that swallow light.

use crate::Vec3;

/// A round patch, as seen along z, from which less light comes back or none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stain {
    /// x and y of its middle in the part frame, millimetres.
    pub centre_mm: (f64, f64),
    /// Radius up to the middle of its rim, millimetres.
    pub radius_mm: f64,
    /// Width of the rim, over which it fades, millimetres; 0 for a sharp one.
    pub rim_mm: f64,
    /// Probability that a reading within is lost, 0 to 1.
    pub loss: f64,
}

impl Stain {
    /// Whether its lengths are lengths and its loss is a probability.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn validate(&self) -> Result<(), String> {
        let (x, y) = self.centre_mm;
        if !(x.is_finite() && y.is_finite()) {
            return Err("a stain must have a place".into());
        }
        for (name, value_mm) in [("radius", self.radius_mm), ("rim", self.rim_mm)] {
            if !(0.0..=1000.0).contains(&value_mm) {
                return Err(format!(
                    "a stain's {name} (mm) must lie between 0 and 1000, not {value_mm}"
                ));
            }
        }
        if !(0.0..=1.0).contains(&self.loss) {
            return Err(format!(
                "a stain's loss must lie between 0 and 1, not {}",
                self.loss
            ));
        }
        Ok(())
    }

    /// Probability that a reading at a point is lost to it. Across the rim it falls from `loss`
    /// to 0 without a kink, by 3 t^2 - 2 t^3.
    #[must_use]
    pub fn loss_at(&self, point_mm: Vec3) -> f64 {
        let off_mm = libm::hypot(point_mm.x - self.centre_mm.0, point_mm.y - self.centre_mm.1);
        let outer_mm = self.radius_mm + self.rim_mm / 2.0;
        if off_mm >= outer_mm {
            return 0.0;
        }
        if off_mm <= self.radius_mm - self.rim_mm / 2.0 {
            return self.loss;
        }
        let t = (outer_mm - off_mm) / self.rim_mm;
        self.loss * t * t * (3.0 - 2.0 * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAIN: Stain = Stain {
        centre_mm: (3.0, -2.0),
        radius_mm: 4.0,
        rim_mm: 2.0,
        loss: 0.8,
    };

    #[test]
    fn it_fades_across_its_rim_alone() {
        let at = |off_mm: f64| STAIN.loss_at(Vec3::new(3.0 + off_mm, -2.0, 50.0));
        for (off_mm, expected) in [(0.0, 0.8), (2.99, 0.8), (4.0, 0.4), (5.0, 0.0), (9.0, 0.0)] {
            assert!((at(off_mm) - expected).abs() < 1e-12, "{off_mm}");
        }
        let falling: Vec<f64> = (0..=20).map(|k| at(3.0 + 0.1 * f64::from(k))).collect();
        assert!(falling.windows(2).all(|pair| pair[0] >= pair[1]));
    }

    #[test]
    fn a_sharp_one_has_no_rim() {
        let sharp = Stain {
            rim_mm: 0.0,
            ..STAIN
        };
        let at = |off_mm: f64| sharp.loss_at(Vec3::new(3.0, -2.0 + off_mm, 0.0));
        assert!((at(3.999) - 0.8).abs() < 1e-12 && at(4.001) == 0.0);
    }

    #[test]
    fn what_is_no_stain_is_refused() {
        assert!(STAIN.validate().is_ok());
        for wrong in [
            Stain { loss: 1.5, ..STAIN },
            Stain {
                radius_mm: -1.0,
                ..STAIN
            },
            Stain {
                rim_mm: f64::NAN,
                ..STAIN
            },
            Stain {
                centre_mm: (f64::INFINITY, 0.0),
                ..STAIN
            },
        ] {
            assert!(wrong.validate().is_err(), "{wrong:?}");
        }
    }
}
