//! Sections of treated edges: heights over the distance from the wall.

/// The section of a treated edge, whose wall lies at distance 0 and whose face begins where it runs
/// out. Heights are those off the face: down from a top, up from a floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Section {
    /// A quarter circle of this radius, millimetres.
    Arc(f64),
    /// A slant of this width and rise, millimetres.
    Slant(f64, f64),
}

impl Section {
    /// How far it reaches from the wall, millimetres.
    pub(super) fn width_mm(self) -> f64 {
        match self {
            Self::Arc(radius) => radius,
            Self::Slant(width, _) => width,
        }
    }

    /// How far it reaches off the face, millimetres.
    pub(super) fn rise_mm(self) -> f64 {
        match self {
            Self::Arc(radius) => radius,
            Self::Slant(_, rise) => rise,
        }
    }

    /// Height and its slope, as a size, at a distance from the wall, which is not negative.
    pub(super) fn at(self, distance_mm: f64) -> (f64, f64) {
        match self {
            _ if distance_mm >= self.width_mm() => (0.0, 0.0),
            Self::Arc(radius) => {
                let along = radius - distance_mm;
                let root = (radius * radius - along * along).max(0.0).sqrt();
                (radius - root, along / root.max(1e-9))
            }
            Self::Slant(width, rise) => (rise * (1.0 - distance_mm / width), rise / width),
        }
    }
}

/// How samples stray from a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Strays {
    /// Standard deviation of heights where a face is level, millimetres.
    pub(super) noise_mm: f64,
    /// Of places across the wall.
    pub(super) blur_mm: f64,
    /// What is no sample of the section lies anywhere within this height, millimetres.
    pub(super) span_mm: f64,
}

/// Share of samples that tell of nothing: outliers and mixed ones.
const OUTLIERS: f64 = 0.05;
/// How often a ray that passes beyond the wall comes back with nothing against one that met the section.
const MISSING: f64 = 0.25;
/// What is steeper than this is lost so often that it tells nothing: 50 degrees.
const TELLING: f64 = 1.2;
/// What is steeper is no section, but a wall.
const STEEPEST: f64 = 12.0;

impl Strays {
    /// Logarithm of how likely a sample at a distance from the wall has a height, or a ray that passes
    /// there does not come back.
    pub(super) fn log_likelihood(&self, section: Section, distance_mm: f64, height_mm: f64) -> f64 {
        if height_mm.is_infinite() {
            let share =
                0.5 * libm::erfc(-distance_mm / self.blur_mm * core::f64::consts::FRAC_1_SQRT_2);
            let (_, slope) = section.at(distance_mm.max(0.0));
            let lost = if slope > TELLING { 1.0 } else { MISSING };
            return libm::log(share * lost + (1.0 - share));
        }
        let anywhere = OUTLIERS / self.span_mm;
        // Beyond the wall lies what is beyond the section.
        let below = if height_mm > section.rise_mm() - 3.0 * self.noise_mm {
            (1.0 - OUTLIERS) / self.span_mm
        } else {
            0.0
        };
        let t = distance_mm / self.blur_mm;
        if t < -4.0 {
            return libm::log(below + anywhere);
        }
        let (expected, slope) = section.at(distance_mm.max(0.0));
        // The noise of a range grows with the length of the spot on what it meets.
        let slope = slope.min(STEEPEST);
        let (across, along) = (slope * self.blur_mm, self.noise_mm);
        let sigma = (along * along * (1.0 + slope * slope) + across * across).sqrt();
        let off = (height_mm - expected) / sigma;
        let density = (1.0 - OUTLIERS) * FLAT * libm::exp(-0.5 * off * off) / sigma;
        let own = if t > 4.0 {
            density
        } else {
            let share = 0.5 * libm::erfc(-t * core::f64::consts::FRAC_1_SQRT_2);
            share * density + (1.0 - share) * below
        };
        libm::log(own + anywhere)
    }
}

/// 1 / sqrt(2 pi).
const FLAT: f64 = 0.398_942_280_401_432_7;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_run_from_the_wall_into_the_face() {
        for section in [Section::Arc(2.0), Section::Slant(2.0, 3.0)] {
            assert!((section.at(0.0).0 - section.rise_mm()).abs() < 1e-12);
            assert_eq!(section.at(section.width_mm()), (0.0, 0.0));
            // The slope is that of the heights.
            let (a, b) = (section.at(0.9).0, section.at(0.9 + 1e-6).0);
            assert!(((a - b) / 1e-6 - section.at(0.9).1).abs() < 1e-4);
        }
        // On the circle about (2, 2).
        let (height, _) = Section::Arc(2.0).at(0.5);
        assert!((1.5 * 1.5 + (2.0 - height) * (2.0 - height) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn what_lies_on_the_section_or_deep_beyond_its_wall_is_likely() {
        let strays = Strays {
            noise_mm: 0.1,
            blur_mm: 0.05,
            span_mm: 10.0,
        };
        let arc = Section::Arc(2.0);
        let of = |distance: f64, height: f64| strays.log_likelihood(arc, distance, height);
        let on = arc.at(1.0).0;
        assert!(of(1.0, on) > of(1.0, on + 0.3) && of(1.0, on + 0.3) > of(1.0, 8.0));
        assert!(of(-1.0, 8.0) > of(-1.0, on) && of(1.0, 8.0) < of(-1.0, 8.0));
        // Densities over all heights sum to about 1 on either side.
        for distance in [-1.0, -0.04, 0.0, 0.04, 0.5, 3.0] {
            let steps = (0..10_000).map(|k| 0.001 * f64::from(k));
            let sum: f64 = steps.map(|h| 0.001 * libm::exp(of(distance, h))).sum();
            assert!((0.45..1.1).contains(&sum), "{distance}: {sum}");
        }
    }
}
