//! What is to be known to speak with NATS.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use async_nats::{ConnectOptions, ServerAddr};

use crate::QueueError;

/// Longest prefix of names on the server.
const MOST_PREFIX_CHARS: usize = 24;
/// Longest domain.
const MOST_DOMAIN_CHARS: usize = 32;
/// Longest pause between two attempts to connect.
const LONGEST_PAUSE: Duration = Duration::from_secs(2);
/// How long a server may take to answer.
pub(crate) const ANSWER: Duration = Duration::from_secs(5);

/// What nobody should read in a log.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

impl Secret {
    /// Keeps it.
    #[must_use]
    pub fn new(secret: impl Into<String>) -> Self {
        Self(secret.into())
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("(secret)")
    }
}

/// How the server knows who connects.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Login {
    /// It asks for nothing, or knows by the certificate.
    #[default]
    None,
    /// A token that all share.
    Token(Secret),
    /// A name and a password.
    Password {
        /// The name.
        user: String,
        /// The password.
        password: Secret,
    },
    /// The seed of an nkey: the server has its public half.
    Nkey(Secret),
    /// The text of a file of credentials (`.creds`): a JWT and the seed of its nkey.
    Credentials(Secret),
}

/// How a queue on NATS is reached, and how it is kept there.
#[derive(Clone, PartialEq)]
pub struct Options {
    /// Addresses of servers (`nats://host:4222`, `tls://host`); others of their cluster are found
    /// by themselves.
    pub servers: Vec<String>,
    /// Name by which the server's operators see this client.
    pub name: String,
    /// How the server knows who connects.
    pub login: Login,
    /// Whom to trust, in place of those whom the machine trusts (PEM).
    pub ca_file: Option<PathBuf>,
    /// Files of this client's certificate and of its key (PEM).
    pub certificate: Option<(PathBuf, PathBuf)>,
    /// Connects in no other way than by TLS.
    pub tls_required: bool,
    /// Begins the names of streams, buckets and subjects, so that several installations may share
    /// a server.
    pub prefix: String,
    /// Domain of the servers that keep everything, where they have one: what leads to them by way of
    /// leaf nodes.
    pub domain: Option<String>,
    /// Begins the subjects on which this client is answered, so that the server's permissions can
    /// keep others from listening there.
    pub inbox: String,
    /// Makes the streams and buckets that are missing, as benches do. Workers that may not do so
    /// wait for them.
    pub makes_missing: bool,
    /// On how many servers of a cluster everything is kept: 1, 3 or 5.
    pub replicas: usize,
    /// For how long an order is a worker's that gives no sign of life.
    pub ack_wait: Duration,
    /// For how long an order is a worker's that is connected and neither asks whether it should
    /// stop nor tells how far it is.
    pub silence: Duration,
    /// How often an idle worker looks for orders that it was not told of.
    pub poll: Duration,
    /// Orders that may wait and run at once, of all benches.
    pub quota_jobs: u64,
    /// Bytes that a bench's journals and results may take on the server; any amount unless set.
    pub quota_bytes: Option<u64>,
}

impl fmt::Debug for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Options")
            .field("servers", &self.shown_servers())
            .field("name", &self.name)
            .field("login", &self.login)
            .field("prefix", &self.prefix)
            .finish_non_exhaustive()
    }
}

impl Options {
    /// Usual ones, for these servers.
    #[must_use]
    pub fn new(servers: Vec<String>) -> Self {
        Self {
            servers,
            name: "relief".to_owned(),
            login: Login::None,
            ca_file: None,
            certificate: None,
            tls_required: false,
            prefix: "relief".to_owned(),
            domain: None,
            inbox: "_INBOX".to_owned(),
            makes_missing: true,
            replicas: 1,
            ack_wait: Duration::from_secs(30),
            silence: Duration::from_secs(15 * 60),
            poll: Duration::from_secs(2),
            quota_jobs: 100_000,
            quota_bytes: None,
        }
    }

    /// Refuses what cannot work.
    pub(crate) fn check(&self) -> Result<(), QueueError> {
        let refused = |why: String| Err(QueueError::Refused(why));
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if !(1..=MOST_PREFIX_CHARS).contains(&self.prefix.len()) || !self.prefix.chars().all(plain)
        {
            return refused(format!(
                "prefix `{}`: give 1 to {MOST_PREFIX_CHARS} small letters, digits and `-`",
                self.prefix
            ));
        }
        if !matches!(self.replicas, 1 | 3 | 5) {
            return refused(format!("replicas = {}: give 1, 3 or 5", self.replicas));
        }
        if self.ack_wait < Duration::from_millis(100) || self.poll.is_zero() {
            return refused("ack_wait and poll: give 100 ms or more, and more than 0".to_owned());
        }
        if self.inbox.is_empty() || self.inbox.contains(['*', '>', ' ']) {
            return refused(format!("inbox `{}`: give a plain subject", self.inbox));
        }
        let word = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if let Some(domain) = &self.domain
            && !((1..=MOST_DOMAIN_CHARS).contains(&domain.len()) && domain.chars().all(word))
        {
            return refused(format!(
                "domain `{domain}`: give 1 to {MOST_DOMAIN_CHARS} letters, digits, `-` and `_`"
            ));
        }
        self.addresses()?;
        self.connect_options().map(drop)
    }

    /// What requests to `JetStream` begin with.
    pub(crate) fn api(&self) -> String {
        match &self.domain {
            Some(domain) => format!("$JS.{domain}.API"),
            None => "$JS.API".to_owned(),
        }
    }

    /// The servers' addresses.
    pub(crate) fn addresses(&self) -> Result<Vec<ServerAddr>, QueueError> {
        if self.servers.is_empty() {
            return Err(QueueError::Refused(
                "no server: give one as nats://host:4222".to_owned(),
            ));
        }
        let address = |server: &String| {
            server.parse().map_err(|error| {
                QueueError::Refused(format!(
                    "server `{}`: {error}; give it as nats://host:4222",
                    shown(server)
                ))
            })
        };
        self.servers.iter().map(address).collect()
    }

    /// The servers as they may be shown: an address may have a password in it.
    pub(crate) fn shown_servers(&self) -> String {
        let servers: Vec<_> = self.servers.iter().map(|server| shown(server)).collect();
        servers.join(", ")
    }

    /// The client's options, but for what it is to tell whom.
    pub(crate) fn connect_options(&self) -> Result<ConnectOptions, QueueError> {
        let mut options = ConnectOptions::new()
            .name(&self.name)
            .custom_inbox_prefix(&self.inbox)
            .require_tls(self.tls_required)
            .request_timeout(Some(ANSWER))
            .connection_timeout(ANSWER)
            .ping_interval(Duration::from_secs(10))
            .max_reconnects(None)
            .reconnect_delay_callback(pause);
        options = match &self.login {
            Login::None => options,
            Login::Token(token) => options.token(token.0.clone()),
            Login::Password { user, password } => {
                options.user_and_password(user.clone(), password.0.clone())
            }
            Login::Nkey(seed) => {
                nkeys_seed(&seed.0)?;
                options.nkey(seed.0.trim().to_owned())
            }
            Login::Credentials(text) => options.credentials(&text.0).map_err(|_| {
                QueueError::Refused(
                    "the NATS credentials cannot be read: give the whole text of a .creds file"
                        .to_owned(),
                )
            })?,
        };
        if let Some(file) = &self.ca_file {
            options = options.add_root_certificates(file.clone());
        }
        if let Some((certificate, key)) = &self.certificate {
            options = options.add_client_certificate(certificate.clone(), key.clone());
        }
        Ok(options)
    }
}

/// A seed that is none would be found out at the first connection only, and tried for ever.
fn nkeys_seed(seed: &str) -> Result<(), QueueError> {
    let seed = seed.trim();
    let base32 = |c: char| c.is_ascii_uppercase() || ('2'..='7').contains(&c);
    if seed.len() == 58 && seed.starts_with("SU") && seed.chars().all(base32) {
        Ok(())
    } else {
        Err(QueueError::Refused(
            "the NATS nkey is no seed of a user: give the 58 characters that begin with SU"
                .to_owned(),
        ))
    }
}

/// Longer after each attempt, and never long.
pub(crate) fn pause(attempts: usize) -> Duration {
    let doublings = u32::try_from(attempts.saturating_sub(1))
        .unwrap_or(u32::MAX)
        .min(8);
    let pause = Duration::from_millis(20).saturating_mul(1 << doublings);
    if attempts <= 1 {
        Duration::ZERO
    } else {
        pause.min(LONGEST_PAUSE)
    }
}

/// An address without its password.
fn shown(server: &str) -> String {
    match (server.split_once("://"), server.rsplit_once('@')) {
        (Some((scheme, _)), Some((_, host))) => format!("{scheme}://{host}"),
        (None, Some((_, host))) => host.to_owned(),
        _ => server.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_not_shown() {
        let mut options = Options::new(vec!["nats://me:hunter2@host:4222".to_owned()]);
        options.login = Login::Token(Secret::new("hunter3"));
        assert!(!format!("{options:?}").contains("hunter"), "{options:?}");
        assert_eq!(options.shown_servers(), "nats://host:4222");
    }

    type Spoil = fn(&mut Options);

    #[test]
    fn what_cannot_work_is_refused_with_what_to_give() {
        let good = Options::new(vec!["nats://host".to_owned()]);
        good.check().unwrap();
        let bad: [(&str, Spoil); 7] = [
            ("domain", |o| o.domain = Some("a.b".to_owned())),
            ("prefix", |o| o.prefix = "a.b".to_owned()),
            ("replicas", |o| o.replicas = 2),
            ("ack_wait", |o| o.ack_wait = Duration::ZERO),
            ("inbox", |o| o.inbox = "a.>".to_owned()),
            ("no server", |o| o.servers.clear()),
            ("nkey", |o| o.login = Login::Nkey(Secret::new("SUA"))),
        ];
        for (word, spoil) in bad {
            let mut options = good.clone();
            spoil(&mut options);
            let told = options.check().unwrap_err().to_string();
            assert!(told.contains(word), "{told}");
        }
    }

    #[test]
    fn pauses_grow_and_stay_short() {
        assert_eq!(pause(1), Duration::ZERO);
        assert!(pause(3) > pause(2));
        assert_eq!(pause(1000), LONGEST_PAUSE);
    }
}
