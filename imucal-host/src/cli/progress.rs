//! Progress on work of over two seconds; nothing in a pipe.

use std::{
    io::IsTerminal,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget};

use super::output::{self, Volume};

/// Work shorter than this shows nothing.
const QUIET: Duration = Duration::from_secs(2);

/// A line that says what is being done, once it takes long; each stage on a line of its own where more is asked for.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    begun: Instant,
}

impl Progress {
    /// Starts counting.
    pub fn start() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        if std::io::stderr().is_terminal() && output::volume() == Volume::Usual {
            let shown = bar.clone();
            std::thread::spawn(move || {
                std::thread::sleep(QUIET);
                if !shown.is_finished() {
                    shown.set_draw_target(ProgressDrawTarget::stderr());
                    shown.enable_steady_tick(Duration::from_millis(120));
                }
            });
        }
        Self { bar, begun: Instant::now() }
    }

    /// Says what is being done now.
    pub fn stage(&self, what: &str) {
        if output::volume() == Volume::Verbose {
            let seconds = self.begun.elapsed().as_secs_f64();
            output::report("stage", &format_args!("{seconds:.1} s: {what}"));
        }
        self.bar.set_message(what.to_owned());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
