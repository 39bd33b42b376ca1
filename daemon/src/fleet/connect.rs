//! How the servers are reached, by the configuration and the files that it names.

use std::path::PathBuf;

use job_queue::BenchName;
use job_queue::jetstream::{Login, Options, Secret};
use rustls::pki_types::PrivateKeyDer;
use rustls::pki_types::pem::PemObject;

use crate::config::NatsConfig;
use crate::receivers::{FileError, authorities_in, certificates_in, read_secret};

/// Looks at the files that the section names.
pub(crate) fn check_files(config: &NatsConfig) -> Result<(), FileError> {
    login(config)?;
    certificate(config)?;
    match &config.ca_file {
        Some(path) => authorities_in(path).map(drop),
        None => Ok(()),
    }
}

/// Files of this client's certificate and of its key, which hold such.
fn certificate(config: &NatsConfig) -> Result<Option<(PathBuf, PathBuf)>, FileError> {
    let (Some(certificate), Some(key)) = (&config.certificate_file, &config.key_file) else {
        return Ok(None);
    };
    certificates_in("certificate_file", certificate)?;
    let text = read_secret("key_file", "key", key)?;
    if let Err(error) = PrivateKeyDer::from_pem_slice(text.as_bytes()) {
        let message = format!("{} holds no PEM private key: {error}", key.display());
        return Err(FileError::new("key_file", message));
    }
    Ok(Some((certificate.clone(), key.clone())))
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
    if let Some(path) = &config.credentials_file {
        let text = read_secret("credentials_file", "credentials", path)?;
        let has = |label: &str| text.contains(&format!("-----BEGIN {label}-----"));
        if !(has("NATS USER JWT") && has("USER NKEY SEED")) {
            let message = format!(
                "{} holds no credentials of a user: a JWT and the seed of its nkey are needed, as \
                 `nsc generate creds` writes them",
                path.display()
            );
            return Err(FileError::new("credentials_file", message));
        }
        return Ok(Login::Credentials(Secret::new(&text)));
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
    options.certificate = certificate(config)?;
    options.tls_required = config.servers.iter().any(|one| one.starts_with("tls:"));
    options.prefix.clone_from(&config.prefix);
    options.domain.clone_from(&config.domain);
    options.replicas = config.replicas;
    options.ack_wait = config.silence();
    options.quota_bytes = Some(u64::from(config.quota_mb) << 20);
    Ok(options)
}
