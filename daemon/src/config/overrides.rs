//! Settings of one scan in place of those of the configuration.

use relief_api::SettingOverrides;
use serde_json::{Map, Value};

use super::load::with_nearest_name;
use super::processing::Processing;

/// Overrides that cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("setting `{key}`: {message}")]
pub struct OverrideError {
    /// The key as it was given.
    pub key: String,
    /// What is wrong and what to do.
    pub message: String,
}

impl Processing {
    /// These settings with some replaced, keyed `section.key` as in the file.
    ///
    /// # Errors
    /// An unknown key, or a value that cannot be, is refused by its name.
    pub fn with_overrides(&self, overrides: &SettingOverrides) -> Result<Self, OverrideError> {
        let mut settings = self.clone();
        for (key, value) in overrides {
            let wrong = |message: String| OverrideError {
                key: key.clone(),
                message,
            };
            let Some((section, name)) = key.split_once('.') else {
                return Err(wrong(
                    "keys are written `section.key`, such as `regrid.pitch_mm`".into(),
                ));
            };
            // By way of a tree, so that serde checks overrides exactly as it does the file.
            let mut tree = serde_json::to_value(&settings).map_err(|e| wrong(e.to_string()))?;
            let sections = tree.as_object_mut();
            let Some(table) = sections.and_then(|s| s.get_mut(section)?.as_object_mut()) else {
                return Err(wrong(format!(
                    "there is no section [{section}] that a scan can override; there are \
                     regrid, segment, fill, reconstruct and deliverables"
                )));
            };
            put(table, name, value);
            settings = serde_json::from_value(tree)
                .map_err(|error| wrong(with_nearest_name(&error.to_string())))?;
        }
        settings
            .check()
            .map_err(|(section, message)| OverrideError {
                key: section.to_owned(),
                message,
            })?;
        // The service reads no files for those who ask it over the network.
        if settings.deliverables.unread_machine().is_some() {
            return Err(OverrideError {
                key: "deliverables.toolpath.machine".to_owned(),
                message: "a machine's file is read with the configuration, or by the client: the \
                          service needs its content here"
                    .to_owned(),
            });
        }
        if settings.deliverables.unread_network().is_some() {
            return Err(OverrideError {
                key: "deliverables.features_network".to_owned(),
                message: "a network's file is read with the configuration: of others the service \
                          needs the content here, as { \"content\": \"...\" }; without a file there \
                          are \"default\" and \"published\""
                    .to_owned(),
            });
        }
        Ok(settings)
    }
}

/// Puts a value at `key`, or at `section.key` of a section within, which is made if it is not there.
fn put(table: &mut Map<String, Value>, name: &str, value: &Value) {
    let Some((section, rest)) = name.split_once('.') else {
        table.insert(name.to_owned(), value.clone());
        return;
    };
    let within = table.entry(section).or_insert(Value::Null);
    if !within.is_object() {
        *within = Value::Object(Map::new());
    }
    if let Value::Object(within) = within {
        put(within, rest, value);
    }
}
