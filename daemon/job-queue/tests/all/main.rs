//! The queue on a real `nats-server`.
//!
//! Without that program the tests are skipped, unless `RELIEF_NEEDS_NATS` is set.

mod depot;
mod jetstream;
mod server;
