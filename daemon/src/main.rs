//! The service as a program: command line, signals, log, systemd.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use reliefd::logging::{self, LogHandle};
use reliefd::{Config, Daemon};
use sd_notify::NotifyState;
use tokio::signal::unix::{Signal, SignalKind, signal};

/// The Relief service: takes scans from a slide-table scanner and leaves CAD files in a
/// spool folder.
///
/// SIGHUP reads the configuration again and takes over what may change in service.
/// SIGTERM and SIGINT end the service in good order.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// The configuration (TOML)
    #[arg(long, value_name = "FILE", default_value = "/etc/relief/reliefd.toml")]
    config: PathBuf,
    /// Only look whether the configuration is sound
    #[arg(long)]
    check_config: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("reliefd: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let config = Config::load(&arguments.config)?;
    if arguments.check_config {
        println!("{}: sound", arguments.config.display());
        return Ok(());
    }
    let log = logging::init(&config.log)?;
    tokio::runtime::Builder::new_multi_thread()
        // The API needs little; the processors are for the jobs.
        .worker_threads(2)
        .enable_all()
        .build()?
        .block_on(serve(arguments, config, &log))
}

async fn serve(
    arguments: &Arguments,
    config: Config,
    log: &LogHandle,
) -> Result<(), Box<dyn std::error::Error>> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut hangup = signal(SignalKind::hangup())?;
    let daemon = Daemon::start(config).await?;
    tell_systemd(&[NotifyState::Ready]);
    loop {
        tokio::select! {
            () = received(&mut terminate) => break,
            () = received(&mut interrupt) => break,
            () = received(&mut hangup) => reload(&daemon, arguments, log),
        }
    }
    tell_systemd(&[NotifyState::Stopping]);
    daemon.shutdown().await;
    Ok(())
}

async fn received(signal: &mut Signal) {
    if signal.recv().await.is_none() {
        // No more signals can come; other ways to end the process remain.
        std::future::pending().await
    }
}

/// A configuration that is not sound changes nothing.
fn reload(daemon: &Daemon, arguments: &Arguments, log: &LogHandle) {
    let config = match Config::load(&arguments.config) {
        Ok(config) => config,
        Err(error) => {
            tracing::error!(%error, "the configuration stays as it was");
            return;
        }
    };
    let outcome = daemon.reload(&config);
    if let Err(error) = log.set_level(&config.log.level) {
        tracing::error!(%error, "the log level stays as it was");
    }
    tracing::info!(applied = ?outcome.applied, "configuration read again");
    if !outcome.needs_restart.is_empty() {
        tracing::warn!(
            sections = ?outcome.needs_restart,
            "these changes only hold after a restart of reliefd"
        );
    }
}

fn tell_systemd(states: &[NotifyState<'_>]) {
    // Without systemd there is nobody to tell, and that is no error.
    if let Err(error) = sd_notify::notify(states) {
        tracing::debug!(%error, "cannot tell systemd");
    }
}
