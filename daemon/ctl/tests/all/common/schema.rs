//! Documents held against what is published about them.

use std::fs;
use std::path::Path;

use jsonschema::{Retrieve, Uri, Validator};
use serde_json::{Value, json};

pub(crate) fn published(name: &str) -> Value {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schema");
    let text = fs::read_to_string(folder.join(name)).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The schemas as published, or, strictly, with every key forbidden that they do not name.
struct Published {
    strict: bool,
}

impl Retrieve for Published {
    fn retrieve(
        &self,
        uri: &Uri<String>,
    ) -> Result<Value, Box<dyn std::error::Error + Send + Sync>> {
        let name = uri.path().as_str().trim_start_matches('/');
        let mut schema = published(name);
        if self.strict {
            close(&mut schema);
        }
        Ok(schema)
    }
}

/// Forbids keys without a description.
fn close(schema: &mut Value) {
    match schema {
        Value::Object(keys) => {
            // The keys of an event depend on its kind, which `properties` does not tell.
            if keys.contains_key("properties")
                && keys.contains_key("required")
                && !keys.contains_key("allOf")
            {
                keys.insert("additionalProperties".into(), false.into());
            }
            keys.values_mut().for_each(close);
        }
        Value::Array(items) => items.iter_mut().for_each(close),
        _ => {}
    }
}

pub(crate) fn validator(reference: &str, strict: bool) -> Validator {
    jsonschema::options()
        .with_base_uri("json-schema:///")
        .with_retriever(Published { strict })
        .build(&json!({ "$ref": reference }))
        .unwrap()
}

#[track_caller]
pub(crate) fn check(reference: &str, document: &Value) {
    // What an event holds beside its kind is told by the kind.
    let modes: &[bool] = if reference.ends_with("/watch") {
        &[false]
    } else {
        &[false, true]
    };
    for &strict in modes {
        let schema = validator(reference, strict);
        let problems: Vec<String> = schema
            .iter_errors(document)
            .map(|error| format!("{}: {error}", error.instance_path()))
            .collect();
        assert!(
            problems.is_empty(),
            "{reference}, strict {strict}: {problems:#?}\n{document:#}"
        );
    }
}
