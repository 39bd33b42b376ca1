//! All tests of the wire protocol.

mod page;
mod properties;
mod versioning;
