//! `--set key=value`.

use relief_api::SettingOverrides;
use serde_json::Value;

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

/// The settings by key; the last of several for one key holds.
pub(crate) fn overrides(settings: Vec<Setting>) -> SettingOverrides {
    settings
        .into_iter()
        .map(|setting| (setting.key, setting.value))
        .collect()
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
        assert_eq!(overrides(settings).get("a"), Some(&json!(2)));
    }
}
