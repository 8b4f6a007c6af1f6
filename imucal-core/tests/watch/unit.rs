//! A unit as its record says it is, second by second at rest: true values, the errors its calibration has, in-run instability as
//! a Gauss–Markov process, white noise.

use imucal_core::{
    record::{CalibrationRecord, Date, FirstOrder, FitQuality, RawUnit, SensorIdentity, TriadRecord},
    watch::{Look, Mean, WatchSettings},
};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const GRAVITY: f32 = 9.81;
/// Field, µT, and its dip, rad.
pub const FIELD: (f32, f32) = (49.0, 1.15);

/// How good the sensors of a kind are: standard errors of bias and of the relative gain, rms residual, instability, noise of a
/// second's mean. Acc, gyr, mag in m/s², rad/s, µT.
#[derive(Clone, Copy, Debug)]
pub struct Grade {
    pub name: &'static str,
    pub bias: [f32; 3],
    pub gain: [f32; 3],
    pub rms: [f32; 3],
    pub instability: [f32; 3],
    pub noise: [f32; 3],
}

/// Figures of fits of `xsens-mti` and of `mpu9150`, with the instabilities and noises of such sensors' data sheets.
pub const GRADES: [Grade; 2] = [
    Grade {
        name: "industrial",
        bias: [6e-4, 6e-5, 0.03],
        gain: [8e-5, 3e-4, 5e-4],
        rms: [1.1e-3, 2e-3, 0.15],
        instability: [3e-4, 5e-5, 0.02],
        noise: [6e-4, 1.2e-4, 0.03],
    },
    Grade {
        name: "consumer",
        bias: [5e-3, 2e-4, 0.1],
        gain: [5e-4, 2e-3, 2e-3],
        rms: [0.01, 1e-2, 0.5],
        instability: [1.5e-3, 1e-4, 0.08],
        noise: [3e-3, 1.7e-4, 0.1],
    },
];

impl Grade {
    fn triad(&self, sensor: usize, unit: RawUnit) -> TriadRecord {
        let gain_std = [[self.gain[sensor]; 3]; 3];
        TriadRecord {
            // A little rotated, so that the magnetometer is in the accelerometer's axes.
            gain: [[1.01, 0.004, -0.002], [-0.003, 0.99, 0.005], [0.001, -0.006, 1.005]],
            bias: [0.3, -0.2, 0.1].map(|bias: f32| bias * self.bias[sensor] * 50.0),
            unit_in: unit,
            unit_out: unit,
            model: "K12".parse().unwrap(),
            temperature: None,
            quality: FitQuality {
                gain_std,
                bias_std: [self.bias[sensor]; 3],
                rms: self.rms[sensor],
                held_out_rms: None,
                observations: 40,
                parameters: 12,
                condition: 5.0,
                coverage: 0.9,
                field_norm: None,
            },
            order: FirstOrder,
        }
    }

    pub fn record(&self) -> CalibrationRecord {
        let sensor = SensorIdentity { name: self.name.parse().unwrap(), serial: "W1".parse().unwrap() };
        CalibrationRecord {
            acc: Some(self.triad(0, RawUnit::MetrePerSecondSquared)),
            gyr: Some(self.triad(1, RawUnit::RadianPerSecond)),
            mag: Some(self.triad(2, RawUnit::MicroTesla)),
            ..CalibrationRecord::empty(sensor, Date::from_days(20_000))
        }
    }

    /// What the record and the settings allow a statistic's length of `sensor` to be off by, one standard error, roughly.
    pub fn allowed(&self, sensor: usize) -> f32 {
        let size = [GRAVITY, 0.0, FIELD.0][sensor];
        let pose = [self.rms[0], EARTH / 3f32.sqrt(), self.rms[2]][sensor];
        let parts = [self.bias[sensor], self.gain[sensor] * size, pose, self.instability[sensor]];
        parts.iter().map(|part| part * part).sum::<f32>().sqrt()
    }

    /// What a caller who knows place and sensor sets.
    pub fn settings(&self, place: f32) -> WatchSettings {
        WatchSettings {
            gravity: GRAVITY,
            field: Some(FIELD.0),
            dip: Some(FIELD.1),
            instability: self.instability,
            memory: MEMORY,
            place,
            ..WatchSettings::default()
        }
    }
}

pub const MEMORY: f32 = 300.0;
const EARTH: f32 = 7.292e-5;
/// Latitude, rad.
const LATITUDE: f32 = 0.91;

/// One unit.
#[derive(Clone)]
pub struct Unit {
    pub grade: Grade,
    pub settings: WatchSettings,
    pub rng: ChaCha8Rng,
    spare: Option<f32>,
    /// Errors of gain and bias, relative and in calibrated units.
    gain: [Matrix3<f32>; 3],
    bias: [Vector3<f32>; 3],
    slow: [Vector3<f32>; 3],
    /// Of the present pose: specific force, Earth's rate, field, and what its residual adds.
    truth: [Vector3<f32>; 3],
    scatter: [Vector3<f32>; 3],
    /// What has been added to each triad.
    pub shift: [Vector3<f32>; 3],
    pub time: u32,
    pub temperature: f32,
    pub moved: bool,
}

impl Unit {
    pub fn new(grade: Grade, place: f32, seed: u64) -> Self {
        let zero = [Vector3::zeros(); 3];
        let mut unit = Self {
            settings: grade.settings(place),
            grade,
            rng: ChaCha8Rng::seed_from_u64(seed),
            spare: None,
            gain: [Matrix3::zeros(); 3],
            bias: zero,
            slow: zero,
            truth: zero,
            scatter: zero,
            shift: zero,
            time: 0,
            temperature: 25.0,
            moved: true,
        };
        for sensor in 0..3 {
            unit.gain[sensor] = Matrix3::from_fn(|_, _| unit.normal() * grade.gain[sensor]);
            unit.bias[sensor] = unit.vector(grade.bias[sensor]);
            unit.slow[sensor] = unit.vector(grade.instability[sensor]);
        }
        unit.turn(place);
        unit
    }

    pub fn normal(&mut self) -> f32 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = (-2.0 * (1.0 - self.rng.random::<f32>()).ln()).sqrt();
        let (sin, cos) = (std::f32::consts::TAU * self.rng.random::<f32>()).sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }

    pub fn vector(&mut self, std: f32) -> Vector3<f32> {
        Vector3::from_fn(|_, _| self.normal() * std)
    }

    /// Puts the unit down in another attitude, where the field differs by a share of `place`.
    pub fn turn(&mut self, place: f32) {
        let axes = Matrix3::from_fn(|_, _| self.normal()).qr().q();
        let axes = if axes.determinant() < 0.0 { -axes } else { axes };
        let (north, down) = (FIELD.0 * FIELD.1.cos(), FIELD.0 * FIELD.1.sin());
        let field = Vector3::new(north, 0.0, down) + self.vector(place * FIELD.0);
        let earth = Vector3::new(LATITUDE.cos(), 0.0, -LATITUDE.sin()) * EARTH;
        self.truth = [axes * Vector3::new(0.0, 0.0, -GRAVITY), axes * earth, axes * field];
        for sensor in [0, 2] {
            self.scatter[sensor] = self.vector(self.grade.rms[sensor]);
        }
        self.moved = true;
    }

    /// The attitude at which it lies.
    pub fn pose(&self) -> [[Vector3<f32>; 3]; 2] {
        [self.truth, self.scatter]
    }

    /// Puts the unit down as it lay once, after a motion.
    pub fn take(&mut self, pose: &[[Vector3<f32>; 3]; 2]) {
        [self.truth, self.scatter] = *pose;
        self.moved = true;
    }

    /// Direction in which the triad is read: of gravity, the first axis, of the field.
    pub fn direction(&self, sensor: usize) -> Vector3<f32> {
        if sensor == 1 { Vector3::x() } else { self.truth[sensor].normalize() }
    }

    /// A second of rest.
    pub fn look(&mut self) -> Look {
        let keep = (-1.0 / MEMORY).exp();
        let renew = (1.0 - keep * keep).sqrt();
        let means = [0, 1, 2].map(|sensor| {
            let std = self.grade.instability[sensor];
            self.slow[sensor] = self.slow[sensor] * keep + self.vector(std * renew);
            let noise = self.grade.noise[sensor];
            let error = self.gain[sensor] * self.truth[sensor] - self.bias[sensor] + self.scatter[sensor];
            let value =
                self.truth[sensor] + error + self.slow[sensor] + self.shift[sensor] + self.vector(noise);
            Mean { value, variance: Vector3::repeat(noise * noise) }
        });
        let [acc, gyr, mag] = means;
        let moved = std::mem::replace(&mut self.moved, false);
        let look = Look {
            time: self.time,
            acc,
            gyr: Some(gyr),
            mag: Some(mag),
            temperature: self.temperature,
            moved,
        };
        self.time += 1;
        look
    }
}
