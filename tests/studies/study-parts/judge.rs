//! What OpenCASCADE and Gmsh say of the exported files, and who makes the parts.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

const MAKE: &str = "tests/judges/parts/make.py";
const CHECK: &str = "tests/judges/parts/check.py";
const MESH: &str = "tests/judges/gmsh_check.py";
/// Edges of one face may lie so far in all where none belongs: a corner's worth.
pub(crate) const MISPLACED_MM: f64 = 1.0;

/// Gmsh meshes most files in a second or two, and some in no time that anyone would wait for.
const MESHED_WITHIN_S: u32 = 60;

/// The verdict on a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct Judged {
    pub(crate) seed: u64,
    /// `igs` or `step`.
    pub(crate) file: String,
    pub(crate) is_read: bool,
    pub(crate) faces: usize,
    pub(crate) invalid: usize,
    /// Edges of one face after sewing, and those where none belongs.
    pub(crate) free_mm: f64,
    pub(crate) misplaced_mm: f64,
    /// What Gmsh complains of as it meshes the faces, where it was asked.
    #[serde(default)]
    pub(crate) complaints: Option<Vec<String>>,
}

/// What the script about meshes says of a file.
#[derive(Debug, Deserialize)]
struct Meshed {
    problems: Vec<String>,
}

impl Judged {
    pub(crate) fn is_valid(&self) -> bool {
        self.is_read && self.faces > 0 && self.invalid == 0
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.is_read && self.misplaced_mm <= MISPLACED_MM
    }
}

/// A Python with OpenCASCADE, and with Gmsh where that is asked.
#[derive(Debug, Clone)]
pub(crate) struct Python(pub(crate) PathBuf);

impl Python {
    fn run(&self, script: &str, words: &[String]) -> Result<Output> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        Command::new(&self.0)
            .args(["-B", script])
            .args(words)
            .current_dir(root)
            .stderr(Stdio::inherit())
            .output()
            .with_context(|| format!("cannot start {}", self.0.display()))
    }

    fn said(&self, script: &str, words: &[String]) -> Result<String> {
        let output = self.run(script, words)?;
        ensure!(
            output.status.success(),
            "{script} ended with {}",
            output.status
        );
        Ok(String::from_utf8(output.stdout)?)
    }

    /// Makes the parts that are not there.
    pub(crate) fn make(&self, folder: &Path, seeds: &[u64]) -> Result<()> {
        let folder = absolute(folder)?;
        let mut words = vec!["--out".to_owned(), folder];
        words.extend(seeds.iter().map(u64::to_string));
        eprint!("{}", self.said(MAKE, &words)?);
        Ok(())
    }

    /// Judges the models in a folder.
    pub(crate) fn judge(&self, folder: &Path, seeds: &[u64]) -> Result<Vec<Judged>> {
        let mut words = vec![absolute(folder)?];
        words.extend(seeds.iter().map(u64::to_string));
        Ok(serde_json::from_str(&self.said(CHECK, &words)?)?)
    }

    /// Has Gmsh mesh the files that were judged, each by a process of its own: one that falls
    /// over says nothing of the others.
    pub(crate) fn mesh(&self, folder: &Path, judged: &mut [Judged]) -> Result<()> {
        let folder = absolute(folder)?;
        for file in judged {
            let model = format!("{folder}/{}.step", file.seed);
            let text = fs::read_to_string(&model).context(model.clone())?;
            let area_mm2 = stated_area_mm2(&text).context(format!("{model} states no area"))?;
            let words = [
                format!("{folder}/{}.{}", file.seed, file.file),
                "--area-mm2".to_owned(),
                area_mm2.to_string(),
                "--within-s".to_owned(),
                MESHED_WITHIN_S.to_string(),
            ];
            let output = self.run(MESH, &words)?;
            // Killed by a signal, that of the clock among them: the file was too much for Gmsh.
            // Whatever else leaves no verdict, as a Python without Gmsh does, is no fault of it.
            file.complaints = Some(if output.status.code().is_none() {
                vec![format!("{MESH} ended with {}", output.status)]
            } else {
                let said: Vec<Meshed> = serde_json::from_slice(&output.stdout)
                    .with_context(|| format!("no verdict of {MESH}, {}", output.status))?;
                said.into_iter().flat_map(|m| m.problems).collect()
            });
        }
        Ok(())
    }
}

/// The area that a STEP file says its faces have.
fn stated_area_mm2(step: &str) -> Option<f64> {
    let (_, rest) = step.split_once("AREA_MEASURE(")?;
    rest.split_once(')')?.0.trim().parse().ok()
}

fn absolute(folder: &Path) -> Result<String> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    Ok(fs::canonicalize(folder)?.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_is_that_of_the_file() {
        let text =
            "#1=MEASURE_REPRESENTATION_ITEM('surface area measure',\nAREA_MEASURE(8327.5),#2);";
        assert_eq!(stated_area_mm2(text), Some(8327.5));
        assert_eq!(stated_area_mm2("#1=PLANE('',#2);"), None);
    }

    #[test]
    fn a_file_holds_if_it_was_read_and_all_is_where_it_belongs() {
        let sound = Judged {
            seed: 1,
            file: "igs".into(),
            is_read: true,
            faces: 4,
            invalid: 0,
            free_mm: 300.0,
            misplaced_mm: 0.4,
            complaints: None,
        };
        assert!(sound.is_valid() && sound.is_closed());
        let with = |change: fn(&mut Judged)| {
            let mut changed = sound.clone();
            change(&mut changed);
            changed
        };
        assert!(!with(|j| j.invalid = 1).is_valid());
        assert!(!with(|j| j.faces = 0).is_valid());
        assert!(!with(|j| j.misplaced_mm = 1.5).is_closed());
        let unread = with(|j| j.is_read = false);
        assert!(!unread.is_valid() && !unread.is_closed());
    }
}
