//! Formulas that are tried: functions of drivers, in the notation of a user's own effects.
//!
//! | driver | functions |
//! | --- | --- |
//! | x: what this axis, the next and the one after sense, likewise the fields of the other sensors and angular acceleration | x, x², x³, \|x\|, tanh, dead zone, knee, lag of x and x² |
//! | one component of these, the same on all axes | likewise |
//! | products of two of these, and of one with temperature or its rate | as they are |
//! | squares of rate and specific force, temperature, its rate | as they are, and lagged |
//! | angles of gimbals | sinusoids of one to twelve periods a turn, by halves |
//! | rates of gimbals | x, \|x\|, x², tanh |
//!
//! An amplitude an axis. Left out: what the baseline always has, such as the axis' own input.

use super::term::{Driver, Formulated, Shape};
use crate::{
    effect::{XYZ, si},
    recording::{GIMBALS, SensorKind},
};

/// Periods a turn of a sinusoid in an angle.
const PERIODS: std::ops::RangeInclusive<u32> = 2..=24;
/// Time constants, s.
const LAGS: [f64; 6] = [0.5, 2.0, 5.0, 12.0, 30.0, 80.0];
/// Where a function bends: from this share of how far the axis that moves least does, to this one of the largest value, each
/// further by no more than this factor, and so many at most.
const BENDS: (f64, f64, f64, usize) = (0.06, 0.7, 1.8, 12);
/// Bends that a fit may reach, as shares of the least and the largest of those that are tried.
const BEYOND: (f64, f64) = (0.3, 1.4);
/// A knee goes no further than this share of the largest value.
const KNEE: f64 = 0.9;

/// What a recording holds in addition to its sensors.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Gimbals turn the sensor.
    pub gimbals: bool,
    /// A temperature that varies about this mean, °C.
    pub temperature: Option<f64>,
    /// The magnetic field is known in the sensor's axes.
    pub field: bool,
}

/// Values that a driver takes in a recording.
#[derive(Clone, Debug)]
pub struct Taken {
    /// The largest size on any axis.
    pub largest: f64,
    /// How far the values of the axis that moves least are from their middle.
    pub least: f64,
    /// Values that the axes are below for some shares of the time, in rising order.
    pub quantiles: Vec<f64>,
}

/// The formulas for a sensor. `taken` gives the values of a driver in the recording.
pub fn formulas(kind: SensorKind, held: Held, taken: &dyn Fn(&Driver) -> Taken) -> Vec<Formulated> {
    let fields = fields(kind, held);
    let (vectors, components) = (vectors(&fields), components(&fields));
    let mut all = Vec::new();
    for drivers in [&vectors, &components] {
        for driver in drivers {
            of_vector(driver, &taken(driver), &mut all);
        }
        for (at, one) in drivers.iter().enumerate() {
            all.extend(drivers[at + 1..].iter().map(|other| one.times(other).itself(2)));
        }
    }
    for (driver, name) in [("w", "rate"), ("a", "force")] {
        let text = format!("({driver}_x^2 + {driver}_y^2 + {driver}_z^2)");
        let unit = if driver == "w" { "(rad/s)^2" } else { "(m/s^2)^2" };
        of_scalar(&Driver::scalar(&format!("square_of_{name}"), &text, unit), &mut all);
    }
    if let Some(mean) = held.temperature {
        of_temperature(mean, &[vectors, components].concat(), &mut all);
    }
    if held.gimbals {
        for gimbal in GIMBALS {
            of_gimbal(gimbal, taken, &mut all);
        }
    }
    all
}

/// What a sensor's axes may follow: their own inputs, the fields of the other sensors, angular acceleration; each with its unit.
fn fields(kind: SensorKind, held: Held) -> Vec<(&'static str, String)> {
    let others = [("a", SensorKind::Acc), ("w", SensorKind::Gyr), ("B", SensorKind::Mag)];
    let known = |(_, of): &(&str, SensorKind)| *of != kind && (*of != SensorKind::Mag || held.field);
    let mut fields = vec![("y", si(kind))];
    fields.extend(others.into_iter().filter(known).map(|(name, of)| (name, si(of))));
    fields.push(("wd", "rad/s^2".to_owned()));
    fields
}

/// Of each field the component along the axis itself, along the next, and along the one after.
fn vectors(fields: &[(&'static str, String)]) -> Vec<Driver> {
    let of = |(name, unit): &(&'static str, String)| [0, 1, 2].map(|next| Driver::vector(name, next, unit));
    fields.iter().flat_map(of).collect()
}

/// Of each field its components, each the same on all axes.
fn components(fields: &[(&'static str, String)]) -> Vec<Driver> {
    let of = |(name, unit): &(&'static str, String)| {
        XYZ.map(|axis| {
            let text = format!("{name}_{axis}");
            Driver::scalar(&text.to_lowercase(), &text, unit)
        })
    };
    fields.iter().flat_map(of).collect()
}

fn of_vector(driver: &Driver, taken: &Taken, all: &mut Vec<Formulated>) {
    if !driver.is_in_baseline() {
        all.push(driver.itself(1));
    }
    all.push(driver.function("square", "$^2", 2, None));
    all.push(driver.function("cube", "$^3", 2, None));
    all.push(driver.function("size", "abs($)", 2, None));
    let (bends, range) = bends(taken);
    for value in bends {
        let bend = |name| Shape::about(name, driver, value, range);
        all.push(driver.function("soft_limit", "tanh($ / s)", 3, Some(bend("s"))));
        all.push(driver.function("dead_zone", "$ - max(min($, d), -d)", 4, Some(bend("d"))));
    }
    let most = KNEE * taken.largest;
    for value in taken.quantiles.iter().copied().filter(|value| value.abs() < most) {
        let knee = Shape::about("k0", driver, value, (-most, most));
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

/// Where a function bends, and what a fit may reach.
fn bends(taken: &Taken) -> (Vec<f64>, (f64, f64)) {
    let (from, to, factor, most) = BENDS;
    let (low, high) = (from * taken.least, to * taken.largest);
    let steps = (libm::log(high / low) / libm::log(factor)).ceil().clamp(1.0, most as f64 - 1.0);
    let each = (0..=steps as u32).map(|at| low * libm::pow(high / low, f64::from(at) / steps)).collect();
    (each, (BEYOND.0 * low, BEYOND.1 * high))
}

fn of_gimbal(gimbal: &str, taken: &dyn Fn(&Driver) -> Taken, all: &mut Vec<Formulated>) {
    let rate = Driver::scalar(&format!("{gimbal}_rate"), &format!("{gimbal}_rate"), "rad/s");
    all.push(rate.itself(1));
    all.push(rate.function("size", "abs($)", 2, None));
    all.push(rate.function("square", "$^2", 2, None));
    let (bends, range) = bends(&taken(&rate));
    for value in bends {
        let bend = Shape::about("s", &rate, value, range);
        all.push(rate.function("soft_limit", "tanh($ / s)", 3, Some(bend)));
    }
    for half in PERIODS {
        all.push(Formulated::sinusoid(gimbal, 0.5 * f64::from(half)));
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Values between minus and plus 3.
    pub fn taken(_: &Driver) -> Taken {
        Taken { largest: 3.0, least: 3.0, quantiles: vec![-2.0, -0.5, 0.0, 0.5, 2.0] }
    }

    #[test]
    fn every_formula_can_be_read_and_none_is_there_twice() {
        let held = Held { gimbals: true, temperature: Some(25.0), field: true };
        for kind in SensorKind::ALL {
            let all = formulas(kind, held, &taken);
            assert!((900..1500).contains(&all.len()), "{}", all.len());
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
        for formula in formulas(SensorKind::Acc, held, &taken) {
            let text = formula.terms.concat().concat();
            assert!(!text.contains("temp") && !text.contains("inner") && !text.contains("B_"), "{text}");
        }
    }

    #[test]
    fn a_product_of_two_components_may_act_on_all_axes() {
        let held = Held { gimbals: false, temperature: None, field: true };
        let all = formulas(SensorKind::Gyr, held, &taken);
        let of = |text: &str| {
            all.iter().filter(|formula| formula.terms == [[0; 3].map(|_| text.to_owned())]).count()
        };
        assert_eq!((of("y_z * a_y"), of("a_x"), of("a_x^2"), of("abs(B_z)")), (1, 1, 1, 1));
        // Misalignment holds it.
        assert_eq!(of("y_x"), 0);
    }

    #[test]
    fn bends_are_tried_from_what_the_least_axis_moves_to_what_the_largest_reaches() {
        // A machine's axis across its way moves by 0.3 m/s², the one along gravity shows 11 m/s².
        let (bends, range) = bends(&Taken { largest: 11.0, least: 0.3, quantiles: Vec::new() });
        assert!((bends[0] - 0.018).abs() < 1e-9 && (bends[bends.len() - 1] - 7.7).abs() < 1e-9, "{bends:?}");
        assert!(bends.windows(2).all(|pair| pair[1] / pair[0] < 1.8 && pair[1] > pair[0]), "{bends:?}");
        assert!(range.0 < bends[0] && range.1 > 7.7, "{range:?}");
    }

    #[test]
    fn knees_are_tried_where_the_axes_are_and_not_at_their_ends() {
        let mut all = Vec::new();
        let quantiles = vec![-10.9, -9.8, 0.0, 0.2];
        of_vector(&Driver::vector("y", 0, "uT"), &Taken { largest: 11.0, least: 0.3, quantiles }, &mut all);
        let knees = all.iter().filter(|formula| formula.name.starts_with("knee"));
        let places: Vec<f64> = knees.flat_map(Formulated::shapes).collect();
        assert_eq!(places, [-9.8, 0.0, 0.2]);
    }
}
