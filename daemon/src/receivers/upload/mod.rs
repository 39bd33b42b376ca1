//! Uploads: copies of results that go elsewhere, whole or not at all.

mod folder;
mod parcel;
mod s3;
mod sftp;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, TryLockError};
use std::time::{Duration, Instant};

use relief_api::{DeliveryAttempt, WebhookEvent, WebhookKind, WebhookMessage};

use super::FileError;
use super::receiver::{self, Receiver, Settings, Verdict};
use crate::config::{UploadConfig, UploadTo};
use crate::service::lock;
use crate::store::Message;
use folder::Folder;
use parcel::Parcel;
use s3::Store;
use sftp::Sftp;

/// Shorter than the command line waits for the outcome of a test.
const LONGEST_TEST: Duration = Duration::from_secs(25);

/// How a copy gets where it goes.
trait Way: Send + Sync {
    /// Copies all files, until then at the latest. Where a copy is there already it is left.
    fn send(&self, parcel: &Parcel, until: Instant) -> Result<(), String>;
}

struct Upload {
    files: Vec<String>,
    timeout: Duration,
    way: Box<dyn Way>,
    /// Held by whoever copies: two would be in each other's way.
    copying: Mutex<()>,
    /// The service ends.
    closing: Arc<AtomicBool>,
}

/// Where copies go, as it is shown to everybody.
fn shown(config: &UploadConfig) -> String {
    let folder = config.folder.clone().unwrap_or_default();
    let text = |part: &Option<String>| part.clone().unwrap_or_default();
    match config.to {
        UploadTo::Folder => folder.display().to_string(),
        UploadTo::S3 => {
            let endpoint = text(&config.endpoint);
            let (endpoint, bucket) = (endpoint.trim_end_matches('/'), text(&config.bucket));
            format!("{endpoint}/{bucket}/{}", text(&config.prefix))
        }
        UploadTo::Sftp => {
            let (user, host) = (text(&config.user), text(&config.host));
            format!("sftp://{user}@{host}/{}", folder.display())
        }
    }
}

/// Looks at the files that an upload names.
pub(crate) fn check_files(config: &UploadConfig) -> Result<(), FileError> {
    match config.to {
        UploadTo::Folder => Ok(()),
        UploadTo::S3 => Store::new(config).map(drop),
        UploadTo::Sftp => {
            for (key, path) in [
                ("identity_file", &config.identity_file),
                ("known_hosts_file", &config.known_hosts_file),
                ("to", &Some(PathBuf::from(sftp::PROGRAM))),
            ] {
                let path = path.clone().unwrap_or_default();
                if !path.is_file() {
                    let why = format!("{} is not there, or is no file", path.display());
                    return Err(FileError::new(key, why));
                }
            }
            Ok(())
        }
    }
}

/// The receiver of a section; `state_dir` is the service's.
pub(super) fn receiver(config: &UploadConfig, state_dir: &Path) -> Result<Receiver, FileError> {
    let settings = Settings {
        name: config.name.clone(),
        kind: WebhookKind::Upload,
        shown: shown(config),
        events: vec![WebhookEvent::JobDone],
        timeout: config.timeout(),
        retry: config.retry,
    };
    let closing = Arc::new(AtomicBool::new(false));
    let way: Box<dyn Way> = match config.to {
        UploadTo::Folder => Box::new(Folder::new(config)),
        UploadTo::S3 => Box::new(Store::new(config)?),
        UploadTo::Sftp => Box::new(Sftp::new(config, state_dir, Arc::clone(&closing))),
    };
    let upload = Upload {
        files: config.files.clone(),
        timeout: config.timeout(),
        way,
        copying: Mutex::default(),
        closing,
    };
    Ok(Receiver::new(settings, upload))
}

impl receiver::Way for Upload {
    fn deliver(&self, message: &Message, attempt: &mut DeliveryAttempt) -> Verdict {
        let told: Option<WebhookMessage> = serde_json::from_str(&message.body).ok();
        let Some(job) = told.and_then(|told| told.data.job) else {
            attempt.error = Some("there is no result that could go there".into());
            return Verdict::Gone;
        };
        let directory = PathBuf::from(job.directory.as_deref().unwrap_or_default());
        if !directory.is_dir() {
            attempt.error = Some(format!("the result {} is not there any more", job.result));
            return Verdict::Gone;
        }
        let is_test = message.delivery.event == WebhookEvent::Test;
        let longest = match is_test {
            true => self.timeout.min(LONGEST_TEST),
            false => self.timeout,
        };
        let alone = match self.copying.try_lock() {
            Err(TryLockError::WouldBlock) if is_test => {
                attempt.error = Some("it is just copying something: try again later".into());
                return Verdict::Again;
            }
            Err(TryLockError::WouldBlock) => lock(&self.copying),
            Err(TryLockError::Poisoned(alone)) => alone.into_inner(),
            Ok(alone) => alone,
        };
        let until = Instant::now() + longest;
        let sent = Parcel::of(&job.result, &directory, &self.files)
            .and_then(|parcel| self.way.send(&parcel, until));
        drop(alone);
        match sent {
            Ok(()) => Verdict::Delivered,
            Err(why) => {
                attempt.error = Some(why);
                Verdict::Again
            }
        }
    }

    fn close(&self) {
        self.closing.store(true, Ordering::Relaxed);
    }
}
