//! The service on the local network: DNS-SD (RFC 6763) by multicast DNS (RFC 6762).
//!
//! The API can be reached on this machine alone. What is announced is the reverse proxy that
//! passes requests on to it.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, Ipv6Addr, UdpSocket};
use std::time::{Duration, Instant};

use mdns_sd::{DaemonEvent, ResolvedService, ServiceDaemon, ServiceEvent, ServiceInfo};
use serde::Serialize;

use crate::config::{Config, is_host_name};

/// What is announced and looked for.
const SERVICE: &str = "_relief._tcp.local.";
/// UDP port of multicast DNS (RFC 6762, section 3).
pub const MDNS_PORT: u16 = 5353;
/// Longest label of a domain name (RFC 1035, section 2.3.4).
const MOST_LABEL_BYTES: usize = 63;
/// Longest string of a TXT record (RFC 6763, section 6.1), with its key.
const MOST_TXT_BYTES: usize = 255;
/// More services than this are somebody's joke.
const MOST_FOUND: usize = 1_000;
/// How long the end of the service waits for its goodbye to be sent.
const FAREWELL: Duration = Duration::from_millis(500);

/// Others cannot be heard, or not be told.
#[derive(Debug, thiserror::Error)]
pub enum DiscoveryError {
    /// As the library tells it.
    #[error("multicast DNS does not work here: {0}")]
    Mdns(#[from] mdns_sd::Error),
    /// The library would see no network, and not say so.
    #[error("the network cannot be used: {0}")]
    Network(#[from] std::io::Error),
}

/// What others on the network are told, until it ends.
pub(crate) struct Announcement {
    daemon: ServiceDaemon,
    fullname: String,
}

impl Announcement {
    /// Begins to announce the service, if that is configured. Scans are taken whether or not
    /// others can be told.
    pub(crate) fn begin(config: &Config) -> Option<Self> {
        if !config.discovery.announce {
            return None;
        }
        match Self::new(config) {
            Ok(begun) => Some(begun),
            Err(error) => {
                tracing::warn!(
                    %error,
                    "the service is not announced: does the sandbox let it (discovery.conf)?"
                );
                None
            }
        }
    }

    fn new(config: &Config) -> Result<Self, DiscoveryError> {
        let announced = announced(config)?;
        check_network()?;
        let fullname = announced.get_fullname().to_owned();
        let daemon = ServiceDaemon::new_with_port(config.discovery.mdns_port)?;
        let events = daemon.monitor()?;
        daemon.register(announced)?;
        let told = std::thread::Builder::new()
            .name("discovery".into())
            .spawn(move || {
                // Until the daemon is gone.
                for event in events.iter() {
                    match event {
                        DaemonEvent::Error(error) => {
                            tracing::warn!(%error, "trouble with multicast DNS");
                        }
                        DaemonEvent::NameChange(change) => {
                            let (from, to) = (change.original, change.new_name);
                            tracing::warn!(from, to, "another one on the network has this name");
                        }
                        _ => {}
                    }
                }
            });
        if let Err(error) = told {
            tracing::warn!(%error, "trouble with multicast DNS will not be told");
        }
        tracing::info!(name = fullname, "announced on the network");
        Ok(Self { daemon, fullname })
    }

    /// Tells others that the service is gone.
    pub(crate) fn end(self) {
        if let Ok(status) = self.daemon.unregister(&self.fullname) {
            // Who has not heard it forgets the service in two minutes.
            let _ = status.recv_timeout(FAREWELL);
        }
        if let Ok(status) = self.daemon.shutdown() {
            let _ = status.recv_timeout(FAREWELL);
        }
    }
}

/// What a sandbox keeps closed, the library passes over in silence.
fn check_network() -> std::io::Result<()> {
    if_addrs::get_if_addrs()?;
    UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))
        .or_else(|_| UdpSocket::bind((Ipv6Addr::UNSPECIFIED, 0)))
        .map(drop)
}

/// The records by which the service is found.
fn announced(config: &Config) -> Result<ServiceInfo, DiscoveryError> {
    let discovery = &config.discovery;
    let Some(host) = config.http.hosts.first() else {
        let why = "there is no name in http.hosts by which it could be reached";
        return Err(mdns_sd::Error::Msg(why.into()).into());
    };
    let label = host.split('.').next().unwrap_or(host);
    // Multicast DNS has names of its own; the name to be used stands in the TXT record.
    let target = match host.strip_suffix(".local") {
        Some(_) => format!("{host}."),
        None => format!("{label}.local."),
    };
    let mut name = discovery
        .name
        .clone()
        .unwrap_or_else(|| format!("Relief on {label}"));
    while name.len() > MOST_LABEL_BYTES {
        name.pop();
    }
    let scanners = config.each_scanner();
    let scanners = joined(scanners.iter().map(|scanner| scanner.name));
    let properties = [
        ("version", env!("CARGO_PKG_VERSION")),
        ("path", "/"),
        ("host", host),
        ("scheme", if discovery.https { "https" } else { "http" }),
        ("scanners", &scanners),
    ];
    let info = ServiceInfo::new(SERVICE, &name, &target, "", discovery.port, &properties[..])?;
    // Each interface tells its own addresses, also those that it gets later.
    Ok(info.enable_addr_auto())
}

/// As many names as one string of a TXT record has room for.
fn joined<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let room = MOST_TXT_BYTES - "scanners=".len();
    names.fold(String::new(), |mut all, name| {
        if all.len() + name.len() < room {
            if !all.is_empty() {
                all.push(',');
            }
            all.push_str(name);
        }
        all
    })
}

/// A service that was heard. All of it was said by others on the network, and proves nothing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Found {
    /// What it is called.
    pub name: String,
    /// Where it says that it is reached.
    pub url: String,
    /// Addresses that it has, in order.
    pub addresses: Vec<String>,
    /// Its version; empty if it says none.
    pub version: String,
    /// Names of its scanners.
    pub scanners: Vec<String>,
}

impl Found {
    fn of(service: &ResolvedService) -> Self {
        let said = |key: &str| {
            let value = service.get_property_val_str(key).unwrap_or_default();
            printable(value)
        };
        let name = service.fullname.strip_suffix(SERVICE);
        let name = name.unwrap_or(&service.fullname).trim_end_matches('.');
        let host = said("host");
        let target = service.host.trim_end_matches('.');
        let host = if is_host_name(&host) { &host } else { target };
        let (scheme, usual) = match said("scheme").as_str() {
            "http" => ("http", 80),
            _ => ("https", 443),
        };
        let port = match service.port {
            port if port == usual => String::new(),
            port => format!(":{port}"),
        };
        let mut addresses: Vec<_> = service.get_addresses().iter().collect();
        addresses.sort_by_key(|address| address.to_ip_addr());
        let scanners = said("scanners");
        Self {
            name: printable(&name.replace("\\.", ".").replace("\\\\", "\\")),
            url: printable(&format!("{scheme}://{host}{port}/")),
            addresses: addresses.iter().map(ToString::to_string).collect(),
            version: said("version"),
            scanners: scanners
                .split(',')
                .filter(|name| !name.is_empty())
                .map(str::to_owned)
                .collect(),
        }
    }
}

/// What can do no harm on a terminal.
fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

/// The services that are heard on the local network in this time, by name.
///
/// # Errors
/// [`DiscoveryError`] where nothing can be heard at all.
pub fn look_around(mdns_port: u16, longest: Duration) -> Result<Vec<Found>, DiscoveryError> {
    let until = Instant::now() + longest;
    check_network()?;
    let daemon = ServiceDaemon::new_with_port(mdns_port)?;
    let trouble = daemon.monitor()?;
    let events = daemon.browse(SERVICE)?;
    let mut found = BTreeMap::new();
    while let Ok(event) = events.recv_deadline(until) {
        match event {
            ServiceEvent::ServiceResolved(service) if found.len() < MOST_FOUND => {
                found.insert(service.fullname.clone(), Found::of(&service));
            }
            ServiceEvent::ServiceRemoved(_, fullname) => {
                found.remove(&fullname);
            }
            _ => {}
        }
    }
    if let Ok(status) = daemon.shutdown() {
        let _ = status.recv_timeout(FAREWELL);
    }
    let trouble = trouble.try_iter().find_map(|event| match event {
        DaemonEvent::Error(error) => Some(error),
        _ => None,
    });
    match trouble {
        Some(error) if found.is_empty() => Err(error.into()),
        _ => Ok(found.into_values().collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(host: &str) -> Config {
        let mut config = Config::default();
        config.http.hosts = vec![host.to_owned()];
        config.discovery.announce = true;
        config
    }

    fn found(config: &Config) -> Found {
        Found::of(&announced(config).unwrap().as_resolved_service())
    }

    #[test]
    fn what_is_announced_is_what_is_found() {
        let mut config = config("bench.lab.example");
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let expected = Found {
            name: "Relief on bench".into(),
            url: "https://bench.lab.example/".into(),
            addresses: Vec::new(),
            version,
            scanners: vec!["scanner".into()],
        };
        assert_eq!(found(&config), expected);
        config.discovery.port = 8080;
        config.discovery.https = false;
        config.discovery.name = Some("Dr. Kim's bench".into());
        for name in ["left", "right"] {
            let scanner = config.scanner.clone();
            config.scanners.insert(name.into(), scanner);
        }
        let found = found(&config);
        assert_eq!(found.url, "http://bench.lab.example:8080/");
        assert_eq!(found.name, "Dr. Kim's bench");
        assert_eq!(found.scanners, ["left", "right"]);
    }

    #[test]
    fn long_names_and_many_scanners_find_room() {
        let mut config = config(&"b".repeat(63));
        for number in 0..40 {
            let scanner = config.scanner.clone();
            config
                .scanners
                .insert(format!("scanner-{number:02}"), scanner);
        }
        let found = found(&config);
        assert_eq!(found.name.len(), MOST_LABEL_BYTES);
        // Eleven bytes each with the comma, of 246.
        assert_eq!(found.scanners.len(), 22);
        assert_eq!(found.scanners[21], "scanner-21");
    }

    #[test]
    fn what_others_say_does_no_harm() {
        let said = [
            ("host", "evil.example/\u{1b}[2J@"),
            ("scheme", "javascript"),
            ("version", "1\u{7}\n2"),
        ];
        let info = ServiceInfo::new(SERVICE, "a\u{1b}b", "c.local.", "", 443, &said[..]).unwrap();
        let found = Found::of(&info.as_resolved_service());
        assert_eq!(found.url, "https://c.local/");
        assert_eq!((found.name.as_str(), found.version.as_str()), ("ab", "12"));
    }

    #[test]
    fn nothing_is_announced_that_cannot_be_reached() {
        assert!(Announcement::begin(&Config::default()).is_none());
        let mut config = Config::default();
        config.discovery.announce = true;
        let error = announced(&config).unwrap_err().to_string();
        assert!(error.contains("http.hosts"), "{error}");
    }
}
