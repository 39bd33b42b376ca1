//! The road from seeds to tables: parts, scans, answers, verdicts.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use crate::JudgeOptions;
use crate::scan;

const JUDGES: &str = "tests/judges/features";
const PAGE: &str = "docs/studies/features.md";
/// What the page begins with.
const PREFACE: &str = "tests/studies/study-features/preface.md";
/// Columns and rows of the published part so near that a million samples come back, millimetres.
const MILLION_PITCH: &str = "0.0893";
const MILLION: &str = "million";
/// Runs of which the fastest counts: what else the machine does only makes them slower.
const RUNS: usize = 5;
/// Most seconds for a million samples on two processors.
const MILLION_MOST_S: f64 = 3.0;
/// Of a short study.
const SHORT_PUBLISHED: usize = 2;
const SHORT_RANDOM: usize = 6;
const CHANCE_SEED: &str = "1";

/// Scans that are told of together, and how they are recognised.
struct Set {
    /// As the tables call it.
    name: &'static str,
    /// Its parts.
    parts: Vec<String>,
    /// What the command is told besides.
    words: Vec<OsString>,
    /// Whether the solids are made and judged, too.
    with_solids: bool,
}

pub(crate) struct Study<'a> {
    pub(crate) options: &'a JudgeOptions,
    root: PathBuf,
    pub(crate) parts: PathBuf,
    pub(crate) relief: PathBuf,
}

impl JudgeOptions {
    fn is_whole(&self) -> bool {
        !self.short && !self.only_published
    }
}

/// Does all of it.
pub(crate) fn run(options: &JudgeOptions) -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let parts = options.place.join("parts");
    fs::create_dir_all(&parts).with_context(|| parts.display().to_string())?;
    let relief = match &options.relief {
        Some(relief) => relief.clone(),
        None => std::env::current_exe()?.with_file_name("relief"),
    };
    ensure!(relief.exists(), "no command at {}", relief.display());
    let study = Study {
        options,
        root,
        parts: fs::canonicalize(parts)?,
        relief: fs::canonicalize(relief)?,
    };
    eprint!(
        "{}",
        String::from_utf8(study.python("judge_check.py", &[])?)?
    );
    study.make()?;
    let mut verdicts = Vec::new();
    for set in study.sets() {
        verdicts.push((set.name, study.judged(&set)?));
    }
    let million = if options.is_whole() {
        Some(study.million()?)
    } else {
        None
    };
    study.table(&verdicts)?;
    study.report(&verdicts, million)
}

fn names(seeds: impl Iterator<Item = u64>, name: impl Fn(u64) -> String) -> Vec<String> {
    seeds.map(name).collect()
}

/// Where the rebuilt solid goes.
fn step_of(found: &Path, part: &str) -> [OsString; 2] {
    ["--step".into(), found.join(format!("{part}.step")).into()]
}

impl Study<'_> {
    pub(crate) fn published(&self) -> impl Iterator<Item = u64> {
        let most = if self.options.short {
            SHORT_PUBLISHED
        } else {
            usize::MAX
        };
        self.options.published.clone().take(most)
    }

    fn random(&self) -> impl Iterator<Item = u64> {
        let most = if self.options.short {
            SHORT_RANDOM
        } else {
            usize::MAX
        };
        self.options.seeds.clone().take(most)
    }

    fn sets(&self) -> Vec<Set> {
        let set = |name, parts: Vec<String>, words: &[OsString]| Set {
            name,
            parts,
            words: words.to_vec(),
            with_solids: words.is_empty(),
        };
        let turned = names(self.published(), |seed| format!("published-5deg-{seed}"));
        let straight = names(self.published(), |seed| format!("published-0deg-{seed}"));
        let odd = ["blank", "free-form", "half", "cut"].map(|name| format!("odd-{name}"));
        let random = names(self.random(), |seed| seed.to_string());
        let mut sets = vec![
            set("published", turned, &[]),
            set("published-0", straight, &[]),
        ];
        if self.options.only_published {
            return sets;
        }
        sets.push(set("random", random.clone(), &[]));
        sets.push(set("odd", odd.to_vec(), &[]));
        if let Some(plain) = &self.options.plain {
            let plain = ["--network".into(), plain.into()];
            sets.push(set("random-plain", random.clone(), &plain));
            let chance = ["--classes-by-chance", CHANCE_SEED].map(Into::into);
            sets.push(set("random-chance", random, &chance));
        }
        sets
    }

    /// Parts and scans that are not there.
    fn make(&self) -> Result<()> {
        let out: [OsString; 2] = ["--out".into(), self.parts.clone().into()];
        let seeds = |seeds: &mut dyn Iterator<Item = u64>| -> Vec<OsString> {
            seeds.map(|seed| seed.to_string().into()).collect()
        };
        let published = seeds(&mut self.published());
        for turn in ["5", "0"] {
            let turn: [OsString; 2] = ["--turn-deg".into(), turn.into()];
            self.python("published.py", &[&out[..], &turn, &published].concat())?;
        }
        if !self.options.only_published {
            self.python("odd.py", &out)?;
            let random = seeds(&mut self.random());
            self.python("make.py", &[&out[..], &random].concat())?;
        }
        if self.options.is_whole() {
            let words = ["--pitch-mm", MILLION_PITCH, "--name", MILLION, "1"].map(Into::into);
            self.python("published.py", &[&out[..], &words].concat())?;
            scan::all(&self.parts, &[MILLION.to_owned()])?;
        }
        let all = self.sets().into_iter().flat_map(|set| set.parts);
        scan::all(&self.parts, &all.collect::<Vec<_>>())
    }

    /// Runs a script of the judges'; gives what it prints.
    pub(crate) fn python(&self, script: &str, words: &[OsString]) -> Result<Vec<u8>> {
        let output = self.run_python(script, words)?;
        ensure!(
            output.status.success(),
            "{script} ended with {}",
            output.status
        );
        Ok(output.stdout)
    }

    fn run_python(&self, script: &str, words: &[OsString]) -> Result<Output> {
        let output = Command::new(&self.options.python)
            .arg("-B")
            .arg(format!("{JUDGES}/{script}"))
            .args(words)
            .current_dir(&self.root)
            .stderr(Stdio::inherit())
            .output()
            .with_context(|| format!("cannot start {}", self.options.python.display()))?;
        Ok(output)
    }

    /// Has the command recognise a scan, and keeps how long it took. Without an answer there is no
    /// file; the judge counts that.
    fn recognise(&self, found: &Path, part: &str, words: &[OsString]) -> Result<Option<f64>> {
        let file = |ending: &str| found.join(format!("{part}.{ending}"));
        for ending in ["features.json", "step", "seconds"] {
            let old = file(ending);
            if old.exists() {
                fs::remove_file(&old).with_context(|| old.display().to_string())?;
            }
        }
        let begun = Instant::now();
        let output = Command::new(&self.relief)
            .arg("features")
            .arg(self.parts.join(format!("{part}.scan")))
            .arg("-o")
            .arg(file("features.json"))
            .args(words)
            .output()
            .with_context(|| format!("cannot start {}", self.relief.display()))?;
        let seconds = begun.elapsed().as_secs_f64();
        if !output.status.success() {
            let told = String::from_utf8_lossy(&output.stderr);
            eprintln!("{part}: no answer, {}: {}", output.status, told.trim());
            return Ok(None);
        }
        let text = serde_json::to_vec(&seconds)?;
        fs::write(file("seconds"), text)?;
        Ok(Some(seconds))
    }

    /// Answers to a set of scans, and the file with what the judge says of them.
    fn judged(&self, set: &Set) -> Result<PathBuf> {
        let found = self.options.place.join("found").join(set.name);
        fs::create_dir_all(&found).with_context(|| found.display().to_string())?;
        let found = fs::canonicalize(found)?;
        for part in &set.parts {
            let mut words = set.words.clone();
            if set.with_solids {
                words.extend(step_of(&found, part));
            }
            self.recognise(&found, part, &words)?;
        }
        let mut words: Vec<OsString> = vec!["--truth".into(), self.parts.clone().into()];
        words.extend(["--found".into(), found.clone().into()]);
        words.extend(set.parts.iter().map(Into::into));
        let verdict = found.with_extension("json");
        fs::write(&verdict, self.python("judge.py", &words)?)
            .with_context(|| verdict.display().to_string())?;
        Ok(verdict)
    }

    /// Seconds for a million samples, the fastest of a few runs; and how many samples there are.
    fn million(&self) -> Result<(f64, u64)> {
        let found = self.options.place.join("found");
        fs::create_dir_all(&found).with_context(|| found.display().to_string())?;
        let found = fs::canonicalize(found)?;
        let mut fastest = f64::INFINITY;
        for _ in 0..RUNS {
            let seconds = self.recognise(&found, MILLION, &step_of(&found, MILLION))?;
            fastest = fastest.min(seconds.context("no answer to the scan of a million samples")?);
        }
        let seen = fs::read(self.parts.join(format!("{MILLION}.seen.json")))?;
        let seen: serde_json::Value = serde_json::from_slice(&seen)?;
        let samples = seen["samples"].as_u64().context("samples are not told")?;
        Ok((fastest, samples))
    }

    /// Table 3 of the paper, where it is asked for.
    fn table(&self, verdicts: &[(&str, PathBuf)]) -> Result<()> {
        let Some(page) = &self.options.table else {
            return Ok(());
        };
        let of = |name: &str| {
            let found = verdicts.iter().find(|(own, _)| *own == name);
            found
                .map(|(_, file)| file.clone().into_os_string())
                .context("no such scans")
        };
        let mut words: Vec<OsString> = vec!["--turned".into(), of("published")?];
        words.extend(["--straight".into(), of("published-0")?]);
        words.extend(["--reduction".into(), self.reduction()?.into()]);
        words.extend(["--page".into(), page.into()]);
        self.python("table3.py", &words)?;
        Ok(())
    }

    fn report(&self, verdicts: &[(&str, PathBuf)], million: Option<(f64, u64)>) -> Result<()> {
        let mut words: Vec<OsString> = Vec::new();
        for (name, file) in verdicts {
            let mut set = OsString::from(format!("{name}="));
            set.push(file);
            words.extend(["--set".into(), set]);
        }
        if let Some((seconds, samples)) = million {
            let told = format!(
                "{samples} samples of the published part: {seconds:.2} s from the scan file to the \
                 features and the solid, the fastest of {RUNS} runs. Asked: {MILLION_MOST_S} s."
            );
            words.extend(["--seconds".into(), told.into()]);
        }
        if self.options.write {
            words.extend(["--preface", PREFACE, "--page", PAGE].map(Into::into));
        }
        if self.options.check {
            words.push("--check".into());
        }
        let said = self.run_python("report.py", &words)?;
        print!("{}", String::from_utf8_lossy(&said.stdout));
        ensure!(
            said.status.success(),
            "report.py ended with {}",
            said.status
        );
        if let Some((seconds, _)) = million.filter(|_| self.options.check) {
            ensure!(
                seconds <= MILLION_MOST_S,
                "a million samples took {seconds:.2} s, more than {MILLION_MOST_S} s"
            );
        }
        Ok(())
    }
}
