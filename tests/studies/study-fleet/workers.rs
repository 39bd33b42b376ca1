//! Workers in processes of their own.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result};

/// The program, and what it is told each time.
#[derive(Debug, Clone)]
pub(crate) struct Hire {
    pub(crate) program: PathBuf,
    pub(crate) servers: Vec<String>,
    pub(crate) folder: PathBuf,
    pub(crate) silence_s: u32,
}

/// A worker, killed when dropped.
#[derive(Debug)]
pub(crate) struct Hired(Child);

impl Drop for Hired {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Hired {
    /// Most memory that it has had at a time, in MiB.
    pub(crate) fn most_memory_mib(&self) -> Result<f64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.0.id()))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let words = line.context("the system does not tell of its memory")?;
        let kib = words.trim().trim_end_matches(" kB").parse::<f64>()?;
        Ok(kib / 1024.0)
    }
}

impl Hire {
    /// Starts one.
    pub(crate) fn start(&self, name: &str) -> Result<Hired> {
        let log = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(log_of(&self.folder, name))?;
        let child = Command::new(&self.program)
            .arg("worker")
            .args(["--name", name, "--threads", "1"])
            .args(["--silence-s", &self.silence_s.to_string()])
            .arg("--work-dir")
            .arg(&self.folder)
            .arg("--connect")
            .args(&self.servers)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .with_context(|| format!("cannot start {}: build it first", self.program.display()))?;
        Ok(Hired(child))
    }
}

fn log_of(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.log"))
}
