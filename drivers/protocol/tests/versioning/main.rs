//! The bytes of every message, version by version.

mod v1;
mod v1_continue;
