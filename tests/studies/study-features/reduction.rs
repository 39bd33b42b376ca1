//! The paper's run of data reduction (section 4.2), with the command as it is delivered.

use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::scan;
use crate::study::Study;

/// What the paper asked for: distance, angle, rate.
const ASKED: [&str; 6] = [
    "--reduce-distance-mm",
    "0.9",
    "--reduce-angle-deg",
    "30",
    "--reduce-rate",
    "2",
];
/// Scans of each kind at most.
const MOST: usize = 5;

impl Study<'_> {
    /// Thins scans of the published part without and with its table; gives the file of what was left.
    pub(crate) fn reduction(&self) -> Result<PathBuf> {
        let seeds: Vec<u64> = self.published().take(MOST).collect();
        let with_table: Vec<String> = seeds
            .iter()
            .map(|seed| format!("published-5deg-{seed}"))
            .collect();
        let alone: Vec<String> = seeds
            .iter()
            .map(|seed| format!("published-alone-{seed}"))
            .collect();
        let out: [OsString; 2] = ["--out".into(), self.parts.clone().into()];
        let words = ["--no-table", "--name", "published-alone-{seed}"].map(Into::into);
        let seeds = seeds.iter().map(|seed| seed.to_string().into());
        let words: Vec<OsString> = out.into_iter().chain(words).chain(seeds).collect();
        self.python("published.py", &words)?;
        scan::all(&self.parts, &alone)?;
        let told = serde_json::json!({
            "part": self.reduced(&alone)?,
            "table": self.reduced(&with_table)?,
        });
        let file = self.options.place.join("found/reduction.json");
        fs::write(&file, serde_json::to_vec(&told)?).with_context(|| file.display().to_string())?;
        Ok(fs::canonicalize(file)?)
    }

    fn reduced(&self, parts: &[String]) -> Result<Vec<Value>> {
        parts.iter().map(|part| self.reduced_one(part)).collect()
    }

    fn reduced_one(&self, part: &str) -> Result<Value> {
        let found = self.options.place.join("found/reduced");
        fs::create_dir_all(&found).with_context(|| found.display().to_string())?;
        let output = Command::new(&self.relief)
            .args(["--json", "features"])
            .arg(self.parts.join(format!("{part}.scan")))
            .arg("-o")
            .arg(found.join(format!("{part}.features.json")))
            .arg("--reduced")
            .arg(found.join(format!("{part}.xyz")))
            .args(ASKED)
            .output()
            .with_context(|| format!("cannot start {}", self.relief.display()))?;
        ensure!(
            output.status.success(),
            "{part}: not thinned, {}: {}",
            output.status,
            String::from_utf8_lossy(&output.stderr).trim()
        );
        let told: Value = serde_json::from_slice(&output.stdout)?;
        let reduced = told
            .get("reduced")
            .context("the command tells of no thinning")?;
        Ok(reduced.clone())
    }
}
