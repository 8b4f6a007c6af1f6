//! The latest of some stretches of time: the one that goes on, and the three before it, each where it was made.

/// As many places.
const PLACES: u8 = 4;

/// Four places in turn. Nothing is moved as time goes on, since a device moves memory slowly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring<V> {
    places: [V; PLACES as usize],
    /// The place of the one that goes on.
    now: u8,
    /// Places before it that hold something.
    whole: u8,
}

impl<V: Copy> Ring<V> {
    /// One that goes on, and none before.
    pub(super) fn new(first: V) -> Self {
        Self { places: [first; PLACES as usize], now: 0, whole: 0 }
    }
}

impl<V> Ring<V> {
    /// The one that goes on.
    #[inline]
    pub(super) fn now(&mut self) -> &mut V {
        let [a, b, c, d] = &mut self.places;
        match self.now % PLACES {
            0 => a,
            1 => b,
            2 => c,
            _ => d,
        }
    }

    /// The one so many before it, up to three; `None` where there was none.
    #[inline]
    pub(super) fn before(&self, back: u8) -> Option<&V> {
        let [a, b, c, d] = &self.places;
        let place = match self.now.wrapping_sub(back) % PLACES {
            0 => a,
            1 => b,
            2 => c,
            _ => d,
        };
        (back <= self.whole).then_some(place)
    }

    /// Another one goes on; the oldest is forgotten.
    #[inline]
    pub(super) fn turn(&mut self, next: V) -> &mut V {
        self.now = self.now.wrapping_add(1) % PLACES;
        self.whole = self.whole.saturating_add(1).min(PLACES - 1);
        let now = self.now();
        *now = next;
        now
    }

    /// There was none before the one that goes on.
    #[inline]
    pub(super) fn forget(&mut self) {
        self.whole = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_before_the_one_that_goes_on_are_kept_in_order() {
        let mut ring = Ring::new(10);
        assert_eq!((*ring.now(), ring.before(1)), (10, None));
        for next in 11..18 {
            *ring.turn(next) += 100;
        }
        let before = [1, 2, 3].map(|back| ring.before(back).copied());
        assert_eq!((*ring.now(), before), (117, [Some(116), Some(115), Some(114)]));
        assert_eq!(ring.before(4), None);
        ring.forget();
        assert_eq!((*ring.now(), ring.before(1)), (117, None));
    }
}
