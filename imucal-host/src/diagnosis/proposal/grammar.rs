//! Formulas that are tried: functions of drivers, in the notation of a user's own effects.
//!
//! | driver | functions |
//! | --- | --- |
//! | x: what this axis, the next and the one after sense, likewise the fields of the other sensors and angular acceleration | x, x², x³, \|x\|, tanh, dead zone, knee, lag of x and x² |
//! | products of two of these, and of one with temperature or its rate | as they are |
//! | squares of rate and specific force, temperature, its rate | as they are, and lagged |
//! | angles of gimbals | sinusoids of one to twelve periods a turn, by halves |
//! | rates of gimbals | x, \|x\|, x², tanh |
//!
//! An amplitude an axis. Left out: what the baseline always has, such as the axis' own input.

use super::term::{Driver, Formulated, Shape};
use crate::{effect::si, recording::SensorKind};

/// Periods a turn of a sinusoid in an angle.
const PERIODS: std::ops::RangeInclusive<u32> = 2..=24;
/// Time constants, s.
const LAGS: [f64; 6] = [0.5, 2.0, 5.0, 12.0, 30.0, 80.0];
/// Where a function bends, as shares of the largest value of its driver.
const BENDS: [f64; 6] = [0.06, 0.12, 0.22, 0.35, 0.5, 0.7];
/// Where a knee lies, likewise.
const KNEES: [f64; 9] = [-0.7, -0.45, -0.25, -0.1, 0.0, 0.1, 0.25, 0.45, 0.7];

/// What a recording holds besides its sensors.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Gimbals turn the sensor.
    pub gimbals: bool,
    /// A temperature that varies about this mean, °C.
    pub temperature: Option<f64>,
    /// The magnetic field is known in the sensor's axes.
    pub field: bool,
}

/// The formulas for a sensor. `largest` gives the largest size of a driver in the recording.
pub fn formulas(kind: SensorKind, held: Held, largest: &dyn Fn(&Driver) -> f64) -> Vec<Formulated> {
    let vectors = vectors(kind, held);
    let mut all = Vec::new();
    for driver in &vectors {
        of_vector(driver, largest(driver), &mut all);
    }
    for (at, one) in vectors.iter().enumerate() {
        all.extend(vectors[at + 1..].iter().map(|other| one.times(other).itself(2)));
    }
    for (driver, name) in [("w", "rate"), ("a", "force")] {
        let text = format!("({driver}_x^2 + {driver}_y^2 + {driver}_z^2)");
        let unit = if driver == "w" { "(rad/s)^2" } else { "(m/s^2)^2" };
        of_scalar(&Driver::scalar(&format!("square_of_{name}"), &text, unit), &mut all);
    }
    if let Some(mean) = held.temperature {
        of_temperature(mean, &vectors, &mut all);
    }
    if held.gimbals {
        for gimbal in ["outer", "middle", "inner"] {
            of_gimbal(gimbal, largest, &mut all);
        }
    }
    all
}

/// Vectors that an axis may follow: of each, the component of the axis itself, of the next, and of the one after.
fn vectors(kind: SensorKind, held: Held) -> Vec<Driver> {
    let others = [("a", SensorKind::Acc), ("w", SensorKind::Gyr), ("B", SensorKind::Mag)];
    let known = |(_, of): &(&str, SensorKind)| *of != kind && (*of != SensorKind::Mag || held.field);
    let mut fields = vec![("y", si(kind))];
    fields.extend(others.into_iter().filter(known).map(|(name, of)| (name, si(of))));
    fields.push(("wd", "rad/s^2".to_owned()));
    let each =
        fields.iter().flat_map(|(name, unit)| (0..3).map(move |next| Driver::vector(name, next, unit)));
    each.collect()
}

fn of_vector(driver: &Driver, largest: f64, all: &mut Vec<Formulated>) {
    if !driver.is_of_axis("y") {
        all.push(driver.itself(1));
    }
    all.push(driver.function("square", "$^2", 2, None));
    all.push(driver.function("cube", "$^3", 2, None));
    all.push(driver.function("size", "abs($)", 2, None));
    for share in BENDS {
        let bend = |name| Shape::about(name, driver, share * largest, (0.02 * largest, largest));
        all.push(driver.function("soft_limit", "tanh($ / s)", 3, Some(bend("s"))));
        all.push(driver.function("dead_zone", "$ - max(min($, d), -d)", 4, Some(bend("d"))));
    }
    for share in KNEES {
        let knee = Shape::about("k0", driver, share * largest, (-0.9 * largest, 0.9 * largest));
        all.push(driver.function("knee", "max($ - k0, 0)", 3, Some(knee)));
    }
    for tau in LAGS {
        all.push(driver.function("lag", "lag($, tau)", 3, Some(Shape::time(tau))));
        all.push(driver.function("lag_of_square", "lag($^2, tau)", 4, Some(Shape::time(tau))));
    }
}

fn of_scalar(driver: &Driver, all: &mut Vec<Formulated>) {
    all.push(driver.itself(2));
    for tau in LAGS {
        all.push(driver.function("lag", "lag($, tau)", 3, Some(Shape::time(tau))));
    }
}

fn of_temperature(mean: f64, vectors: &[Driver], all: &mut Vec<Formulated>) {
    let temperature = Driver::scalar("temperature", &format!("(temp - {mean:.1})"), "K");
    let rate = Driver::scalar("temperature_rate", "temp_rate", "K/s");
    all.push(rate.itself(1));
    all.push(rate.function("size", "abs($)", 2, None));
    for tau in LAGS {
        for driver in [&temperature, &rate] {
            all.push(driver.function("lag", "lag($, tau)", 3, Some(Shape::time(tau))));
        }
    }
    all.push(temperature.function("cube", "$^3", 2, None));
    for vector in vectors {
        all.push(temperature.times(vector).itself(2));
        all.push(rate.times(vector).itself(3));
    }
}

fn of_gimbal(gimbal: &str, largest: &dyn Fn(&Driver) -> f64, all: &mut Vec<Formulated>) {
    let rate = Driver::scalar(&format!("{gimbal}_rate"), &format!("{gimbal}_rate"), "rad/s");
    all.push(rate.itself(1));
    all.push(rate.function("size", "abs($)", 2, None));
    all.push(rate.function("square", "$^2", 2, None));
    let most = largest(&rate);
    for share in BENDS {
        let bend = Shape::about("s", &rate, share * most, (0.02 * most, most));
        all.push(rate.function("soft_limit", "tanh($ / s)", 3, Some(bend)));
    }
    for half in PERIODS {
        all.push(Formulated::sinusoid(gimbal, 0.5 * f64::from(half)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_formula_can_be_read_and_none_is_there_twice() {
        let held = Held { gimbals: true, temperature: Some(25.0), field: true };
        for kind in SensorKind::ALL {
            let all = formulas(kind, held, &|_| 3.0);
            assert!((400..900).contains(&all.len()), "{}", all.len());
            let mut texts: Vec<String> = Vec::new();
            for formula in &all {
                assert!(formula.parsed().is_ok(), "{formula:?}");
                texts.push(format!("{:?} {:?}", formula.terms, formula.shape));
            }
            texts.sort();
            let count = texts.len();
            texts.dedup();
            assert_eq!(texts.len(), count);
        }
    }

    #[test]
    fn without_gimbals_temperature_and_field_no_formula_asks_for_them() {
        let held = Held { gimbals: false, temperature: None, field: false };
        for formula in formulas(SensorKind::Acc, held, &|_| 3.0) {
            let text = formula.terms.concat().concat();
            assert!(!text.contains("temp") && !text.contains("inner") && !text.contains("B_"), "{text}");
        }
    }
}
