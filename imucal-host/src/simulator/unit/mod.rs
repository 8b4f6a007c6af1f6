//! Units under test: raw errors of realistic size drawn from a seed, noise, drift, converter, mount.
//!
//! A triad puts out, in SI units of its raw output,
//!
//! ```text
//! y = K v_q + b + noise + drift      clipped at full scale, rounded to counts
//! ```
//!
//! with v in the enclosure's frame q, which the mount turns by up to a degree on the table: the unified model's K is
//! K·C_t_q. Not modelled: errors of sampling time, noise that depends on motion or temperature.

use imucal_core::{rotation, triad::Triad};
use nalgebra::{Matrix3, Vector3};

use super::{
    NoiseLevel,
    random::{Purpose, Random},
};
use crate::recording::{
    Manifest, SensorKind, Unit,
    manifest::{Counts, Identity, PerSensor, Rig, Site},
};

mod drift;
mod gx2;
mod mtx;

pub(super) use drift::DriftCourse;
pub use drift::{Drift, DriftKind};

/// What a data sheet and raw recordings say of one triad, in SI units (m/s², rad/s, µT).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriadSheet {
    /// Full scale, both signs.
    pub full_scale: f64,
    /// White noise, SI unit per √Hz.
    pub noise_density: f64,
    /// Bandwidth of the analogue filter, Hz: noise above does not get through.
    pub bandwidth: f64,
    /// Standard deviation of the drift within a recording.
    pub instability: f64,
    /// Largest raw bias.
    pub offset: f64,
    /// Largest share of one axis in another, rad.
    pub misalignment: f64,
    /// Largest error of scale.
    pub scale: f64,
    /// Counts of the 16-bit converter per SI unit.
    pub counts_per_unit: f64,
}

/// What is known of a type of unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// Name in the manifest.
    pub name: &'static str,
    /// Accelerometer.
    pub acc: TriadSheet,
    /// Gyroscope.
    pub gyr: TriadSheet,
    /// Magnetometer.
    pub mag: TriadSheet,
}

/// Types of unit there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UnitKind {
    /// Xsens MTx.
    #[default]
    Mtx,
    /// MicroStrain 3DM-GX2.
    Gx2,
}

impl UnitKind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Mtx, Self::Gx2];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mtx => "mtx",
            Self::Gx2 => "3dm-gx2",
        }
    }

    /// The unit of a name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// What is known of it.
    pub fn sheet(self) -> &'static Sheet {
        match self {
            Self::Mtx => &mtx::SHEET,
            Self::Gx2 => &gx2::SHEET,
        }
    }
}

/// One triad of a drawn unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriadUnderTest {
    /// Raw SI to true SI in the enclosure's axes: K⁻¹ and b.
    pub triad: Triad<f64>,
    /// Full scale, SI, both signs.
    pub full_scale: f64,
    /// White noise of a sample, SI.
    pub noise: f64,
    /// Drift within the recording.
    pub drift: Drift,
    /// The converter.
    pub counts: Counts,
}

/// A unit drawn from a seed.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitUnderTest {
    /// Name of its type.
    pub name: &'static str,
    /// Serial number.
    pub serial: String,
    /// Mounting rotation: table to enclosure.
    pub c_t_q: Matrix3<f64>,
    /// Accelerometer.
    pub acc: TriadUnderTest,
    /// Gyroscope.
    pub gyr: TriadUnderTest,
    /// Magnetometer.
    pub mag: TriadUnderTest,
}

impl UnitUnderTest {
    /// A unit of this kind, sampled at `rate` Hz.
    pub fn draw(kind: UnitKind, seed: u64, rate: f64) -> Self {
        let mut random = Random::new(seed, Purpose::Unit);
        let sheet = kind.sheet();
        let mount = random.normals().normalize() * random.between(0.1, 1.0).to_radians();
        let [acc, gyr, mag] =
            [sheet.acc, sheet.gyr, sheet.mag].map(|sheet| draw_triad(&sheet, rate, &mut random));
        Self {
            name: sheet.name,
            // Drawn: a part of the seed would give a sealed case away.
            serial: format!("SIM-{:06}", random.below(1_000_000)),
            // The enclosure is turned by the mount; components go the other way.
            c_t_q: rotation::exp(&-mount),
            acc,
            gyr,
            mag,
        }
    }

    /// One triad.
    pub fn triad(&self, kind: SensorKind) -> &TriadUnderTest {
        match kind {
            SensorKind::Acc => &self.acc,
            SensorKind::Gyr => &self.gyr,
            SensorKind::Mag => &self.mag,
        }
    }

    /// The manifest of a recording of it, in raw counts or in SI units.
    pub(super) fn manifest(&self, site: Site, rig: Rig, in_counts: bool) -> Manifest {
        let mut manifest = Manifest {
            site,
            rig: Some(rig),
            sensor: Identity { name: Some(self.name.to_owned()), serial: Some(self.serial.clone()) },
            ..Manifest::default()
        };
        let of = |value: &dyn Fn(&TriadUnderTest) -> f64| PerSensor {
            acc: Some(value(&self.acc)),
            gyr: Some(value(&self.gyr)),
            mag: Some(value(&self.mag)),
        };
        if in_counts {
            (manifest.units.acc, manifest.units.gyr, manifest.units.mag) =
                (Unit::Counts, Unit::Counts, Unit::Counts);
            manifest.counts = PerSensor {
                acc: Some(self.acc.counts),
                gyr: Some(self.gyr.counts),
                mag: Some(self.mag.counts),
            };
            manifest.ranges = of(&|triad| triad.full_scale * triad.counts.per_unit);
        } else {
            manifest.ranges = of(&|triad| triad.full_scale);
        }
        manifest
    }

    /// Gives it noise of these levels, by [`SensorKind::ALL`].
    pub(super) fn apply(&mut self, levels: [NoiseLevel; 3]) {
        let triads = [&mut self.acc, &mut self.gyr, &mut self.mag];
        for (triad, level) in triads.into_iter().zip(levels) {
            triad.noise *= level.white;
            triad.drift.sigma *= level.drift;
            triad.drift.kind = level.kind;
        }
    }
}

fn draw_triad(sheet: &TriadSheet, rate: f64, random: &mut Random) -> TriadUnderTest {
    let mut within = |largest: f64| random.between(-largest, largest);
    let sensitivity = Matrix3::from_fn(|row, column| match row == column {
        true => 1.0 + within(sheet.scale),
        false => within(sheet.misalignment),
    });
    let bias = Vector3::from_fn(|_, _| within(sheet.offset));
    TriadUnderTest {
        // Diagonally dominant by far, so that there is an inverse.
        triad: Triad { gain: sensitivity.try_inverse().unwrap_or_else(Matrix3::identity), bias },
        full_scale: sheet.full_scale,
        noise: sheet.noise_density * f64::min(0.5 * rate, sheet.bandwidth).sqrt(),
        drift: Drift { sigma: sheet.instability, kind: DriftKind::default() },
        counts: Counts { offset: 32_768.0, per_unit: sheet.counts_per_unit },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_differ_by_seed_and_are_as_bad_as_their_sheet_says() {
        for kind in UnitKind::ALL {
            let sheet = kind.sheet();
            for seed in 0..20 {
                let unit = UnitUnderTest::draw(kind, seed, 100.0);
                assert_ne!(unit, UnitUnderTest::draw(kind, seed + 1, 100.0));
                let mount = nalgebra::Rotation3::from_matrix_unchecked(unit.c_t_q).angle().to_degrees();
                assert!((0.1 - 1e-9..1.0 + 1e-9).contains(&mount), "{mount}");
                for (triad, sheet) in [(unit.acc, sheet.acc), (unit.gyr, sheet.gyr), (unit.mag, sheet.mag)] {
                    let k = triad.triad.sensitivity().unwrap() - Matrix3::identity();
                    assert!(k.amax() <= f64::max(sheet.scale, sheet.misalignment) + 1e-12);
                    assert!(triad.triad.bias.amax() <= sheet.offset);
                }
            }
        }
    }

    #[test]
    fn converters_of_sixteen_bits_hold_the_full_scale() {
        for kind in UnitKind::ALL {
            for sheet in [kind.sheet().acc, kind.sheet().gyr, kind.sheet().mag] {
                assert!(sheet.full_scale * sheet.counts_per_unit < 32_767.0, "{kind:?}");
            }
        }
    }
}
