//! A drift watch for people.

use super::{
    measure::{measure, plain},
    prose::hanging,
};
use crate::diagnosis::watched::{Disturbance, Watched, WatchedShift, WatchedState, WatchedTriad};

/// The whole of it; each line ends.
pub fn watched(watch: &Watched) -> String {
    let known = |text: &str| if text.is_empty() { "unknown".to_owned() } else { text.to_owned() };
    let mut text = hanging(
        "drift watch: ",
        &format!(
            "sensor {}, serial {}, record of {}; {} of rest ({} rests), from {} s to {} s on the device's clock; set to {} false \
             alarms a day of rest",
            known(&watch.sensor),
            known(&watch.serial),
            watch.record_date,
            duration(watch.watched),
            watch.rests,
            watch.from,
            watch.to,
            watch.false_alarms_a_day as f32
        ),
    );
    watch.triads.iter().for_each(|triad| text.push_str(&of_triad(triad)));
    watch.remarks.iter().for_each(|remark| text.push_str(&hanging("  note: ", remark)));
    text
}

fn of_triad(triad: &WatchedTriad) -> String {
    let state = match triad.state {
        WatchedState::Unseen => "not seen enough to be judged",
        WatchedState::Stuck => "stuck: its values do not change",
        WatchedState::Quiet => "as its record says",
        WatchedState::Moved => "has moved",
    };
    let mut text = hanging(&format!("  {}: ", triad.sensor), state);
    triad.shifts.iter().for_each(|shift| text.push_str(&hanging("    - ", &of_shift(shift))));
    triad.disturbances.iter().for_each(|spell| text.push_str(&hanging("    - ", &of_disturbance(spell))));
    if triad.state == WatchedState::Moved && !triad.causes.is_empty() {
        let causes = format!("causes of this recording that act on it: {}", triad.causes.join(", "));
        text.push_str(&hanging("    - ", &causes));
    }
    text
}

fn of_shift(shift: &WatchedShift) -> String {
    let against = match shift.compared_with.as_str() {
        "record" => format!("{}, where the record allows ± {}", plain(shift.by), plain(shift.std_error)),
        _ => format!("{} from what it was", measure(shift.by, shift.std_error)),
    };
    let temperature =
        shift.temperature.map_or(String::new(), |temperature| format!(", at {temperature:.1} °C"));
    format!(
        "{} by {against}, since {} s, found at {} s{temperature}",
        shift.statistic, shift.since, shift.found
    )
}

fn of_disturbance(spell: &Disturbance) -> String {
    let count = if spell.count > 1 { format!(" (the last of {})", spell.count) } else { String::new() };
    let Disturbance { statistic, by, from, to, .. } = spell;
    format!("{statistic} by up to {} from {from} s to {to} s, and back: something near it{count}", plain(*by))
}

/// `3 d`, `4 h`, `10 min` or `12 s`, whole ones.
fn duration(seconds: u32) -> String {
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7200 => format!("{} min", seconds / 60),
        7200..172_800 => format!("{} h", seconds / 3600),
        _ => format!("{} d", seconds / 86_400),
    }
}
