//! NanoVDB's grids.

#![no_main]

use drt_medium::nanovdb::{decode, encode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(volume) = decode(bytes, "fuzz.nvdb", None)
        && let Ok(written) = encode(&volume)
    {
        let again = decode(&written, "again.nvdb", None).expect("what was written can be read");
        assert!(again.grid == volume.grid && again.name == volume.name);
    }
});
