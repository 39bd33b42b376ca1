//! `relief manual`: the pages and completions that a package installs.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use clap::{Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

use crate::cli::Invocation;
use crate::failure::Failure;
use crate::output;

/// Write the manual pages and shell completions of relief and reliefd into a folder
#[derive(Debug, clap::Args)]
#[command(hide = true)]
pub(crate) struct Args {
    /// The folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// The configuration with every key explained, which is its own best manual.
const CONFIGURATION: &str = include_str!("../../../../config/serial.toml");

const SHELLS: [Shell; 3] = [Shell::Bash, Shell::Zsh, Shell::Fish];

pub(crate) fn run(args: &Args, json: bool) -> Result<(), Failure> {
    write(&args.folder).map_err(|error| {
        Failure::at(format!("cannot write to {}", args.folder.display()), &error)
    })?;
    let folder = args.folder.display().to_string();
    output::either(json, &folder, Clone::clone)
}

fn write(folder: &Path) -> io::Result<()> {
    let (pages, completions) = (folder.join("man"), folder.join("completions"));
    fs::create_dir_all(&pages)?;
    fs::create_dir_all(&completions)?;
    clap_mangen::generate_to(Invocation::command(), &pages)?;
    service(&mut File::create(pages.join("reliefd.8"))?)?;
    configuration(&mut File::create(pages.join("reliefd.toml.5"))?)?;
    for shell in SHELLS {
        for mut command in [Invocation::command(), reliefd::Arguments::command()] {
            let name = command.get_name().to_owned();
            clap_complete::generate_to(shell, &mut command, name, &completions)?;
        }
    }
    Ok(())
}

fn service(out: &mut File) -> io::Result<()> {
    let command: Command = reliefd::Arguments::command();
    let man = Man::new(command).section("8").manual("Relief");
    man.render_title(out)?;
    man.render_name_section(out)?;
    man.render_synopsis_section(out)?;
    man.render_description_section(out)?;
    man.render_options_section(out)?;
    section(
        out,
        "EXIT STATUS",
        &[
            ("0", "The service was asked to end, and has."),
            (
                "1",
                "It could not start; what is wrong is told on standard error.",
            ),
            ("2", "The command line is wrong."),
            ("78", "The configuration is wrong."),
        ],
    )?;
    section(
        out,
        "FILES",
        &[
            ("/etc/relief/reliefd.toml", "The configuration."),
            (
                "/run/relief/reliefd.sock",
                "The socket of the HTTP API, for the group relief.",
            ),
            (
                "/var/lib/relief",
                "Kept scans, and the list of scans and jobs.",
            ),
            ("/var/spool/relief", "The results, a folder each."),
        ],
    )?;
    section(
        out,
        "ENVIRONMENT",
        &[
            (
                "LISTEN_FDS, LISTEN_PID",
                "Sockets handed over by systemd, on which the API is offered: one Unix socket, \
                 and one loopback address.",
            ),
            (
                "NOTIFY_SOCKET, WATCHDOG_USEC",
                "Where systemd is told how the service does, and in which time.",
            ),
            (
                "JOURNAL_STREAM",
                "Set by systemd where standard error leads to its journal.",
            ),
        ],
    )?;
    see_also(
        out,
        "relief(1), reliefd.toml(5), systemctl(1), journalctl(1)",
    )?;
    man.render_version_section(out)
}

fn configuration(out: &mut File) -> io::Result<()> {
    let mut page = Roff::new();
    page.control("TH", ["reliefd.toml", "5", "", "", "Relief"]);
    page.control("SH", ["NAME"]);
    page.text([roman("reliefd.toml - configuration of the Relief service")]);
    page.control("SH", ["DESCRIPTION"]);
    page.text([roman(
        "A TOML file. A key that does not exist, or a value that cannot be, is refused with its \
         line. The example below shows every key; those that are commented out show their default.",
    )]);
    page.control("SH", ["EXAMPLE"]);
    page.control("nf", []);
    for line in CONFIGURATION.lines() {
        page.text([roman(line)]);
    }
    page.control("fi", []);
    page.to_writer(out)?;
    see_also(out, "reliefd(8)")
}

/// A section of a manual page: terms, and what they mean.
fn section(out: &mut File, title: &str, terms: &[(&str, &str)]) -> io::Result<()> {
    let mut page = Roff::new();
    page.control("SH", [title]);
    for (term, meaning) in terms {
        page.control("TP", []);
        page.text([roman(*term)]);
        page.text([roman(*meaning)]);
    }
    page.to_writer(out)
}

fn see_also(out: &mut File, pages: &str) -> io::Result<()> {
    let mut page = Roff::new();
    page.control("SH", ["SEE ALSO"]);
    page.text([roman(pages)]);
    page.to_writer(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_its_page_and_every_shell_its_completions() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path()).unwrap();
        let page = |name: &str| fs::read_to_string(folder.path().join("man").join(name)).unwrap();
        for command in Invocation::command().get_subcommands() {
            let file = format!("man/relief-{}.1", command.get_name());
            let there = folder.path().join(&file).exists();
            assert_eq!(there, !command.is_hide_set(), "{file}");
        }
        assert!(page("relief.1").contains("relief\\-scan"));
        for words in [
            "/etc/relief/reliefd.toml",
            "SIGHUP",
            "\\-\\-check\\-config",
            "EXIT STATUS",
        ] {
            assert!(page("reliefd.8").contains(words), "{words}");
        }
        assert!(page("reliefd.toml.5").contains("column_timeout_ms"));
        for name in [
            "relief.bash",
            "reliefd.bash",
            "_relief",
            "_reliefd",
            "relief.fish",
            "reliefd.fish",
        ] {
            let text = fs::read_to_string(folder.path().join("completions").join(name)).unwrap();
            assert!(text.contains("config"), "{name}");
        }
    }
}
