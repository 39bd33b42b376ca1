//! What clients may ask of the API at most.

use std::time::Duration;

use serde::Deserialize;

use super::value;

/// What clients may ask of the API at most.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HttpConfig {
    /// Connections at a time, on the socket and on the loopback address each.
    #[serde(deserialize_with = "value::connections")]
    pub connections: usize,
    /// Clients that listen to the events at a time.
    #[serde(deserialize_with = "value::connections")]
    pub listeners: usize,
    /// How long the head of a request may take, and then its body.
    #[serde(deserialize_with = "value::http_milliseconds")]
    pub request_timeout_ms: u32,
    /// How long a client may leave unread what is sent to it.
    #[serde(deserialize_with = "value::http_milliseconds")]
    pub stall_timeout_ms: u32,
    /// Names by which a reverse proxy on this machine is known, which passes requests on to the
    /// loopback address; lower case, without ports.
    #[serde(deserialize_with = "value::host_names")]
    pub hosts: Vec<String>,
}

impl HttpConfig {
    /// How long the head of a request may take, and then its body.
    #[must_use]
    pub fn request_timeout(&self) -> Duration {
        Duration::from_millis(self.request_timeout_ms.into())
    }

    /// How long a client may leave unread what is sent to it.
    #[must_use]
    pub fn stall_timeout(&self) -> Duration {
        Duration::from_millis(self.stall_timeout_ms.into())
    }
}

impl Default for HttpConfig {
    fn default() -> Self {
        Self {
            connections: 256,
            listeners: 64,
            request_timeout_ms: 10_000,
            stall_timeout_ms: 30_000,
            hosts: Vec::new(),
        }
    }
}
