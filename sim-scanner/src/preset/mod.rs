//! Scanners to be: presets after real ones, and the settings a user may change.

use crate::mechanics::Mechanics;
use crate::mount::Mount;
use crate::noise::NoiseModel;
use crate::optics::Optics;
use crate::scanner::{Head, HeadKind, Scanner, Sweep};
use crate::scene::{Material, Scene, benches, figures};
use thiserror::Error;

mod propose;

/// A scanner model to imitate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// The laser camera on a slide table of Shim and Lee 1995: 240 columns by 256 samples of
    /// an object about 10 cm each way at 700 to 800 mm, range counts of 0.1 mm.
    #[default]
    Paper,
    /// A Cyberware 3030 MS: laser stripe on a linear stage, columns 0.25 mm apart, samples
    /// 1.4 mm apart.
    Cyberware,
    /// A Riftek RF627: laser profile sensor close to the object, samples 0.147 mm apart.
    Rf627,
}

impl Preset {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Cyberware => "cyberware",
            Self::Rf627 => "rf627",
        }
    }
}

/// What differs from the preset. `None` keeps the preset's value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Overrides {
    /// Columns of the proposed scan.
    pub columns: Option<u32>,
    /// Samples per column of the proposed scan.
    pub samples: Option<u32>,
    /// Distance between columns, millimetres.
    pub pitch_mm: Option<f64>,
    /// Range (or y and z) per count, millimetres.
    pub range_count_mm: Option<f64>,
    /// Distance of the camera from the object's middle, millimetres.
    pub standoff_mm: Option<f64>,
    /// See [`NoiseModel::noise_mm`].
    pub noise_mm: Option<f64>,
    /// See [`NoiseModel::outliers`].
    pub outliers: Option<f64>,
    /// See [`NoiseModel::outliers_one_sided`].
    pub outliers_one_sided: Option<f64>,
    /// See [`NoiseModel::outlier_clusters`].
    pub outlier_clusters: Option<f64>,
    /// See [`NoiseModel::mixed`].
    pub mixed: Option<f64>,
    /// See [`NoiseModel::dropouts`].
    pub dropouts: Option<f64>,
    /// See [`NoiseModel::glare`].
    pub glare: Option<f64>,
    /// See [`NoiseModel::glare_width_rad`]; here in degrees.
    pub glare_width_deg: Option<f64>,
    /// See [`Mechanics::jitter_mm`].
    pub jitter_mm: Option<f64>,
    /// See [`Mechanics::backlash_mm`].
    pub backlash_mm: Option<f64>,
    /// How the head is mounted.
    pub mount: Mount,
}

/// Why a scanner cannot be made.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum SetupError {
    /// A setting is out of its range.
    #[error("{0}")]
    Setting(String),
    /// The object does not fit before the camera.
    #[error(
        "the object is {size_mm:.0} mm {along}, too large for this scanner: at most {most_mm:.0} mm"
    )]
    Size {
        /// Extent of the object, millimetres.
        size_mm: f64,
        /// The direction in words.
        along: &'static str,
        /// The greatest extent, millimetres.
        most_mm: f64,
    },
}

/// Most columns of a scan.
pub const COLUMNS_MAX: u32 = 100_000;
/// Most samples in a column.
pub const SAMPLES_MAX: u32 = 4096;

/// The numbers of a preset.
struct Base {
    standoff_mm: f64,
    baseline_mm: (f64, f64),
    spot_radius_mm: f64,
    polar: bool,
    count_nm: u32,
    fan_jitter: f64,
    columns: Layout,
    samples: Layout,
    noise: NoiseModel,
}

/// How many columns (or samples): a number of them, or a distance between them.
enum Layout {
    Count(u32),
    PitchMm(f64),
}

impl Preset {
    fn base(self) -> Base {
        let none = NoiseModel::none();
        match self {
            Self::Paper => Base {
                standoff_mm: 750.0,
                baseline_mm: (0.0, 150.0),
                spot_radius_mm: 0.2,
                polar: true,
                count_nm: 100_000,
                fan_jitter: 0.0,
                columns: Layout::Count(240),
                samples: Layout::Count(256),
                noise: NoiseModel {
                    noise_mm: 0.05,
                    speckle_share: 0.3,
                    mixed: 0.1,
                    dropouts: 0.001,
                    // 75 degrees: plaster and drawing paper send too little light back
                    // beyond.
                    incidence_max_rad: 1.309,
                    ..none
                },
            },
            Self::Cyberware => Base {
                standoff_mm: 750.0,
                baseline_mm: (220.0, 0.0),
                spot_radius_mm: 0.5,
                polar: false,
                count_nm: 1_000,
                fan_jitter: 0.05,
                columns: Layout::PitchMm(0.25),
                samples: Layout::PitchMm(1.4),
                noise: NoiseModel {
                    noise_mm: 0.05,
                    speckle_share: 0.5,
                    tail_share: 0.06,
                    tail_factor: 8.0,
                    mixed: 0.8,
                    dropouts: 0.002,
                    incidence_max_rad: 1.3,
                    ..none
                },
            },
            Self::Rf627 => Base {
                standoff_mm: 120.0,
                baseline_mm: (40.0, 0.0),
                spot_radius_mm: 0.05,
                polar: false,
                count_nm: 1_000,
                fan_jitter: 0.04,
                columns: Layout::PitchMm(0.2),
                // At the reference depth; on a groove, most of which is nearer, 0.147 mm.
                samples: Layout::PitchMm(0.155),
                noise: NoiseModel {
                    noise_mm: 0.0195,
                    speckle_share: 0.83,
                    mixed: 0.2,
                    dropouts: 0.0005,
                    incidence_max_rad: 1.4,
                    ..none
                },
            },
        }
    }

    /// A scanner of this model before a scene, and the scan that it proposes: one that covers
    /// the object.
    ///
    /// # Errors
    /// [`SetupError`] when a setting is out of range, or the object is too large.
    pub fn set_up(
        self,
        scene: Scene,
        overrides: &Overrides,
        seed: u64,
    ) -> Result<(Scanner, Sweep), SetupError> {
        let base = self.base();
        check(overrides)?;
        let noise = overrides.apply_to(base.noise);
        noise.validate().map_err(SetupError::Setting)?;
        for stain in &scene.stains {
            stain.validate().map_err(SetupError::Setting)?;
        }
        let (low, high) = scene.object_extent_mm();
        let (view_low, view_high) = scene.view_extent_mm();
        let middle = scene.middle_mm.unwrap_or((low + high) / 2.0);
        let standoff_mm = overrides.standoff_mm.unwrap_or(base.standoff_mm);
        // The object may take up to 4/5 of the way to the camera on the near side.
        let depth_mm = standoff_mm * 0.8;
        for (size_mm, along, most_mm) in [
            (view_high.x - view_low.x, "along the table", TABLE_MM),
            (high.y - low.y, "high", standoff_mm),
            (high.z - low.z, "deep", depth_mm * 2.0),
        ] {
            if size_mm.is_nan() || size_mm > most_mm {
                return Err(SetupError::Size {
                    size_mm,
                    along,
                    most_mm,
                });
            }
        }
        // On whole counts, so that the announced calibration is exact.
        let whole_um = |v: f64| libm::round(v * 1e3) / 1e3;
        let optics = Optics {
            camera_y_mm: whole_um(middle.y),
            camera_z_mm: whole_um(middle.z + standoff_mm),
            baseline_mm: base.baseline_mm,
            spot_radius_mm: base.spot_radius_mm,
        };
        let count_nm = overrides
            .range_count_mm
            .map_or(base.count_nm, |mm| libm::round(mm * 1e6) as u32);
        let kind = if base.polar {
            HeadKind::Polar {
                angle_count_nrad: ANGLE_COUNT_NRAD,
                range_count_nm: count_nm,
            }
        } else {
            HeadKind::Cartesian {
                count_nm,
                reference_z_mm: whole_um(middle.z),
            }
        };
        // The paper's window reaches 50 mm before and behind the middle; a deeper object
        // widens it.
        let half_mm = ((high.z - low.z) / 2.0)
            .max(view_high.z - middle.z)
            .max(middle.z - view_low.z);
        let half_depth = (half_mm * 1.1 + 5.0).max(standoff_mm / 15.0);
        let scanner = Scanner {
            scene,
            optics,
            head: Head {
                kind,
                window_mm: (standoff_mm - half_depth, standoff_mm + half_depth),
                fan_jitter: base.fan_jitter,
            },
            mechanics: Mechanics {
                jitter_mm: overrides.jitter_mm.unwrap_or(0.0),
                encoder_noise_mm: 0.0,
                backlash_mm: overrides.backlash_mm.unwrap_or(0.0),
                speed_mm_s: 200.0,
                count_nm: TABLE_COUNT_NM,
            },
            // Table position 0 is at the home switch, left of the object.
            table_origin_nm: libm::round((middle.x - TABLE_MM / 2.0) * 1e3) as i64 * 1000,
            part_offset_mm: crate::Vec3::ZERO,
            mount: overrides.mount,
            noise,
            seed,
        };
        let (low, high) = (view_low.to_array(), view_high.to_array());
        let sweep = propose::propose(&scanner, &base, overrides, low, high)?;
        Ok((scanner, sweep))
    }

    /// The scene that shows this object as the preset's own would.
    #[must_use]
    pub fn material(self) -> Material {
        match self {
            Self::Paper => Material::PAPER,
            Self::Cyberware | Self::Rf627 => Material::PLASTER,
        }
    }
}

/// Travel of the table, millimetres.
pub const TABLE_MM: f64 = 400.0;
const TABLE_COUNT_NM: u32 = 10_000;
const ANGLE_COUNT_NRAD: u32 = 1_000;
/// Free space around the object in a proposed scan, millimetres.
const MARGIN_MM: f64 = 3.0;

impl Overrides {
    fn apply_to(&self, noise: NoiseModel) -> NoiseModel {
        NoiseModel {
            noise_mm: self.noise_mm.unwrap_or(noise.noise_mm),
            outliers: self.outliers.unwrap_or(noise.outliers),
            outliers_one_sided: self.outliers_one_sided.unwrap_or(noise.outliers_one_sided),
            outlier_clusters: self.outlier_clusters.unwrap_or(noise.outlier_clusters),
            mixed: self.mixed.unwrap_or(noise.mixed),
            dropouts: self.dropouts.unwrap_or(noise.dropouts),
            glare: self.glare.unwrap_or(noise.glare),
            glare_width_rad: self
                .glare_width_deg
                .map_or(noise.glare_width_rad, f64::to_radians),
            ..noise
        }
    }
}

fn check(overrides: &Overrides) -> Result<(), SetupError> {
    let within = |name: &str, value: Option<f64>, low: f64, high: f64| match value {
        Some(v) if !(low..=high).contains(&v) => Err(SetupError::Setting(format!(
            "{name} must lie between {low} and {high}, not {v}"
        ))),
        _ => Ok(()),
    };
    let count = |name: &str, value: Option<u32>, most: u32| {
        within(name, value.map(f64::from), 1.0, f64::from(most))
    };
    count("columns", overrides.columns, COLUMNS_MAX)?;
    count("samples", overrides.samples, SAMPLES_MAX)?;
    within("pitch (mm)", overrides.pitch_mm, 0.01, 50.0)?;
    within("range count (mm)", overrides.range_count_mm, 1e-5, 1.0)?;
    within("standoff (mm)", overrides.standoff_mm, 50.0, 2_000.0)?;
    overrides.mount.validate().map_err(SetupError::Setting)?;
    within("jitter (mm)", overrides.jitter_mm, 0.0, 10.0)?;
    within("backlash (mm)", overrides.backlash_mm, 0.0, 10.0)
}

/// An object by its name, or none if no built-in object is called that.
#[must_use]
pub fn object(name: &str, material: Material) -> Option<Scene> {
    let bodies = match name {
        "house" => vec![figures::house()],
        "cylinder" => vec![figures::cylinder()],
        "figure" => figures::figure(),
        "groove" => figures::groove(),
        "house-on-table" => return Some(benches::house_on_table(material)),
        "cylinder-on-table" => return Some(benches::cylinder_on_table(material)),
        "house-before-plane" => return Some(benches::house_before_plane(material)),
        _ => return None,
    };
    Some(Scene::new(bodies, material))
}
