//! A recording's file corrected into another one, part after part in constant memory.

use std::path::Path;

use imucal_core::{
    nonlinearity::TooSteep,
    record::{CalibrationRecord, HigherOrder},
};

use super::{ApplyError, Correction, check};
use crate::{
    file::OutputSet,
    recording::{
        ReadError, Recording, Source, Warning, WriteError,
        transfer::{TransferError, transfer},
    },
    store::StoredCalibration,
};

/// What has been corrected.
#[derive(Clone, Debug, PartialEq)]
pub struct Applied {
    /// Name of the recording.
    pub recording: String,
    /// Its rows.
    pub rows: usize,
    /// What was odd but harmless in it.
    pub warnings: Vec<Warning>,
    /// That nobody can know whether it and the calibration belong together, and what is not as its terms of temperature want it.
    pub remarks: Vec<String>,
}

/// Why a file was not corrected.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The calibration is not for it.
    #[error("{refusal}")]
    Refused {
        /// Why.
        refusal: ApplyError,
        /// What was odd in the first part.
        warnings: Vec<Warning>,
    },
    /// Nonlinear terms that cannot be undone.
    #[error(transparent)]
    TooSteep(#[from] TooSteep),
    /// The result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Corrects a recording's file into files of a set that is to be committed: what [`apply`](super::apply) makes of the whole.
/// Whether the calibration belongs to it is judged by the first part, before anything is written.
///
/// # Errors
/// [`StreamError`]; then the set is not to be committed.
pub fn stream(
    source: Source<'_>,
    (stored, record): (&StoredCalibration, &CalibrationRecord<HigherOrder>),
    other_serial: bool,
    out: &Path,
    files: &mut OutputSet,
) -> Result<Applied, StreamError> {
    let mut correction = Correction::new(stored, record)?;
    let mut first = None;
    let judge = |part: &Recording| (part.name.clone(), check(part, stored, record, other_serial));
    let transferred = transfer(source, out, files, |part| {
        let (_, judged) = first.get_or_insert_with(|| judge(&part));
        judged.is_ok().then(|| correction.correct(part))
    });
    let transferred = transferred.map_err(|error| match error {
        TransferError::Read(error) => StreamError::Read(error),
        TransferError::Write(error) => StreamError::Write(error),
    })?;
    let (rows, warnings) = (transferred.rows, transferred.warnings);
    match first {
        Some((_, Err(refusal))) => Err(StreamError::Refused { refusal, warnings }),
        Some((recording, Ok(remark))) => {
            let remarks = remark.into_iter().chain(correction.remarks()).collect();
            Ok(Applied { recording, rows, warnings, remarks })
        }
        None => Err(ReadError::NoRows { path: source.path.to_path_buf() }.into()),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::{fs, path::PathBuf};

    use super::*;
    use crate::{apply::apply, file::Limits, recording::Mapping};

    const MANIFEST: &str = "format = \"imucal-recording/1\"\n[units]\nt = \"s\"\nacc = \"counts\"\n\
        [counts]\nacc = { offset = 32768.0, per_unit = 600.0 }\n";
    /// Temperature and nonlinear terms.
    pub(in crate::apply) const CALIBRATION: &str = r#"
format = "imucal-calibration/1"
recording = "run.csv"
date = "2026-11-26"
[sensor]
name = ""
serial = ""
[acc]
model = "T9"
unit_in = "counts"
unit_out = "m/s^2"
gain = [[0.00166, 0.0, -0.00001], [0.0, 0.00167, 0.00002], [0.0, 0.0, 0.00166]]
bias = [33123.75, 33275.125, 32364.5]
gain_std = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
bias_std = [0.25, 0.25, 0.25]
rms = 0.001
observations = 38
parameters = 9
condition = 16.0
coverage = 0.875
[acc.temperature]
reference = 25.0
bias_slope = [3.0, -2.0, 1.0]
scale_slope = [0.0001, 0.0002, -0.0001]
[acc.nonlinearity]
range = 10000.0
quadratic = [1e-8, -2e-8, 1e-8]
cubic = [1e-13, 0.0, 0.0]
cross = [[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.0, 0.0, 0.0]]
quadratic_std = [0.0, 0.0, 0.0]
cubic_std = [0.0, 0.0, 0.0]
cross_std = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
"#;

    struct Bench {
        folder: tempfile::TempDir,
        stored: StoredCalibration,
        record: CalibrationRecord<HigherOrder>,
    }

    impl Bench {
        /// A recording of three parts. The second begins without a temperature.
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let rows = 2 * 65_536 + 5;
            let row = |k: usize| {
                let temperature =
                    if k % 65_536 < 40 && k > 40 { String::new() } else { (20 + k % 7).to_string() };
                let note = if k.is_multiple_of(3) { "\"a, \"\"b\"\"\"" } else { "c" };
                let x = 33_000 + k % 611;
                format!(
                    "{},{x},{},38300,{temperature},{},{note}\n",
                    k as f64 / 128.0,
                    33_300 - k % 97,
                    k / 1000
                )
            };
            let text = (0..rows)
                .fold("t,acc_x,acc_y,acc_z,temp,segment,note\n".to_owned(), |text, k| text + &row(k));
            fs::write(folder.path().join("run.csv"), text).unwrap();
            fs::write(folder.path().join("run.toml"), MANIFEST).unwrap();
            let stored: StoredCalibration = toml::from_str(CALIBRATION).unwrap();
            let record = stored.to_record(Path::new("cal.toml")).unwrap();
            Self { folder, stored, record }
        }

        fn path(&self, name: &str) -> PathBuf {
            self.folder.path().join(name)
        }

        fn stream(&self, out: &str) -> Result<Applied, StreamError> {
            let (path, mapping, limits) = (self.path("run.csv"), Mapping::default(), Limits::default());
            let source = Source { path: &path, mapping: &mapping, manifest: None, limits: &limits };
            let mut files = OutputSet::default();
            let applied = stream(source, (&self.stored, &self.record), false, &self.path(out), &mut files)?;
            files.commit().unwrap();
            Ok(applied)
        }

        fn whole(&self) -> Recording {
            apply(&Recording::read(&self.path("run.csv")).unwrap(), &self.stored, &self.record).unwrap()
        }
    }

    fn assert_the_parts_give_what_the_whole_gives(bench: &Bench, whole: &Recording, ending: &str) {
        let [parts, at_once] = ["parts", "whole"].map(|name| format!("{name}.{ending}"));
        let applied = bench.stream(&parts).unwrap();
        whole.write(&bench.path(&at_once)).unwrap();
        assert!(fs::read(bench.path(&parts)).unwrap() == fs::read(bench.path(&at_once)).unwrap(), "{ending}");
        let manifest = |name: &str| fs::read_to_string(bench.path(name)).unwrap();
        assert_eq!(manifest("parts.toml"), manifest("whole.toml"));
        assert_eq!((applied.rows, &applied.warnings), (whole.rows(), &whole.warnings));
        assert!(applied.remarks.len() == 1 && applied.remarks[0].contains("no serial"));
    }

    #[test]
    fn a_file_is_corrected_by_parts_as_its_whole() {
        let bench = Bench::new();
        let whole = bench.whole();
        assert_the_parts_give_what_the_whole_gives(&bench, &whole, "csv");
        assert_the_parts_give_what_the_whole_gives(&bench, &whole, "csv.gz");
        #[cfg(feature = "parquet")]
        assert_the_parts_give_what_the_whole_gives(&bench, &whole, "parquet");
    }

    #[test]
    fn corrected_numbers_have_the_digits_of_the_core_s_and_the_others_are_as_they_were() {
        let bench = Bench::new();
        bench.stream("out.csv").unwrap();
        let (before, after) =
            ["run.csv", "out.csv"].map(|name| fs::read_to_string(bench.path(name)).unwrap()).into();
        let whole = bench.whole();
        let values = &whole.acc.as_ref().unwrap().values;
        for ((before, after), value) in before.lines().zip(after.lines()).skip(1).zip(values) {
            let (before, after) = (fields(before), fields(after));
            assert_eq!((before[0], &before[4..]), (after[0], &after[4..]));
            for (text, value) in after[1..4].iter().zip(value) {
                assert_eq!(text.parse::<f64>().unwrap() as f32, *value as f32);
                assert_eq!(*text, (*value as f32).to_string());
            }
        }
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn in_parquet_corrected_numbers_are_those_of_the_core_and_others_doubles() {
        use parquet::{
            basic::Type::{DOUBLE, FLOAT},
            file::reader::{FileReader, SerializedFileReader},
        };
        let bench = Bench::new();
        bench.stream("out.parquet").unwrap();
        let (whole, again) = (bench.whole(), Recording::read(&bench.path("out.parquet")).unwrap());
        let bits = |recording: &Recording| -> Vec<[u32; 3]> {
            let values = &recording.acc.as_ref().unwrap().values;
            values.iter().map(|v| v.map(|x| (x as f32).to_bits()).into()).collect()
        };
        assert_eq!(bits(&whole), bits(&again));
        let reader = SerializedFileReader::new(fs::File::open(bench.path("out.parquet")).unwrap()).unwrap();
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        let kinds = schema.columns().iter().map(|column| (column.name(), column.physical_type()));
        for (name, kind) in kinds.filter(|(name, _)| name.starts_with("acc") || name.starts_with("gyr")) {
            assert_eq!(kind, if name.starts_with("acc") { FLOAT } else { DOUBLE }, "{name}");
        }
    }

    fn fields(line: &str) -> Vec<&str> {
        line.splitn(5, ',').collect()
    }

    #[test]
    fn what_a_calibration_has_corrected_is_not_corrected_by_it_a_second_time() {
        let mut bench = Bench::new();
        bench.stream("out.csv").unwrap();
        fs::rename(bench.path("out.csv"), bench.path("run.csv")).unwrap();
        fs::rename(bench.path("out.toml"), bench.path("run.toml")).unwrap();
        let refused = bench.stream("again.csv").unwrap_err().to_string();
        assert!(refused.contains("acc was corrected by this calibration before"), "{refused}");
        // What the first one left is corrected by another; both are named.
        let acc = bench.stored.acc.as_mut().unwrap();
        let first = acc.identity();
        (acc.unit_in, acc.gain) = (acc.unit_out, [[1.01, 0.0, 0.0], [0.0, 0.99, 0.0], [0.0, 0.0, 1.0]]);
        (acc.bias, acc.temperature, acc.nonlinearity) = ([0.01, 0.0, 0.0], None, None);
        let second = acc.identity();
        bench.record = bench.stored.to_record(Path::new("cal.toml")).unwrap();
        bench.stream("again.csv").unwrap();
        let again = Recording::read(&bench.path("again.csv")).unwrap();
        assert_eq!(again.manifest.calibrated.acc, Some(vec![first, second]));
    }

    #[test]
    fn what_is_refused_by_its_first_part_writes_nothing() {
        let mut bench = Bench::new();
        bench.stored.acc.as_mut().unwrap().unit_in = crate::recording::Unit::Gravity;
        let refused = bench.stream("out.csv").unwrap_err();
        assert!(
            matches!(refused, StreamError::Refused { .. })
                && refused.to_string().contains("acc is in counts")
        );
        bench.stored.acc.as_mut().unwrap().unit_in = crate::recording::Unit::Counts;
        // Twice the full scale.
        let twice = |acc: &mut crate::store::StoredTriad| {
            acc.gain.as_flattened_mut().iter_mut().for_each(|entry| *entry *= 2.0)
        };
        bench.stored.acc.iter_mut().for_each(twice);
        let refused = bench.stream("out.csv").unwrap_err().to_string();
        assert!(refused.contains("acc: in the calibration a count is 2.00 times what [counts]"), "{refused}");
        bench
            .stored
            .acc
            .iter_mut()
            .for_each(|acc| acc.gain.as_flattened_mut().iter_mut().for_each(|entry| *entry /= 2.0));
        let text = fs::read_to_string(bench.path("run.csv")).unwrap();
        fs::write(bench.path("run.csv"), text + "0,1,2,3,,,\n").unwrap();
        assert!(matches!(bench.stream("out.csv").unwrap_err(), StreamError::Read(_)));
        assert_eq!(fs::read_dir(bench.folder.path()).unwrap().count(), 2);
    }
}
