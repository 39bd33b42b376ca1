//! Copies into a folder of another machine, by the program `sftp`, confined as hooks are.

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use deliverables::MANIFEST_NAME;

use super::super::hook::{OURSELVES, readable};
use super::super::run::{Until, run};
use super::Way;
use super::parcel::Parcel;
use crate::config::UploadConfig;
use crate::confined::{Confined, Folders};

/// OpenSSH's.
pub(super) const PROGRAM: &str = "/usr/bin/sftp";
const PORT: u16 = 22;
const MB: u64 = 1_000_000;

pub(super) struct Sftp {
    config: UploadConfig,
    /// Where it has its working folder, one run at a time.
    folder: PathBuf,
    closing: Arc<AtomicBool>,
}

impl Sftp {
    pub(super) fn new(config: &UploadConfig, state_dir: &Path, closing: Arc<AtomicBool>) -> Self {
        Self {
            config: config.clone(),
            folder: state_dir.join("uploads").join(&config.name),
            closing,
        }
    }

    fn command(&self, batch: &Path) -> Vec<String> {
        let config = &self.config;
        let file = |path: &Option<PathBuf>| path.clone().unwrap_or_default().display().to_string();
        let option = |text: String| ["-o".to_owned(), text];
        let mut words = vec![PROGRAM.to_owned()];
        // Nothing of whoever the service's user is may lead elsewhere.
        words.extend(["-F".to_owned(), "/dev/null".to_owned()]);
        for text in [
            "BatchMode=yes".to_owned(),
            "LogLevel=ERROR".to_owned(),
            "IdentitiesOnly=yes".to_owned(),
            "StrictHostKeyChecking=yes".to_owned(),
            "GlobalKnownHostsFile=/dev/null".to_owned(),
            format!("UserKnownHostsFile={}", file(&config.known_hosts_file)),
            format!("IdentityFile={}", file(&config.identity_file)),
            format!("User={}", config.user.clone().unwrap_or_default()),
            format!("ConnectTimeout={}", config.timeout_s),
        ] {
            words.extend(option(text));
        }
        words.extend(["-P".to_owned(), config.port.unwrap_or(PORT).to_string()]);
        words.extend(["-b".to_owned(), batch.display().to_string()]);
        words.push(config.host.clone().unwrap_or_default());
        words
    }
}

/// A word of sftp's own commands.
fn word(text: &Path) -> String {
    let text = text.display().to_string();
    // Within quotes nothing else has a meaning, but for patterns of names.
    let special = |c: char| matches!(c, '"' | '\\' | '*' | '?' | '[');
    let escaped: String = text
        .chars()
        .flat_map(|c| special(c).then_some('\\').into_iter().chain([c]))
        .collect();
    format!("\"{escaped}\"")
}

/// What sftp is told to do. A line that begins with `-` may fail.
fn batch(parcel: &Parcel, folder: &Path) -> String {
    let place = folder.join(&parcel.result);
    let part = folder.join(format!(".{}.part", parcel.result));
    let mut lines = vec![format!("-mkdir {}", word(&part))];
    for piece in &parcel.files {
        lines.push(format!(
            "put {} {}",
            word(&parcel.directory.join(&piece.name)),
            word(&part.join(&piece.name))
        ));
    }
    // Where an attempt of before has come to its end unheard, it is there already.
    lines.push(format!("-rename {} {}", word(&part), word(&place)));
    lines.push(format!("ls {}", word(&place.join(MANIFEST_NAME))));
    lines.join("\n") + "\n"
}

impl Way for Sftp {
    fn send(&self, parcel: &Parcel, until: Instant) -> Result<(), String> {
        for piece in &parcel.files {
            parcel.open(piece)?;
        }
        let config = &self.config;
        let commands = self.folder.with_extension("batch");
        let folder = config.folder.clone().unwrap_or_default();
        let failed = |error: std::io::Error| format!("{}: {error}", commands.display());
        fs::create_dir_all(self.folder.parent().unwrap_or(&self.folder)).map_err(failed)?;
        fs::write(&commands, batch(parcel, &folder)).map_err(failed)?;
        let left_s = until.saturating_duration_since(Instant::now()).as_secs();
        let files = [&config.identity_file, &config.known_hosts_file];
        let mut read = vec![parcel.directory.clone(), commands.clone()];
        read.extend(files.into_iter().flatten().cloned());
        let confined = Confined {
            parent: rustix::process::getpid().as_raw_pid(),
            cpu_s: left_s.max(1),
            memory_bytes: 4_096 * MB,
            file_bytes: MB,
            processes: 4_096,
            folders: Some(Folders {
                read,
                write: self.folder.clone(),
            }),
            command: self.command(&commands),
        };
        let environment = [("HOME", "/nonexistent".to_owned())];
        let until = Until {
            time: until,
            closing: &self.closing,
        };
        let helper = config.helper.as_deref().unwrap_or(Path::new(OURSELVES));
        let ran = run(helper, &confined, &environment, &self.folder, &until);
        let _ = fs::remove_file(&commands);
        let ran = ran.map_err(|error| format!("sftp cannot be run: {error}"))?;
        let said = readable(&ran.output);
        match ran.status {
            Some(status) if status.success() => Ok(()),
            None => Err("sftp had not come to its end in timeout_s, and was killed".to_owned()),
            Some(status) => {
                let how = status.code().or(status.signal()).unwrap_or_default();
                Err(format!("sftp failed ({how}): {}", said.replace('\n', "; ")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_mean_what_they_say() {
        assert_eq!(word(Path::new("/a b/c.igs")), "\"/a b/c.igs\"");
        assert_eq!(word(Path::new("a\"; !sh \\*")), "\"a\\\"; !sh \\\\\\*\"");
    }
}
