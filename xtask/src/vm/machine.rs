//! A run of the machine.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// A panic ends the machine; an emulated timer need not be proved.
const ALWAYS: &str = "console=ttyS0 quiet panic=-1 no_timer_check";

pub(super) struct Machine<'a> {
    pub(super) kernel: &'a Path,
    pub(super) initramfs: &'a Path,
    /// Stays as it is: what the machine writes is forgotten with it.
    pub(super) disk: Option<&'a Path>,
    pub(super) memory_mb: u32,
    pub(super) processors: u32,
    /// For the kernel, besides those that all machines get.
    pub(super) parameters: &'a str,
    pub(super) kvm: bool,
    pub(super) patience: Duration,
}

/// Ends the machine whatever becomes of us.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Machine<'_> {
    /// Boots, shows what the machine says, and gives it back when the machine has ended.
    pub(super) fn run(&self) -> Result<String> {
        let start = Instant::now();
        let mut child = Running(
            self.command()
                .spawn()
                .context("cannot start the emulator")?,
        );
        let output = child.0.stdout.take().context("the machine is mute")?;
        let (lines, heard) = channel();
        std::thread::spawn(move || {
            let mut output = BufReader::new(output);
            let mut line = Vec::new();
            while matches!(output.read_until(b'\n', &mut line), Ok(count) if count > 0) {
                let text = String::from_utf8_lossy(&line).trim_end().to_owned();
                line.clear();
                if lines.send(text).is_err() {
                    return;
                }
            }
        });
        let mut said = String::new();
        loop {
            let left = self.patience.saturating_sub(start.elapsed());
            match heard.recv_timeout(left) {
                Ok(line) => {
                    println!("{line}");
                    said.push_str(&line);
                    said.push('\n');
                }
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {
                    bail!("the virtual machine did not end within {:?}", self.patience)
                }
            }
        }
        let status = child.0.wait()?;
        if !status.success() {
            bail!("the emulator ended with {status}");
        }
        println!("vm: {:.0} s", start.elapsed().as_secs_f64());
        Ok(said)
    }

    fn command(&self) -> Command {
        let mut command = Command::new("qemu-system-x86_64");
        command
            .args(["-machine", "pc", "-cpu", "max"])
            .args(["-smp", &self.processors.to_string()])
            .args(["-m", &self.memory_mb.to_string()])
            .args(["-accel", if self.kvm { "kvm" } else { "tcg" }])
            .args(["-nodefaults", "-no-user-config", "-no-reboot"])
            .args(["-display", "none", "-monitor", "none", "-serial", "stdio"])
            .arg("-kernel")
            .arg(self.kernel)
            .arg("-initrd")
            .arg(self.initramfs)
            .args(["-append", &format!("{ALWAYS} {}", self.parameters)])
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        if let Some(disk) = self.disk {
            // What is never kept need not be safe: each sync would wait for this machine's disk.
            let manner = "if=virtio,format=raw,snapshot=on,cache=unsafe";
            let drive = format!("file={},{manner}", disk.display());
            command.args(["-drive", &drive]);
        }
        command
    }
}
