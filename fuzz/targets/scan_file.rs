//! See [`relief_fuzz::scan_file`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| relief_fuzz::scan_file(data));
