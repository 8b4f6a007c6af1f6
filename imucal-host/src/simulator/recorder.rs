//! A unit with three triads that records a motion: errors, noise and counts of realistic size.

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Vector3};

use super::{
    random::{Purpose, Random},
    truth::Motion,
};
use crate::recording::{
    Manifest, Recording, SensorKind, Unit,
    manifest::{Counts, Identity, Site},
};

/// One triad of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedSensor {
    /// Counts to true SI: what a calibration ought to find.
    pub truth: Triad<f64>,
    /// Nominal conversion of its data sheet.
    pub counts: Counts,
    /// White noise of a sample, SI.
    pub noise: f64,
}

/// Three triads, sampled together.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedUnit {
    /// Name.
    pub name: String,
    /// Serial number.
    pub serial: String,
    /// Accelerometer.
    pub acc: SimulatedSensor,
    /// Gyroscope.
    pub gyr: SimulatedSensor,
    /// Magnetometer.
    pub mag: SimulatedSensor,
    /// Sampling interval, s.
    pub interval: f64,
}

impl SimulatedUnit {
    /// Raw output as of an uncalibrated MTx: misalignment up to 0.05, offsets up to 1.2 m/s² and 3.6 °/s, noise at
    /// 100 Hz 8 mm/s² and 0.3 °/s (models.md 7).
    pub fn mtx() -> Self {
        let sensor = |per_unit: f64, gain: Matrix3<f64>, bias: Vector3<f64>, noise| SimulatedSensor {
            truth: Triad { gain, bias }.in_unit(32_768.0, per_unit),
            counts: Counts { offset: 32_768.0, per_unit },
            noise,
        };
        Self {
            name: "MTx (simulated)".into(),
            serial: "SIM-0001".into(),
            acc: sensor(
                415.0,
                Matrix3::new(1.004, -0.003, -0.009, 0.0, 1.007, -0.021, 0.0, 0.0, 0.999),
                Vector3::new(0.86, 1.22, -0.97),
                0.008,
            ),
            gyr: sensor(
                4778.0,
                Matrix3::new(1.002, 0.006, 0.002, 0.008, 0.997, -0.053, 0.025, -0.002, 1.004),
                Vector3::new(0.002, -0.062, -0.053),
                0.3f64.to_radians(),
            ),
            mag: sensor(
                200.0,
                Matrix3::new(0.98, 0.02, -0.03, 0.0, 1.03, 0.015, 0.0, 0.0, 1.01),
                Vector3::new(6.0, -4.0, 9.0),
                0.05,
            ),
            interval: 0.01,
        }
    }

    /// One triad.
    pub fn sensor(&self, kind: SensorKind) -> &SimulatedSensor {
        match kind {
            SensorKind::Acc => &self.acc,
            SensorKind::Gyr => &self.gyr,
            SensorKind::Mag => &self.mag,
        }
    }

    fn manifest(&self, motion: &dyn Motion) -> Manifest {
        let mut manifest = Manifest::default();
        let place = motion.place();
        (manifest.units.acc, manifest.units.gyr, manifest.units.mag) =
            (Unit::Counts, Unit::Counts, Unit::Counts);
        manifest.counts.acc = Some(self.acc.counts);
        manifest.counts.gyr = Some(self.gyr.counts);
        manifest.counts.mag = Some(self.mag.counts);
        manifest.site = Site {
            latitude_deg: Some(place.latitude_deg),
            height_m: None,
            gravity: Some(place.gravity),
            field_ned_ut: Some(place.field_n.into()),
        };
        manifest.rig = Some(motion.rig());
        manifest.sensor = Identity { name: Some(self.name.clone()), serial: Some(self.serial.clone()) };
        manifest
    }
}

/// Records a motion with a unit; the noise is drawn from the seed, the same on any machine.
pub fn record(name: &str, motion: &dyn Motion, unit: &SimulatedUnit, seed: u64) -> Recording {
    let mut random = Random::new(seed, Purpose::Noise);
    let rows = (motion.duration() / unit.interval).floor() as usize;
    let time: Vec<f64> = (0..rows).map(|k| k as f64 * unit.interval).collect();
    let mut columns = [const { Vec::new() }; 3];
    for t in &time {
        let truth = motion.truth(*t, &|_| ());
        for ((kind, value), column) in
            SensorKind::ALL.into_iter().zip([truth.f_t, truth.w_it_t, truth.b_t]).zip(&mut columns)
        {
            column.push(sample(unit.sensor(kind), &value, &mut random));
        }
    }
    let manifest = unit.manifest(motion);
    let [acc, gyr, mag] = columns;
    let mut recording = Recording::new(name, manifest.clone(), time);
    // Its own manifest has every conversion it needs.
    recording.acc = manifest.triple(SensorKind::Acc, acc).ok();
    recording.gyr = manifest.triple(SensorKind::Gyr, gyr).ok();
    recording.mag = manifest.triple(SensorKind::Mag, mag).ok();
    recording
}

/// One sample in nominal SI: the sensor's errors, noise, and the converter's steps.
fn sample(sensor: &SimulatedSensor, truth: &Vector3<f64>, random: &mut Random) -> Vector3<f64> {
    let noise = random.normals() * sensor.noise;
    let raw = sensor.truth.predict(&(truth + noise)).unwrap_or_default();
    raw.map(|counts| (counts.round() - sensor.counts.offset) / sensor.counts.per_unit)
}
