//! The queue on a real `nats-server`.
//!
//! Without that program the tests are skipped, unless `RELIEF_NEEDS_NATS` is set.

mod bench;
mod cluster;
mod cost;
mod depot;
mod jetstream;
mod link;
mod login;
mod roles;
mod server;
