//! From the light that comes back to the range that is reported: noise and mistakes.

use crate::optics::Spot;
use crate::random::{Draws, Purpose};
use crate::scene::Material;

/// How a reading strays from the truth. Shares and probabilities are 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// Standard deviation of the range at normal incidence, millimetres. It grows with the
    /// spot's length on the surface, that is with 1 / cos of the incidence.
    pub noise_mm: f64,
    /// Share of the noise's variance that is frozen to the surface point (speckle).
    pub speckle_share: f64,
    /// Edge of the cells within which speckle is the same, millimetres.
    pub speckle_cell_mm: f64,
    /// Share of readings with wider noise.
    pub tail_share: f64,
    /// How many times wider.
    pub tail_factor: f64,
    /// Probability of a reading anywhere in the range window.
    pub outliers: f64,
    /// Probability of a reading short of the surface (a flash of a glossy edge, dust).
    pub outliers_one_sided: f64,
    /// Mean distance of those from the surface, millimetres.
    pub one_sided_mm: f64,
    /// Probability that a run of 3 to 8 readings, all off by about the same amount, starts
    /// at a sample.
    pub outlier_clusters: f64,
    /// Greatest amount by which a run is off, millimetres.
    pub cluster_mm: f64,
    /// Probability that a spot on a step edge gives a mixed reading; 1 mixes all of them.
    pub mixed: f64,
    /// Probability that a spot at normal incidence is lost; more at a slant, and more so on
    /// glossy materials.
    pub dropouts: f64,
    /// No light comes back beyond this angle of incidence, radians.
    pub incidence_max_rad: f64,
    /// Probability that a reading is lost where a glossy surface mirrors the beam straight at
    /// the sensor, which then sees nothing but the glare.
    pub glare: f64,
    /// Angle between mirrored beam and sensor over which that fades, radians: the probability
    /// is `glare` exp(-(angle / `glare_width_rad`)^2 / 2).
    pub glare_width_rad: f64,
}

impl NoiseModel {
    /// A scanner without noise or mistakes.
    #[must_use]
    pub fn none() -> Self {
        Self {
            noise_mm: 0.0,
            speckle_share: 0.0,
            speckle_cell_mm: 0.05,
            tail_share: 0.0,
            tail_factor: 1.0,
            outliers: 0.0,
            outliers_one_sided: 0.0,
            one_sided_mm: 3.0,
            outlier_clusters: 0.0,
            cluster_mm: 10.0,
            mixed: 0.0,
            dropouts: 0.0,
            incidence_max_rad: 1.5,
            glare: 0.0,
            glare_width_rad: 0.0,
        }
    }

    /// Whether each share is one, and each length is a length.
    ///
    /// # Errors
    /// The name of the first setting that is out of its range, with the range.
    pub fn validate(&self) -> Result<(), String> {
        let shares = [
            ("speckle share", self.speckle_share),
            ("tail share", self.tail_share),
            ("outliers", self.outliers),
            ("one-sided outliers", self.outliers_one_sided),
            ("outlier clusters", self.outlier_clusters),
            ("mixed", self.mixed),
            ("dropouts", self.dropouts),
            ("glare", self.glare),
        ];
        for (name, value) in shares {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("{name} must lie between 0 and 1, not {value}"));
            }
        }
        let lengths = [
            ("noise (mm)", self.noise_mm),
            ("one-sided outliers' distance (mm)", self.one_sided_mm),
            ("clusters' distance (mm)", self.cluster_mm),
        ];
        for (name, value) in lengths {
            if !(0.0..=100.0).contains(&value) {
                return Err(format!("{name} must lie between 0 and 100, not {value}"));
            }
        }
        if !(self.speckle_cell_mm > 0.0 && self.speckle_cell_mm.is_finite()) {
            return Err("the speckle cell must have a size above 0 mm".into());
        }
        // Beyond a right angle no mirror sends light to the side it came from.
        if !(0.0..=core::f64::consts::FRAC_PI_2).contains(&self.glare_width_rad) {
            return Err(format!(
                "the glare's width must lie between 0 and 90 degrees, not {}",
                self.glare_width_rad.to_degrees()
            ));
        }
        Ok(())
    }
}

/// What a reading came to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// A reading of one surface, with noise alone.
    Clean,
    /// Mixed by a step edge or bent at a silhouette.
    Mixed,
    /// An outlier of any sort.
    Outlier,
}

/// A range as the head takes it, before it is cut to counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Distance along the beam, millimetres.
    pub range_mm: f64,
    /// Strength of the returned light, 0 to 255.
    pub intensity: u8,
    /// The light was too strong to measure.
    pub saturated: bool,
    /// What came between.
    pub kind: Kind,
}

/// Which reading is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleKey {
    /// Seed of the scanner.
    pub seed: u64,
    /// Repeat of the scan: the frozen part of the noise is the same in each.
    pub repeat: u64,
    /// Column of the scan.
    pub column: u32,
    /// Sample of the column.
    pub sample: u32,
}

impl SampleKey {
    fn draws(self, purpose: Purpose, sample: u32) -> Draws {
        let key = [self.repeat, u64::from(self.column), u64::from(sample)];
        Draws::keyed(self.seed, purpose, &key)
    }
}

const RUN_LEAST: u32 = 3;
const RUN_MOST: u32 = 8;

impl NoiseModel {
    /// The reading of a spot; `None` for a lost one. `window_mm` is the range window.
    #[must_use]
    pub fn read(
        &self,
        key: SampleKey,
        spot: &Spot,
        material: Material,
        window_mm: (f64, f64),
    ) -> Option<Reading> {
        // Every draw is taken whatever the settings, so that one setting changed leaves the
        // draws of the others as they were.
        let mut draws = key.draws(Purpose::Sample, key.sample);
        let lost = draws.uniform();
        let noise = draws.normal();
        let wide = draws.uniform();
        let mix = (draws.uniform(), draws.between(-0.15, 0.15));
        let anywhere = (draws.uniform(), draws.uniform());
        let short = (draws.uniform(), draws.uniform());

        let cos = spot.incidence_cos;
        let slope2 = 1.0 / (cos * cos) - 1.0;
        let losing = self.dropouts * (1.0 + slope2 * (1.0 + 4.0 * material.gloss));
        if lost < losing || cos < libm::cos(self.incidence_max_rad) {
            return None;
        }
        if self.is_swallowed(key, spot) {
            return None;
        }
        let (surface_mm, mut kind) = self.place(spot, mix)?;
        let factor = if wide < self.tail_share {
            self.tail_factor
        } else {
            1.0
        };
        let fresh = noise * factor * libm::sqrt(1.0 - self.speckle_share);
        let frozen = self.speckle(key.seed, spot) * libm::sqrt(self.speckle_share);
        let mut range_mm = surface_mm + (fresh + frozen) * self.noise_mm / cos;
        if let Some(offset_mm) = self.cluster_offset_mm(key) {
            range_mm += offset_mm;
            kind = Kind::Outlier;
        }
        if short.0 < self.outliers_one_sided {
            range_mm += self.one_sided_mm * libm::log(1.0 - short.1);
            kind = Kind::Outlier;
        }
        if anywhere.0 < self.outliers {
            range_mm = window_mm.0 + (window_mm.1 - window_mm.0) * anywhere.1;
            kind = Kind::Outlier;
        }
        if range_mm < window_mm.0 || range_mm > window_mm.1 {
            return None;
        }
        // A glossy surface that faces the beam mirrors it.
        let mirror = libm::pow(cos, 1.0 + 8.0 * material.gloss);
        let light = 255.0 * spot.lit * material.albedo * mirror * (1.0 + material.gloss);
        Some(Reading {
            range_mm,
            intensity: light.clamp(1.0, 255.0) as u8,
            saturated: light > 255.0,
            kind,
        })
    }

    /// Whether the reading is lost to gloss or to a stain.
    ///
    /// Draws of its own: those of the other mistakes stay as they are on a surface without.
    fn is_swallowed(&self, key: SampleKey, spot: &Spot) -> bool {
        let blinded = self.blinded(spot.mirror_off_rad);
        if blinded <= 0.0 && spot.stained <= 0.0 {
            return false;
        }
        let mut draws = key.draws(Purpose::Loss, key.sample);
        let (by_gloss, by_stain) = (draws.uniform(), draws.uniform());
        by_gloss < blinded || by_stain < spot.stained
    }

    /// Probability that the sensor is blinded by a beam mirrored past it at this angle, radians.
    fn blinded(&self, off_rad: f64) -> f64 {
        if self.glare <= 0.0 || self.glare_width_rad <= 0.0 {
            return 0.0;
        }
        let off = off_rad / self.glare_width_rad;
        self.glare * libm::exp(-off * off / 2.0)
    }

    /// Range of the surface that is taken for the spot's, step edges considered.
    fn place(&self, spot: &Spot, (chance, jolt): (f64, f64)) -> Option<(f64, Kind)> {
        let Some(step) = spot.step else {
            return Some((spot.range_mm, Kind::Clean));
        };
        if chance >= self.mixed {
            return spot.axis_seen.then_some((spot.range_mm, Kind::Clean));
        }
        let bent_mm = spot.range_mm + step.curl_mm;
        let range_mm = match step.other {
            // The shares of a real spot vary smoothly; those of its few beams do not.
            Some((other_mm, share)) => {
                bent_mm + (other_mm - bent_mm) * (share + jolt).clamp(0.0, 1.0)
            }
            None => bent_mm,
        };
        Some((range_mm, Kind::Mixed))
    }

    /// Noise frozen to the surface: standard normal, drawn from the point's cell.
    fn speckle(&self, seed: u64, spot: &Spot) -> f64 {
        if self.speckle_share <= 0.0 {
            return 0.0;
        }
        let cell =
            |coordinate_mm: f64| libm::floor(coordinate_mm / self.speckle_cell_mm) as i64 as u64;
        let point = spot.hit.point_mm;
        let face = (spot.hit.face.body as u64) << 32 | spot.hit.face.face as u64;
        let key = [face, cell(point.x), cell(point.y), cell(point.z)];
        Draws::keyed(seed, Purpose::Speckle, &key).normal()
    }

    /// How far a run of outliers throws this sample off, if it is in one.
    fn cluster_offset_mm(&self, key: SampleKey) -> Option<f64> {
        if self.outlier_clusters <= 0.0 {
            return None;
        }
        // A run is known by its start, so look for starts that reach this sample.
        (0..RUN_MOST).find_map(|back| {
            let start = key.sample.checked_sub(back)?;
            let mut draws = key.draws(Purpose::Cluster, start);
            let starts = draws.uniform() < self.outlier_clusters;
            let length = RUN_LEAST + (draws.bits() % u64::from(RUN_MOST - RUN_LEAST + 1)) as u32;
            let size_mm = self.cluster_mm * draws.between(0.2, 1.0);
            let nearer = draws.uniform() < 0.5;
            (starts && back < length).then_some(if nearer { -size_mm } else { size_mm })
        })
    }
}
