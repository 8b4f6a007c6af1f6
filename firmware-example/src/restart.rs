//! Why the device has started: words in memory that a reset leaves alone and a power-on fills with anything.
//!
//! ```text
//! ├───────┼───────┼─────────┼────────┼───────┤
//! │ magic │ cause │ address │ resets │ check │   u32 each; check: the complement of the sum of the four before it
//! └───────┴───────┴─────────┴────────┴───────┘
//! ```
//!
//! A run begins by writing that it ends without a word, which is what it says if nothing comes after that: a reset by
//! a pin or by a debugger. Its handlers write what they know before they reset the device.

use imucal_core::link::{LastReset, ResetCause};

/// The words.
pub type Words = [u32; 5];

const MAGIC: u32 = u32::from_le_bytes(*b"IMUR");

/// What the words say of the run before; they are then those of the run that begins.
pub fn begin(words: &mut Words) -> LastReset {
    let last = match read(words) {
        Some(last) => LastReset { resets: last.resets.saturating_add(1), ..last },
        None => LastReset { cause: ResetCause::PowerOn, address: 0, resets: 0 },
    };
    *words = written(&LastReset { cause: ResetCause::Unannounced, address: 0, ..last });
    last
}

/// The words of a run that ends so.
pub fn end(words: &mut Words, cause: ResetCause, address: u32) {
    let resets = read(words).map_or(0, |run| run.resets);
    *words = written(&LastReset { cause, address, resets });
}

fn written(last: &LastReset) -> Words {
    let words @ [a, b, c, d] = [MAGIC, last.cause as u32, last.address, last.resets];
    [a, b, c, d, check(words)]
}

fn check(words: [u32; 4]) -> u32 {
    !words.iter().fold(0u32, |sum, word| sum.wrapping_add(*word))
}

fn read(words: &Words) -> Option<LastReset> {
    let [magic, number, address, resets, stored] = *words;
    let cause = ResetCause::ALL.into_iter().find(|cause| *cause as u32 == number)?;
    let intact = magic == MAGIC && stored == check([magic, number, address, resets]);
    intact.then_some(LastReset { cause, address, resets })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_run_ended_by_is_reported_to_the_next_and_to_no_other() {
        let mut words = [0xA5A5_A5A5; 5];
        let power_on = LastReset { cause: ResetCause::PowerOn, address: 0, resets: 0 };
        assert_eq!(begin(&mut words), power_on);
        for (resets, cause) in (1..).zip(ResetCause::ALL) {
            end(&mut words, cause, 0x1234);
            assert_eq!(begin(&mut words), LastReset { cause, address: 0x1234, resets });
            assert_eq!(begin(&mut words.clone()).cause, ResetCause::Unannounced);
        }
    }

    #[test]
    fn a_word_that_has_lost_a_bit_makes_it_a_power_on() {
        let mut words = [0; 5];
        begin(&mut words);
        end(&mut words, ResetCause::Fault, 0x1234_5678);
        for bit in 0..160 {
            let mut damaged = words;
            damaged[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(begin(&mut damaged).cause, ResetCause::PowerOn, "bit {bit}");
        }
    }
}
