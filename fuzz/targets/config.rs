//! See [`relief_fuzz::config`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| relief_fuzz::config(data));
