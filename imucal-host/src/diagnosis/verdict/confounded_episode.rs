//! Episodes that last as long as a hand carries the sensor about.
//!
//! Where it lies before and after, the field may not be that of where it is turned: such an episode is distinguished from a change
//! of place by nothing in the recording.

use crate::diagnosis::{finding::Cause, residual::block::Block};

/// Share of the moving blocks at either end that may be a tracker's jerks.
const JERKS: f64 = 0.005;

/// Takes out of `causes` what begins and ends within `near` of the movement, s, and says so.
pub fn leave_out(causes: &mut Vec<Cause>, blocks: &[Block], near: f64) -> Vec<String> {
    let moving: Vec<f64> =
        blocks.iter().filter(|block| block.rest.is_none()).map(|block| block.time).collect();
    // A tracker's jerk or two at rest is no movement.
    let jerks = (JERKS * moving.len() as f64) as usize;
    let (Some(first), Some(last)) = (moving.get(jerks), moving.iter().rev().nth(jerks)) else {
        return Vec::new();
    };
    let (first, last) = (*first, *last);
    let time = |cause: &Cause, name: &str| {
        cause.parameters.iter().find(|amount| amount.name == name).and_then(|amount| amount.value)
    };
    let lasts = |cause: &mut Cause| {
        let ends = time(cause, "t_start").zip(time(cause, "t_end"));
        ends.is_some_and(|(start, end)| (start - first).abs() < near && (end - last).abs() < near)
    };
    let remark = |cause: Cause| {
        format!(
            "not asserted: {} from {first:.0} to {last:.0} s, for as long as the sensor is carried elsewhere; the surroundings \
             there would look the same",
            cause.effect
        )
    };
    causes.extract_if(.., lasts).map(remark).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::{finding::Amount, residual::block::cut, settings::Settings};

    fn episode(start: f64, end: Option<f64>) -> Cause {
        let amount =
            |name: &str, value| Amount { name: name.into(), value, std_error: None, unit: "s".into() };
        Cause {
            effect: "mag.bias_step".into(),
            probability: 1.0,
            equivalents: Vec::new(),
            parameters: vec![amount("t_start", Some(start)), amount("t_end", end)],
            material: true,
            gap_closed: None,
            gap_closed_ci95: None,
        }
    }

    #[test]
    fn an_episode_as_long_as_the_movement_is_left_out() {
        let time: Vec<f64> = (0..10_000).map(|k| 0.01 * f64::from(k)).collect();
        let moves: Vec<bool> = time.iter().map(|t| (30.0..80.0).contains(t)).collect();
        let blocks = cut(&time, &moves, 0.01, &Settings::default().residual);
        let mut causes = vec![episode(29.0, Some(81.5)), episode(28.0, Some(60.0)), episode(30.0, None)];
        let remarks = leave_out(&mut causes, &blocks, 3.0);
        assert_eq!((causes.len(), remarks.len()), (2, 1));
        assert!(remarks[0].contains("mag.bias_step from 30 to 80 s"), "{}", remarks[0]);
    }
}
