//! How the servers are reached, by the configuration and the files that it names.

use job_queue::BenchName;
use job_queue::jetstream::{Login, Options, Secret};

use crate::config::NatsConfig;
use crate::receivers::{FileError, read_secret};

/// Looks at the files that the section names.
pub(crate) fn check_files(config: &NatsConfig) -> Result<(), FileError> {
    login(config).map(drop)
}

fn login(config: &NatsConfig) -> Result<Login, FileError> {
    if let Some(path) = &config.token_file {
        let token = read_secret("token_file", "token", path)?;
        return Ok(Login::Token(Secret::new(token.trim())));
    }
    if let Some(path) = &config.nkey_file {
        let text = read_secret("nkey_file", "seed", path)?;
        // Tools write the seed between lines of decoration.
        let seed = text
            .lines()
            .map(str::trim)
            .find(|line| line.starts_with("SU"));
        let Some(seed) = seed else {
            let message = format!(
                "{} holds no seed of a user's nkey: a line that begins with SU is needed, as \
                 `nk -gen user` writes it",
                path.display()
            );
            return Err(FileError::new("nkey_file", message));
        };
        return Ok(Login::Nkey(Secret::new(seed)));
    }
    Ok(Login::None)
}

/// What the client is told.
pub(super) fn options(config: &NatsConfig, name: &BenchName) -> Result<Options, FileError> {
    let mut options = Options::new(config.servers.clone());
    options.name = name.to_string();
    // Where others may be kept from listening.
    options.inbox = format!("_INBOX_{name}");
    options.login = login(config)?;
    options.ca_file.clone_from(&config.ca_file);
    options.tls_required = config.servers.iter().any(|one| one.starts_with("tls:"));
    options.prefix.clone_from(&config.prefix);
    options.replicas = config.replicas;
    options.ack_wait = config.silence();
    options.quota_bytes = Some(u64::from(config.quota_mb) << 20);
    Ok(options)
}
