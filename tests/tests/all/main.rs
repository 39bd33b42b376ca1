//! Tests through several crates, without a service.

mod background;
mod fuzz_corpora;
mod outline;
mod shapes;
