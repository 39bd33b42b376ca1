//! See [`relief_fuzz::http`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| relief_fuzz::http(data));
