//! See [`relief_fuzz::step`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| relief_fuzz::step(data));
