//! Lets independent programs judge the CAD files of simulated scans.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::{shell, study};

/// The judge's packages, pinned: another OpenCASCADE may judge otherwise.
const PACKAGES: [&str; 2] = [OCP, "numpy"];
/// OpenCASCADE.
pub(crate) const OCP: &str = "cadquery-ocp==8.0.1.1.0";

/// Meshes the files, where that is asked for.
const GMSH: &str = "gmsh==4.15.2";

/// Fits surfaces, where that is asked for.
pub(crate) const SCIPY: &str = "scipy==1.17.1";

/// The simulated objects, and what is asked of their scans.
const OBJECTS: [&str; 2] = ["house", "cylinder"];

/// Seeds begin here. Lower ones were looked at while the stages were tuned.
const FIRST_SEED: u32 = 101;

/// Scans by the fastest of which a bound on seconds is judged: what else the machine does
/// meanwhile only makes them slower.
const ATTEMPTS: u32 = 3;

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Scans of each object.
    #[arg(long, default_value_t = 2)]
    pub(crate) seeds: u32,
    /// Also let FreeCAD load the files (needs `freecadcmd`).
    #[arg(long)]
    pub(crate) freecad: bool,
    /// Also have Gmsh mesh the files
    #[arg(long)]
    pub(crate) gmsh: bool,
    /// Most seconds from a scan's last column to its result in the spool; how long that takes is
    /// only told if not given. For machines that have nothing else to do.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) within_s: Option<f64>,
    /// Leave out the recorded scan, which takes longer than all others together.
    #[arg(long)]
    pub(crate) no_recorded: bool,
    /// Leave out the reader in Rust, which takes minutes to build
    #[arg(long)]
    pub(crate) no_cadmpeg: bool,
    /// Also judge recognised machining features: scans of the published part, random and odd ones.
    #[arg(long)]
    pub(crate) features: bool,
    /// Where the scans go; `target/judges/scenes` if not given.
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
}

/// Files of a part made by hand that the writer's own tests hold to the letter: the other
/// schema and unit, and a name with every kind of character.
const STEP_SAMPLES: [&str; 2] = ["sample_ap242.step", "sample_ap214_inch.step"];

/// Shapes that files know by their numbers or their profiles, from either side; no simulated object has them all.
const SHAPES: [&str; 17] = [
    "cylinder",
    "hollow-cylinder",
    "cone",
    "hollow-cone",
    "sphere",
    "hollow-sphere",
    "torus",
    "hollow-torus",
    "standing-torus",
    "ring-cone",
    "hollow-ring-cone",
    "ring-torus",
    "hollow-ring-torus",
    "extrusion",
    "revolution",
    "hollow-revolution",
    "ring-revolution",
];

/// The program that writes them.
const SAMPLES: &str = "write_sample";

/// The IGES entities that know their neighbours without sewing.
const SHELLS: &str = "186";

/// One judged scan.
struct Case {
    name: String,
    arguments: Vec<String>,
    faces: Option<u32>,
    /// Creases, each of which must be an edge of two faces in the STEP file.
    creases: u32,
    /// They must be so in the IGES file, too.
    is_shell: bool,
}

/// Installs and builds what judges in the first tier.
pub(crate) fn prepare() -> Result<()> {
    let place = shell::root().join("target/judges");
    python(&place, &[])?;
    shell::run("cargo", &["build", "--release", "--example", SAMPLES])
}

/// Scans every object through the pseudo-terminal and the service, and has the IGES and the
/// STEP file of each judged. All are judged before the first failure is reported.
pub(crate) fn run(options: &Options) -> Result<()> {
    let place = shell::root().join("target/judges");
    let python = python(&place, gmsh(options.gmsh))?;
    let scenes = options.out.clone().unwrap_or_else(|| place.join("scenes"));
    study::build()?;
    let judges = Judges {
        python,
        cadmpeg: (!options.no_cadmpeg).then(|| cadmpeg(&place)).transpose()?,
        freecad: options.freecad,
        gmsh: options.gmsh,
        within_s: options.within_s.map(|seconds| seconds.to_string()),
    };
    let mut failed = Vec::new();
    for name in STEP_SAMPLES {
        let file = format!("geometry/cad-exchange/tests/golden/{name}");
        let words = ["--expect-faces", "2", "--min-shared-edges", "1"];
        if let Err(error) = judges.step(&file, &words) {
            failed.push(format!("{name}: {error}"));
        }
    }
    failed.extend(judges.shapes(&scenes)?);
    for case in cases(options.seeds, options.no_recorded) {
        let folder = scenes.join(&case.name);
        if folder.exists() {
            std::fs::remove_dir_all(&folder)
                .with_context(|| format!("cannot empty {}", folder.display()))?;
        }
        println!("\n{}", case.name);
        if let Err(error) = judges.judge(&case, &folder) {
            failed.push(format!("{}: {error}", case.name));
        }
    }
    if options.features {
        let short = ["--short", "--check"].map(Into::into);
        if let Err(error) = study::features(&short) {
            failed.push(format!("machining features: {error}"));
        }
    }
    if failed.is_empty() {
        println!("\njudges: every file holds");
        return Ok(());
    }
    bail!(
        "{} files do not hold:\n  {}",
        failed.len(),
        failed.join("\n  ")
    );
}

fn cases(seeds: u32, no_recorded: bool) -> Vec<Case> {
    let mut cases = Vec::new();
    for object in OBJECTS {
        for seed in FIRST_SEED..FIRST_SEED + seeds {
            // Round faces in shells are judged as rectangles.
            let shells = (object == "house").then_some(SHELLS);
            for entities in ["114", "128", "190"].into_iter().chain(shells) {
                let words = ["--object", object, "--entities", entities, "--seed"];
                cases.push(Case {
                    name: format!("{object}-{entities}-{seed}"),
                    arguments: words
                        .map(String::from)
                        .into_iter()
                        .chain([seed.to_string()])
                        .collect(),
                    faces: Some(if object == "house" { 4 } else { 2 }),
                    creases: if object == "house" { 5 } else { 1 },
                    is_shell: entities == SHELLS,
                });
            }
        }
    }
    let bunny = shell::root().join("../shared/data/stanford_bunny/bun000.ply.gz");
    if no_recorded {
        println!("left out: the recorded scan");
    } else if bunny.exists() {
        cases.push(Case {
            name: "bun000".into(),
            arguments: vec!["--replay".into(), bunny.display().to_string()],
            faces: None,
            creases: 1,
            is_shell: false,
        });
    } else {
        println!("skipped: no recorded scans beside the repository");
    }
    cases
}

/// The programs that judge.
struct Judges {
    python: String,
    cadmpeg: Option<String>,
    freecad: bool,
    gmsh: bool,
    within_s: Option<String>,
}

impl Judges {
    fn judge(&self, case: &Case, folder: &Path) -> Result<()> {
        let out = folder.display().to_string();
        let scan_scene = shell::target()
            .join("release/scan-scene")
            .display()
            .to_string();
        let mut words: Vec<&str> = case.arguments.iter().map(String::as_str).collect();
        words.extend(["--out", &out]);
        if let Some(seconds) = &self.within_s {
            words.extend(["--within-s", seconds]);
        }
        let mut scanned = shell::run(&scan_scene, &words);
        for _ in 1..ATTEMPTS {
            if scanned.is_err() && self.within_s.is_some() {
                println!("once more");
                scanned = shell::run(&scan_scene, &words);
            }
        }
        scanned?;
        let file = file_in(folder, "igs")?;
        if case.faces.is_some() {
            let truth = folder.join("truth.json").display().to_string();
            let check = "tests/judges/scene_check.py";
            shell::run(&self.python, &[check, &file, &truth])?;
        } else {
            let check = "tests/judges/occ_check.py";
            shell::quiet(&self.python, &[check, "--no-points", &file])?;
        }
        let creases = case.creases.to_string();
        if case.is_shell {
            let check = "tests/judges/occ_check.py";
            let words = [check, "--no-points", "--min-shared-edges", &creases, &file];
            shell::quiet(&self.python, &words)?;
        }
        let step = file_in(folder, "step")?;
        self.step(&step, &["--iges", &file, "--min-shared-edges", &creases])?;
        let faces = case.faces.map(|n| n.to_string());
        if self.gmsh {
            let mut words = vec!["tests/judges/gmsh_check.py", &file, &step];
            let expected = faces.as_deref().map(|n| ["--expect-faces", n]);
            words.extend(expected.iter().flatten());
            shell::quiet(&self.python, &words)?;
        }
        let mut words = vec![file.as_str()];
        words.extend(faces.as_deref());
        self.read(&words)?;
        if self.freecad {
            let mut with = vec![("IGES_FILE", file.clone())];
            with.extend(faces.map(|n| ("EXPECT_FACES", n)));
            shell::run_with("freecadcmd", &["tests/judges/freecad_check.py"], &with)?;
        }
        Ok(())
    }

    /// A rectangle of each shape, as many at a time as there are processors; gives what failed.
    fn shapes(&self, scenes: &Path) -> Result<Vec<String>> {
        std::fs::create_dir_all(scenes)
            .with_context(|| format!("cannot make {}", scenes.display()))?;
        shell::run("cargo", &["build", "--release", "--example", SAMPLES])?;
        let next = AtomicUsize::new(0);
        let failed = Mutex::new(Vec::new());
        let work = || {
            while let Some(name) = SHAPES.get(next.fetch_add(1, Ordering::Relaxed)) {
                let judged = self.shape(name, scenes);
                println!(
                    "{name}: {}",
                    if judged.is_ok() { "sound" } else { "FAILED" }
                );
                let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
                failed.extend(judged.err().map(|error| format!("{name}: {error}")));
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
                scope.spawn(work);
            }
        });
        Ok(failed.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// A rectangle of a shape by its numbers, in IGES and in STEP.
    fn shape(&self, name: &str, scenes: &Path) -> Result<()> {
        let file = |ending: &str| {
            scenes
                .join(format!("{name}.{ending}"))
                .display()
                .to_string()
        };
        let shells = scenes
            .join(format!("{name}-shell.igs"))
            .display()
            .to_string();
        let files = [
            (file("igs"), "190"),
            (shells, SHELLS),
            (file("step"), "ap242"),
        ];
        let program = shell::target().join("release/examples").join(SAMPLES);
        let program = program.display().to_string();
        for (file, kind) in &files {
            shell::quiet(&program, &[file, kind, name])?;
        }
        let [(iges, _), (shells, _), (step, _)] = &files;
        let check = "tests/judges/occ_check.py";
        for iges in [iges, shells] {
            let words = [check, "--no-points", "--expect-faces", "1", iges];
            shell::quiet(&self.python, &words)?;
            self.step(step, &["--iges", iges, "--expect-faces", "1"])?;
            self.read(&[iges, "1"])?;
        }
        Ok(())
    }

    /// Has the independent reader read a file, if there is one.
    fn read(&self, words: &[&str]) -> Result<()> {
        let reader = self.cadmpeg.as_deref();
        reader.map_or(Ok(()), |reader| shell::quiet(reader, words))
    }

    fn step(&self, file: &str, words: &[&str]) -> Result<()> {
        let check = ["tests/judges/step_check.py", file];
        shell::quiet(&self.python, &[&check, words].concat())
    }
}

/// The one file of a folder with this ending.
fn file_in(folder: &Path, ending: &str) -> Result<String> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("no {}", folder.display()))?;
    let files: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == ending))
        .collect();
    match &files[..] {
        [file] => Ok(file.display().to_string()),
        _ => bail!(
            "{} files .{ending} in {} instead of one",
            files.len(),
            folder.display()
        ),
    }
}

/// An independent reader in Rust, in a workspace of its own.
fn cadmpeg(place: &Path) -> Result<String> {
    let home = place.join("cadmpeg");
    let manifest = "tests/judges/cadmpeg/Cargo.toml";
    let target = home.display().to_string();
    let mut words = vec![
        "build",
        "--release",
        "--locked",
        "--manifest-path",
        manifest,
    ];
    words.extend(["--target-dir", &target]);
    shell::run("cargo", &words)?;
    Ok(home.join("release/judge-cadmpeg").display().to_string())
}

/// Gmsh, if asked for, among the packages of [`python`].
pub(crate) fn gmsh(is_wanted: bool) -> &'static [&'static str] {
    if is_wanted { &[GMSH] } else { &[] }
}

/// A Python with the judge's packages, and more if asked for, made once.
pub(crate) fn python(place: &Path, more: &[&str]) -> Result<String> {
    let mut packages = PACKAGES.to_vec();
    packages.extend(more);
    let home = place.join("python");
    let python = home.join("bin/python").display().to_string();
    let ready = home.join("ready");
    // What more an earlier run asked for does no harm.
    let had = std::fs::read_to_string(&ready).unwrap_or_default();
    packages.retain(|package| !had.lines().any(|line| line == *package));
    if packages.is_empty() {
        return Ok(python);
    }
    if had.is_empty() {
        shell::run("python3", &["-m", "venv", &home.display().to_string()])?;
    }
    install(&python, &packages)?;
    let now: Vec<&str> = had.lines().chain(packages.iter().copied()).collect();
    std::fs::write(&ready, now.join("\n"))
        .with_context(|| format!("cannot write {}", ready.display()))?;
    Ok(python)
}

/// A Python of a judge of its own, made once: each pins what it needs, apart from the others.
pub(crate) fn environment(place: &Path, packages: &[&str]) -> Result<String> {
    let home = place.join("python");
    let python = home.join("bin/python").display().to_string();
    let ready = home.join("ready");
    let wanted = packages.join("\n");
    if std::fs::read_to_string(&ready).is_ok_and(|had| had == wanted) {
        return Ok(python);
    }
    shell::run("python3", &["-m", "venv", &home.display().to_string()])?;
    install(&python, packages)?;
    std::fs::write(&ready, wanted).with_context(|| format!("cannot write {}", ready.display()))?;
    Ok(python)
}

fn install(python: &str, packages: &[&str]) -> Result<()> {
    let pip = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ];
    shell::run(python, &[&pip[..], packages].concat())
}
