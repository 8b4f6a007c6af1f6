//! Progress on work of over two seconds; nothing in a pipe.

use std::{
    io::IsTerminal,
    path::Path,
    thread,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output::{self, Volume};
use crate::file::metered::bytes_read;

/// Work shorter than this shows nothing.
const QUIET: Duration = Duration::from_secs(2);
/// How often it is drawn.
const TICK: Duration = Duration::from_millis(120);

/// What is being done, of which no end is known.
const STAGE: &str = "{spinner} {elapsed} {wide_msg}";
/// What is counted, with the time that is left.
const COUNT: &str = "{bar:24} {pos} of {len} {msg}, {eta} left";
/// A recording as it is read.
const BYTES: &str = "{bar:24} {bytes} of {total_bytes} {msg}, {eta} left";

/// A line that says what is being done, once it takes long; each stage on a line of its own where more is asked for.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    begun: Instant,
}

impl Progress {
    /// Starts counting.
    pub fn start() -> Self {
        Self::drawn(
            ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden()).with_style(style(STAGE)),
            None,
        )
    }

    /// The same, of so many things, which have a name.
    pub fn of(all: usize, name: &str) -> Self {
        let bar = ProgressBar::with_draw_target(Some(all as u64), ProgressDrawTarget::hidden());
        Self::drawn(bar.with_style(style(COUNT)).with_message(name.to_owned()), None)
    }

    /// The same, of the bytes of a recording that is read from now on; of its stage alone where its length is not known.
    pub fn reading(path: &Path) -> Self {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let read = match path.metadata() {
            Ok(file) if file.is_file() => {
                let bar = ProgressBar::with_draw_target(Some(file.len()), ProgressDrawTarget::hidden());
                Self::drawn(
                    bar.with_style(style(BYTES)).with_message(format!("of {name}")),
                    Some(bytes_read()),
                )
            }
            _ => Self::start(),
        };
        read.verbose(&format!("reading {name}"));
        read
    }

    /// Draws it once it takes long. A reader's bytes are looked at from `read` on.
    fn drawn(bar: ProgressBar, read: Option<u64>) -> Self {
        if std::io::stderr().is_terminal() && output::volume() == Volume::Usual {
            let shown = bar.clone();
            thread::spawn(move || {
                thread::sleep(QUIET);
                if !shown.is_finished() {
                    shown.set_draw_target(ProgressDrawTarget::stderr());
                }
                while !shown.is_finished() {
                    if let Some(before) = read {
                        shown.set_position(bytes_read().saturating_sub(before));
                    }
                    shown.tick();
                    thread::sleep(TICK);
                }
            });
        }
        Self { bar, begun: Instant::now() }
    }

    /// Says what is being done now.
    pub fn stage(&self, what: &str) {
        self.verbose(what);
        self.bar.set_message(what.to_owned());
    }

    /// Says how many are done.
    pub fn done(&self, count: usize) {
        self.verbose(&format!("{count} of {} {}", self.bar.length().unwrap_or_default(), self.bar.message()));
        self.bar.set_position(count as u64);
    }

    fn verbose(&self, what: &str) {
        if output::volume() == Volume::Verbose {
            let seconds = self.begun.elapsed().as_secs_f64();
            output::report("stage", &format_args!("{seconds:.1} s: {what}"));
        }
    }
}

/// A template of this file; they are tested.
fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_spinner())
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_template_is_understood() {
        for template in [STAGE, COUNT, BYTES] {
            assert!(ProgressStyle::with_template(template).is_ok(), "{template}");
        }
    }

    #[test]
    fn what_is_counted_knows_its_end() {
        let progress = Progress::of(40, "cases");
        progress.done(7);
        assert_eq!((progress.bar.position(), progress.bar.length()), (7, Some(40)));
        assert_eq!(progress.bar.message(), "cases");
    }
}
