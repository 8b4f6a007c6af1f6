//! A recording's clock that runs unevenly against that of a stream: `clk.jump` and `clk.wander`, taken into account before any
//! fit.

use crate::{
    diagnosis::{finding::Amount, reference::clock_steadiness::Steadiness, screening::conventions::Finding},
    effect::{self, clock_jump, clock_wander},
};

/// The jumps and the wander of a clock, as faults of the recording.
pub fn findings(steadiness: &Steadiness) -> Vec<Finding> {
    let wander = steadiness.wander.and_then(|rms| {
        let amplitude = Some(std::f64::consts::SQRT_2 * rms);
        Finding::new(clock_wander::ID, &[(amplitude, None), (None, None)], steadiness.p_value)
    });
    jumps(steadiness).into_iter().chain(wander).collect()
}

/// All jumps as one finding; `None` without one.
fn jumps(steadiness: &Steadiness) -> Option<Finding> {
    let effect = effect::find(clock_jump::ID).filter(|_| !steadiness.jumps.is_empty())?;
    let mut parameters = Vec::new();
    for (at, jump) in steadiness.jumps.iter().enumerate() {
        let mut add = |name: &str, value: f64, std_error: f64| {
            let name = if at == 0 { name.to_owned() } else { format!("{name}_{}", at + 1) };
            let (value, std_error) = (Some(value), Some(std_error));
            parameters.push(Amount { name, value, std_error, unit: "s".to_owned() });
        };
        add("jump", jump.by, jump.error);
        let (middle, length) =
            (0.5 * (jump.within.start + jump.within.end), jump.within.end - jump.within.start);
        // Anywhere within it alike.
        add("t_start", middle, length / libm::sqrt(12.0));
    }
    Some(Finding { effect, parameters, p_value: steadiness.p_value })
}

/// What was done about an uneven clock, for a reader; `None` of an even one.
pub fn remark(steadiness: &Steadiness) -> Option<String> {
    match (steadiness.wander, steadiness.jumps.len()) {
        (Some(rms), _) => Some(format!(
            "the times of the rows wander against the simulator's clock by {:.1} ms root mean square: the diagnosis follows it by \
             windows of five seconds, and what changes faster remains a gap",
            1e3 * rms
        )),
        (None, 0) => None,
        (None, jumps) => Some(format!(
            "the clock jumps {} against the simulator's: the diagnosis takes that into account, and leaves the rows out at which the \
             clock may have jumped already or not yet",
            if jumps == 1 { "once".to_owned() } else { format!("{jumps} times") }
        )),
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        diagnosis::{Diagnosis, Options, diagnose, finding::Cause},
        effect,
        recording::{Recording, Stream},
        simulator::{
            Dose,
            robot::{RobotKind, RobotScene},
        },
    };

    fn scene(kind: RobotKind, id: Option<(&str, Vec<f64>)>, seed: u64) -> RobotScene {
        let dose = |(id, values)| Dose { effect: effect::find(id).unwrap(), values };
        let doses = id.map(dose).into_iter().collect();
        RobotScene { kind, duration: 100.0, doses, seed, clock_offset: 0.02, ..RobotScene::default() }
    }

    fn diagnosed(real: &Recording, simulated: &Recording) -> Diagnosis {
        diagnose(real, &Options { stream: Stream::of(simulated), ..Options::default() }, &|_| ())
    }

    fn cause<'d>(diagnosis: &'d Diagnosis, id: &str) -> Option<&'d Cause> {
        diagnosis.causes.iter().find(|cause| cause.effect == id)
    }

    fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
        diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect()
    }

    const KINDS: [RobotKind; 3] = [RobotKind::Legged, RobotKind::Wheeled, RobotKind::Flying];

    #[test]
    fn a_jump_is_found_with_its_size_and_no_motion_is_blamed_for_it() {
        for (seed, kind) in KINDS.into_iter().enumerate() {
            for jump in [0.04, -0.015] {
                let pair =
                    scene(kind, Some(("clk.jump", vec![jump, 47.0])), seed as u64).record("jump").unwrap();
                let diagnosis = diagnosed(&pair.real, &pair.simulated);
                let found =
                    cause(&diagnosis, "clk.jump").unwrap_or_else(|| panic!("{kind:?} {:?}", ids(&diagnosis)));
                let [size, start] = &found.parameters[..] else { panic!("one jump: {found:?}") };
                let (value, error) = (size.value.unwrap(), size.std_error.unwrap());
                assert!(
                    (value - jump).abs() < 3.0 * error && error < 2e-3,
                    "{kind:?} {jump}: {value} {error}"
                );
                assert!((start.value.unwrap() - 47.0).abs() < 1.0, "{kind:?} {jump}: {start:?}");
                assert!(
                    cause(&diagnosis, "ref.motion_mismatch").is_none(),
                    "{kind:?} {jump}: {:?}",
                    ids(&diagnosis)
                );
            }
        }
    }

    #[test]
    fn a_wander_is_followed_and_no_motion_is_blamed_for_it() {
        for (seed, kind) in KINDS.into_iter().enumerate() {
            let pair =
                scene(kind, Some(("clk.wander", vec![0.012, 70.0])), seed as u64).record("wander").unwrap();
            let diagnosis = diagnosed(&pair.real, &pair.simulated);
            let found =
                cause(&diagnosis, "clk.wander").unwrap_or_else(|| panic!("{kind:?} {:?}", ids(&diagnosis)));
            let amplitude = found.parameters[0].value.unwrap();
            assert!((amplitude - 0.012).abs() < 0.003, "{kind:?}: {amplitude}");
            assert!(cause(&diagnosis, "ref.motion_mismatch").is_none(), "{kind:?}: {:?}", ids(&diagnosis));
        }
    }

    #[test]
    fn a_slow_gyroscope_is_no_clock_that_wanders() {
        for kind in [RobotKind::Wheeled, RobotKind::Flying] {
            let pair = scene(kind, Some(("gyr.bandwidth", vec![0.08, 0.0])), 3).record("slow").unwrap();
            let diagnosis = diagnosed(&pair.real, &pair.simulated);
            let found = ids(&diagnosis);
            assert!(
                cause(&diagnosis, "gyr.bandwidth").is_some(),
                "{kind:?}: {found:?} {:?}",
                diagnosis.remarks
            );
            assert!(cause(&diagnosis, "clk.wander").is_none(), "{kind:?}: {found:?}");
        }
    }

    #[test]
    fn a_clock_that_runs_evenly_neither_jumps_nor_wanders() {
        for (seed, kind) in KINDS.into_iter().enumerate() {
            let pair = scene(kind, None, 20 + seed as u64).record("even").unwrap();
            let diagnosis = diagnosed(&pair.real, &pair.simulated);
            for id in ["clk.jump", "clk.wander"] {
                assert!(cause(&diagnosis, id).is_none(), "{kind:?} {seed}: {:?}", ids(&diagnosis));
            }
        }
    }
}
