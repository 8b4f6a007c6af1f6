//! The program `imucal`.

use std::process::ExitCode;

fn main() -> ExitCode {
    imucal_host::cli::run()
}
