//! Mitsuba's `.vol` grids.

#![no_main]

use drt_medium::vol::{decode, encode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(volume) = decode(bytes, "fuzz.vol") {
        let written = encode(&volume).expect("what was read can be written");
        let again = decode(&written, "again.vol").expect("what was written can be read");
        assert!(encode(&again).is_ok_and(|again| again == written));
    }
});
