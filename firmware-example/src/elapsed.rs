//! Milliseconds since the start, by a counter that comes round.

use core::num::NonZeroU32;

/// Follows a counter of `bits` bits: it must be looked at more than once a round.
#[derive(Clone, Copy, Debug)]
pub struct Elapsed {
    /// Ticks of a millisecond.
    per_millisecond: NonZeroU32,
    /// Ones, as many as the counter has.
    mask: u32,
    last: u32,
    rest: u32,
    milliseconds: u32,
}

impl Elapsed {
    /// From now on, where the counter stands at zero.
    pub const fn new(bits: u32, per_millisecond: NonZeroU32) -> Self {
        Self { per_millisecond, mask: u32::MAX >> (32 - bits), last: 0, rest: 0, milliseconds: 0 }
    }

    /// The counter stands at `now`; milliseconds since the start, which come round after 49 days.
    pub fn at(&mut self, now: u32) -> u32 {
        let ticks = now.wrapping_sub(self.last) & self.mask;
        self.last = now;
        self.rest += ticks % self.per_millisecond;
        let carried = self.rest / self.per_millisecond;
        self.rest %= self.per_millisecond;
        self.milliseconds =
            self.milliseconds.wrapping_add(ticks / self.per_millisecond).wrapping_add(carried);
        self.milliseconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks at a counter every `step` ticks for so many; what it says at the end, ms.
    fn followed(bits: u32, per_millisecond: u32, step: u64, ticks: u64) -> u32 {
        let mut elapsed = Elapsed::new(bits, NonZeroU32::new(per_millisecond).expect("not zero"));
        let mask = u64::from(u32::MAX >> (32 - bits));
        let looks = (1..=ticks / step).map(|look| elapsed.at(((look * step) & mask) as u32));
        looks.last().expect("it was looked at")
    }

    #[test]
    fn time_is_right_over_many_rounds_however_often_the_counter_is_looked_at() {
        // A day of 24 bits at 25 MHz, looked at hardly more than once a round, and oftener.
        let day = 86_400_000u64;
        for step in [(1 << 24) - 1, 9_999_991, 12_345_677] {
            let ticks = day * 25_000 / step * step;
            assert_eq!(u64::from(followed(24, 25_000, step, ticks)), ticks / 25_000, "every {step}");
        }
        // A fortnight of 32 bits at 1 MHz.
        for step in [2_000_000, (1 << 31) + 7] {
            let ticks = 14 * day * 1_000 / step * step;
            assert_eq!(u64::from(followed(32, 1_000, step, ticks)), ticks / 1_000, "every {step}");
        }
    }
}
