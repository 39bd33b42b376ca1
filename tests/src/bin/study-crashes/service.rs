//! The program, and what it tells.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use relief_api::{Event, Scan, Status, path};
use relief_tests::rig::{Client, Events, GUARD};

/// How often a service is asked whether it has come so far.
const ASK: Duration = Duration::from_millis(5);

/// `reliefd` in a process of its own, killed when dropped.
pub(crate) struct Program {
    child: Child,
    log: PathBuf,
    pub(crate) client: Client,
}

impl Program {
    /// Starts it on a folder; it may not answer yet.
    pub(crate) fn start(program: &Path, folder: &Path, port: &Path) -> Result<Self> {
        let socket = folder.join("reliefd.sock");
        let mut config = String::new();
        writeln!(config, "[service]\nsocket = {socket:?}")?;
        writeln!(config, "state_dir = {:?}", folder.join("state"))?;
        writeln!(config, "spool_dir = {:?}", folder.join("spool"))?;
        writeln!(config, "[scanner]\nport = {port:?}")?;
        // So that a scanner whose host was killed is soon ready for the next.
        writeln!(config, "request_timeout_ms = 200\ndead_man_ms = 600")?;
        writeln!(config, "[log]\nlevel = \"warn\"\nformat = \"text\"")?;
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
            .with_context(|| format!("cannot start {}", program.display()))?;
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

    /// Waits until it answers.
    pub(crate) async fn ready(&mut self) -> Result<()> {
        self.until(|_| true).await
    }

    /// Waits until no job waits or runs.
    pub(crate) async fn idle(&mut self) -> Result<()> {
        self.until(|status| status.jobs_queued + status.jobs_running == 0)
            .await
    }

    /// SIGKILL.
    pub(crate) fn kill(mut self) -> Result<()> {
        self.child.kill()?;
        let status = self.child.wait()?;
        ensure!(!status.success(), "it ended by itself before: {status}");
        Ok(())
    }

    /// SIGTERM, and waits for its orderly end.
    pub(crate) fn end(mut self) -> Result<()> {
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

/// What a subscriber of the events hears.
pub(crate) struct Heard(Events);

impl Heard {
    pub(crate) async fn listen(client: &Client) -> Result<Self> {
        Ok(Self(client.events().await?))
    }

    /// Waits for the result of a scan; its name.
    pub(crate) async fn published(&mut self, scan: &str) -> Result<String> {
        let find = |event: &Event| match event {
            Event::Published {
                scan: of, result, ..
            } if of == scan => Some(Ok(result.clone())),
            Event::Scan(told) if told.id == scan => match told.state {
                relief_api::ScanState::Failed => Some(Err(told.reason.clone())),
                _ => None,
            },
            _ => None,
        };
        match self.0.until(find).await?.1 {
            Ok(result) => Ok(result),
            Err(reason) => bail!("the scan {scan} failed: {}", reason.unwrap_or_default()),
        }
    }

    /// Waits for the end of a scan.
    pub(crate) async fn over(&mut self, scan: &str) -> Result<Scan> {
        self.0.scan_over(scan).await
    }

    /// Results told before the service was gone and not looked at yet.
    pub(crate) async fn rest(&mut self) -> Vec<String> {
        let mut results = Vec::new();
        while let Ok(Some(event)) = self.0.next().await {
            if let Event::Published { result, .. } = event {
                results.push(result);
            }
        }
        results
    }
}
