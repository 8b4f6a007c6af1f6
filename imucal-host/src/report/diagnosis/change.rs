//! What to change in the simulator: for whoever keeps a simulator, by how much of the gap each change closes.

use std::fmt::{self, Write};

use super::{amount, share_words};
use crate::{
    diagnosis::{
        Diagnosis, Verdict,
        finding::{Cause, Gap},
    },
    effect::{self, motion_mismatch},
    report::prose::hanging,
};

/// What is left above the noise from this ratio on is reported.
const ABOVE_NOISE: f64 = 1.2;
/// Stretches repeat where this share of their distances are whole periods, to this share of a period.
const REPEATED: f64 = 0.8;
const NEAR: f64 = 0.15;
/// Fewer stretches than this show no period.
const FEWEST: usize = 4;

/// The changes, those that close most first; what is no sensor's stands last.
pub fn write_changes(text: &mut String, diagnosis: &Diagnosis) -> fmt::Result {
    if diagnosis.causes.is_empty() {
        return Ok(());
    }
    writeln!(text, "\nwhat to change in the simulator, what closes most of the gap first")?;
    let (own, of_reference) = changes(diagnosis);
    for (at, words) in own.iter().enumerate() {
        text.push_str(&hanging(&format!("  {}. ", at + 1), words));
    }
    for words in of_reference {
        text.push_str(&hanging("  -  ", &words));
    }
    Ok(())
}

/// The sensors' changes, those that close most first; then what is no sensor's.
pub(crate) fn changes(diagnosis: &Diagnosis) -> (Vec<String>, Vec<String>) {
    let mut causes: Vec<&Cause> = diagnosis.causes.iter().filter(|cause| !is_of_reference(cause)).collect();
    let closed = |cause: &Cause| cause.gap_closed.filter(|share| share.is_finite()).unwrap_or(-1.0);
    causes.sort_by(|a, b| closed(b).total_cmp(&closed(a)));
    let of_reference = diagnosis.causes.iter().filter(|cause| is_of_reference(cause)).map(|cause| {
        let words = match cause.effect == motion_mismatch::ID {
            true => motion(cause),
            false => change(cause),
        };
        format!("{words}: not the sensor")
    });
    (causes.into_iter().map(change).collect(), of_reference.collect())
}

fn is_of_reference(cause: &Cause) -> bool {
    cause.effect.starts_with("ref.")
}

/// `clk.time_offset, 61 % (59 to 63 %): offset 12.40 ± 0.10 ms`.
fn change(cause: &Cause) -> String {
    let share = match cause.gap_closed.filter(|share| share.is_finite()) {
        Some(share) => share_words(share, cause.gap_closed_ci95.unwrap_or([f64::NAN; 2])),
        None => "corrected before the gap was measured".to_owned(),
    };
    let amounts: Vec<String> = cause.parameters.iter().map(amount).collect();
    let remedy =
        effect::find(&cause.effect).map_or(String::new(), |effect| format!(". {}", effect.words.remedy));
    format!("{}, {share}: {}{}", cause.effect, amounts.join("; "), remedy.trim_end_matches('.'))
}

/// Where the machine moved otherwise, and how often.
fn motion(cause: &Cause) -> String {
    let values = |name: &str| -> Vec<f64> {
        let own = |of: &str| of == name || of.strip_prefix(name).is_some_and(|rest| rest.starts_with('_'));
        cause.parameters.iter().filter(|amount| own(&amount.name)).filter_map(|amount| amount.value).collect()
    };
    let (starts, ends) = (values("t_start"), values("t_end"));
    let lengths: Vec<f64> = starts.iter().zip(&ends).map(|(start, end)| end - start).collect();
    let when = match (starts.as_slice(), period(&starts)) {
        ([start], _) => format!("from {start:.1} to {:.1} s", start + lengths.first().unwrap_or(&0.0)),
        (_, Some((period, phase))) => {
            let length = middle(lengths.clone());
            format!("in {} stretches, {phase:.1}–{:.1} s of each {period:.1} s", starts.len(), phase + length)
        }
        _ => {
            let first = starts.iter().zip(&ends).take(3).map(|(start, end)| format!("{start:.1}–{end:.1}"));
            let more = if starts.len() > 3 { ", …" } else { "" };
            format!("in {} stretches ({}{more} s)", starts.len(), first.collect::<Vec<_>>().join(", "))
        }
    };
    let most = |name: &str, unit: &str| {
        let most = values(name).into_iter().reduce(f64::max)?;
        Some(format!("{most:.2} {unit}"))
    };
    let lacks: Vec<String> =
        [most("lacking_rate", "rad/s"), most("lacking_force", "m/s²")].into_iter().flatten().collect();
    let lacks = match lacks.is_empty() {
        true => String::new(),
        false => format!(", up to {} that the simulator lacks", lacks.join(" and ")),
    };
    format!("the real machine moved otherwise {when}, {:.1} s in all{lacks}", lengths.iter().sum::<f64>())
}

/// The period of starts, s, and where in it they lie, counted from zero; `None` where they do not repeat.
fn period(starts: &[f64]) -> Option<(f64, f64)> {
    if starts.len() < FEWEST {
        return None;
    }
    let apart: Vec<f64> = starts.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let rough = middle(apart.clone());
    let whole = |apart: &f64| (apart / rough).round().max(1.0);
    let near = |apart: &&f64| (*apart / rough - whole(apart)).abs() < NEAR;
    let repeats = apart.iter().filter(near).count() as f64;
    if rough <= 0.0 || repeats < REPEATED * apart.len() as f64 {
        return None;
    }
    let period = middle(apart.iter().filter(near).map(|apart| apart / whole(apart)).collect());
    // About the first, so that none is cut by the end of the period.
    let from_first = |start: &f64| {
        let turns = (start - starts[0]) / period;
        (turns - turns.round()) * period
    };
    let phase = middle(starts.iter().map(from_first).collect());
    Some((period, (starts[0] + phase).rem_euclid(period)))
}

fn middle(values: Vec<f64>) -> f64 {
    crate::recording::median(values).unwrap_or(0.0)
}

/// What is left after all changes.
pub fn write_remainder(text: &mut String, diagnosis: &Diagnosis) -> fmt::Result {
    if diagnosis.gap.is_empty() {
        return Ok(());
    }
    writeln!(text, "\nwhat remains")?;
    text.push_str(&hanging("  ", &remainder(diagnosis)));
    Ok(())
}

/// What is left, in words.
pub(crate) fn remainder(diagnosis: &Diagnosis) -> String {
    let above = |gap: &&Gap| gap.rms_after > ABOVE_NOISE * gap.noise_floor;
    let left: Vec<String> = diagnosis
        .gap
        .iter()
        .filter(above)
        .map(|gap| {
            let over = (gap.rms_after.powi(2) - gap.noise_floor.powi(2)).sqrt();
            format!("{} {}: {over:.1e} {} beyond the noise", gap.sensor, gap.axis, gap.unit)
        })
        .collect();
    let unknown = matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Partly);
    match (left.is_empty(), unknown) {
        (true, false) => "nothing beyond the noise of this recording".to_owned(),
        (true, true) => "something below the noise of a block, whose cause is unknown".to_owned(),
        (false, true) => format!("{}; its cause is unknown", left.join("; ")),
        (false, false) => left.join("; "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::finding::Amount;

    fn stretches(starts: &[f64], length: f64) -> Cause {
        let parameters = starts.iter().enumerate().flat_map(|(at, start)| {
            let end = if at == 0 { String::new() } else { format!("_{}", at + 1) };
            let amount = |name: &str, value: f64, unit: &str| Amount {
                name: format!("{name}{end}"),
                value: Some(value),
                std_error: None,
                unit: unit.to_owned(),
            };
            [
                amount("t_start", *start, "s"),
                amount("t_end", start + length, "s"),
                amount("lacking_rate", 0.2, "rad/s"),
            ]
        });
        Cause {
            effect: motion_mismatch::ID.to_owned(),
            probability: 1.0,
            equivalents: Vec::new(),
            parameters: parameters.collect(),
            material: true,
            gap_closed: None,
            gap_closed_ci95: None,
        }
    }

    #[test]
    fn stretches_that_repeat_are_reported_by_their_period() {
        let said = motion(&stretches(&[3.2, 7.21, 11.19, 19.2, 23.2], 0.4));
        assert!(said.contains("in 5 stretches, 3.2–3.6 s of each 4.0 s, 2.0 s in all"), "{said}");
        assert!(said.contains("up to 0.20 rad/s that the simulator lacks"), "{said}");
    }

    #[test]
    fn stretches_that_do_not_repeat_are_reported_one_by_one() {
        let said = motion(&stretches(&[3.0, 9.0, 31.0, 40.0], 2.0));
        assert!(said.contains("in 4 stretches (3.0–5.0, 9.0–11.0, 31.0–33.0, … s)"), "{said}");
        assert!(motion(&stretches(&[3.0], 2.0)).contains("from 3.0 to 5.0 s"));
    }
}
