//! Classes of effects that count as one answer: the contract's, and nowhere else.

/// Classes of more than one effect; every other id stands alone.
pub const CLASSES: [&[&str]; 5] = [
    &["mag.motor_current", "mag.eddy_current", "mag.bandwidth"],
    &["gyr.angular_acceleration", "gyr.bandwidth"],
    &["rig.encoder_offset", "rig.wobble", "rig.axis_nonorthogonality"],
    &["acc.lever_arm", "acc.inner_lever_arm"],
    &["mag.gimbal_hard_iron_outer", "mag.gimbal_soft_iron_outer"],
];

/// The class of an id, by its first member.
pub fn class(id: &str) -> &str {
    let of = CLASSES.iter().find(|class| class.contains(&id));
    of.and_then(|class| class.first()).copied().unwrap_or(id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{CATALOGUE, find};

    /// As the contract writes them.
    const CONTRACT: &str = "{`mag.motor_current`, `mag.eddy_current`, `mag.bandwidth`}; \
        {`gyr.angular_acceleration`, `gyr.bandwidth`}; \
        {`rig.encoder_offset`, `rig.wobble`, `rig.axis_nonorthogonality`}; {`acc.lever_arm`, `acc.inner_lever_arm`}; \
        {`mag.gimbal_hard_iron_outer`, `mag.gimbal_soft_iron_outer`}";

    #[test]
    fn the_classes_are_the_contract_s() {
        let written: Vec<Vec<&str>> =
            CONTRACT.split(';').map(|class| class.split('`').skip(1).step_by(2).collect()).collect();
        assert_eq!(written, CLASSES.map(<[_]>::to_vec));
    }

    #[test]
    fn every_member_is_in_the_catalogue_and_in_one_class() {
        let members: Vec<&str> = CLASSES.concat();
        for (at, member) in members.iter().enumerate() {
            assert!(find(member).is_some() && !members[..at].contains(member), "{member}");
        }
    }

    #[test]
    fn an_effect_without_fellows_is_a_class_of_its_own() {
        assert_eq!(class("mag.bandwidth"), class("mag.eddy_current"));
        assert_ne!(class("gyr.bandwidth"), class("mag.bandwidth"));
        assert_eq!(class("rig.encoder_harmonic"), "rig.encoder_harmonic");
        let alone = CATALOGUE.iter().filter(|effect| class(&effect.id) == effect.id).count();
        assert_eq!(alone, CATALOGUE.len() - CLASSES.concat().len() + CLASSES.len());
    }
}
