use super::*;
use crate::{
    accept::{Quantity, Refusal},
    rotation::axis_order::{CODES, signed_permutation},
};

/// All axes reversed.
const REVERSED: usize = 7;

/// A session of twenty poses, of a unit one of whose sensors puts out its axes by a code.
fn session(sensor: usize, code: usize) -> Held {
    let (mut session, mut hand) = (Held::new(SessionSettings::default()), Hand::new(code as u64));
    let p = signed_permutation::<f64>(code).expect("a code");
    hand.truth[sensor].gain *= p.transpose();
    hand.rest(&mut session, 5.0);
    for k in 0..20u32 {
        let k = f64::from(k);
        let z = 1.0 - (2.0 * k + 1.0) / 20.0;
        let (sin, cos) = (2.4 * k).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        hand.pose(&mut session, &Vector3::new(radius * cos, radius * sin, z).cast());
    }
    session.finish();
    while session.work() {}
    session
}

fn code_of(session: &Held, sensor: Sensor) -> Option<usize> {
    match session.estimate(sensor).expect("an estimate").verdict {
        Ok(()) => None,
        Err(Refusal::Implausible { what: Quantity::Axes, value, .. }) => Some(value as usize),
        Err(other) => panic!("{sensor:?}: {other}"),
    }
}

#[test]
fn a_gyroscope_whose_axes_are_in_another_order_is_refused_by_the_code_that_mends_it() {
    for code in 0..CODES {
        let session = session(1, code);
        let (acc, gyr) = (code_of(&session, Sensor::Accelerometer), code_of(&session, Sensor::Gyroscope));
        assert_eq!(gyr, (code != 0).then_some(code));
        assert_eq!(session.guide().advice == Advice::CorrectAxes, code != 0, "{code}");
        // One that is turned may be right, and the accelerometer mirrored.
        let mirror = signed_permutation::<f64>(code).expect("a code").determinant() < 0.0;
        assert_eq!(acc.is_some(), code != 0 && (!mirror || code == REVERSED), "{code}");
    }
}

#[test]
fn an_accelerometer_whose_axes_are_in_another_order_is_refused_with_its_gyroscope() {
    for code in (1..CODES).filter(|code| *code != REVERSED) {
        let session = session(0, code);
        let p = signed_permutation::<f64>(code).expect("a code");
        let acc = code_of(&session, Sensor::Accelerometer);
        assert!(code_of(&session, Sensor::Gyroscope).is_some(), "{code}");
        // A mirror image is taken before a turn, since that is the more common error.
        let mend = if p.determinant() < 0.0 { p } else { -p };
        assert_eq!(acc.and_then(signed_permutation::<f64>), Some(mend), "{code}");
    }
}
