//! Everything a user may choose, and the device that it makes.

use std::convert::Infallible;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use thiserror::Error;

use crate::device::DeviceSettings;
use crate::endpoint::pty::{self, PtyError, PtyServer};
use crate::endpoint::usb::{self, Attachment, Personality, UsbError, UsbServer};
use crate::line::LineFaults;
use crate::preset::{self, Overrides, Preset, SetupError};
use crate::replay::{Replay, ReplayError};
use crate::scene::artefacts::{self, Artefact};
use crate::scene::{Body, Material, Mesh, Scene, Stain, StlError};
use crate::source::Source;

/// What stands on the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Object {
    /// One of the objects that come with the simulator, by name (see [`Object::BUILT_IN`]).
    BuiltIn(String),
    /// An STL file, in its own coordinates (taken as millimetres).
    Stl(PathBuf),
    /// A recorded scan, sent again.
    Recording(PathBuf),
}

impl Object {
    /// The objects that come with the simulator.
    pub const BUILT_IN: [&'static str; 12] = [
        "house",
        "cylinder",
        "figure",
        "groove",
        "house-on-table",
        "cylinder-on-table",
        "house-before-plane",
        "sphere",
        "spheres",
        "ball-bar",
        "step-gauge",
        "plate",
    ];
}

impl Default for Object {
    fn default() -> Self {
        Self::BuiltIn("house".into())
    }
}

impl FromStr for Object {
    type Err = Infallible;

    /// The name of a built-in object, else the path of an STL file.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(if Self::BUILT_IN.contains(&text) {
            Self::BuiltIn(text.into())
        } else {
            Self::Stl(text.into())
        })
    }
}

impl core::fmt::Display for Object {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::BuiltIn(name) => f.write_str(name),
            Self::Stl(path) => write!(f, "{}", path.display()),
            Self::Recording(path) => write!(f, "recording {}", path.display()),
        }
    }
}

/// A simulated scanner to be.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SimConfig {
    /// What stands on the table.
    pub object: Object,
    /// The scanner that is imitated. Plays no part for a recording.
    pub preset: Preset,
    /// What differs from the preset. Plays no part for a recording.
    pub overrides: Overrides,
    /// How references (spheres, ball bars, step gauges, plates) are made and placed.
    pub artefact: Artefact,
    /// Seed of everything random.
    pub seed: u64,
    /// Names and pace.
    pub device: DeviceSettings,
    /// Faults of the line.
    pub line: LineFaults,
    /// The table's top is in view, just below the object.
    pub table_plane: bool,
    /// A plane is in view, this far behind the object, millimetres.
    pub back_plane_mm: Option<f64>,
    /// Stains of the object. Play no part for a recording.
    pub stains: Vec<Stain>,
}

/// Why a simulated scanner cannot be made.
#[derive(Debug, Error)]
pub enum SimError {
    /// No object of that name.
    #[error("no object is called {0:?}: use {known}, or an STL file", known = Object::BUILT_IN.join(", "))]
    UnknownObject(String),
    /// The object's file cannot be opened.
    #[error("cannot open {path}: {source}; objects are {known}, or an STL file", known = Object::BUILT_IN.join(", "))]
    Open {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The object's file is no usable STL.
    #[error("{path}: {source}")]
    Stl {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: StlError,
    },
    /// The settings do not go together.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The recording cannot be replayed.
    #[error("cannot replay {path}: {source}")]
    Replay {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ReplayError,
    },
    /// No pseudo-terminal.
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// No USB device.
    #[error(transparent)]
    Usb(#[from] UsbError),
}

impl SimConfig {
    /// What the device measures with.
    ///
    /// # Errors
    /// [`SimError`] when the object cannot be read or a setting is out of range.
    pub fn source(&self) -> Result<Source, SimError> {
        let material = self.preset.material();
        let scene = match &self.object {
            Object::Recording(path) => {
                let replay = Replay::open(path).map_err(|source| SimError::Replay {
                    path: path.clone(),
                    source,
                })?;
                return Ok(Source::Replay(replay));
            }
            Object::BuiltIn(name) => match artefacts::scene(name, &self.artefact, material) {
                Some(scene) => Some(scene.map_err(SetupError::Setting)?),
                None => preset::object(name, material),
            }
            .ok_or_else(|| SimError::UnknownObject(name.clone()))?,
            Object::Stl(path) => Scene::new(vec![Body::Mesh(Box::new(read_stl(path)?))], material),
        };
        if let Some(distance_mm) = self.back_plane_mm
            && !(0.0..=500.0).contains(&distance_mm)
        {
            return Err(SimError::Setup(SetupError::Setting(format!(
                "the back plane must stand 0 to 500 mm behind the object, not {distance_mm}"
            ))));
        }
        let scene = self
            .with_surroundings(scene, material)
            .with_stains(self.stains.clone());
        let (mut scanner, proposed) = self.preset.set_up(scene, &self.overrides, self.seed)?;
        // The window reaches to the plane behind.
        if let Some(distance_mm) = self.back_plane_mm {
            scanner.head.window_mm.1 += distance_mm;
        }
        Ok(Source::Simulated {
            scanner: Box::new(scanner),
            proposed,
        })
    }

    fn with_surroundings(&self, mut scene: Scene, material: Material) -> Scene {
        let (low, _) = scene.object_extent_mm();
        if self.table_plane {
            scene = scene.with_table_plane(low.y, material);
        }
        if let Some(distance_mm) = self.back_plane_mm {
            scene = scene.with_back_plane(low.z - distance_mm, material);
        }
        scene
    }

    /// Offers the device on a pseudo-terminal until the result is dropped.
    ///
    /// # Errors
    /// [`SimError`] when the device cannot be made or offered.
    pub fn serve_pty(&self, link: Option<&Path>) -> Result<PtyServer, SimError> {
        self.serve_with(self.source()?, link)
    }

    /// As [`SimConfig::serve_pty`], with a source made before.
    ///
    /// # Errors
    /// [`SimError::Pty`] when no pseudo-terminal is to be had or the link cannot be made.
    pub fn serve_with(&self, source: Source, link: Option<&Path>) -> Result<PtyServer, SimError> {
        let device = self.device.clone();
        Ok(pty::serve(source, device, self.seed, &self.line, link)?)
    }

    /// Offers a device with a source made before on USB, until the result is dropped.
    ///
    /// # Errors
    /// [`SimError::Usb`] when it cannot be offered there.
    pub fn serve_usb(
        &self,
        source: Source,
        personality: Personality,
        attachment: Attachment,
    ) -> Result<UsbServer, SimError> {
        let device = self.device.clone();
        Ok(usb::serve(
            source,
            device,
            self.seed,
            &self.line,
            personality,
            attachment,
        )?)
    }
}

fn read_stl(path: &Path) -> Result<Mesh, SimError> {
    let file = File::open(path).map_err(|source| SimError::Open {
        path: path.to_path_buf(),
        source,
    })?;
    Mesh::read_stl(&mut BufReader::new(file)).map_err(|source| SimError::Stl {
        path: path.to_path_buf(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_an_object_is_named() {
        let config = |object: &str| SimConfig {
            object: object.parse().expect("never fails"),
            ..SimConfig::default()
        };
        let missing = config("no-such.stl").source().expect_err("no such file");
        assert!(missing.to_string().contains("no-such.stl"), "{missing}");
        let directory = config(env!("CARGO_MANIFEST_DIR")).source();
        assert!(
            matches!(directory, Err(SimError::Stl { .. })),
            "{directory:?}"
        );
    }

    #[test]
    fn settings_out_of_range_are_refused_in_words() {
        let overrides = Overrides {
            outliers: Some(1.5),
            ..Overrides::default()
        };
        let error = SimConfig {
            overrides,
            ..SimConfig::default()
        }
        .source()
        .expect_err("more outliers than samples");
        assert_eq!(
            error.to_string(),
            "outliers must lie between 0 and 1, not 1.5"
        );
    }

    #[test]
    fn the_default_proposes_the_scan_of_the_paper() {
        let proposed = SimConfig::default().source().expect("built in").proposed();
        assert_eq!((proposed.columns, proposed.samples), (240, 256));
    }

    #[test]
    fn columns_and_pitch_are_as_asked() {
        let overrides = Overrides {
            columns: Some(50),
            pitch_mm: Some(0.3),
            samples: Some(100),
            ..Overrides::default()
        };
        let source = SimConfig {
            overrides,
            ..SimConfig::default()
        }
        .source()
        .expect("in range");
        let plan = source.proposed();
        assert_eq!(
            (plan.columns, plan.samples, plan.pitch_counts),
            (50, 100, 30)
        );
        let middle = plan.first_table_counts + plan.pitch_counts * 49 / 2;
        assert!((middle - 20_000).abs() <= 16, "{middle}");
    }
}
