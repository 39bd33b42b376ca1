//! Where the service listens.

use std::fmt;
use std::path::PathBuf;

use serde::{Serialize, de::DeserializeOwned};

use super::Client;
use super::token::{self, Token};
use crate::failure::Failure;
use crate::output;

/// Where to find the service, as the user says it.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct EndpointArgs {
    /// Unix socket of the service
    #[arg(long, value_name = "PATH", env = "RELIEF_SOCKET", default_value = DEFAULT_SOCKET)]
    socket: PathBuf,
    /// Address of the service on this machine, such as http://127.0.0.1:7437, instead of
    /// the socket
    #[arg(long, value_name = "URL", value_parser = parse_url)]
    url: Option<Address>,
    /// File with the token that --url needs (see `relief token`); or the token itself in the
    /// environment variable RELIEF_TOKEN
    #[arg(long, value_name = "FILE", env = "RELIEF_TOKEN_FILE")]
    token_file: Option<PathBuf>,
}

/// Where a packaged service listens.
pub(crate) const DEFAULT_SOCKET: &str = "/run/relief/reliefd.sock";

impl EndpointArgs {
    pub(crate) fn endpoint(&self) -> Result<Endpoint, Failure> {
        Ok(match self.url.clone() {
            // The socket needs no token, so that one that is not there is no trouble.
            None => Endpoint::Socket(self.socket.clone()),
            Some(address) => Endpoint::Loopback {
                address,
                token: token::find(self.token_file.as_deref())?,
            },
        })
    }

    /// The service to ask.
    pub(crate) fn client(&self) -> Result<Client, Failure> {
        Ok(Client::new(self.endpoint()?))
    }

    /// Asks the service for something and prints it, as JSON or as it is told to people.
    pub(crate) async fn show<T: Serialize + DeserializeOwned>(
        &self,
        path: &str,
        json: bool,
        told: impl FnOnce(&T) -> String,
    ) -> Result<(), Failure> {
        let answer: T = self.client()?.get(path).await?;
        output::either(json, &answer, told)
    }
}

/// Where the service listens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Endpoint {
    Socket(PathBuf),
    Loopback {
        address: Address,
        token: Option<Token>,
    },
}

/// A port of this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Address {
    pub(crate) host: String,
    pub(crate) port: u16,
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port } = self;
        if host.contains(':') {
            write!(f, "[{host}]:{port}")
        } else {
            write!(f, "{host}:{port}")
        }
    }
}

impl Endpoint {
    /// What to put into the `Host` header.
    pub(crate) fn host(&self) -> String {
        match self {
            Self::Socket(_) => "localhost".into(),
            Self::Loopback { address, .. } => address.to_string(),
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Socket(path) => write!(f, "{}", path.display()),
            Self::Loopback { .. } => write!(f, "http://{}", self.host()),
        }
    }
}

fn parse_url(text: &str) -> Result<Address, String> {
    const EXAMPLE: &str = "expected something like http://127.0.0.1:7437";
    let Some(rest) = text.strip_prefix("http://") else {
        return Err(format!(
            "only http:// is spoken, and only on this machine; {EXAMPLE}"
        ));
    };
    let authority = rest.strip_suffix('/').unwrap_or(rest);
    let (host, port) = authority
        .rsplit_once(':')
        .ok_or_else(|| format!("no port; {EXAMPLE}"))?;
    let port = port
        .parse()
        .map_err(|_| format!("`{port}` is not a port; {EXAMPLE}"))?;
    let bare = host.strip_prefix('[').and_then(|h| h.strip_suffix(']'));
    let host = bare.unwrap_or(host);
    if host.is_empty()
        || host.contains(['/', '@', '?', '#'])
        || (bare.is_none() && host.contains(':'))
    {
        return Err(format!("`{host}` is not a host; {EXAMPLE}"));
    }
    Ok(Address {
        host: host.to_owned(),
        port,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_are_read_or_refused_with_an_example() {
        for text in [
            "http://127.0.0.1:7437",
            "http://127.0.0.1:7437/",
            "http://[::1]:80",
        ] {
            let address = parse_url(text).unwrap();
            let shown = format!("http://{address}");
            assert_eq!(shown, text.trim_end_matches('/'));
        }
        for text in [
            "https://a:1",
            "http://a",
            "http://:80",
            "http://a:x",
            "http://a/b:80",
            "a:80",
        ] {
            let error = parse_url(text).unwrap_err();
            assert!(error.contains("http://127.0.0.1:7437"), "{text}: {error}");
        }
    }
}
