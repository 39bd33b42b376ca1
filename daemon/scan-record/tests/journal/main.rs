//! The journal from outside: round trips, torn tails, hostile bytes, version 1.

mod common;
mod durability;
mod hostile;
mod round_trip;
mod version_1;
