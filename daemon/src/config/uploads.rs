//! The sections `[[uploads]]`: where copies of results go.

use std::path::PathBuf;
use std::time::Duration;

use serde::Deserialize;

use super::receivers::{KeyFault, Retry};
use super::value;

/// Where copies of results go.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UploadConfig {
    /// Its name; safe in a path and on a command line.
    #[serde(deserialize_with = "value::upload_name")]
    pub name: String,
    /// What is there; each kind has keys of its own.
    pub to: UploadTo,
    /// Patterns of names of files that go there, such as `*.igs`; `manifest.json` always does.
    #[serde(default = "all_files", deserialize_with = "value::patterns")]
    pub files: Vec<String>,
    /// How long an attempt may take.
    #[serde(
        default = "default_timeout_s",
        deserialize_with = "value::hook_seconds"
    )]
    pub timeout_s: u32,
    /// The folder, on this machine or on that of `host`.
    #[serde(default)]
    pub folder: Option<PathBuf>,
    /// Refuse a folder on whose place nothing is mounted.
    #[serde(default)]
    pub must_be_mount: Option<bool>,
    /// Address of the object store.
    #[serde(default, deserialize_with = "value::object_store")]
    pub endpoint: Option<String>,
    /// Bucket of the object store.
    #[serde(default)]
    pub bucket: Option<String>,
    /// Region that requests are signed for; `us-east-1` unless set.
    #[serde(default)]
    pub region: Option<String>,
    /// What names of objects begin with.
    #[serde(default)]
    pub prefix: Option<String>,
    /// File with the id of the key in its first line, and the secret in its second.
    #[serde(default)]
    pub key_file: Option<PathBuf>,
    /// File with the certificates of the authorities that are trusted; without it, those that
    /// the machine trusts.
    #[serde(default)]
    pub ca_file: Option<PathBuf>,
    /// Machine that is reached by SFTP.
    #[serde(default, deserialize_with = "value::host")]
    pub host: Option<String>,
    /// Its port; 22 unless set.
    #[serde(default)]
    pub port: Option<u16>,
    /// Who the service is there.
    #[serde(default, deserialize_with = "value::user")]
    pub user: Option<String>,
    /// File with the private key, without a passphrase.
    #[serde(default)]
    pub identity_file: Option<PathBuf>,
    /// File with the keys by which the host is known.
    #[serde(default)]
    pub known_hosts_file: Option<PathBuf>,
    /// When an upload is tried again; no key of the file.
    #[serde(skip)]
    pub retry: Retry,
    /// The program `reliefd`, where it is not what runs; no key of the file.
    #[serde(skip)]
    pub helper: Option<PathBuf>,
}

/// What takes copies of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum UploadTo {
    /// A folder, such as a mounted share.
    Folder,
    /// An object store that speaks S3.
    S3,
    /// A folder of another machine, by SFTP.
    Sftp,
}

impl UploadTo {
    /// As it is spelt.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Folder => "folder",
            Self::S3 => "s3",
            Self::Sftp => "sftp",
        }
    }
}

fn all_files() -> Vec<String> {
    vec!["*".to_owned()]
}

fn default_timeout_s() -> u32 {
    600
}

impl UploadConfig {
    /// An upload with everything else as it is by default.
    #[must_use]
    pub fn new(name: &str, to: UploadTo) -> Self {
        Self {
            name: name.to_owned(),
            to,
            files: all_files(),
            timeout_s: default_timeout_s(),
            folder: None,
            must_be_mount: None,
            endpoint: None,
            bucket: None,
            region: None,
            prefix: None,
            key_file: None,
            ca_file: None,
            host: None,
            port: None,
            user: None,
            identity_file: None,
            known_hosts_file: None,
            retry: Retry::default(),
            helper: None,
        }
    }

    /// How long an attempt may take.
    #[must_use]
    pub fn timeout(&self) -> Duration {
        Duration::from_secs(self.timeout_s.into())
    }

    /// Refuses keys of another kind, and misses those of its own.
    pub(super) fn check(&self) -> Result<(), KeyFault> {
        use UploadTo::{Folder, S3, Sftp};
        type Kinds = &'static [UploadTo];
        let keys: [(&'static str, bool, Kinds, Kinds); 13] = [
            // The key, whether it is there, who has it, and who needs it.
            (
                "folder",
                self.folder.is_some(),
                &[Folder, Sftp],
                &[Folder, Sftp],
            ),
            (
                "must_be_mount",
                self.must_be_mount.is_some(),
                &[Folder],
                &[],
            ),
            ("endpoint", self.endpoint.is_some(), &[S3], &[S3]),
            ("bucket", self.bucket.is_some(), &[S3], &[S3]),
            ("region", self.region.is_some(), &[S3], &[]),
            ("prefix", self.prefix.is_some(), &[S3], &[]),
            ("key_file", self.key_file.is_some(), &[S3], &[S3]),
            ("ca_file", self.ca_file.is_some(), &[S3], &[]),
            ("host", self.host.is_some(), &[Sftp], &[Sftp]),
            ("port", self.port.is_some(), &[Sftp], &[]),
            ("user", self.user.is_some(), &[Sftp], &[Sftp]),
            (
                "identity_file",
                self.identity_file.is_some(),
                &[Sftp],
                &[Sftp],
            ),
            (
                "known_hosts_file",
                self.known_hosts_file.is_some(),
                &[Sftp],
                &[Sftp],
            ),
        ];
        let to = self.to;
        for (key, is_there, of, needed_by) in keys {
            if is_there && !of.contains(&to) {
                let of: Vec<&str> = of.iter().map(|to| to.as_str()).collect();
                let (of, to) = (of.join(" and "), to.as_str());
                return Err((key, format!("`{key}` is for {of}, not for {to}: remove it")));
            }
            if !is_there && needed_by.contains(&to) {
                return Err(("to", format!("an upload to {} needs `{key}`", to.as_str())));
            }
        }
        if to == Folder
            && !self
                .folder
                .as_ref()
                .is_some_and(|folder| folder.is_absolute())
        {
            return Err(("folder", "the folder is to be a whole path".to_owned()));
        }
        let is_secure = self
            .endpoint
            .as_ref()
            .is_some_and(|url| url.starts_with("https:"));
        if self.ca_file.is_some() && !is_secure {
            let told = "`ca_file` is for https, but `endpoint` is not: remove it, or change the \
                        address";
            return Err(("ca_file", told.to_owned()));
        }
        Ok(())
    }
}
