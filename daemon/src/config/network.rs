//! The network that tells machining features, in the configuration.

use std::fmt;
use std::path::{Path, PathBuf};

use deliverables::features::FeatureNetwork;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::further::{DELIVERABLES, Wrong};
use super::processing::DeliverablesConfig;

/// A network: by its name until its file is read, and then with its content, so that a scan is kept
/// with the network that tells its features.
#[derive(Debug, Clone, PartialEq)]
pub enum NetworkChoice {
    /// `default`, `published`, or a file.
    Named(String),
    /// What a file holds.
    Read(NetworkContent),
}

/// A network's file that has been read.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkContent {
    text: String,
    network: FeatureNetwork,
}

impl NetworkContent {
    fn new(text: String) -> Result<Self, String> {
        let network = FeatureNetwork::read(&text)?;
        Ok(Self { text, network })
    }
}

/// As it is kept with a scan.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept {
    content: String,
}

impl Serialize for NetworkChoice {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Named(name) => name.serialize(to),
            Self::Read(read) => Kept {
                content: read.text.clone(),
            }
            .serialize(to),
        }
    }
}

impl<'de> Deserialize<'de> for NetworkChoice {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = NetworkChoice;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "\"default\", \"published\", the name of a network's file, or a table with its \
                     content",
                )
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                if text.trim().is_empty() {
                    return Err(E::custom(
                        "the network's file has no name: give one such as \"network.toml\", or \
                         \"default\"",
                    ));
                }
                Ok(NetworkChoice::Named(text.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                let kept = Kept::deserialize(MapAccessDeserializer::new(map))?;
                NetworkContent::new(kept.content)
                    .map(NetworkChoice::Read)
                    .map_err(A::Error::custom)
            }
        }
        from.deserialize_any(Either)
    }
}

impl DeliverablesConfig {
    /// The network that tells features; `None` where its file has not been read.
    pub(super) fn network(&self) -> Option<FeatureNetwork> {
        match &self.features_network {
            None => Some(FeatureNetwork::default()),
            Some(NetworkChoice::Named(name)) => FeatureNetwork::built_in(name),
            Some(NetworkChoice::Read(read)) => Some(read.network.clone()),
        }
    }

    /// The network's file, if it is only named.
    #[must_use]
    pub fn unread_network(&self) -> Option<&Path> {
        match self.features_network.as_ref()? {
            NetworkChoice::Named(name) if FeatureNetwork::built_in(name).is_none() => {
                Some(Path::new(name))
            }
            _ => None,
        }
    }

    /// Reads the network's file, if there is one, whose name is relative to that of the
    /// configuration.
    ///
    /// # Errors
    /// The section, and what is wrong with the file.
    pub(super) fn read_network(&mut self, config: &Path) -> Result<(), Wrong> {
        let Some(named) = self.unread_network() else {
            return Ok(());
        };
        let path: PathBuf = config.parent().unwrap_or(Path::new("")).join(named);
        let wrong = |told: String| (DELIVERABLES, format!("features_network: {told}"));
        let text = std::fs::read_to_string(&path).map_err(|error| {
            wrong(format!(
                "cannot read {}: {error}; name a file from the folder of the configuration, or in \
                 full, \"default\" or \"published\"",
                path.display()
            ))
        })?;
        let read = NetworkContent::new(text)
            .map_err(|error| wrong(format!("{} is no network: {error}", path.display())))?;
        self.features_network = Some(NetworkChoice::Read(read));
        Ok(())
    }
}
