//! A stream of another movement than the recorded one.
//!
//! ```text
//! y = K v + b      g² = tr(K V Kᵀ) / tr V      V = Σ (v − v̄)(v − v̄)ᵀ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | y, v | samples, and what the stream gives at their times |
//! | K, b | gain, misalignment and turn of the mount together, and bias, by least squares |
//! | g | what a sensor repeats of its stream: near 1 however it is mounted and shaken, near 0 of another movement |
//!
//! Sizes of what is sensed find the clock, and those of two flights with the same rests agree well enough for that. Not looked
//! for: a stretch of another movement, which `ref.motion_mismatch` names.

use super::pairs::Pairs;
use crate::{diagnosis::reference::moments::Moments, recording::SensorKind};

/// A sensor follows its stream if it repeats this share of it,
const REPEATED: f64 = 0.5;
/// or if the stream explains this share of its samples' variance: in another unit it repeats another share.
const EXPLAINED: f64 = 0.3;

/// Why a stream is not that of the recorded movement: no sensor follows it, nor does the gyroscope, which any movement that
/// turns the unit shows. `None` where one does, or where nothing shows it.
pub(super) fn contradiction(pairs: &[Option<Pairs>; 3]) -> Option<String> {
    let moments = |kind: SensorKind| Some((kind, pairs[kind as usize].as_ref()?.trusted().moments()));
    let compared: Vec<(SensorKind, Moments)> = SensorKind::ALL.into_iter().filter_map(moments).collect();
    let shows_turns = compared.iter().any(|(kind, _)| *kind == SensorKind::Gyr);
    if !shows_turns || compared.iter().any(|(_, moments)| follows(moments)) {
        return None;
    }
    let shares = compared.iter().map(|(kind, moments)| {
        format!("{:.0} % of what the {kind} senses", 100.0 * (1.0 - moments.unexplained()).max(0.0))
    });
    Some(format!(
        "the stream is of another movement: at the clock that fits best it explains {}, whatever the gain and the mount; give \
         --sim what the simulator says of this recording's movement",
        shares.collect::<Vec<_>>().join(" and ")
    ))
}

fn follows(moments: &Moments) -> bool {
    let k = moments.sensitivity();
    let repeated = (k * moments.input * k.transpose()).trace() / moments.input.trace().max(f64::MIN_POSITIVE);
    repeated > REPEATED * REPEATED || moments.unexplained() < 1.0 - EXPLAINED
}

#[cfg(test)]
mod tests {
    use crate::{
        diagnosis::{
            screening::conventions,
            settings::{Settings, Source},
        },
        recording::{Recording, Stream, check::integrity::inspect},
        simulator::{
            StreamClock, Streamed,
            robot::{RobotKind, RobotScene},
        },
    };

    /// What the conventions say of a robot's recording and the stream of another, or of the same.
    fn checked(real: &Recording, stream: &Stream, scene: &RobotScene) -> Option<String> {
        let clock = StreamClock::default();
        let movement =
            Streamed::new(stream, clock, &real.time, vec![25.0; real.rows()], scene.place).unwrap();
        let source = Settings::preset(Source::Simulator).source;
        conventions::check(real, &inspect(real), &movement, source).contradiction
    }

    #[test]
    fn another_drive_or_flight_is_none_of_the_recording_s_and_its_own_is() {
        for (seed, kind) in [RobotKind::Legged, RobotKind::Wheeled, RobotKind::Flying].into_iter().enumerate()
        {
            let scene = RobotScene { kind, duration: 90.0, seed: seed as u64, ..RobotScene::default() };
            let other = RobotScene { seed: seed as u64 + 10, ..scene.clone() };
            let (own, other) = (scene.record("own").unwrap(), other.record("other").unwrap());
            let of_own = checked(&own.real, &Stream::of(&own.simulated).unwrap(), &scene);
            assert_eq!(of_own, None, "{kind:?}");
            let of_other = checked(&own.real, &Stream::of(&other.simulated).unwrap(), &scene);
            assert!(of_other.is_some_and(|why| why.contains("another movement")), "{kind:?}");
        }
    }
}
