//! See [`relief_fuzz::iges`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| relief_fuzz::iges(data));
