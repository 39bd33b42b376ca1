//! The command line of the program `reliefd`.

use std::path::PathBuf;

use clap::Parser;

/// The Relief service: takes scans from a slide-table scanner and leaves CAD files in a
/// spool folder.
///
/// SIGHUP reads the configuration again and takes over what may change in service.
/// SIGTERM and SIGINT end the service in good order.
#[derive(Debug, Parser)]
#[command(name = "reliefd", version)]
pub struct Arguments {
    /// The configuration (TOML)
    #[arg(long, value_name = "FILE", default_value = "/etc/relief/reliefd.toml")]
    pub config: PathBuf,
    /// Only look whether the configuration is sound
    #[arg(long)]
    pub check_config: bool,
}
