//! Tests that a manifest switches off: `test = false` and `doctest = false` spare the build of programs
//! that would test nothing, and must not hide what does.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;

/// Adds every library and program whose tests, or examples in its documentation, would not run.
pub(crate) fn check(metadata: &Value, broken: &mut Vec<String>) -> Result<()> {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    for target in packages.flat_map(|package| package["targets"].as_array().into_iter().flatten()) {
        let is = |kind: &str| target["kind"][0].as_str() == Some(kind);
        if !is("lib") && !is("bin") {
            continue;
        }
        let name = target["name"].as_str().context("a target without a name")?;
        let root = target["src_path"].as_str().context("one without sources")?;
        let off = |switch: &str| target[switch].as_bool() == Some(false);
        for path in modules(Path::new(root))? {
            let text = read(&path)?;
            let shown = path.display();
            if off("test") && has_tests(&text) {
                broken.push(format!(
                    "{shown}: has tests, and {name} says `test = false`"
                ));
            }
            if is("lib") && off("doctest") && has_examples(&text) {
                broken.push(format!(
                    "{shown}: has examples, and {name} says `doctest = false`"
                ));
            }
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// A target's files, found by their `mod` lines: library and programs may share a folder.
fn modules(root: &Path) -> Result<BTreeSet<PathBuf>> {
    let mut found = BTreeSet::new();
    let mut waiting = vec![root.to_owned()];
    while let Some(path) = waiting.pop() {
        let folder = path.parent().context("a source without a folder")?;
        let own = if path == root || path.ends_with("mod.rs") {
            folder.to_owned()
        } else {
            path.with_extension("")
        };
        for module in read(&path)?.lines().filter_map(module) {
            let beside = own.join(format!("{module}.rs"));
            let within = own.join(module).join("mod.rs");
            waiting.extend([beside, within].into_iter().filter(|path| path.exists()));
        }
        found.insert(path);
    }
    Ok(found)
}

/// What a line such as `pub(crate) mod name;` names.
fn module(line: &str) -> Option<&str> {
    let (before, name) = line.trim().strip_suffix(';')?.rsplit_once("mod ")?;
    (before.is_empty() || before.starts_with("pub")).then_some(name)
}

fn has_tests(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim);
    lines.any(|line| line.starts_with("#[test]") || line.starts_with("#[tokio::test"))
}

/// Whether documentation has code that rustdoc would run: each fence that opens names a language, or
/// is Rust.
fn has_examples(text: &str) -> bool {
    let comment = |line: &'_ str| -> Option<String> {
        let line = line.trim();
        let text = line.strip_prefix("///").or(line.strip_prefix("//!"))?;
        Some(text.trim().to_owned())
    };
    let mut is_open = false;
    for line in text.lines().filter_map(comment) {
        let Some(language) = line.strip_prefix("```") else {
            continue;
        };
        if !is_open && (language.is_empty() || language.starts_with("rust")) {
            return true;
        }
        is_open = !is_open;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_are_found_by_their_lines() {
        assert_eq!(module("pub(crate) mod plane;"), Some("plane"));
        assert_eq!(module("    mod plane;"), Some("plane"));
        assert_eq!(module("// a mod of sorts;"), None);
        assert_eq!(module("mod tests {"), None);
        let own = modules(&crate::shell::root().join("xtask/src/main.rs")).unwrap();
        assert!(own.contains(&crate::shell::root().join("xtask/src/targets.rs")));
    }

    #[test]
    fn what_is_switched_off_is_told_where_there_is_something() {
        let here = crate::shell::root().join("xtask/src/targets.rs");
        let of = |kind: &str, tests: bool| {
            let target = serde_json::json!({
                "kind": [kind], "name": "own", "src_path": here, "test": tests, "doctest": tests,
            });
            let mut broken = Vec::new();
            let metadata = serde_json::json!({ "packages": [{ "targets": [target] }] });
            check(&metadata, &mut broken).unwrap();
            broken
        };
        assert_eq!(of("bin", true), Vec::<String>::new());
        let told = of("bin", false);
        assert!(told.len() == 1 && told[0].contains("has tests"), "{told:?}");
    }

    #[test]
    fn examples_are_told_from_drawings() {
        assert!(has_examples("/// ```\n/// let one = 1;\n/// ```\n"));
        assert!(has_examples("//! ```text\n//! y\n//! ```\n//! ```rust\n"));
        assert!(!has_examples("//! ```text\n//! y\n//! ```\n"));
        assert!(!has_examples("// ```\n"));
    }
}
