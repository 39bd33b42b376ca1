//! `--set key=value`.

use std::path::Path;

use deliverables::MachineFile;
use relief_api::SettingOverrides;
use serde_json::Value;

use crate::failure::Failure;

/// A processing setting that differs from the service's configuration.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Setting {
    key: String,
    value: Value,
}

/// Reads `regrid.neighbours=25`. Numbers and booleans become what they look like,
/// everything else is text.
pub(crate) fn parse(text: &str) -> Result<Setting, String> {
    let (key, value) = text
        .split_once('=')
        .ok_or("expected KEY=VALUE, such as regrid.neighbours=25")?;
    let (key, value) = (key.trim(), value.trim());
    if key.is_empty() || value.is_empty() {
        return Err("key or value is missing; expected KEY=VALUE".into());
    }
    let value = match serde_json::from_str::<Value>(value) {
        Ok(parsed @ (Value::Number(_) | Value::Bool(_) | Value::String(_) | Value::Array(_))) => {
            parsed
        }
        _ => Value::String(value.to_owned()),
    };
    Ok(Setting {
        key: key.to_owned(),
        value,
    })
}

/// The key whose file is read here, with the rights of whoever asks.
const MACHINE: &str = "deliverables.toolpath.machine";

/// The settings by key; the last of several for one key holds. The service is sent the content of
/// a machine's file.
pub(crate) fn overrides(settings: Vec<Setting>) -> Result<SettingOverrides, Failure> {
    let mut overrides: SettingOverrides = settings
        .into_iter()
        .map(|setting| (setting.key, setting.value))
        .collect();
    if let Some(machine) = overrides.get_mut(MACHINE)
        && let Value::String(name) = machine
    {
        let read = MachineFile::read(Path::new(name));
        let read = read.map_err(|error| Failure::Failed(error.to_string()))?;
        *machine =
            serde_json::to_value(read).map_err(|error| Failure::Failed(error.to_string()))?;
    }
    Ok(overrides)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_become_what_they_look_like() {
        for (text, value) in [
            ("a.b=25", json!(25)),
            ("a.b = 0.42", json!(0.42)),
            ("a.b=true", json!(true)),
            ("a.b=shim-lee", json!("shim-lee")),
            ("a.b=\"25\"", json!("25")),
            ("a.b=[0, 1.5]", json!([0, 1.5])),
        ] {
            let found = parse(text).unwrap();
            assert_eq!(
                (found.key.as_str(), &found.value),
                ("a.b", &value),
                "{text}"
            );
        }
        assert!(parse("a.b").is_err() && parse("=3").is_err() && parse("a=").is_err());
    }

    #[test]
    fn the_last_of_several_holds() {
        let settings = vec![parse("a=1").unwrap(), parse("a=2").unwrap()];
        assert_eq!(overrides(settings).unwrap().get("a"), Some(&json!(2)));
    }

    #[test]
    fn a_machine_is_sent_as_its_file_has_it() {
        let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/machine.toml");
        let named = |file: &str| overrides(vec![parse(&format!("{MACHINE}={file}")).unwrap()]);
        let sent = named(example).unwrap();
        assert_eq!(sent[MACHINE]["safe_z_mm"], json!(30.0));
        assert_eq!(sent[MACHINE]["tools"][0]["cutter"], json!("ball:6"));
        let missing = named("no/such.toml").unwrap_err();
        assert!(
            matches!(&missing, Failure::Failed(why) if why.contains("cannot read no/such.toml")),
            "{missing:?}"
        );
    }
}
