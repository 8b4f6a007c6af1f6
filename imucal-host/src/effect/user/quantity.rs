//! What a formula may depend on: the ideal chain at the sensor, and what the sensor's axis itself senses.

use nalgebra::Vector3;

use crate::effect::Input;

/// A rate of temperature is the slope between its means over this time before and after, s: a thermometer's steps and
/// noise hide it over less.
const WARMING: f64 = 15.0;

/// Vectors, in the enclosure's axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Field {
    /// Specific force, m/s².
    Force,
    /// Rate, rad/s.
    Rate,
    /// Angular acceleration, rad/s².
    Acceleration,
    /// Magnetic field, µT.
    Magnetic,
    /// What the sensor's axes sense: output after scale and misalignment, before bias and other effects; SI units.
    Sensed,
}

/// One input of a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// A component of a vector; `None` is that of the axis whose output is formed.
    Vector(Field, Option<usize>),
    /// Temperature, °C.
    Temperature,
    /// Its rate, K/s.
    TemperatureRate,
    /// Time, s.
    Time,
    /// Angle of a gimbal, outermost first, rad, not wrapped.
    Angle(usize),
    /// Its rate, rad/s.
    AngleRate(usize),
}

impl Quantity {
    /// It is a component of the magnetic field.
    pub(super) fn is_magnetic(&self) -> bool {
        matches!(self, Self::Vector(Field::Magnetic, _))
    }
}

const VECTORS: [(&str, Field); 5] = [
    ("a", Field::Force),
    ("w", Field::Rate),
    ("wd", Field::Acceleration),
    ("B", Field::Magnetic),
    ("y", Field::Sensed),
];
const AXES: [&str; 3] = ["x", "y", "z"];
const SCALARS: [(&str, Quantity); 9] = [
    ("temp", Quantity::Temperature),
    ("temp_rate", Quantity::TemperatureRate),
    ("t", Quantity::Time),
    ("outer", Quantity::Angle(0)),
    ("middle", Quantity::Angle(1)),
    ("inner", Quantity::Angle(2)),
    ("outer_rate", Quantity::AngleRate(0)),
    ("middle_rate", Quantity::AngleRate(1)),
    ("inner_rate", Quantity::AngleRate(2)),
];

/// Names and quantities, all of them.
pub(super) fn all() -> Vec<(String, Quantity)> {
    let components = VECTORS.into_iter().flat_map(|(name, field)| {
        let axes = AXES.iter().enumerate();
        let each = axes.map(move |(axis, of)| (format!("{name}_{of}"), Quantity::Vector(field, Some(axis))));
        each.chain([(name.to_owned(), Quantity::Vector(field, None))])
    });
    components.chain(SCALARS.map(|(name, quantity)| (name.to_owned(), quantity))).collect()
}

/// The quantity of a name.
pub(super) fn find(name: &str) -> Option<Quantity> {
    all().into_iter().find(|(own, _)| own == name).map(|(_, quantity)| quantity)
}

/// Rows that a formula is evaluated at, for one axis of its sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    /// What the unit is given.
    pub(crate) input: &'a [Input],
    /// What each axis senses.
    pub(crate) sensed: &'a [Vector3<f64>],
    /// The axis.
    pub(crate) axis: usize,
}

impl Rows<'_> {
    /// Times, s.
    pub(super) fn times(&self) -> Vec<f64> {
        self.input.iter().map(|row| row.time).collect()
    }

    /// A quantity at each row.
    pub(super) fn column(&self, quantity: Quantity) -> Vec<f64> {
        let of = |value: &dyn Fn(&Input) -> f64| self.input.iter().map(value).collect();
        match quantity {
            Quantity::Vector(field, axis) => {
                let axis = axis.unwrap_or(self.axis);
                match field {
                    Field::Force => of(&|row| row.f_q[axis]),
                    Field::Rate => of(&|row| row.w_iq_q[axis]),
                    Field::Acceleration => of(&|row| row.dw_iq_q[axis]),
                    Field::Magnetic => of(&|row| row.b_q[axis]),
                    Field::Sensed => self.sensed.iter().map(|row| row[axis]).collect(),
                }
            }
            Quantity::Temperature => of(&|row| row.temperature),
            Quantity::TemperatureRate => self.warming(),
            Quantity::Time => of(&|row| row.time),
            Quantity::Angle(gimbal) => of(&|row| row.angles[gimbal]),
            Quantity::AngleRate(gimbal) => of(&|row| row.angle_rates[gimbal]),
        }
    }

    /// Rate of the temperature, K/s: the slope between its means before and after each row, the row in both.
    fn warming(&self) -> Vec<f64> {
        let Some(first) = self.input.first() else { return Vec::new() };
        let (mut times, mut readings) = (vec![0.0], vec![0.0]);
        let (mut time, mut reading) = (0.0, 0.0);
        for row in self.input {
            time += row.time - first.time;
            reading += row.temperature - first.temperature;
            times.push(time);
            readings.push(reading);
        }
        let mean = |sums: &[f64], rows: (usize, usize)| {
            (sums[rows.1 + 1] - sums[rows.0]) / (rows.1 + 1 - rows.0) as f64
        };
        let last = self.input.len() - 1;
        let (mut from, mut to) = (0, 0);
        let slope = |(at, row): (usize, &Input)| {
            while self.input[from].time < row.time - WARMING {
                from += 1;
            }
            while to < last && self.input[to + 1].time <= row.time + WARMING {
                to += 1;
            }
            // Where rows are further apart, the neighbours.
            let (before, after) = ((from.min(at.saturating_sub(1)), at), (at, to.max(at + 1).min(last)));
            let step = mean(&times, after) - mean(&times, before);
            let rise = mean(&readings, after) - mean(&readings, before);
            if step > 0.0 { rise / step } else { 0.0 }
        };
        self.input.iter().enumerate().map(slope).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warming(apart: f64, temperature: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let mut input = Input::empty(600);
        for (row, input) in input.iter_mut().enumerate() {
            // Every seventh row is missing.
            input.time = apart * (row + row / 7) as f64;
            input.temperature = temperature(input.time);
        }
        let rows = Rows { input: &input, sensed: &[], axis: 0 };
        rows.times().into_iter().zip(rows.column(Quantity::TemperatureRate)).collect()
    }

    #[test]
    fn the_rate_of_a_steady_warming_is_exact_however_far_apart_the_rows_are() {
        for apart in [0.01, 1.0, 40.0] {
            for (time, rate) in warming(apart, |time| 20.0 + 0.05 * time) {
                assert!((rate - 0.05).abs() < 1e-9, "{apart} {time}: {rate}");
            }
        }
    }

    #[test]
    fn steps_of_a_thermometer_do_not_show_as_heat() {
        let largest = warming(0.5, |time| (100.0 * (20.0 + 2e-3 * time)).round() / 100.0);
        assert!(largest.iter().skip(30).take(500).all(|(_, rate)| (rate - 2e-3).abs() < 5e-4));
    }

    #[test]
    fn every_name_stands_for_one_quantity() {
        let mut names: Vec<String> = all().into_iter().map(|(name, _)| name).collect();
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!((names.len(), count), (29, 29));
        assert_eq!(find("wd_z"), Some(Quantity::Vector(Field::Acceleration, Some(2))));
        assert_eq!(find("wdz"), None);
    }
}
