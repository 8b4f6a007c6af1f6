//! A user's own effects of the trials with robots, where the user brings none: from a file in the notation of
//! [`crate::effect::user`]. They are candidates of the pairs that they are drawn for, and of no others.

use std::{path::Path, sync::LazyLock};

use crate::{
    blind::trial::OwnEffects,
    effect::{Effect, user},
};

/// The file.
const TEXT: &str = include_str!("own_effects.toml");

/// Its effects.
pub static OWN: LazyLock<Vec<&'static Effect>> =
    LazyLock::new(|| user::parse(TEXT, Path::new("own_effects.toml")).unwrap_or_default());

/// Those that are drawn: the user's, or the file's.
pub(super) fn drawn(own: &OwnEffects) -> &[&'static Effect] {
    if own.drawn().is_empty() { &OWN } else { own.drawn() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{blind::robot::outside, effect::CATALOGUE};

    #[test]
    fn they_are_of_all_sensors_and_known_to_nothing_else() {
        assert_eq!(OWN.len(), 6);
        for sensor in ["acc", "gyr", "mag"] {
            let of_sensor = OWN.iter().filter(|effect| effect.id.starts_with(sensor));
            assert_eq!(of_sensor.count(), 2, "{sensor}");
        }
        let known = CATALOGUE.iter().chain(outside::SPOKEN.iter()).chain(outside::UNSPOKEN.iter());
        assert!(known.into_iter().all(|known| OWN.iter().all(|own| own.id != known.id)));
    }
}
