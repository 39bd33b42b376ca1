//! The queue on a real `nats-server`.
//!
//! Without that program the tests are skipped, unless `RELIEF_NEEDS_NATS` is set.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

mod bench;
mod cluster;
mod credentials;
mod depot;
mod jetstream;
mod link;
mod login;
mod roles;
mod server;
