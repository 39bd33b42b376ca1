//! Whoever speaks HTTP with those who are told.

use std::path::Path;
use std::time::Duration;

use rustls::crypto::ring;
use ureq::Agent;
use ureq::tls::{Certificate, RootCerts, TlsConfig};

use super::files::{FileError, authorities_in, authorities_of_the_machine};

/// Bytes of the head of an answer.
pub(super) const MOST_HEAD_BYTES: usize = 16 << 10;

/// One that posts to this address, and trusts those of the file or else whom the machine trusts.
pub(crate) fn agent(
    url: &str,
    ca_file: Option<&Path>,
    timeout: Duration,
) -> Result<Agent, FileError> {
    // Where another part of the process has chosen one, that will do.
    let _ = ring::default_provider().install_default();
    let authorities = match ca_file {
        Some(path) => authorities_in(path)?,
        None if url.starts_with("https:") => authorities_of_the_machine(),
        None => Vec::new(),
    };
    let authorities: Vec<Certificate<'static>> = authorities
        .iter()
        .map(|certificate| Certificate::from_der(certificate).to_owned())
        .collect();
    let tls = TlsConfig::builder().root_certs(RootCerts::from(authorities));
    Ok(Agent::config_builder()
        .tls_config(tls.build())
        .timeout_global(Some(timeout))
        .http_status_as_error(false)
        .max_redirects(0)
        .max_redirects_will_error(false)
        .max_response_header_size(MOST_HEAD_BYTES)
        // Messages are far between, and no connection is kept open for the next.
        .max_idle_connections(0)
        .proxy(None)
        .user_agent(concat!("reliefd/", env!("CARGO_PKG_VERSION")))
        .build()
        .new_agent())
}
