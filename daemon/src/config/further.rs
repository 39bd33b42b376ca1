//! Surfaces and NC programs that a job makes beside the trimmed model. None is made unless its
//! section is there.

use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use deliverables::{Further, MachineFile, MachineFileError, MillOf, SkinOptions, ToolpathOptions};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use surfacing::{JumpThresholds, Placement, SurfaceError};
use toolpath::{Cutter, Pattern, ToolpathError};

use super::processing::DeliverablesConfig;
use super::value;

/// One B-spline surface over the range image.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceConfig {
    /// Greatest distance in z between surface and range image; has to be there.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub tolerance_mm: Option<f64>,
    /// How knots are placed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub knots: Option<KnotsChoice>,
    /// Jumps of z and its first three derivatives that are breaks, for derivative knots.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thresholds: Option<[f64; 4]>,
    /// Nodes are moved by up to this before, so that curvature varies less.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub fair_mm: Option<f64>,
}

/// How knots are placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum KnotsChoice {
    /// As few as the tolerance allows.
    Optimal,
    /// In equal spans.
    Uniform,
    /// At the vertices of the reference sections' polylines.
    Polyline,
    /// Where derivatives of these sections break.
    Derivative,
}

/// A surface skinned over sections of the range image.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SkinConfig {
    /// Greatest distance of a data point from the surface; has to be there.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub tolerance_mm: Option<f64>,
    /// How the surface is found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<SkinMethod>,
    /// Degree of the surface across sections.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degree: Option<usize>,
    /// Distance of the sections along y; each row of the range image if left out.
    #[serde(
        deserialize_with = "value::positive",
        skip_serializing_if = "Option::is_none"
    )]
    pub every_mm: Option<f64>,
}

/// How a skinned surface is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SkinMethod {
    /// With the fewest control points.
    Relief,
    /// Section by section, as published by Jo, Kwon & Han.
    Jo,
}

/// An NC program.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ToolpathConfig {
    /// The machine; has to be there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub machine: Option<MachineChoice>,
    /// The finishing cutter, one of the machine's; has to be there.
    #[serde(deserialize_with = "cutter", skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// Another of them to rough with first.
    #[serde(deserialize_with = "cutter", skip_serializing_if = "Option::is_none")]
    pub rough: Option<String>,
    /// What is milled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<OfChoice>,
    /// Height of the cusps between finishing passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scallop_mm: Option<f64>,
    /// How far above contact the cutter may be led.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance_mm: Option<f64>,
    /// How finishing passes run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternChoice>,
    /// Direction of finishing passes, degrees from x towards y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// What roughing leaves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowance_mm: Option<f64>,
    /// Whether there are arcs (G2, G3).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arcs: Option<bool>,
    /// Distance of the simulation's nodes; after the model's size if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pitch_mm: Option<f64>,
}

/// What is milled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OfChoice {
    /// The trimmed model.
    Model,
    /// The B-spline surface.
    Surface,
}

/// How finishing passes run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PatternChoice {
    /// Straight.
    Parallel,
    /// Such that all cusps are of one height.
    Scallop,
}

/// A machine: by the name of its file until that is read, and then as it was in it, so that a scan is
/// kept with the machine that it was to be milled on.
#[derive(Debug, Clone, PartialEq)]
pub enum MachineChoice {
    /// The file.
    File(PathBuf),
    /// What it holds.
    Read(Box<MachineFile>),
}

impl Serialize for MachineChoice {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::File(path) => path.serialize(to),
            Self::Read(machine) => machine.serialize(to),
        }
    }
}

impl<'de> Deserialize<'de> for MachineChoice {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = MachineChoice;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a machine's file, or a table of its keys")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                if text.trim().is_empty() {
                    return Err(E::custom(
                        "the machine's file has no name: give one such as \"machine.toml\"",
                    ));
                }
                Ok(MachineChoice::File(text.into()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                MachineFile::deserialize(MapAccessDeserializer::new(map))
                    .map(|machine| MachineChoice::Read(Box::new(machine)))
            }
        }
        from.deserialize_any(Either)
    }
}

/// A section, or `"off"` for none, which a scan may override with.
pub(super) fn or_off<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    from: D,
) -> Result<Option<T>, D::Error> {
    struct OrOff<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for OrOff<T> {
        type Value = Option<T>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a section, or \"off\"")
        }

        fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
            match text {
                "off" => Ok(None),
                other => Err(E::custom(format!(
                    "`{other}` is neither a section nor \"off\"; set the keys of the section, such \
                     as tolerance_mm"
                ))),
            }
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            T::deserialize(MapAccessDeserializer::new(map)).map(Some)
        }
    }
    from.deserialize_any(OrOff(PhantomData))
}

fn cutter<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    let text = String::deserialize(from)?;
    text.parse::<Cutter>().map_err(D::Error::custom)?;
    Ok(Some(text))
}

/// The section and what is wrong in it.
pub(super) type Wrong = (&'static str, String);

pub(super) const DELIVERABLES: &str = "deliverables";
const SURFACE: &str = "deliverables.surface";
const SKIN: &str = "deliverables.skin";
const TOOLPATH: &str = "deliverables.toolpath";

fn missing(section: &'static str, key: &str, such_as: &str) -> Wrong {
    let told = format!("the key `{key}` is missing: give it, such as {key} = {such_as}");
    (section, told)
}

impl SurfaceConfig {
    fn settings(&self) -> Result<surfacing::Settings, Wrong> {
        let tolerance_mm = self.tolerance_mm;
        let tolerance_mm = tolerance_mm.ok_or_else(|| missing(SURFACE, "tolerance_mm", "0.05"))?;
        let settings = surfacing::Settings {
            placement: match self.knots {
                None => Placement::default(),
                Some(KnotsChoice::Optimal) => Placement::Optimal,
                Some(KnotsChoice::Uniform) => Placement::Uniform,
                Some(KnotsChoice::Polyline) => Placement::Polyline,
                Some(KnotsChoice::Derivative) => Placement::Derivative,
            },
            thresholds: self
                .thresholds
                .map_or_else(Default::default, JumpThresholds),
            fair_mm: self.fair_mm,
            ..surfacing::Settings::new(tolerance_mm)
        };
        settings.validate().map_err(|error| {
            let key = match &error {
                SurfaceError::Setting { what, .. } if what.contains("fairing") => "fair_mm",
                SurfaceError::Threshold { .. } => "thresholds",
                _ => "tolerance_mm",
            };
            (SURFACE, format!("{key}: {error}"))
        })?;
        Ok(settings)
    }
}

impl SkinConfig {
    fn options(&self) -> Result<SkinOptions, Wrong> {
        let tolerance_mm = self.tolerance_mm;
        let tolerance_mm = tolerance_mm.ok_or_else(|| missing(SKIN, "tolerance_mm", "0.05"))?;
        let usual = skin::Settings::new(tolerance_mm);
        let settings = skin::Settings {
            method: match self.method {
                None => usual.method,
                Some(SkinMethod::Relief) => skin::Method::Relief,
                Some(SkinMethod::Jo) => skin::Method::Jo,
            },
            degree_across: self.degree.unwrap_or(usual.degree_across),
            ..usual
        };
        settings
            .check()
            .map_err(|error| (SKIN, format!("degree: {error}")))?;
        Ok(SkinOptions {
            settings,
            every_mm: self.every_mm,
        })
    }
}

impl ToolpathConfig {
    fn settings(&self) -> Result<toolpath::Settings, Wrong> {
        let parsed = |key: &str, name: &String| -> Result<Cutter, Wrong> {
            let parsed = name.parse::<Cutter>();
            parsed.map_err(|error| (TOOLPATH, format!("{key}: {error}")))
        };
        let tool = self.tool.as_ref();
        let tool = tool.ok_or_else(|| missing(TOOLPATH, "tool", "\"ball:6\""))?;
        let mut settings = toolpath::Settings::finishing(parsed("tool", tool)?);
        let rough = self.rough.as_ref().map(|name| parsed("rough", name));
        settings.rough = rough.transpose()?;
        for (place, own) in [
            (&mut settings.scallop_mm, self.scallop_mm),
            (&mut settings.tolerance_mm, self.tolerance_mm),
            (&mut settings.angle_deg, self.angle_deg),
            (&mut settings.allowance_mm, self.allowance_mm),
        ] {
            *place = own.unwrap_or(*place);
        }
        settings.arcs = self.arcs.unwrap_or(settings.arcs);
        if let Some(pattern) = self.pattern {
            settings.pattern = match pattern {
                PatternChoice::Parallel => Pattern::Parallel,
                PatternChoice::Scallop => Pattern::Scallop,
            };
        }
        settings.validate().map_err(|error| match error {
            ToolpathError::NeedsBall(_) => (TOOLPATH, format!("pattern: {error}")),
            error => (TOOLPATH, error.to_string()),
        })?;
        if let Some(pitch_mm) = self.pitch_mm
            && !(1e-3..=10.0).contains(&pitch_mm)
        {
            return Err((
                TOOLPATH,
                format!("pitch_mm = {pitch_mm}: must be 0.001 to 10"),
            ));
        }
        Ok(settings)
    }

    /// The options, once the machine's file has been read.
    fn options(&self) -> Result<Option<ToolpathOptions>, Wrong> {
        let settings = self.settings()?;
        let machine = match &self.machine {
            None => return Err(missing(TOOLPATH, "machine", "\"machine.toml\"")),
            Some(MachineChoice::File(_)) => return Ok(None),
            Some(MachineChoice::Read(machine)) => machine,
        };
        let file = machine.as_ref().clone();
        let machine = file
            .machine()
            .map_err(|why| (TOOLPATH, format!("machine: {why}")))?;
        for (key, cutter) in [("tool", Some(settings.finish)), ("rough", settings.rough)] {
            if let Some(cutter) = cutter {
                machine
                    .tool(&cutter)
                    .map_err(|error| (TOOLPATH, format!("{key}: {error}")))?;
            }
        }
        Ok(Some(ToolpathOptions {
            of: match self.of {
                None | Some(OfChoice::Model) => MillOf::Model,
                Some(OfChoice::Surface) => MillOf::Surface,
            },
            settings,
            pitch_mm: self.pitch_mm,
            file,
            machine,
        }))
    }
}

impl DeliverablesConfig {
    /// What is made beside the trimmed model. A machine whose file has not been read gives no NC
    /// program, a network's no features; [`DeliverablesConfig::unread_machine`] and
    /// [`DeliverablesConfig::unread_network`] tell.
    ///
    /// # Errors
    /// The section, and what is wrong in it.
    pub fn further(&self) -> Result<Further, (&'static str, String)> {
        let surface = self.surface.as_ref().map(SurfaceConfig::settings);
        let skin = self.skin.as_ref().map(SkinConfig::options);
        let toolpath = self.toolpath.as_ref().map(ToolpathConfig::options);
        let further = Further {
            surface: surface.transpose()?,
            skin: skin.transpose()?,
            toolpath: toolpath.transpose()?.flatten(),
            features: self.network().filter(|_| self.features),
            edits: self.edit.clone(),
        };
        if !self.features && !self.edit.is_empty() {
            let told = "edit changes features, which are off: set features = true";
            return Err((DELIVERABLES, told.to_owned()));
        }
        let of = self.toolpath.as_ref().and_then(|own| own.of);
        if of == Some(OfChoice::Surface) && further.surface.is_none() {
            let told = "of = \"surface\" mills the surface of [deliverables.surface], which is off: \
                        give that section its tolerance_mm, or set of = \"model\"";
            return Err((TOOLPATH, told.to_owned()));
        }
        Ok(further)
    }

    /// The machine's file, if it is only named.
    #[must_use]
    pub fn unread_machine(&self) -> Option<&Path> {
        match self.toolpath.as_ref()?.machine.as_ref()? {
            MachineChoice::File(path) => Some(path),
            MachineChoice::Read(_) => None,
        }
    }

    /// Reads the machine's file, if there is one, whose name is relative to that of the
    /// configuration.
    ///
    /// # Errors
    /// The section, and what is wrong with the file.
    pub(super) fn read_machine(&mut self, config: &Path) -> Result<(), Wrong> {
        let Some(toolpath) = &mut self.toolpath else {
            return Ok(());
        };
        if let Some(MachineChoice::File(path)) = &toolpath.machine {
            let path = config.parent().unwrap_or(Path::new("")).join(path);
            let read = MachineFile::read(&path).map_err(|error| {
                let told = match error {
                    MachineFileError::Read { .. } => format!(
                        "machine: {error}; name a file from the folder of the configuration, or in \
                         full"
                    ),
                    _ => format!("machine: {error}"),
                };
                (TOOLPATH, told)
            })?;
            toolpath.machine = Some(MachineChoice::Read(Box::new(read)));
        }
        Ok(())
    }
}
