//! A recording of samples in memory: checked as those of a file are.

use std::path::Path;

use nalgebra::Vector3;

use super::{
    Recording,
    manifest::Manifest,
    place::Places,
    read::{
        assembly::{check_time, checked, keep_assumed, note_columns},
        clock::Clock,
        columns::{GIMBAL, NAMES, POSITION, REFERENCE, TEMPERATURE, TIME},
    },
    read_error::ReadError,
    sensor_kind::SensorKind,
    triple::{Nominal, Triple},
    warning::Warning,
};

/// A rig's gimbals, outermost first.
pub const GIMBALS: [&str; 3] = ["outer", "middle", "inner"];

/// Samples in the units of a manifest, as the columns of a file are; all that are there have as many rows as `time`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Times, strictly increasing.
    pub time: Vec<f64>,
    /// Accelerometer; NaN where not measured, as below.
    pub acc: Option<Vec<Vector3<f64>>>,
    /// Gyroscope.
    pub gyr: Option<Vec<Vector3<f64>>>,
    /// Magnetometer.
    pub mag: Option<Vec<Vector3<f64>>>,
    /// Temperature.
    pub temperature: Option<Vec<f64>>,
    /// Encoder angles outer, middle, inner.
    pub gimbal: Option<Vec<[f64; 3]>>,
    /// Reference attitude as quaternion w, x, y, z.
    pub reference: Option<Vec<[f64; 4]>>,
    /// Position of the reference point, m.
    pub position: Option<Vec<[f64; 3]>>,
}

impl Recording {
    /// A recording of samples in memory; `warnings` are those of its manifest.
    ///
    /// # Errors
    ///
    /// As [`Recording::read`], with rows for lines, and [`ReadError::Lengths`].
    pub fn of_samples(
        name: &str,
        (manifest, warnings): (Manifest, Vec<Warning>),
        samples: Samples,
    ) -> Result<Self, ReadError> {
        let path = Path::new(name);
        check_lengths(path, &samples)?;
        check_finite(path, &samples)?;
        let mut clock = Clock::new(manifest.units.t);
        let mut time = samples.time;
        time.iter_mut().for_each(|t| *t = clock.take_number(*t));
        check_time(path, &time, (&Places::WHOLE, &clock), manifest.units.t)?;
        let per_si = clock.per_si();
        if per_si != 1.0 {
            time.iter_mut().for_each(|t| *t /= per_si);
        }
        let triple = |kind, values: Option<Vec<Vector3<f64>>>| {
            values.map(|values| in_si(path, &manifest, kind, values)).transpose()
        };
        let acc = triple(SensorKind::Acc, samples.acc)?;
        let gyr = triple(SensorKind::Gyr, samples.gyr)?;
        let mag = triple(SensorKind::Mag, samples.mag)?;
        let angle = 1.0 / manifest.units.gimbal.per_si();
        let turned =
            |rows: Vec<[f64; 3]>| rows.into_iter().map(|row| row.map(|value| value * angle)).collect();
        // Trackers write so where they lost the body.
        let seen = |value: f64| if value.is_infinite() { f64::NAN } else { value };
        let placed = |rows: Vec<[f64; 3]>| rows.into_iter().map(|row| row.map(seen)).collect();
        let mut recording = Self {
            epoch: clock.epoch,
            acc,
            gyr,
            mag,
            temperature: samples.temperature,
            gimbal: samples.gimbal.map(turned),
            reference: samples.reference,
            position: samples.position.map(placed),
            warnings,
            ..Self::new(name, manifest, time)
        };
        keep_assumed(&mut recording, true);
        note_columns(&mut recording, None);
        checked(recording, &Places::WHOLE)
    }
}

fn in_si(
    path: &Path,
    manifest: &Manifest,
    kind: SensorKind,
    mut values: Vec<Vector3<f64>>,
) -> Result<Triple, ReadError> {
    let manifest_path = || Manifest::path_for(path).unwrap_or_else(|| path.to_path_buf());
    let fault = |fault| ReadError::Manifest { path: manifest_path(), line: 1, fault };
    let nominal = manifest.nominal(kind).map_err(fault)?;
    if nominal != Nominal::IDENTITY {
        values.iter_mut().flatten().for_each(|value| *value = nominal.to_si(*value));
    }
    manifest.triple(kind, values).map_err(fault)
}

/// Refuses what has more or fewer rows than there are times, and a recording without any.
fn check_lengths(path: &Path, samples: &Samples) -> Result<(), ReadError> {
    let expected = samples.time.len();
    if expected == 0 {
        return Err(ReadError::NoRows { path: path.to_path_buf() });
    }
    let lengths = [
        ("acc_x", samples.acc.as_ref().map(Vec::len)),
        ("gyr_x", samples.gyr.as_ref().map(Vec::len)),
        ("mag_x", samples.mag.as_ref().map(Vec::len)),
        (NAMES[TEMPERATURE], samples.temperature.as_ref().map(Vec::len)),
        (NAMES[GIMBAL], samples.gimbal.as_ref().map(Vec::len)),
        (NAMES[REFERENCE], samples.reference.as_ref().map(Vec::len)),
        (NAMES[POSITION], samples.position.as_ref().map(Vec::len)),
    ];
    match lengths.into_iter().find_map(|(column, found)| Some((column, found.filter(|n| *n != expected)?))) {
        Some((column, found)) => {
            Err(ReadError::Lengths { path: path.to_path_buf(), column: column.to_owned(), found, expected })
        }
        None => Ok(()),
    }
}

fn check_finite(path: &Path, samples: &Samples) -> Result<(), ReadError> {
    let infinite = |rows: &mut dyn Iterator<Item = &[f64]>, names: &[&str]| {
        rows.enumerate().find_map(|(row, values)| {
            let at = values.iter().position(|value| value.is_infinite())?;
            let column = names.get(at).map_or_else(String::new, |name| (*name).to_owned());
            Some(ReadError::Infinite {
                path: path.to_path_buf(),
                place: Places::WHOLE.of(row),
                column,
                found: values[at].to_string(),
            })
        })
    };
    let sensors =
        [(SensorKind::Acc, &samples.acc), (SensorKind::Gyr, &samples.gyr), (SensorKind::Mag, &samples.mag)];
    let mut found = sensors.into_iter().find_map(|(kind, values)| {
        infinite(&mut values.iter().flatten().map(Vector3::as_slice), &kind.columns())
    });
    let single = |values: &[f64], slot: usize| infinite(&mut values.chunks(1), &NAMES[slot..=slot]);
    found = found.or_else(|| single(&samples.time, TIME));
    found = found.or_else(|| single(samples.temperature.as_deref().unwrap_or_default(), TEMPERATURE));
    let gimbal = samples.gimbal.iter().flatten();
    found = found.or_else(|| infinite(&mut gimbal.map(<[f64; 3]>::as_slice), &NAMES[GIMBAL..REFERENCE]));
    let reference = samples.reference.iter().flatten();
    found = found.or_else(|| infinite(&mut reference.map(<[f64; 4]>::as_slice), &NAMES[REFERENCE..POSITION]));
    found.map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{
        fixture::{BARE, Fixture, assert_says},
        unit::Unit,
    };

    const SECTIONS: &str = "[units]\nt = \"ms\"\nacc = \"g\"\ngyr = \"counts\"\ngimbal = \"deg\"\n\
        [counts]\ngyr = { offset = 100, per_unit = 50 }\n";

    fn manifest(sections: &str) -> (Manifest, Vec<Warning>) {
        Manifest::parse(&format!("{BARE}{sections}"), Path::new("run.toml")).unwrap()
    }

    fn some() -> Samples {
        Samples {
            time: vec![1_700_000_000_000.0, 1_700_000_000_010.0],
            acc: Some(vec![Vector3::new(0.0, 0.5, 1.0); 2]),
            gyr: Some(vec![Vector3::new(150.0, f64::NAN, 100.0); 2]),
            temperature: Some(vec![20.0, f64::NAN]),
            gimbal: Some(vec![[90.0, 0.0, -90.0]; 2]),
            ..Samples::default()
        }
    }

    #[test]
    fn samples_in_memory_are_the_recording_that_their_file_would_be() {
        let header = "t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,temp,gimbal_outer,gimbal_middle,gimbal_inner\n";
        let rows = "1700000000000,0,0.5,1,150,,100,20,90,0,-90\n1700000000010,0,0.5,1,150,,100,,90,0,-90\n";
        let read = Fixture::new("run.csv", SECTIONS, format!("{header}{rows}")).read();
        let made = Recording::of_samples("run.csv", manifest(SECTIONS), some()).unwrap();
        // NaN is not itself: by text.
        let text = |recording: &Recording| {
            let path = recording.path.clone();
            let plain = Recording { path: "run.csv".into(), ..recording.clone() };
            format!("{plain:?}").replace(&path.display().to_string(), "run.csv")
        };
        let folder = read.path.parent().unwrap().join("").display().to_string();
        assert_eq!(text(&made), text(&read).replace(&folder, ""));
        assert_eq!((made.time[1], made.acc.as_ref().unwrap().unit), (0.01, Unit::Gravity));
    }

    #[test]
    fn what_no_file_may_hold_no_samples_may() {
        let error = |change: &dyn Fn(&mut Samples)| {
            let mut samples = some();
            change(&mut samples);
            Recording::of_samples("run.csv", manifest(SECTIONS), samples).unwrap_err().to_string()
        };
        assert_says(&error(&|it| it.time.clear()), &["run.csv", "no sample"]);
        assert_says(&error(&|it| it.time.reverse()), &["row 2", "column `t`", "strictly increasing"]);
        assert_says(&error(&|it| it.time[0] = f64::NAN), &["row 1", "no time"]);
        assert_says(&error(&|it| it.time[1] = f64::INFINITY), &["row 2", "column `t`", "infinite"]);
        assert_says(
            &error(&|it| it.temperature = Some(vec![1.0])),
            &["column `temp`", "found 1 rows, expected 2"],
        );
        let infinite = |it: &mut Samples| it.gyr.as_mut().unwrap()[1].z = f64::INFINITY;
        assert_says(&error(&infinite), &["run.csv, row 2, column `gyr_z`", "infinite"]);
        let far = |it: &mut Samples| it.gimbal.as_mut().unwrap()[0][2] = f64::NEG_INFINITY;
        assert_says(&error(&far), &["row 1, column `gimbal_inner`", "infinite"]);
    }
}
