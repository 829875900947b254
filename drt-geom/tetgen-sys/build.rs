//! Builds the worker, which the library carries inside it.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/worker.cpp");
    #[cfg(feature = "system")]
    if let Err(sentence) = worker::build() {
        println!("cargo::error={sentence}");
    }
}

#[cfg(feature = "system")]
mod worker {
    use std::env;
    use std::path::Path;

    const SOURCE: &str = "src/worker.cpp";

    pub(super) fn build() -> Result<(), String> {
        if env::var_os("CARGO_CFG_UNIX").is_none() {
            return Err("TetGen's worker process is for Unix only: build without the feature \
                        `tetgen` (of tetgen-sys: `system`)"
                .into());
        }
        let out = env::var_os("OUT_DIR").ok_or("cargo gives no OUT_DIR")?;
        let program = Path::new(&out).join("worker");
        let compiler = cc::Build::new()
            .cpp(true)
            .define("TETLIBRARY", None)
            .opt_level(2)
            .debug(false)
            .try_get_compiler()
            .map_err(|e| format!("no C++ compiler was found: {e}"))?;
        let run = |arguments: &[&std::ffi::OsStr]| {
            compiler.to_command().args(arguments).status().map(|status| status.success()).map_err(
                |e| format!("the C++ compiler {} does not run: {e}", compiler.path().display()),
            )
        };
        let source = SOURCE.as_ref();
        if !run(&["-E".as_ref(), source, "-o".as_ref(), "/dev/null".as_ref()])? {
            return Err("TetGen's header tetgen.h was not found: install the library with its \
                        header (Debian: libtet1.5-dev) or build without the feature `tetgen`"
                .into());
        }
        if !run(&[source, "-o".as_ref(), program.as_os_str(), "-ltet".as_ref()])? {
            return Err("TetGen's worker could not be compiled and linked with -ltet: install \
                        the library (Debian: libtet1.5-dev) or build without the feature `tetgen`"
                .into());
        }
        Ok(())
    }
}
