//! What the user may say, and what follows from it.

use std::path::{Path, PathBuf};

use jiff::Timestamp;
use scan_files::Units;

use super::{reduced, train};
use crate::command::units::UnitName;

/// Recognise the machining features of a part in a scan, without a service
///
/// Pockets, slots, steps, holes and bosses on a block, as they are seen from above, nested in each
/// other, with their dimensions and what these are uncertain by. Reads any scan file that `convert`
/// reads. A neural network tells what a feature is by the code of its section (Jun & Park); what is
/// like nothing that it was taught is told as unknown.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(super) action: Option<Action>,
    /// The scan file
    #[arg(value_name = "SCAN", required = true)]
    scan: Option<PathBuf>,
    /// Where to write the features; default: the scan's name with the ending .features.json, in the
    /// current directory
    #[arg(short, long, value_name = "OUT.json")]
    output: Option<PathBuf>,
    /// Change types, dimensions and directions that you know better, by a file of tables
    /// `[[edit]]`: `id`, and any of `type`, `direction` ([x, y, z]) and dimensions in mm such as
    /// `diameter`; outlines, patterns and the solid follow
    #[arg(long, value_name = "EDITS.toml")]
    pub(super) edit: Option<PathBuf>,
    /// Rebuild the part from its features, as one closed solid, too
    #[arg(long, value_name = "OUT.step")]
    pub(super) step: Option<PathBuf>,
    /// Time to be written into the STEP file; default: SOURCE_DATE_EPOCH, or when the input was
    /// changed
    #[arg(long, value_name = "TIME")]
    pub(super) timestamp: Option<Timestamp>,
    /// Draw them over the part, too
    #[arg(long, value_name = "OUT.png")]
    pub(super) picture: Option<PathBuf>,
    /// Write the scan's points, too, as text, fewer of them (Jun & Park, section 4.2): of what is
    /// straight some go, then every n-th; edge points stay
    #[arg(long, value_name = "OUT.xyz")]
    pub(super) reduced: Option<PathBuf>,
    #[command(flatten)]
    pub(super) reduction: reduced::ReductionArgs,
    /// The network that tells the classes: `default`, `published` (the one of the paper, which
    /// always has an answer), or a file of `relief features train`
    #[arg(long, value_name = "NETWORK", default_value = "default")]
    pub(super) network: String,
    /// Let chance tell the classes, by a seed: what is left of the results without the network
    #[arg(long, value_name = "SEED", hide = true)]
    pub(super) classes_by_chance: Option<u64>,
    /// Leave out features of fewer sample distances across than this
    #[arg(long, value_name = "N", default_value_t = 6.0, value_parser = pitches)]
    pub(super) least_pitches: f64,
    /// Unit of the coordinates in a text or scan file; default: millimetres, or what the file says
    #[arg(long, value_name = "UNIT", value_enum)]
    units: Option<UnitName>,
    /// Seed of every random draw
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u64,
    /// Threads to use; 0 for all processors. The result does not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) threads: usize,
}

/// A least size of features, sample distances.
fn pitches(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (3.0..=1000.0).contains(&value) {
        Ok(value)
    } else {
        Err("3 to 1000 sample distances; of less than 3 nothing can be told".to_owned())
    }
}

#[derive(Debug, clap::Subcommand)]
pub(super) enum Action {
    Train(train::Args),
}

impl Args {
    /// The scan file; clap has seen to it that there is one.
    pub(super) fn scan(&self) -> &Path {
        self.scan.as_deref().unwrap_or(Path::new(""))
    }

    pub(super) fn units(&self) -> Option<Units> {
        self.units.map(UnitName::units)
    }

    /// Name of the part in pictures and files.
    pub(super) fn name(&self) -> String {
        let scan = self.scan();
        let stem = scan.file_stem().unwrap_or(scan.as_os_str());
        let stem = stem.to_string_lossy();
        stem.split('.').next().unwrap_or("part").to_owned()
    }

    pub(super) fn output(&self) -> PathBuf {
        self.output
            .clone()
            .unwrap_or_else(|| PathBuf::from(format!("{}.features.json", self.name())))
    }
}
