//! The least bending that meets bounds: an elastic beam, pushed by pins.

use nurbs::BandedMatrix;

use super::deflect::Deflection;

/// How the ends of a beam are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ends {
    /// They may turn; the first and the last may give way, too, where so marked.
    Hinged {
        /// Whether the first and the last end give way, as a spring does.
        loose: [bool; 2],
    },
    /// Neither place nor direction change.
    Clamped,
}

/// Something that the beam must not come nearer to: `side * (place - deflection)` has to be
/// at least the margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pin {
    /// Where along the beam, strictly between its ends.
    pub(crate) along: f64,
    /// Its place across the beam.
    pub(crate) place: f64,
    /// 1 where the beam has to stay below it, -1 where above.
    pub(crate) side: f64,
}

/// A deflection: a cubic spline with continuous curvature, and knots at the pins that push.
#[derive(Debug, Clone)]
pub(crate) struct Beam {
    length: f64,
    ends: Ends,
    /// Where pins push, and how hard; upwards where positive.
    forces: Vec<(f64, f64)>,
}

/// Most pins that push a beam.
const MOST_PINS: usize = 128;
/// How far a loose end gives way to a force of 1: about as far as the middle of the beam.
const LOOSE: f64 = 0.02;
/// How far a pin may be overrun, in the unit of places.
const EXACT: f64 = 1e-6;
/// The same of a pin that pushes.
const SOFT_EXACT: f64 = 1e-3;
/// Pins nearer to each other along the beam, as a share of its length, push as one would:
/// the system of their forces is nearly singular.
const SOFTNESS: f64 = 1e-10;

impl Beam {
    /// The least bent deflection that no pin stands in the way of.
    ///
    /// # Errors
    /// The pin that asks for the most, where that takes more than `most` anywhere at a pin, or
    /// no deflection is found.
    pub(crate) fn among(
        length: f64,
        ends: Ends,
        pins: &[Pin],
        margin: f64,
        most: f64,
    ) -> Result<Self, usize> {
        let mut beam = Self {
            length,
            ends,
            forces: Vec::new(),
        };
        // The forces are the multipliers of a quadratic programme in which each has the sign
        // of its pin; pins are taken up by the most overrun and let go when they would pull
        // (Lawson & Hanson 1974, chapter 23).
        let mut active: Vec<usize> = Vec::new();
        let mut sizes: Vec<f64> = Vec::new();
        // Long borders have thousands of pins: what each that pushes does to all is worked out once.
        let mut influences: Vec<Vec<f64>> = Vec::new();
        let mut is_active = vec![false; pins.len()];
        let mut reached = vec![-0.0; pins.len()];
        for _ in 0..4 * MOST_PINS {
            let overrun = |k: usize| margin - pins[k].side * (pins[k].place - reached[k]);
            let worst = (0..pins.len())
                .filter(|k| !is_active[*k])
                .map(|k| (overrun(k), k))
                .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            match worst {
                Some((by, k)) if by > EXACT => {
                    active.push(k);
                    sizes.push(0.0);
                    is_active[k] = true;
                    let on = |pin: &Pin| beam.influence(pin.along, pins[k].along, 0);
                    influences.push(pins.iter().map(on).collect());
                }
                _ => {
                    let farthest = reached.iter().map(|deflection| deflection.abs());
                    // Pins that leave no way between them are overrun, however hard they push.
                    let passed = (0..pins.len()).all(|k| overrun(k) <= SOFT_EXACT);
                    if passed && farthest.fold(0.0, f64::max) <= most {
                        return Ok(beam);
                    }
                    let hardest = (0..active.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]));
                    return Err(hardest.map_or(0, |k| active[k]));
                }
            }
            let newest = active.last().copied().unwrap_or(0);
            if active.len() > MOST_PINS {
                return Err(newest);
            }
            loop {
                let wanted = beam.balanced(pins, &active, margin).ok_or(newest)?;
                let pulling = (0..active.len())
                    .filter(|&k| wanted[k] <= 0.0)
                    .map(|k| (sizes[k] / (sizes[k] - wanted[k]), k))
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((share, stops)) = pulling else {
                    sizes = wanted;
                    break;
                };
                for (size, wanted) in sizes.iter_mut().zip(&wanted) {
                    *size += share * (wanted - *size);
                }
                is_active[active.remove(stops)] = false;
                sizes.remove(stops);
                influences.remove(stops);
            }
            beam.forces.clear();
            reached.fill(-0.0);
            for ((k, size), influences) in active.iter().zip(&sizes).zip(&influences) {
                let force = -pins[*k].side * size;
                beam.forces.push((pins[*k].along, force));
                for (deflection, influence) in reached.iter_mut().zip(influences) {
                    *deflection += force * influence;
                }
            }
        }
        Err(active.last().copied().unwrap_or(0))
    }

    /// Forces of these pins, positive where they push, with which the beam just touches them.
    fn balanced(&self, pins: &[Pin], active: &[usize], margin: f64) -> Option<Vec<f64>> {
        let mut matrix = BandedMatrix::zero(active.len(), active.len());
        let mut forces = Vec::with_capacity(active.len());
        for (i, &k) in active.iter().enumerate() {
            let pin = &pins[k];
            forces.push(margin - pin.side * pin.place);
            for (j, &l) in active[..=i].iter().enumerate() {
                let other = &pins[l];
                let influence = self.influence(pin.along, other.along, 0);
                let softness = if i == j { 1.0 + SOFTNESS } else { 1.0 };
                matrix.add(i, j, softness * pin.side * other.side * influence);
            }
        }
        matrix.cholesky().ok()?.solve(&mut forces);
        forces.iter().all(|f| f.is_finite()).then_some(forces)
    }

    /// Deflection at a place, or its first derivative, by a force of 1 at another. Forces
    /// are those on a beam of length 1.
    fn influence(&self, along: f64, at: f64, order: usize) -> f64 {
        let (x, a) = (along / self.length, at / self.length);
        // The other half is the mirror image.
        let (x, a, sign) = if x <= a {
            (x, a, 1.0)
        } else {
            (1.0 - x, 1.0 - a, -1.0)
        };
        let b = 1.0 - a;
        let held = match (self.ends, order) {
            (Ends::Hinged { .. }, 0) => b * x * (1.0 - b * b - x * x),
            (Ends::Hinged { .. }, _) => sign * b * (1.0 - b * b - 3.0 * x * x) / self.length,
            (Ends::Clamped, 0) => b * b * x * x * (3.0 * a - (3.0 * a + b) * x),
            (Ends::Clamped, _) => {
                sign * b * b * x * (6.0 * a - 3.0 * (3.0 * a + b) * x) / self.length
            }
        } / 6.0;
        let Ends::Hinged { loose } = self.ends else {
            return held;
        };
        // Between ends that give way the beam only turns.
        let (x, a) = (along / self.length, at / self.length);
        let [first, last] = loose.map(|loose| if loose { LOOSE } else { 0.0 });
        held + if order == 0 {
            first * (1.0 - x) * (1.0 - a) + last * x * a
        } else {
            (last * a - first * (1.0 - a)) / self.length
        }
    }
}

impl Deflection for Beam {
    fn at(&self, along: f64, order: usize) -> f64 {
        let shares = self.forces.iter();
        shares
            .map(|(at, force)| force * self.influence(along, *at, order))
            .sum()
    }

    /// Where pins push.
    fn knots(&self) -> Vec<f64> {
        self.forces.iter().map(|f| f.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HINGED: Ends = Ends::Hinged {
        loose: [false, false],
    };

    fn pin(along: f64, place: f64, side: f64) -> Pin {
        Pin { along, place, side }
    }

    #[test]
    fn a_beam_that_nothing_touches_is_straight() {
        let pins = [pin(3.0, 0.5, 1.0), pin(5.0, -0.2, -1.0)];
        let beam = Beam::among(10.0, HINGED, &pins, 0.1, 1.0).unwrap();
        assert_eq!(beam.knots().len(), 0);
        assert_eq!(beam.at(4.0, 0), 0.0);
    }

    #[test]
    fn the_deflection_is_that_of_the_textbook() {
        // In the middle of a hinged beam of length 1 a force of 1 deflects it by 1 / 48, of a
        // clamped one by 1 / 192.
        for (ends, share) in [(HINGED, 48.0), (Ends::Clamped, 192.0)] {
            let beam = Beam {
                length: 2.0,
                ends,
                forces: vec![(1.0, 1.0)],
            };
            assert!((beam.at(1.0, 0) - 1.0 / share).abs() < 1e-15);
            assert!(beam.at(1.0, 1).abs() < 1e-15);
            assert_eq!(beam.at(0.0, 0), 0.0);
            for x in [0.3, 0.9, 1.1, 1.8] {
                let slope = (beam.at(x + 1e-6, 0) - beam.at(x - 1e-6, 0)) / 2e-6;
                assert!((beam.at(x, 1) - slope).abs() < 1e-8);
            }
            let flat = beam.at(1e-9, 1).abs() < 1e-8;
            assert_eq!(flat, ends == Ends::Clamped);
        }
    }

    #[test]
    fn every_pin_is_passed_on_its_side_and_needless_ones_let_go() {
        let mut pins = Vec::new();
        for k in 1..100 {
            let along = f64::from(k);
            let wave = 0.1 * libm::sin(along * 0.21) + 0.03 * libm::cos(1.7 * along);
            pins.push(pin(along, wave + 0.06, 1.0));
            pins.push(pin(along, wave - 0.06, -1.0));
        }
        let beam = Beam::among(100.0, HINGED, &pins, 0.02, 0.5).unwrap();
        for p in &pins {
            let room = p.side * (p.place - beam.at(p.along, 0));
            assert!(room >= 0.02 - 2e-6, "{p:?} {room}");
        }
        let knots = beam.knots().len();
        assert!((4..40).contains(&knots), "{knots}");
    }

    #[test]
    fn a_loose_end_gives_way() {
        let pins = [pin(0.1, -0.1, 1.0), pin(60.0, 0.02, 1.0)];
        let loose = Ends::Hinged {
            loose: [true, false],
        };
        let beam = Beam::among(100.0, loose, &pins, 0.02, 0.5).unwrap();
        assert!((beam.at(0.0, 0) + 0.12).abs() < 0.01, "{}", beam.at(0.0, 0));
        assert!(beam.at(100.0, 0).abs() < 1e-12);
        assert!(Beam::among(100.0, HINGED, &pins, 0.02, 0.5).is_err());
    }

    #[test]
    fn pins_that_leave_no_way_are_refused() {
        let pins = [pin(5.0, -0.3, 1.0), pin(5.0, 0.3, -1.0)];
        assert!(Beam::among(10.0, HINGED, &pins, 0.02, 0.5).is_err());
        let far = [pin(5.0, -0.9, 1.0)];
        assert!(Beam::among(10.0, HINGED, &far, 0.02, 0.5).is_err());
    }
}
