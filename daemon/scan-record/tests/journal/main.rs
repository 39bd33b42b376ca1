//! The journal from outside: round trips, torn tails, going on, hostile bytes, version 1.

mod common;
mod continued;
mod durability;
mod hostile;
mod round_trip;
mod version_1;
mod version_2;
