//! What is true at one row of a recording, before any sensor.

use nalgebra::{Matrix3, Vector3};

use super::machine::Swing;
use crate::recording::SensorKind;

/// The truth at one row, in the table's frame `t`. `C_a_b` takes components from `a` to `b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The row's time on the sensor's clock, s.
    pub time: f64,
    /// Table to base.
    pub c_t_p: Matrix3<f64>,
    /// Table to outer gimbal.
    pub c_t_o: Matrix3<f64>,
    /// Table to middle gimbal.
    pub c_t_m: Matrix3<f64>,
    /// Base to local north, east, down.
    pub c_p_n: Matrix3<f64>,
    /// True gimbal angles, outermost first.
    pub gimbals: [Swing; 3],
    /// Position in the base, m, from the middle of the way; zero where it is not known.
    pub p_p: Vector3<f64>,
    /// Rate of the table against the base, rad/s.
    pub w_pt_t: Vector3<f64>,
    /// Earth's rotation, rad/s.
    pub w_ie_t: Vector3<f64>,
    /// Rate of the table against inertial space, rad/s: the sum of the former two.
    pub w_it_t: Vector3<f64>,
    /// Angular acceleration against inertial space, rad/s².
    pub dw_it_t: Vector3<f64>,
    /// Gravity of the site, m/s².
    pub gravity: f64,
    /// Specific force where the sensor is, m/s².
    pub f_t: Vector3<f64>,
    /// Magnetic field where the sensor is, µT.
    pub b_t: Vector3<f64>,
    /// Temperature of the sensor, °C.
    pub temperature: f64,
}

impl Truth {
    /// Field effects: adds a field with components in a frame that `c_t_a` takes the table's components to, µT.
    pub fn add_field(&mut self, c_t_a: &Matrix3<f64>, b_a: &Vector3<f64>) {
        self.b_t += c_t_a.tr_mul(b_a);
    }
}

/// The truth at one row in the enclosure's frame `q`: what the triads are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// Time on the sensor's clock, s.
    pub time: f64,
    /// Temperature of the sensor, °C.
    pub temperature: f64,
    /// Specific force, m/s².
    pub f_q: Vector3<f64>,
    /// Rate against inertial space, rad/s.
    pub w_iq_q: Vector3<f64>,
    /// Angular acceleration against inertial space, rad/s².
    pub dw_iq_q: Vector3<f64>,
    /// Magnetic field, µT.
    pub b_q: Vector3<f64>,
    /// True angles of the gimbals, outermost first, rad, not wrapped; zero without gimbals.
    pub angles: [f64; 3],
    /// Their rates, rad/s.
    pub angle_rates: [f64; 3],
}

impl Input {
    /// Rows a hundredth of a second apart, in which nothing is sensed.
    #[cfg(test)]
    pub fn empty(rows: u32) -> Vec<Self> {
        let zero = Vector3::zeros();
        let row = |k| Self {
            time: 0.01 * f64::from(k),
            temperature: 25.0,
            f_q: zero,
            w_iq_q: zero,
            dw_iq_q: zero,
            b_q: zero,
            angles: [0.0; 3],
            angle_rates: [0.0; 3],
        };
        (0..rows).map(row).collect()
    }

    /// The truth as a unit sees it that stands on the table as the table's axes do.
    pub fn of(truth: &Truth) -> Self {
        Self {
            time: truth.time,
            temperature: truth.temperature,
            f_q: truth.f_t,
            w_iq_q: truth.w_it_t,
            dw_iq_q: truth.dw_it_t,
            b_q: truth.b_t,
            angles: truth.gimbals.map(|gimbal| gimbal.angle),
            angle_rates: truth.gimbals.map(|gimbal| gimbal.rate),
        }
    }

    /// What a sensor is given, SI units.
    pub fn given(&self, kind: SensorKind) -> Vector3<f64> {
        match kind {
            SensorKind::Acc => self.f_q,
            SensorKind::Gyr => self.w_iq_q,
            SensorKind::Mag => self.b_q,
        }
    }

    /// As a unit sees it that is turned on the table; `c_t_q` takes the table's components to its own.
    #[must_use]
    pub fn turned(&self, c_t_q: &Matrix3<f64>) -> Self {
        Self {
            f_q: c_t_q * self.f_q,
            w_iq_q: c_t_q * self.w_iq_q,
            dw_iq_q: c_t_q * self.dw_iq_q,
            b_q: c_t_q * self.b_q,
            ..*self
        }
    }
}
