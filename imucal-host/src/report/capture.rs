//! The guide of a session, in sentences.

use imucal_core::{
    record::Sensor,
    session::{
        SessionSettings,
        alignment::NotAligned,
        guide::{Advice, Guide},
    },
};

use super::{
    measure::{counted, plain, rounded},
    table::words,
};
use crate::recording::SensorKind;

/// An axis whose share of a direction is below this does not belong to it.
const SHARE: f32 = 0.3;

/// What to do next.
pub fn advice(advice: &Advice, hold: f32) -> String {
    match advice {
        Advice::HoldStill => "lay the sensor down and leave it still".into(),
        Advice::HoldOn => "keep it still".into(),
        Advice::Turn(to) => {
            format!("turn it until {} up, then keep it still for {hold:.0} s", pointing(to))
        }
        Advice::TurnAbout(to) => {
            format!("turn it about until the magnetometer's {} along the field", pointing(to))
        }
        Advice::CorrectAxes => {
            "end here: the sensors disagree on the axes, which no further pose mends".into()
        }
        Advice::Enough => "enough: every sensor has reached its target".into(),
    }
}

/// `x points`, `x and −z point`.
fn pointing(direction: &[f32; 3]) -> String {
    let axes: Vec<String> = ["x", "y", "z"]
        .into_iter()
        .zip(direction.iter())
        .filter(|(_, share)| share.abs() > SHARE)
        .map(|(name, share)| format!("{}{name}", if *share < 0.0 { "−" } else { "+" }))
        .collect();
    match axes.as_slice() {
        [one] => format!("{one} points"),
        [first, second] => format!("{first} and {second} point"),
        all => format!("{} point", all.join(", ")),
    }
}

/// One line: when, what there is so far, what to do next.
pub fn line(time: f64, guide: &Guide, hold: f32, recorded: &[SensorKind]) -> String {
    let sure: String = recorded
        .iter()
        // An error as large as the vector itself says no more than that there is none yet.
        .filter_map(|kind| Some((kind, guide.error[*kind as usize].filter(|error| *error < 1.0)?)))
        .map(|(kind, error)| format!(", {kind} {} %", percent(error)))
        .collect();
    let never = if guide.never_still { " (it has moved since the beginning)" } else { "" };
    let next = advice(&guide.advice, hold);
    format!("{:>8} s  {}{sure}: {next}{never}", rounded(time, 1), counted(guide.rests, "pose"))
}

/// How sure each recorded sensor is, what is covered, and what was thrown away; ends its lines.
pub fn state(guide: &Guide, settings: &SessionSettings, recorded: &[SensorKind]) -> String {
    let mut text = String::new();
    for kind in recorded {
        let at = *kind as usize;
        let (error, target) = (guide.error[at], settings.target[at]);
        let sure = error.filter(|error| *error < 1.0).map_or("no fit yet".into(), |error| {
            let accepted = if guide.accepted[at] { "accepted" } else { "not accepted yet" };
            format!("{accepted}, expected error {} %", percent(error))
        });
        text += &format!("  {:<14} {sure}; target {} %\n", words(*kind), percent(target));
    }
    text += &format!(
        "  coverage       {:.0} % of the directions by {}; {}, {} of the field\n",
        100.0 * guide.coverage,
        counted(guide.rests, "pose"),
        counted(guide.turns, "turn"),
        counted(guide.points, "place")
    );
    let thrown = guide.thrown;
    let reasons = [
        (thrown.rests, "rest", "too short or too noisy"),
        (thrown.turns, "turn", "with a gap or a clipped sample"),
        (thrown.clipped, "sample", "beyond the sensor's range"),
        (thrown.forgotten, "pose", "for want of room"),
    ];
    for (count, what, why) in reasons.into_iter().filter(|(count, ..)| *count > 0) {
        text += &format!("  left out       {}, {why}\n", counted(count, what));
    }
    text
}

/// Whose axes a magnetometer's calibration is in: the standard error of its rotation into the accelerometer's, rad, or why it was
/// not turned.
pub fn axes(turned: Result<f32, NotAligned>) -> String {
    let why = match turned {
        Ok(error) => {
            let degrees = rounded(f64::from(error).to_degrees(), 2);
            return format!("magnetometer in the accelerometer's axes, to {degrees}°");
        }
        Err(NotAligned::Already) => return "magnetometer in the accelerometer's axes".into(),
        Err(NotAligned::NotAccepted(Sensor::Magnetometer)) => "it is not accepted".into(),
        Err(NotAligned::NotAccepted(_)) => "no accelerometer is accepted".into(),
        Err(NotAligned::TooFewRests { have, need }) => {
            format!("the field was measured at {have} rests of the {need} that are needed")
        }
        Err(NotAligned::Mirrored) => {
            "the dip comes out the other way than at [site], so it or the accelerometer is mirrored".into()
        }
        Err(NotAligned::MountOrMirror) => "it is mounted in another order of the axes, or mirrored".into(),
        Err(NotAligned::Unsure { error, .. }) if error.is_nan() => {
            "the rests do not show how it lies; tilt the sensor in more directions".into()
        }
        Err(NotAligned::Unsure { error, most }) => {
            let [error, most] = [error, most].map(|angle| rounded(f64::from(angle).to_degrees(), 1));
            format!(
                "the rests show how it lies to {error}° alone, {most}° are needed; tilt the sensor in more directions"
            )
        }
    };
    format!("magnetometer in axes of its own: {why}")
}

fn percent(share: f32) -> String {
    plain(100.0 * f64::from(share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whose_axes_a_magnetometer_is_in_is_said_with_the_reason() {
        assert_eq!(axes(Ok(0.0035)), "magnetometer in the accelerometer's axes, to 0.20°");
        let few = axes(Err(NotAligned::TooFewRests { have: 5, need: 8 }));
        let expected =
            "magnetometer in axes of its own: the field was measured at 5 rests of the 8 that are needed";
        assert_eq!(few, expected);
        let unsure = axes(Err(NotAligned::Unsure { error: 0.1, most: 0.035 }));
        assert!(unsure.contains("to 5.7° alone, 2.0° are needed"), "{unsure}");
        assert!(
            axes(Err(NotAligned::Unsure { error: f32::NAN, most: 0.035 }))
                .contains("do not show how it lies")
        );
    }

    #[test]
    fn a_direction_is_said_by_the_axes_that_point_there() {
        let said = |x: f32, y: f32, z: f32| {
            advice(&Advice::Turn(nalgebra::Vector3::new(x, y, z).normalize().into()), 2.0)
        };
        assert_eq!(said(0.0, 0.0, -1.0), "turn it until −z points up, then keep it still for 2 s");
        assert_eq!(said(1.0, 0.0, -1.0), "turn it until +x and −z point up, then keep it still for 2 s");
        assert_eq!(said(1.0, 1.0, -1.0), "turn it until +x, +y, −z point up, then keep it still for 2 s");
    }
}
