//! Judges the segmentation by scenes drawn from seeds, whose true faces are known.
//!
//! ```sh
//! cargo xtask study segmentation --set tune --only polyhedral
//! cargo xtask study segmentation --scene 17 --only abw --pictures pictures
//! ```

mod agree;
mod material;
mod methods;
mod peers;
mod pictures;
mod report;
mod tally;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use clap::{Parser, ValueEnum};
use rayon::prelude::*;
use relief_tests::scenes::{Purpose, Set, View};

use crate::material::Store;
use crate::methods::Method;
use crate::peers::Peer;
use crate::report::Bar;
use crate::tally::{Finding, Tally};

/// Score the segmentation on scenes whose true faces are known
#[derive(Debug, Parser)]
#[command(name = "study-segmentation", version)]
struct Options {
    /// Scenes to look at while tuning, those for figures only, or those for the last word
    #[arg(long = "set", value_enum, default_value = "tune")]
    purpose: PurposeName,
    /// The first few scenes of each set only
    #[arg(long)]
    short: bool,
    /// One set only
    #[arg(long, value_enum)]
    only: Option<SetName>,
    /// One scene only, by its seed
    #[arg(long, value_name = "SEED")]
    scene: Option<u64>,
    /// So many scenes of each set, on from the first: rare failures show in many only
    #[arg(long, value_name = "SCENES", value_parser = clap::value_parser!(u64).range(1..=1000))]
    #[arg(conflicts_with_all = ["short", "scene", "write", "check"])]
    count: Option<u64>,
    /// How the scenes are scanned
    #[arg(long, value_enum, default_value = "plain")]
    view: ViewName,
    /// Write truth and labels side by side as PNG files into this folder
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Every way to scan, not one
    #[arg(long, conflicts_with = "view")]
    full: bool,
    /// Run Open3D and CGAL on the same range images; installs what is not there
    #[arg(long)]
    peers: bool,
    /// Other parameters for Open3D, to choose them on the scenes for tuning
    #[arg(long, value_name = "WORDS", requires = "peers")]
    open3d: Option<String>,
    /// Other parameters for CGAL
    #[arg(long, value_name = "WORDS", requires = "peers")]
    cgal: Option<String>,
    /// Write the tables to docs/studies/segmentation.md, or those of scenes that confirm beside it
    #[arg(long)]
    write: bool,
    /// Fail unless every bar holds
    #[arg(long)]
    check: bool,
    /// Fail unless this share of the regions of each set is correct, whatever the bars
    #[arg(long, value_name = "PERCENT")]
    at_least: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PurposeName {
    Tune,
    Judge,
    Confirm,
}

impl PurposeName {
    /// Where its figures are written, and what stands above them.
    fn page(self) -> Result<(&'static str, &'static str)> {
        match self {
            Self::Tune => bail!("scenes for tuning have no page: add `--set judge`"),
            Self::Judge => Ok(("segmentation.md", include_str!("preface.md"))),
            Self::Confirm => Ok((
                "segmentation-confirmed.md",
                include_str!("preface-confirmed.md"),
            )),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SetName {
    Polyhedral,
    Curved,
    Abw,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ViewName {
    Plain,
    Outliers,
    Mirrored,
    HalfPitch,
    OtherSeed,
    Alone,
    Cluttered,
}

impl Options {
    fn sets(&self) -> Vec<Set> {
        let only = self.only.map(|set| match set {
            SetName::Polyhedral => Set::Polyhedral,
            SetName::Curved => Set::Curved,
            SetName::Abw => Set::Abw,
        });
        Set::ALL
            .into_iter()
            .filter(|set| only.is_none_or(|o| o == *set))
            .collect()
    }

    fn seeds(&self, set: Set) -> Vec<u64> {
        // One of the ABW kind takes as long as several others, and has as many regions.
        let few = if set == Set::Abw { 2 } else { 4 };
        let purpose = match self.purpose {
            PurposeName::Tune => Purpose::Tune,
            PurposeName::Judge => Purpose::Judge,
            PurposeName::Confirm => Purpose::Confirm,
        };
        if let (Some(count), Some(first)) = (self.count, set.seeds(purpose).next()) {
            return (first..first + count).collect();
        }
        let seeds = set.seeds(purpose);
        match self.scene {
            Some(seed) => vec![seed],
            None if self.short => seeds.take(few).collect(),
            None => seeds.collect(),
        }
    }

    fn parameters<'a>(&'a self, peer: &Peer, set: Set) -> &'a str {
        let other = match peer.method {
            Method::Open3d => &self.open3d,
            _ => &self.cgal,
        };
        other.as_deref().unwrap_or_else(|| peer.parameters(set))
    }

    fn view(&self) -> View {
        match self.view {
            ViewName::Plain => View::Plain,
            ViewName::Outliers => View::Outliers,
            ViewName::Mirrored => View::Mirrored,
            ViewName::HalfPitch => View::HalfPitch,
            ViewName::OtherSeed => View::OtherSeed,
            ViewName::Alone => View::Alone,
            ViewName::Cluttered => View::Cluttered,
        }
    }
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("study-segmentation: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Scenes of the ABW kind that are scanned at half the pitch: each has a million nodes.
const ABW_HALF_PITCH: usize = 10;
/// Scenes that a peer is given at once.
const BATCH: usize = 5;

/// Prints as it goes, and keeps what it printed.
#[derive(Debug, Default)]
struct Account(String);

impl Account {
    fn say(&mut self, text: &str) {
        print!("{text}");
        self.0.push_str(text);
    }
}

/// Whether everything that was checked holds.
fn run(options: &Options) -> Result<bool> {
    let page = options.write.then(|| options.purpose.page()).transpose()?;
    let store = Store::open()?;
    let mut account = Account::default();
    if let Some(folder) = &options.pictures {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let (peers, missing) = if options.peers {
        peers::ready()
    } else {
        Default::default()
    };
    for peer in &peers {
        let (name, version) = (peer.method.name(), &peer.version);
        account.say(&format!("\n{name} {version}: {}", peer.meaning()));
        for set in options.sets() {
            let parameters = options.parameters(peer, set);
            account.say(&format!("; {} {parameters}", set.name()));
        }
        account.say(".\n");
    }
    for line in missing {
        account.say(&format!("\n{line}\n"));
    }
    let mut bars = Vec::new();
    for set in options.sets() {
        let seeds = options.seeds(set);
        let view = options.view();
        bars.extend(one_view(options, &store, set, view, &peers, &mut account)?);
        if view == View::Cluttered && set != Set::Abw {
            clutter(&store, set, &seeds, &mut bars)?;
        }
        if !options.full {
            continue;
        }
        bars.extend(one_view(
            options,
            &store,
            set,
            View::Outliers,
            &[],
            &mut account,
        )?);
        for view in [View::Mirrored, View::HalfPitch, View::OtherSeed] {
            let seeds = match (set, view) {
                (Set::Abw, View::HalfPitch) => &seeds[..ABW_HALF_PITCH.min(seeds.len())],
                _ => &seeds[..],
            };
            let agreed = agree::views(&store, set, seeds, view)?;
            told(&mut bars, report::agreement(set, &agreed));
        }
        if set != Set::Abw {
            clutter(&store, set, &seeds, &mut bars)?;
        }
    }
    account.say(&report::verdicts(&bars));
    if let Some((name, preface)) = page {
        let file = material::root().join("docs/studies").join(name);
        let text = format!("{preface}{}", account.0);
        std::fs::create_dir_all(file.parent().context("no folder")?)?;
        std::fs::write(&file, text).with_context(|| format!("cannot write {}", file.display()))?;
    }
    Ok(!options.check || bars.iter().all(|bar| bar.holds))
}

/// Whether a table and a plane behind change the faces.
fn clutter(store: &Store, set: Set, seeds: &[u64], bars: &mut Vec<Bar>) -> Result<()> {
    let found = agree::clutter(store, set, seeds)?;
    print!("{}", report::failures(&found.failed));
    told(bars, report::clutter(set, &found));
    Ok(())
}

/// Keeps a bar, and tells of it at once: the others take minutes.
fn told(bars: &mut Vec<Bar>, bar: Bar) {
    eprintln!("{} {}", bar.set.name(), bar.what);
    bars.push(bar);
}

/// Scores every method on the scenes of a set, scanned in one way.
fn one_view(
    options: &Options,
    store: &Store,
    set: Set,
    view: View,
    peers: &[Peer],
    account: &mut Account,
) -> Result<Vec<Bar>> {
    let findings: Vec<Vec<Finding>> = options
        .seeds(set)
        .par_chunks(if peers.is_empty() { 1 } else { BATCH })
        .map(|seeds| batch(options, store, set, view, seeds, peers))
        .collect::<Result<_>>()?;
    let findings: Vec<Finding> = findings.into_iter().flatten().collect();
    let methods = Method::OURS
        .into_iter()
        .chain(peers.iter().map(|p| p.method));
    let tallies: Vec<Tally> = methods
        .map(|method| Tally::of(method, findings.iter()))
        .collect();
    account.say(&report::table(set, view, &tallies));
    if let (Some(least), Some(relief)) = (options.at_least, tallies.first()) {
        let share = relief.bar().correct_share() * 100.0;
        ensure!(
            share >= least,
            "{}: {share:.2} % of regions are correct at 80 %, less than {least} %",
            set.name()
        );
    }
    // Not for the page: there are many, and another run shows them.
    print!("{}", report::failures(&findings));
    Ok(report::bars(set, view, &tallies))
}

fn batch(
    options: &Options,
    store: &Store,
    set: Set,
    view: View,
    seeds: &[u64],
    peers: &[Peer],
) -> Result<Vec<Finding>> {
    let mut scenes = Vec::new();
    for seed in seeds {
        let (subject, images) = store.get(set, *seed, &[view])?;
        let image = images.into_iter().next().context("no range image")?;
        let labels = methods::all(&subject, &image, view)?;
        scenes.push((subject, image, labels));
    }
    for peer in peers {
        let parameters = options.parameters(peer, set);
        let given: Vec<_> = scenes.iter().map(|(s, i, _)| (s, i)).collect();
        let labelled = peer.label(parameters, &given)?;
        for (scene, labelled) in scenes.iter_mut().zip(labelled) {
            scene.2.push(labelled);
        }
    }
    let mut findings = Vec::new();
    for (subject, image, labels) in &scenes {
        if let Some(folder) = &options.pictures {
            pictures::write(folder, subject, image, view, labels)?;
        }
        let judged = labels.iter();
        findings.extend(judged.map(|labelled| tally::judge(subject, image, view, labelled)));
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Options::command().debug_assert();
    }
}
