//! What simulators make of the files: each draws a still stream by its own formula, in which `noise` finds what it was given.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use imucal_host::allan;
use imucal_host::export::{self, Inputs, Target};
use imucal_host::recording::{Manifest, Nominal, Recording, SensorKind, Triple, Unit};
use imucal_host::simulator::random::{Purpose, Random};
use imucal_host::store::noise_file::{Figure, NoiseFile};
use imucal_tests::program::available;
use nalgebra::Vector3;

use super::plain;

const RATE: f64 = 50.0;
const STEP: f64 = 1.0 / RATE;
const ROWS: usize = 100_000;
const KINDS: [SensorKind; 2] = [SensorKind::Acc, SensorKind::Gyr];

/// A folder with the noise of a unit that was recorded at rest.
struct Bench {
    folder: tempfile::TempDir,
    unit: NoiseFile,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("room");
        let mut random = Random::new(1, Purpose::Noise);
        let mut walks = [Vector3::zeros(); 2];
        let still = |_| {
            let mut sample = |sensor: usize, white: f64, walk: f64| {
                walks[sensor] += random.normals() * walk * STEP.sqrt();
                walks[sensor] + random.normals() * white * RATE.sqrt()
            };
            [sample(0, 7e-4, 2e-4), sample(1, 1.4e-4, 2e-5)]
        };
        let unit = noise_of(folder.path(), "unit.csv", (0..ROWS).map(still).collect());
        Self { folder, unit }
    }

    fn document(&self, target: Target) -> String {
        let calibration = plain();
        let inputs = Inputs { calibration: Some(&calibration), noise: Some(&self.unit), ..Inputs::default() };
        export::document(target, &inputs).expect("a document").text
    }

    /// Asserts that the noise of a stream is that of the unit, within the intervals of both.
    fn assert_alike(&self, stream: Vec<[Vector3<f64>; 2]>) {
        let found = noise_of(self.folder.path(), "stream.csv", stream);
        for kind in KINDS {
            let axes = |file: &NoiseFile| -> Vec<[(f64, f64); 2]> {
                let sensor = file.sensor(kind).expect("estimated");
                let ends = |figure: &Figure| figure.interval.map(|[low, high]| (low, high)).expect("seen");
                sensor.known_axes().map(|axis| [ends(&axis.white), ends(&axis.random_walk)]).collect()
            };
            let (found, asked) = (axes(&found), axes(&self.unit));
            assert_eq!((found.len(), asked.len()), (3, 3));
            for (found, asked) in found.iter().flatten().zip(asked.iter().flatten()) {
                assert!(found.0 < asked.1 && asked.0 < found.1, "{kind}: {found:?} {asked:?}");
            }
        }
    }
}

/// The noise of accelerometer and gyroscope, which are written to a recording.
fn noise_of(folder: &Path, name: &str, rows: Vec<[Vector3<f64>; 2]>) -> NoiseFile {
    let path = folder.join(name);
    let time = (0..rows.len()).map(|row| row as f64 * STEP).collect();
    let mut recording = Recording::new(name, Manifest::default(), time);
    let triple = |sensor: usize, unit| Triple {
        values: rows.iter().map(|row| row[sensor]).collect(),
        unit,
        nominal: Nominal::IDENTITY,
        full_scale: None,
        single: false,
    };
    recording.acc = Some(triple(0, Unit::MetrePerSecondSquared));
    recording.gyr = Some(triple(1, Unit::RadianPerSecond));
    recording.write(&path).expect("written");
    NoiseFile::new(&allan::noise(&path, &Default::default(), &Default::default()).expect("noise"), Vec::new())
}

/// An axis of Gazebo's noise (gz-sensors, `GaussianNoiseModel`): a bias through a first-order filter, of which each step has the
/// variance −σ² τ/2 · expm1(−2 dt/τ), and white noise of a sample's deviation. The sign of `bias_mean` is drawn.
struct Gazebo {
    mean: f64,
    stddev: f64,
    kept: f64,
    step: f64,
    bias: f64,
}

impl Gazebo {
    fn read(element: &str, random: &mut Random) -> Self {
        let of = |tag: &str| -> f64 {
            let (_, rest) =
                element.split_once(&format!("<{tag}>")).unwrap_or_else(|| panic!("{tag}: {element}"));
            rest.split('<').next().and_then(|text| text.parse().ok()).expect("a number")
        };
        let (sigma, time) = (of("dynamic_bias_stddev"), of("dynamic_bias_correlation_time"));
        let sign = if random.share() < 0.5 { -1.0 } else { 1.0 };
        Self {
            mean: of("mean"),
            stddev: of("stddev"),
            kept: (-STEP / time).exp(),
            step: (-sigma * sigma * time / 2.0 * (-2.0 * STEP / time).exp_m1()).sqrt(),
            bias: sign * of("bias_mean"),
        }
    }

    fn sample(&mut self, random: &mut Random) -> f64 {
        self.bias = self.kept * self.bias + self.step * random.normal();
        self.mean + self.stddev * random.normal() + self.bias
    }
}

#[test]
fn gazebo_draws_the_noise_of_the_unit_about_its_bias_whatever_sign_it_draws() {
    let bench = Bench::new();
    let text = bench.document(Target::Sdf);
    let elements: Vec<&str> = text.split("<noise type=\"gaussian\">").skip(1).collect();
    let stream = |seed: u64| -> Vec<[Vector3<f64>; 2]> {
        let mut random = Random::new(seed, Purpose::Noise);
        let mut axes: Vec<Gazebo> = elements.iter().map(|text| Gazebo::read(text, &mut random)).collect();
        assert!(axes.len() >= 6, "{text}");
        let mut triple = |first: usize| Vector3::from_fn(|axis, _| axes[first + axis].sample(&mut random));
        (0..ROWS).map(|_| [triple(0), triple(3)]).collect()
    };
    bench.assert_alike(stream(11));
    // Six signs of each seed: were the bias in `bias_mean`, it would turn about in half of them.
    let bias = Vector3::new(1.5, -0.7, 0.2).map(f64::to_radians);
    for seed in 12..16 {
        let rows = stream(seed);
        let mean = rows[..500].iter().map(|row| row[1]).sum::<Vector3<f64>>() / 500.0;
        assert!((mean - bias).amax() < 1e-3, "{seed}: {mean} {bias}");
    }
}

#[test]
fn kalibr_s_model_draws_the_noise_of_the_unit() {
    let bench = Bench::new();
    let text = bench.document(Target::Kalibr);
    let of = |key: &str| -> f64 {
        let (_, rest) = text.split_once(&format!("{key}: ")).unwrap_or_else(|| panic!("{key}: {text}"));
        rest.split_whitespace().next().and_then(|text| text.parse().ok()).expect("a number")
    };
    assert!((of("update_rate") / RATE - 1.0).abs() < 1e-9);
    let mut random = Random::new(21, Purpose::Noise);
    let mut biases = [Vector3::zeros(); 2];
    let sensors = ["accelerometer", "gyroscope"]
        .map(|name| (of(&format!("{name}_noise_density")), of(&format!("{name}_random_walk"))));
    // The wiki of Kalibr, "IMU noise model": densities of continuous time.
    let stream = (0..ROWS).map(|_| {
        let mut sample = |sensor: usize| {
            let (density, walk) = sensors[sensor];
            biases[sensor] += random.normals() * walk * STEP.sqrt();
            biases[sensor] + random.normals() * density / STEP.sqrt()
        };
        [sample(0), sample(1)]
    });
    bench.assert_alike(stream.collect());
}

#[test]
fn the_python_module_draws_the_noise_of_the_unit() {
    let python = std::env::var("IMUCAL_PYTHON").unwrap_or_else(|_| "python3".into());
    if !available(&python, &["-c", "import numpy"], "Python with numpy (IMUCAL_PYTHON names one)", false) {
        return;
    }
    let bench = Bench::new();
    let here = |name: &str| -> PathBuf { bench.folder.path().join(name) };
    fs::write(here("unit.py"), bench.document(Target::Python)).expect("room");
    let script = format!(
        "import numpy as np, unit\nz = np.zeros(({ROWS}, 3))\n\
         acc, gyr, _ = unit.apply(z, z, None, None, {STEP}, np.random.default_rng(31))\n\
         si = [unit.correct_triad(unit.UNIT[k], v, np.nan) for k, v in (('acc', acc), ('gyr', gyr))]\n\
         np.hstack(si).tofile('stream.bin')"
    );
    let output = Command::new(&python)
        .current_dir(bench.folder.path())
        .args(["-c", &script])
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let bytes = fs::read(here("stream.bin")).expect("a stream");
    let numbers: Vec<f64> = bytes.as_chunks::<8>().0.iter().map(|bytes| f64::from_ne_bytes(*bytes)).collect();
    let row = |row: &[f64]| [Vector3::new(row[0], row[1], row[2]), Vector3::new(row[3], row[4], row[5])];
    bench.assert_alike(numbers.chunks_exact(6).map(row).collect());
}
