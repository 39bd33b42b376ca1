//! Scans of a scene, in memory: what the simulated scanner `paper` delivers.

use anyhow::{Context, Result};
use glam::DVec3;
use pipeline::Settings;
use range_image::{Column, Lattice, RangeImage, Unmonitored};
use scan_files::recommended_pitch_mm;
use sim_scanner::preset::Preset;
use sim_scanner::scanner::{HeadKind, Scanner, Sweep};
use sim_scanner::scene::{Body, ConvexSolid, Material, Scene, Surface};

use super::Drawn;
use crate::columns::received;

/// A way to scan a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum View {
    /// As the preset does: noise 0.05 mm, mixed samples, dropouts, no outliers.
    Plain,
    /// 25 % of the samples anywhere in the range window, and noise of 0.1 mm.
    Outliers,
    /// The samples of the plain view with x turned about.
    Mirrored,
    /// Twice the columns and samples, regridded at half the pitch.
    HalfPitch,
    /// Other noise, and other draws of the regridder.
    OtherSeed,
    /// A tenth more around the part in view, where there is nothing.
    Alone,
    /// The same sweep with the part on a table, before a plane behind it: it differs from
    /// [`Self::Alone`] in nothing else, its noise included.
    Cluttered,
}

impl View {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Plain,
        Self::Outliers,
        Self::Mirrored,
        Self::HalfPitch,
        Self::OtherSeed,
        Self::Alone,
        Self::Cluttered,
    ];

    /// The name in tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Outliers => "outliers",
            Self::Mirrored => "mirrored",
            Self::HalfPitch => "half-pitch",
            Self::OtherSeed => "other-seed",
            Self::Alone => "alone",
            Self::Cluttered => "cluttered",
        }
    }

    /// Node (i, j) of the plain lattice is node (i times the first, j times the second) of
    /// this view's.
    #[must_use]
    pub fn factor(self) -> (i64, i64) {
        match self {
            Self::Mirrored => (-1, 1),
            Self::HalfPitch => (2, 2),
            _ => (1, 1),
        }
    }
}

/// The lattice that the service would choose for a sweep.
#[must_use]
pub fn lattice(scanner: &Scanner, sweep: &Sweep) -> Lattice {
    let column_pitch_mm = f64::from(sweep.pitch_counts.abs()) * scanner.mechanics.count_mm();
    let step = f64::from(sweep.lateral_step_counts);
    let spacing_mm = match scanner.head.kind {
        HeadKind::Polar {
            angle_count_nrad, ..
        } => {
            let (near, far) = scanner.head.window_mm;
            step * f64::from(angle_count_nrad) * 1e-9 * (near + far) / 2.0
        }
        HeadKind::Cartesian { count_nm, .. } => step * f64::from(count_nm) * 1e-6,
    };
    Lattice {
        pitch_mm: recommended_pitch_mm(column_pitch_mm, spacing_mm),
    }
}

/// The columns of the plain view, and the scanner that they come from.
///
/// # Errors
/// When the scene does not fit the scanner.
pub fn plain_columns(drawn: &Drawn) -> Result<(Scanner, Vec<Column>)> {
    let (scanner, sweep) = set_up(drawn, View::Plain)?;
    let columns = columns(&scanner, &sweep);
    Ok((scanner, columns))
}

/// The range image of a view, by the service's default regridding.
///
/// # Errors
/// When the scene does not fit the scanner, or the regridder fails.
pub fn range_image(drawn: &Drawn, view: View) -> Result<RangeImage> {
    let (scanner, sweep) = set_up(drawn, view)?;
    let mut columns = columns(&scanner, &sweep);
    if view == View::Mirrored {
        columns = columns.iter().rev().map(mirrored).collect();
    }
    let finer = if view == View::HalfPitch { 2.0 } else { 1.0 };
    let mut settings = Settings::new(drawn.truth.lattice.pitch_mm / finer).regrid;
    settings.threads = 1;
    if view == View::OtherSeed {
        settings.seed += 1;
    }
    regrid::regrid(columns, &settings, &Unmonitored)
        .with_context(|| format!("{} {} {}", drawn.set.name(), drawn.seed, view.name()))
}

/// The scanner before the scene, and the sweep of a view.
fn set_up(drawn: &Drawn, view: View) -> Result<(Scanner, Sweep)> {
    let mut overrides = drawn.set.overrides(&drawn.scene);
    let mut seed = drawn.seed;
    let mut scene = drawn.scene.clone();
    match view {
        View::Plain | View::Mirrored | View::Alone => {}
        View::Outliers => {
            overrides.outliers = Some(0.25);
            overrides.noise_mm = Some(0.1);
        }
        View::HalfPitch => {
            let base = Preset::Paper.set_up(scene.clone(), &overrides, seed)?.1;
            overrides.columns = Some(base.columns * 2);
            overrides.samples = Some(base.samples * 2);
        }
        View::OtherSeed => seed += 1_000_000,
        View::Cluttered => scene = cluttered(scene),
    }
    let (scanner, mut sweep) = Preset::Paper.set_up(scene, &overrides, seed)?;
    if matches!(view, View::Alone | View::Cluttered) {
        // A tenth more on every side.
        let (columns, samples) = (sweep.columns / 10, sweep.samples / 10);
        sweep.first_table_counts -= sweep.pitch_counts * columns as i32;
        sweep.first_lateral_counts -= sweep.lateral_step_counts * samples as i32;
        sweep.columns += 2 * columns;
        sweep.samples += 2 * samples;
    }
    Ok((scanner, sweep))
}

/// The scene on a table that touches it from below, its far side towards the camera at 40
/// degrees, and before a plane 5 mm behind the object.
fn cluttered(mut scene: Scene) -> Scene {
    const LEAN_RAD: f64 = 40.0 * core::f64::consts::PI / 180.0;
    let (low, high) = scene.object_extent_mm();
    let (sin, cos) = libm::sincos(LEAN_RAD);
    let normal = DVec3::new(0.0, sin, cos);
    // The box around the object stands on it.
    let offset_mm = normal.dot(DVec3::new(high.x, low.y, low.z));
    for (normal, offset_mm) in [(normal, offset_mm), (DVec3::Z, low.z - 5.0)] {
        let solid = ConvexSolid::new(vec![Surface::Plane { normal, offset_mm }]);
        scene.bodies.push((Body::Solid(solid), Material::PAPER));
    }
    scene
}

fn columns(scanner: &Scanner, sweep: &Sweep) -> Vec<Column> {
    (0..sweep.columns)
        .map(|index| received(scanner, &scanner.column(sweep, 0, index)))
        .collect()
}

fn mirrored(column: &Column) -> Column {
    Column::new(-column.x_mm(), column.samples().to_vec())
}
