//! Scenes drawn from seeds, for judging a segmentation: nothing is picked by hand.
//!
//! [`draw`] makes the scene of a set and a seed. Candidates are drawn one after another from
//! the seed until one holds what its set promises ([`Set`]); whether it does is read off the
//! truth alone. [`truth`] labels the nodes, [`scan`] gives the columns that the simulated
//! scanner delivers.

mod abw;
mod curved;
mod dice;
mod polyhedral;
mod promise;
pub mod scan;
mod shapes;
#[cfg(test)]
mod tests;
pub mod truth;

use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::scene::{Material, Scene};

pub use promise::Broken;
pub use scan::View;
pub use truth::Truth;

/// A family of scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Set {
    /// 40 scenes of polyhedra with 3 to 12 visible faces.
    Polyhedral,
    /// 20 scenes with cylinders, spheres, cones, tori and free-form faces beside planes: 2 to
    /// 12 visible faces, at least one of them curved.
    Curved,
    /// 40 scenes after the ABW structured-light images of Hoover et al. 1996: polyhedra on a
    /// floor, mostly before a wall, 512 x 512 samples, 10 to 20 visible faces, shadows, and
    /// depths cut to 256 levels over the scene.
    Abw,
}

/// Which scenes of a set.
///
/// Those for tuning may be looked at while a method is made; those for judging are for its
/// figures only. Figures are looked at, too, and what has been chosen since knows of them; those
/// that confirm are scanned when a method is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Purpose {
    /// Seeds 1, 2, ...
    Tune,
    /// Seeds 1001, 1002, ...
    Judge,
    /// Seeds 2001, 2002, ...
    Confirm,
}

impl Purpose {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Tune, Self::Judge, Self::Confirm];
}

/// A region with fewer nodes is listed, not counted.
pub const LEAST_NODES: usize = 100;

impl Set {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Polyhedral, Self::Curved, Self::Abw];

    /// The name on the command line and in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Polyhedral => "polyhedral",
            Self::Curved => "curved",
            Self::Abw => "abw",
        }
    }

    /// Number of scenes.
    #[must_use]
    pub fn scenes(self) -> u64 {
        match self {
            Self::Polyhedral | Self::Abw => 40,
            Self::Curved => 20,
        }
    }

    /// The seeds of its scenes: consecutive numbers, none left out.
    pub fn seeds(self, purpose: Purpose) -> impl Iterator<Item = u64> {
        let first = match purpose {
            Purpose::Tune => 1,
            Purpose::Judge => 1001,
            Purpose::Confirm => 2001,
        };
        first..first + self.scenes()
    }

    /// Least and greatest number of visible faces that count.
    #[must_use]
    pub fn faces(self) -> (usize, usize) {
        match self {
            Self::Polyhedral => (3, 12),
            Self::Curved => (2, 12),
            Self::Abw => (10, 20),
        }
    }

    /// The scanner's settings, but for the noise.
    fn overrides(self, scene: &Scene) -> Overrides {
        match self {
            Self::Polyhedral | Self::Curved => Overrides::default(),
            Self::Abw => {
                let (low, high) = scene.object_extent_mm();
                let level_mm = ((high.z - low.z) / 256.0 * 100.0).ceil() / 100.0;
                Overrides {
                    columns: Some(512),
                    samples: Some(512),
                    range_count_mm: Some(level_mm),
                    ..Overrides::default()
                }
            }
        }
    }
}

/// A scene that holds what its set promises.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its set.
    pub set: Set,
    /// Its seed.
    pub seed: u64,
    /// Candidates that were drawn before and broke the promise, and how.
    pub refused: Vec<Broken>,
    /// What kind of scene the generator drew.
    pub kind: &'static str,
    /// The scene; the material is that of the preset `paper`.
    pub scene: Scene,
    /// What is visible in the plain view.
    pub truth: Truth,
}

/// Candidates drawn before giving up: far more than any seed needs.
const ATTEMPTS: u64 = 2000;

/// The scene of a set and a seed.
///
/// # Errors
/// When no candidate holds the promise, and what was wrong with the last.
pub fn draw(set: Set, seed: u64) -> anyhow::Result<Drawn> {
    let mut refused = Vec::new();
    for attempt in 0..ATTEMPTS {
        let mut dice = dice::Dice::new(set, seed, attempt);
        let (kind, bodies) = match set {
            Set::Polyhedral => polyhedral::draw(&mut dice),
            Set::Curved => curved::draw(&mut dice),
            Set::Abw => abw::draw(&mut dice),
        };
        let scene = Scene::new(bodies, Material::PAPER);
        let set_up = Preset::Paper.set_up(scene.clone(), &set.overrides(&scene), seed);
        let (scanner, sweep) = match set_up {
            Ok(made) => made,
            Err(error) => {
                refused.push(Broken::DoesNotFit(error));
                continue;
            }
        };
        let truth = match promise::check(set, &scanner, &sweep) {
            Ok(truth) => truth,
            Err(broken) => {
                refused.push(broken);
                continue;
            }
        };
        return Ok(Drawn {
            set,
            seed,
            refused,
            kind,
            scene,
            truth,
        });
    }
    anyhow::bail!(
        "{} scene {seed}: no candidate holds; the last: {:?}",
        set.name(),
        refused.last()
    )
}
