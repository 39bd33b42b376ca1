//! See [`relief_fuzz::protocol`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| relief_fuzz::protocol(data));
