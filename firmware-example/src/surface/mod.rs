//! Every public function of the core, called once with what the compiler cannot know: what the gate links.
//!
//! A function that no image calls is in none, and its panic paths with it. `tests/surface.rs` reads the core's
//! sources and these, and fails where a public function is not reached here. In `f32`, as a device computes; generic
//! functions are those of some model, which stand for the others. The texts of `Refusal`, `Defect`, `IntegerRefusal`,
//! `EncodeError` and `DecodeError` are left out: the compiler's library keeps panic paths where it writes a number with decimals, so a
//! device names the reason instead.

use core::fmt::{self, Write};

/// Calls a function by its path from the core's root; neither its arguments nor its result are known to the compiler.
macro_rules! reach {
    ($($segment:ident)::+ ($($argument:expr),* $(,)?)) => {
        core::hint::black_box($($segment)::+($(core::hint::black_box($argument)),*))
    };
    // A result of kilobytes is looked at where it lies: each copy of it takes stack.
    ($($segment:ident)::+ ($($argument:expr),*), $look:path) => {
        $look(core::hint::black_box(&$($segment)::+($(core::hint::black_box($argument)),*)))
    };
}

mod arithmetic;
mod integer;
mod link;
mod model;
mod observation;
mod observer;
mod record;
mod session;
mod solver;
mod watch;

/// Calls them all.
pub fn reach_all() {
    arithmetic::reach_all();
    integer::reach_all();
    observation::reach_all();
    observer::reach_all();
    model::reach_all();
    solver::reach_all();
    record::reach_all();
    record::reach_higher_order();
    session::reach_all();
    watch::reach_all();
    link::reach_all();
}

/// Text that nobody reads.
struct Discard;

impl Write for Discard {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        core::hint::black_box(text);
        Ok(())
    }
}

/// Something that is written by a function.
struct Shown<F>(F);

impl<F: Fn(&mut fmt::Formatter<'_>) -> fmt::Result> fmt::Display for Shown<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (self.0)(f)
    }
}

/// Has text written.
fn write(text: impl Fn(&mut fmt::Formatter<'_>) -> fmt::Result) {
    // Nobody reads it, so nothing is lost.
    let _written = write!(Discard, "{}", Shown(text));
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_function_returns() {
        super::reach_all();
    }
}
