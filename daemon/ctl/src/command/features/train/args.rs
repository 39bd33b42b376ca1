//! What the user may say, and what follows from it.

use std::path::{Path, PathBuf};

use features::network::{Rates, Recipe, Teaching};

use crate::failure::Failure;

/// Teach a network that tells features, with classes of your own if you give patterns of them
///
/// Sections of each class are drawn with other sizes, edges, slopes, noise, gaps and tilts each time
/// and put in codes; the network is taught these by back-propagation, and judged by others. The same
/// seed and patterns make the same file. `relief features SCAN --network NETWORK.toml` then uses it.
///
/// A file of patterns has a table `[[pattern]]` for each: `class` (a name; a new one is a new class),
/// `sense` ("concave" or "convex"), `form` of the outline ("circular", "closed" or "open"), and either
/// `code`, digits from 1 (straight up) over 3 (level) to 5 (straight down), such as
/// [4, 5, 4, 3, 2, 1, 2] for a pocket, or `section`, its corners as [[s, z], ...] in millimetres from
/// one side to the other, with `pitch_mm` (0.5) and `noise_mm` (0.05) of a scan of it, and `ends`
/// (["rim", "rim"]; "open" where it runs out).
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Patterns of more classes, or of known ones; may be given several times
    #[arg(long, value_name = "FILE.toml")]
    pub(super) patterns: Vec<PathBuf>,
    /// Where the network goes
    #[arg(
        short,
        long,
        value_name = "NETWORK.toml",
        default_value = "network.toml"
    )]
    pub(super) output: PathBuf,
    /// Seed of every random draw; default: that of the built-in network
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Digits of a code that the network looks at; shorter codes are filled up, longer ones thinned
    #[arg(long, value_name = "N", default_value_t = Recipe::SHIPPED.digits)]
    digits: usize,
    /// Neurons of the hidden layer
    #[arg(long, value_name = "N", default_value_t = Recipe::SHIPPED.hidden)]
    hidden: usize,
    /// Sections that are drawn of each class
    #[arg(long, value_name = "N", default_value_t = PER_CLASS)]
    per_class: usize,
    /// Most epochs; in each, every pattern is shown once. Ends sooner once the error of one is below
    /// 0.0001
    #[arg(long, value_name = "N", default_value_t = Recipe::SHIPPED.rates.epochs)]
    epochs: usize,
    /// Make the network of Jun & Park instead: 9-15-6, taught the six rows of their Table 2, which
    /// answers whatever it is asked
    #[arg(
        long,
        conflicts_with_all = ["patterns", "digits", "hidden", "per_class", "epochs"]
    )]
    published: bool,
}

const PER_CLASS: usize = match Recipe::SHIPPED.teaching {
    Teaching::Drawn(count) => count,
    Teaching::Table2 => 0,
};

impl Args {
    pub(super) fn recipe(&self) -> Recipe {
        let base = if self.published {
            Recipe::PUBLISHED
        } else {
            Recipe {
                digits: self.digits,
                hidden: self.hidden,
                teaching: Teaching::Drawn(self.per_class),
                rates: Rates {
                    epochs: self.epochs,
                    ..Recipe::SHIPPED.rates
                },
                ..Recipe::SHIPPED
            }
        };
        Recipe {
            seed: self.seed.unwrap_or(base.seed),
            ..base
        }
    }

    /// Where the network goes, which is none of the files that are read.
    pub(super) fn output(&self) -> Result<&Path, Failure> {
        // A seed in a file is a TOML integer.
        if let Some(seed) = self.seed.filter(|&own| i64::try_from(own).is_err()) {
            let message = format!("--seed {seed}: must be at most {}", i64::MAX);
            return Err(Failure::Usage(message));
        }
        if self.output.extension().is_none_or(|own| own != "toml") {
            return Err(Failure::Usage(format!(
                "{}: a network is written as TOML; name a file with the ending .toml",
                self.output.display()
            )));
        }
        crate::command::places::check_file(&self.output)?;
        for path in &self.patterns {
            if crate::command::convert::same_file(&self.output, path) {
                return Err(Failure::Usage(format!(
                    "{} is read, and cannot be written as well; choose another name with -o",
                    path.display()
                )));
            }
        }
        Ok(&self.output)
    }
}
