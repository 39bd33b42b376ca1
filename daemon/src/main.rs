//! The service as a program: command line, signals, log, systemd.

use std::process::ExitCode;

use clap::Parser;
use reliefd::logging::{self, LogHandle};
use reliefd::systemd::{self, Inherited};
use reliefd::{Arguments, Config, Daemon, HOOK_CHILD, become_hook};
use tokio::signal::unix::{Signal, SignalKind, signal};

/// "Configuration error" in sysexits.h: trying again does not help, and systemd is told so.
const EX_CONFIG: u8 = 78;

fn main() -> ExitCode {
    let mut words = std::env::args_os().skip(1);
    if words.next().is_some_and(|word| word == HOOK_CHILD) {
        return become_hook(words);
    }
    let arguments = Arguments::parse();
    let config = match Config::load_with_files(&arguments.config) {
        Ok(config) => config,
        Err(error) => {
            eprintln!("reliefd: {error}");
            return ExitCode::from(EX_CONFIG);
        }
    };
    if arguments.check_config {
        println!("{}: sound", arguments.config.display());
        for scanner in config.each_scanner() {
            if !scanner.is_the_only {
                println!("scanner {}: {}", scanner.name, scanner.config.place());
            }
        }
        return ExitCode::SUCCESS;
    }
    match run(&arguments, config) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("reliefd: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments, config: Config) -> Result<(), Box<dyn std::error::Error>> {
    // Before there is another thread: it changes the environment.
    let inherited = Inherited::take()?;
    let log = logging::init(&config.log)?;
    tokio::runtime::Builder::new_multi_thread()
        // The API needs little; the processors are for the jobs.
        .worker_threads(2)
        .enable_all()
        .build()?
        .block_on(serve(arguments, config, inherited, &log))
}

async fn serve(
    arguments: &Arguments,
    config: Config,
    inherited: Inherited,
    log: &LogHandle,
) -> Result<(), Box<dyn std::error::Error>> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut hangup = signal(SignalKind::hangup())?;
    let daemon = Daemon::start_activated(config, inherited).await?;
    systemd::ready();
    // A task, so that it depends on the threads that serve the API.
    tokio::spawn(systemd::keep_alive(daemon.health()));
    loop {
        tokio::select! {
            () = received(&mut terminate) => break,
            () = received(&mut interrupt) => break,
            () = received(&mut hangup) => {
                systemd::reloading();
                reload(&daemon, arguments, log);
                systemd::ready();
            }
        }
    }
    systemd::stopping();
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
    let config = match Config::load_with_files(&arguments.config) {
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
