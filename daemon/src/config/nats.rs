//! The section `[nats]`: a NATS server with JetStream, by which jobs go to workers elsewhere.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Duration;

use job_queue::BenchName;
use serde::{Deserialize, Deserializer, de::Error};

/// Longest prefix of names on the servers.
const MOST_PREFIX_CHARS: usize = 24;

/// Where jobs go that are to be worked on elsewhere, and what comes from there.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NatsConfig {
    /// Servers of one cluster, as `nats://HOST:4222` or `tls://HOST:4222`; without any, all is done
    /// on this machine.
    #[serde(deserialize_with = "servers")]
    pub servers: Vec<String>,
    /// What this service is called among the others; made of the host's name unless set.
    #[serde(deserialize_with = "bench")]
    pub bench: Option<BenchName>,
    /// File with a token.
    pub token_file: Option<PathBuf>,
    /// File with the seed of an nkey.
    pub nkey_file: Option<PathBuf>,
    /// File with the credentials of a user (`.creds`): a JWT and the seed of its nkey.
    pub credentials_file: Option<PathBuf>,
    /// File with the certificate by which the servers know this client, for tls.
    pub certificate_file: Option<PathBuf>,
    /// File with the key of that certificate.
    pub key_file: Option<PathBuf>,
    /// File with the certificates of the authorities that are trusted; without it, those that the
    /// machine trusts.
    pub ca_file: Option<PathBuf>,
    /// What every subject, stream and bucket of this fleet begins with.
    #[serde(deserialize_with = "prefix")]
    pub prefix: String,
    /// JetStream domain of the servers that keep everything, where they are reached by a leaf node.
    pub domain: Option<String>,
    /// How many servers of a cluster keep what is kept.
    #[serde(deserialize_with = "replicas")]
    pub replicas: usize,
    /// How long a worker may be silent before another one gets its job.
    #[serde(deserialize_with = "seconds")]
    pub silence_s: u32,
    /// Most jobs of this service that wait or run elsewhere; the rest waits here, so that no
    /// bench takes up all workers. As many as there are workers for it unless set.
    #[serde(deserialize_with = "hand_over")]
    pub hand_over: Option<usize>,
    /// Most bytes of this service's columns and results on their way.
    #[serde(deserialize_with = "quota_mb")]
    pub quota_mb: u32,
    /// How long columns and results that nobody needs stay on the servers at least.
    #[serde(deserialize_with = "unneeded_s")]
    pub unneeded_s: u32,
    /// Whether this service's own jobs are done here while the servers are away.
    pub compute_when_away: bool,
    /// How long they are to be away for that.
    #[serde(deserialize_with = "away")]
    pub away_s: u32,
    /// What must be installed where this service's jobs are done.
    #[serde(deserialize_with = "tools")]
    pub needs: BTreeSet<String>,
    /// What is installed here, for the jobs of others.
    #[serde(deserialize_with = "tools")]
    pub tools: BTreeSet<String>,
    /// Most memory of a job that is done here for others; three quarters of the machine's, shared by
    /// its workers, unless set.
    #[serde(deserialize_with = "memory_mib")]
    pub memory_mib: Option<u64>,
    /// The silence in milliseconds, shorter than a file can say; no key of the file.
    #[serde(skip)]
    pub silence_ms: Option<u64>,
}

impl Default for NatsConfig {
    fn default() -> Self {
        Self {
            servers: Vec::new(),
            bench: None,
            token_file: None,
            nkey_file: None,
            credentials_file: None,
            certificate_file: None,
            key_file: None,
            ca_file: None,
            prefix: "relief".to_owned(),
            domain: None,
            replicas: 1,
            silence_s: 30,
            hand_over: None,
            quota_mb: 4096,
            unneeded_s: 3600,
            compute_when_away: true,
            away_s: 30,
            needs: BTreeSet::new(),
            tools: BTreeSet::new(),
            memory_mib: None,
            silence_ms: None,
        }
    }
}

impl NatsConfig {
    /// Whether jobs go elsewhere at all.
    #[must_use]
    pub fn is_used(&self) -> bool {
        !self.servers.is_empty()
    }

    /// What this service is called.
    #[must_use]
    pub fn bench_name(&self) -> BenchName {
        self.bench.clone().unwrap_or_else(host_as_name)
    }

    /// How long a worker may be silent.
    #[must_use]
    pub fn silence(&self) -> Duration {
        let configured = u64::from(self.silence_s) * 1000;
        Duration::from_millis(self.silence_ms.unwrap_or(configured))
    }

    /// Refuses what cannot be, and what does not go together.
    ///
    /// # Errors
    /// What is wrong, and what to do about it.
    pub fn check(&self) -> Result<(), String> {
        check_servers(&self.servers)?;
        check_prefix(&self.prefix)?;
        check_domain(self.domain.as_deref())?;
        check_tools(&self.needs)?;
        check_tools(&self.tools)?;
        self.check_files()
    }

    /// What is refused of the files that are named, whatever is in them.
    fn check_files(&self) -> Result<(), String> {
        let logins = [
            ("token_file", &self.token_file),
            ("nkey_file", &self.nkey_file),
            ("credentials_file", &self.credentials_file),
        ];
        let for_tls = [
            ("certificate_file", &self.certificate_file),
            ("key_file", &self.key_file),
            ("ca_file", &self.ca_file),
        ];
        let mut named = logins.iter().filter(|(_, file)| file.is_some());
        if let (Some((one, _)), Some((other, _))) = (named.next(), named.next()) {
            return Err(format!(
                "`{one}` and `{other}` are two ways to say who this is: one of them is enough"
            ));
        }
        let unused = |(_, file): &&(&str, &Option<PathBuf>)| file.is_some() && !self.is_used();
        if let Some((key, _)) = logins.iter().chain(&for_tls).find(unused) {
            return Err(format!("`{key}` is for `servers`: name one, or remove it"));
        }
        let is_secure = |server: &String| server.starts_with("tls:");
        let is_secure = self.servers.iter().all(is_secure);
        if let Some((key, _)) = for_tls
            .iter()
            .find(|(_, file)| file.is_some() && !is_secure)
        {
            return Err(format!(
                "`{key}` is for tls, but not all `servers` are: remove it, or change the addresses"
            ));
        }
        match (&self.certificate_file, &self.key_file) {
            (Some(_), None) => Err("`certificate_file` needs the `key_file` of its key".into()),
            (None, Some(_)) => Err("`key_file` needs its `certificate_file`".into()),
            (Some(_), Some(_)) | (None, None) => Ok(()),
        }
    }
}

/// The host's name with what cannot be in one left out.
fn host_as_name() -> BenchName {
    let system = rustix::system::uname();
    let host = system.nodename().to_string_lossy();
    let first = host.split('.').next().unwrap_or_default();
    let name: String = first
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .take(32)
        .collect();
    let fallback = || BenchName::try_from("bench".to_owned());
    // The fallback is a name.
    #[allow(clippy::unwrap_used)]
    BenchName::try_from(name).or_else(|_| fallback()).unwrap()
}

/// What is refused is told without what may be secret in it: others see the log.
fn check_servers(servers: &[String]) -> Result<(), String> {
    for server in servers {
        let rest = ["nats://", "tls://"]
            .iter()
            .find_map(|scheme| server.strip_prefix(scheme));
        let is_host = |c: char| c.is_ascii_alphanumeric() || "-._[]:".contains(c);
        let why = match rest {
            Some(rest) if rest.contains('@') => {
                "an address holds a name or password, which others would see: use a file with a \
                 token or the seed of an nkey"
            }
            Some(rest) if !rest.is_empty() && rest.chars().all(is_host) => continue,
            _ => {
                "addresses of servers such as \"nats://10.0.0.5:4222\" or \
                 \"tls://nats.lab.example:4222\" are needed"
            }
        };
        return Err(why.to_owned());
    }
    Ok(())
}

fn servers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    let all = Vec::<String>::deserialize(deserializer)?;
    check_servers(&all).map_err(D::Error::custom)?;
    Ok(all)
}

fn bench<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<BenchName>, D::Error> {
    let name = String::deserialize(deserializer)?;
    BenchName::try_from(name)
        .map(Some)
        .map_err(D::Error::custom)
}

fn check_prefix(text: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if (1..=MOST_PREFIX_CHARS).contains(&text.len()) && text.chars().all(plain) {
        return Ok(());
    }
    Err(format!(
        "{text:?} is no prefix: 1 to {MOST_PREFIX_CHARS} small letters, digits and `-` are"
    ))
}

fn check_domain(text: Option<&str>) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    match text {
        Some(text) if !((1..=32).contains(&text.len()) && text.chars().all(plain)) => Err(format!(
            "{text:?} is no domain: 1 to 32 letters, digits, `-` and `_` are"
        )),
        Some(_) | None => Ok(()),
    }
}

fn prefix<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let text = String::deserialize(deserializer)?;
    check_prefix(&text).map_err(D::Error::custom)?;
    Ok(text)
}

fn replicas<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    let count = usize::deserialize(deserializer)?;
    if [1, 3, 5].contains(&count) {
        Ok(count)
    } else {
        Err(D::Error::custom(format!(
            "{count} replicas are not possible: 1, 3 or 5 are, and a cluster of at least as many \
             servers"
        )))
    }
}

fn check_tools(tools: &BTreeSet<String>) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let is_none = |tool: &&String| !((1..=24).contains(&tool.len()) && tool.chars().all(plain));
    match tools.iter().find(is_none) {
        Some(tool) => Err(format!(
            "{tool:?} is no name of a tool: 1 to 24 small letters, digits and `_` are"
        )),
        None => Ok(()),
    }
}

fn tools<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeSet<String>, D::Error> {
    let all = BTreeSet::deserialize(deserializer)?;
    check_tools(&all).map_err(D::Error::custom)?;
    Ok(all)
}

/// A number within limits.
fn within<'de, D, T>(deserializer: D, least: T, most: T, of: &str) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Copy + Deserialize<'de> + PartialOrd + std::fmt::Display,
{
    let number = T::deserialize(deserializer)?;
    if (least..=most).contains(&number) {
        Ok(number)
    } else {
        Err(D::Error::custom(format!(
            "{number} {of} are not possible: {least} to {most} are"
        )))
    }
}

fn seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    within(deserializer, 2, 3600, "seconds")
}

fn away<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    within(deserializer, 0, 86_400, "seconds")
}

fn quota_mb<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    within(deserializer, 16, 10_000_000, "MB")
}

fn unneeded_s<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    within(deserializer, 10, 31_536_000, "seconds")
}

fn hand_over<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<usize>, D::Error> {
    within(deserializer, 1, 10_000, "jobs").map(Some)
}

fn memory_mib<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u64>, D::Error> {
    within(deserializer, 64, 100_000_000, "MiB").map(Some)
}
