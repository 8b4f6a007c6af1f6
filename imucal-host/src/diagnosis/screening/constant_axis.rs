//! An axis that shows one value in all rows: broken, not connected, or of fewer axes than its columns say.
//!
//! Nothing of it can be fitted, and its noise is none. Not looked for: an axis that stands still for a while, which
//! `P.stuck_samples` names.

use crate::recording::{Recording, SensorKind};

/// Fewer usable rows show no constant.
const FEWEST: usize = 20;

/// What to say of a sensor with such an axis, which is left out; `None` where all axes change.
pub fn remark(recording: &Recording, kind: SensorKind, usable: &[bool]) -> Option<String> {
    let values = &recording.sensor(kind)?.values;
    let rows = || values.iter().zip(usable).filter(|(_, usable)| **usable).map(|(value, _)| value);
    let first = rows().next().filter(|_| rows().count() >= FEWEST)?;
    let axis = (0..3).find(|axis| rows().all(|value| value[*axis] == first[*axis]))?;
    Some(format!(
        "the {kind} is left out: its {} axis shows the same value in all rows; mend the sensor or its column",
        crate::effect::XYZ[axis]
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::robot::{RobotKind, RobotScene};

    #[test]
    fn an_axis_that_never_changes_is_named_and_one_that_does_once_is_not() {
        let scene = RobotScene { kind: RobotKind::Wheeled, duration: 40.0, ..RobotScene::default() };
        let mut real = scene.record("constant").unwrap().real;
        let usable = vec![true; real.rows()];
        let of = |real: &Recording| remark(real, SensorKind::Gyr, &usable);
        assert_eq!(of(&real), None);
        real.gyr.iter_mut().flat_map(|gyr| &mut gyr.values).for_each(|rate| rate.y = 0.5);
        assert!(of(&real).is_some_and(|remark| remark.contains("its y axis")));
        real.gyr.iter_mut().flat_map(|gyr| gyr.values.last_mut()).for_each(|rate| rate.y = 0.6);
        assert_eq!(of(&real), None);
    }
}
