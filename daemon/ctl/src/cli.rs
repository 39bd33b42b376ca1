//! What the user may say.

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use crate::command::{
    abort, accept, calibrate, change, compare, config, convert, demo, discover, doctor, features,
    fetch, fill, fleet, hooks, jobs, laser, manual, pause, rerun, resume, scan, scans, skin,
    status, surface, token, toolpath, uploads, watch, webhooks, worker,
};

/// Turns scans of slide-table laser scanners into CAD models.
///
/// `relief demo` shows the whole road with a simulated scanner; `relief convert` takes an
/// existing scan file, `relief surface` makes one B-spline surface of it, and `relief compare` holds
/// it against its nominal; `relief features` recognises holes, pockets, slots and their like in it;
/// `relief skin` makes a surface of cross-sections, `relief fill` closes the holes of a mesh, and
/// `relief toolpath` mills a model; `relief calibrate` finds out how a mounted scanner deviates, and
/// `relief accept` how well it measures; `relief doctor` finds out why something does not work. The other
/// commands speak to the service, reliefd.
#[derive(Debug, Parser)]
#[command(name = "relief", version, max_term_width = 100)]
pub(crate) struct Invocation {
    /// Print one JSON document on standard output
    #[arg(long, global = true)]
    pub(crate) json: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands, one small file each in `command/`.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(demo::Args),
    Convert(convert::Args),
    Calibrate(calibrate::Args),
    Accept(accept::Args),
    Compare(compare::Args),
    Features(features::Args),
    Fill(fill::Args),
    Skin(skin::Args),
    Surface(surface::Args),
    Toolpath(toolpath::Args),
    Scan(scan::Args),
    Abort(abort::Args),
    Pause(pause::Args),
    Resume(resume::Args),
    Status(status::Args),
    Scans(scans::Args),
    Jobs(jobs::Args),
    Retry(change::RetryArgs),
    Cancel(change::CancelArgs),
    Rerun(rerun::Args),
    Watch(watch::Args),
    Fetch(fetch::Args),
    Laser(laser::Args),
    Token(token::Args),
    Webhooks(webhooks::Args),
    Hooks(hooks::Args),
    Uploads(uploads::Args),
    Fleet(fleet::Args),
    Worker(worker::Args),
    Config(config::Args),
    Discover(discover::Args),
    Doctor(doctor::Args),
    Manual(manual::Args),
}

/// Reads the command line; on wrong usage says so in one line and gives exit code 2.
pub(crate) fn parse() -> Result<Invocation, ExitCode> {
    Invocation::try_parse().map_err(|error| match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // Nobody is left to be told when standard output is closed.
            let _ = error.print();
            ExitCode::SUCCESS
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            ExitCode::from(2)
        }
        _ => {
            eprintln!("relief: {}", one_line(&error.render().to_string()));
            ExitCode::from(2)
        }
    })
}

/// The message and its tips, without the usage that `--help` shows.
fn one_line(rendered: &str) -> String {
    let told = rendered
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty());
    let kept: Vec<&str> = told
        .take_while(|line| !line.starts_with("Usage:"))
        .filter(|line| !line.starts_with("For more information"))
        .collect();
    let message = kept.join("; ").replace(":; ", ": ");
    let message = message.strip_prefix("error: ").unwrap_or(&message);
    format!("{message} (see `relief --help`)")
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Invocation::command().debug_assert();
    }

    #[test]
    fn every_command_and_option_is_explained() {
        fn check(command: &clap::Command) {
            assert!(
                command.get_about().is_some(),
                "{} has no description",
                command.get_name()
            );
            for argument in command.get_arguments() {
                assert!(
                    argument.get_help().is_some(),
                    "{} of {} has no description",
                    argument.get_id(),
                    command.get_name()
                );
            }
            command.get_subcommands().for_each(check);
        }
        check(&Invocation::command());
    }

    #[test]
    fn wrong_usage_is_told_in_one_line() {
        let error = Invocation::try_parse_from(["relief", "jobs", "--jsn"]).unwrap_err();
        let line = one_line(&error.render().to_string());
        assert!(!line.contains('\n'), "{line}");
        assert!(
            line.starts_with("unexpected argument '--jsn' found; tip:"),
            "{line}"
        );
    }
}
