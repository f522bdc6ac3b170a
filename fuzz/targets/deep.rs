#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| starpipe_fuzz::target("deep")(data));
