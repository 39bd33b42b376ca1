//! `reliefd` as a process, and what the kernel says of it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use relief_api::{Status, path};
use relief_tests::rig::{Client, GUARD};

use crate::trend::Sample;

/// The process; killed when dropped.
pub(crate) struct Program {
    child: Child,
    socket: PathBuf,
}

impl Program {
    pub(crate) fn start(program: &Path, folder: &Path, port: &Path) -> Result<Self> {
        let socket = folder.join("reliefd.sock");
        let mut config = String::new();
        writeln!(config, "[service]\nsocket = {socket:?}")?;
        writeln!(config, "state_dir = {:?}", folder.join("state"))?;
        writeln!(config, "spool_dir = {:?}", folder.join("spool"))?;
        writeln!(config, "[scanner]\nport = {port:?}")?;
        // Old scans go, as they would where the service is left alone.
        writeln!(config, "[storage]\nreserve_mb = 1\nscans_mb = 100")?;
        writeln!(config, "[log]\nlevel = \"error\"\nformat = \"text\"")?;
        let file = folder.join("reliefd.toml");
        std::fs::write(&file, config)?;
        let child = Command::new(program)
            .arg("--config")
            .arg(&file)
            .stdin(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot start {}: build it first", program.display()))?;
        Ok(Self { child, socket })
    }

    /// Waits until it answers.
    pub(crate) async fn ready(&mut self) -> Result<Client> {
        let client = Client::new(&self.socket);
        let begun = Instant::now();
        while client.get::<Status>(path::STATUS).await.is_err() {
            if let Some(status) = self.child.try_wait()? {
                bail!("the service ended by itself: {status}");
            }
            ensure!(begun.elapsed() < GUARD, "the service does not come up");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        Ok(client)
    }

    /// What it takes now.
    pub(crate) fn sample(&self, at: Duration) -> Result<Sample> {
        let process = Path::new("/proc").join(self.child.id().to_string());
        let status = std::fs::read_to_string(process.join("status"))?;
        let number = |name: &str| -> Result<u64> {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            let word = line.and_then(|line| line.split_whitespace().next());
            Ok(word.with_context(|| format!("no {name}"))?.parse()?)
        };
        Ok(Sample {
            at_s: at.as_secs_f64(),
            memory_bytes: number("VmRSS:")? * 1024,
            threads: number("Threads:")?,
            descriptors: std::fs::read_dir(process.join("fd"))?.count() as u64,
        })
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
