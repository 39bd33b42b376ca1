//! The program as a user runs it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use relief_api::{Status, path};

use super::{Client, GUARD};

/// How often a service is asked whether it has come so far.
const ASK: Duration = Duration::from_millis(5);

/// `reliefd` in a process of its own, killed when dropped.
#[derive(Debug)]
pub struct Program {
    child: Child,
    log: PathBuf,
    client: Client,
}

impl Program {
    /// Starts it on a folder, before a scanner at this port; it may not answer yet. `more` is
    /// the rest of its configuration, which begins in the section of the scanner.
    ///
    /// # Errors
    /// When the folder cannot be written, or the program not started.
    pub fn start(program: &Path, folder: &Path, port: &Path, more: &str) -> Result<Self> {
        Self::start_as(program, folder, port, "", more)
    }

    /// The same with more in the section of the service, too.
    ///
    /// # Errors
    /// As [`Program::start`].
    pub fn start_as(
        program: &Path,
        folder: &Path,
        port: &Path,
        service: &str,
        more: &str,
    ) -> Result<Self> {
        let socket = folder.join("reliefd.sock");
        let mut config = String::new();
        writeln!(config, "[service]\nsocket = {socket:?}")?;
        writeln!(config, "state_dir = {:?}", folder.join("state"))?;
        writeln!(config, "spool_dir = {:?}", folder.join("spool"))?;
        writeln!(config, "{service}")?;
        writeln!(config, "[scanner]\nport = {port:?}\n{more}")?;
        let file = folder.join("reliefd.toml");
        std::fs::write(&file, config)?;
        let log = folder.join("reliefd.log");
        let lines = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&log)?;
        let child = Command::new(program)
            .arg("--config")
            .arg(&file)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(lines)
            .spawn()
            .with_context(|| format!("cannot start {}: build it first", program.display()))?;
        Ok(Self {
            child,
            log,
            client: Client::new(&socket),
        })
    }

    /// Asks until something holds.
    async fn until(&mut self, holds: impl Fn(&Status) -> bool) -> Result<()> {
        let begun = Instant::now();
        loop {
            if let Ok(status) = self.client.get::<Status>(path::STATUS).await
                && holds(&status)
            {
                return Ok(());
            }
            if let Some(status) = self.child.try_wait()? {
                let log = std::fs::read_to_string(&self.log)?;
                bail!("the service ended by itself: {status}; its log:\n{log}");
            }
            ensure!(begun.elapsed() < GUARD, "the service does not come so far");
            tokio::time::sleep(ASK).await;
        }
    }

    /// A client of it.
    #[must_use]
    pub fn client(&self) -> &Client {
        &self.client
    }

    /// Its number among the processes.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits until it answers.
    ///
    /// # Errors
    /// When it ends, with its log, or does not answer for long.
    pub async fn ready(&mut self) -> Result<()> {
        self.until(|_| true).await
    }

    /// Waits until no scan is under way and no job waits or runs.
    ///
    /// # Errors
    /// As [`Program::ready`].
    pub async fn idle(&mut self) -> Result<()> {
        self.until(|status| status.scan.is_none() && status.jobs_queued + status.jobs_running == 0)
            .await
    }

    /// SIGKILL.
    ///
    /// # Errors
    /// When it had ended by itself.
    pub fn kill(mut self) -> Result<()> {
        self.child.kill()?;
        let status = self.child.wait()?;
        ensure!(!status.success(), "it ended by itself before: {status}");
        Ok(())
    }

    /// SIGTERM, and waits for its orderly end.
    ///
    /// # Errors
    /// When its end is not in good order.
    pub fn end(mut self) -> Result<()> {
        let id = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(id, rustix::process::Signal::TERM)?;
        let status = self.child.wait()?;
        ensure!(status.success(), "its end was not in good order: {status}");
        Ok(())
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
