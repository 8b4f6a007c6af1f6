//! What a signal that ends the program leaves behind: no part of a file.

/// From now on INT, TERM and HUP remove what is under way before they end the program.
#[cfg(unix)]
pub(super) fn watch() {
    use signal_hook::{
        consts::{SIGHUP, SIGINT, SIGTERM},
        iterator::Signals,
        low_level::emulate_default_handler,
    };

    use crate::file::abandon_parts;

    // What `nohup` or a shell has switched off stays off.
    let ignored = ignored();
    let heeded = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    // Without a handler the program ends as it always did, and the next one sweeps.
    let Ok(mut signals) = Signals::new(heeded) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            let _abandoned = abandon_parts();
            let _ = emulate_default_handler(signal);
        }
    });
}

/// Elsewhere the next program sweeps.
#[cfg(not(unix))]
pub(super) fn watch() {}

/// The signals that this process was started to ignore, a bit each from the lowest; none where the system does not
/// say.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
