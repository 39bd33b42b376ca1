//! The bytes of every message, version by version.

mod v1;
