//! The section `[discovery]`: whether others on the network are told of the service.

use serde::Deserialize;

use super::value;

/// Whether and how the service is announced on the local network.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DiscoveryConfig {
    /// Whether it is.
    pub announce: bool,
    /// What people see; made of the first of `http.hosts` unless set.
    #[serde(deserialize_with = "value::announced_name")]
    pub name: Option<String>,
    /// Port on which the reverse proxy is reached.
    #[serde(deserialize_with = "value::port")]
    pub port: u16,
    /// Whether the proxy speaks HTTPS there.
    pub https: bool,
    /// UDP port of multicast DNS; no key of the file.
    #[serde(skip)]
    pub mdns_port: u16,
}

impl Default for DiscoveryConfig {
    fn default() -> Self {
        Self {
            announce: false,
            name: None,
            port: 443,
            https: true,
            mdns_port: crate::discovery::MDNS_PORT,
        }
    }
}

impl DiscoveryConfig {
    /// Refuses to announce what nobody could reach.
    pub(super) fn check(&self, hosts: &[String]) -> Result<(), String> {
        if self.announce && hosts.is_empty() {
            return Err(
                "announce = true needs the name of a reverse proxy in http.hosts: the service \
                 itself can be reached on this machine alone"
                    .to_owned(),
            );
        }
        Ok(())
    }
}
