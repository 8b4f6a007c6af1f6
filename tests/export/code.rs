//! The C header and the Python module against the core.

use std::fs;
use std::path::Path;
use std::process::Command;

use imucal_core::corrector::{Compensator, FullCorrector};
use imucal_host::export::Target;
use imucal_host::recording::SensorKind;
use imucal_tests::program::available;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{everything, plain, text};

/// Raw samples and temperatures, some of them beyond all ranges or missing.
fn samples(kind: SensorKind, count: usize) -> Vec<([f32; 3], f32)> {
    let mut random = ChaCha8Rng::seed_from_u64(kind as u64);
    let size = [30.0f32, 400.0, 3000.0][kind as usize];
    let temperatures = [24.3f32, -40.0, 85.0, f32::NAN, f32::INFINITY, 0.0, -0.0];
    (0..count)
        .map(|row| {
            let raw = std::array::from_fn(|_| random.random_range(-size..size));
            let own = random.random_range(-40.0f32..85.0);
            (raw, if row % 3 == 0 { temperatures[row / 3 % temperatures.len()] } else { own })
        })
        .collect()
}

/// Bits of the header's corrections, by a program that reads bits and prints bits.
fn corrected_in_c(folder: &Path, kind: SensorKind, samples: &[([f32; 3], f32)]) -> Vec<[u32; 3]> {
    let main = format!(
        "#include <stdint.h>\n#include <stdio.h>\n#include <string.h>\n#include \"imu.h\"\n\
         int main(void) {{ uint32_t in[4], out[3]; float v[4], c[3];\n\
         while (fread(in, 4, 4, stdin) == 4) {{ memcpy(v, in, 16); imucal_correct(&imucal_{kind}, v, v[3], c);\n\
         memcpy(out, c, 12); fwrite(out, 4, 3, stdout); }} return 0; }}\n"
    );
    let (source, program) = (folder.join(format!("{kind}.c")), folder.join(format!("{kind}-program")));
    fs::write(&source, main).expect("room");
    let compiled = Command::new("cc")
        .args(["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-o"])
        .arg(&program)
        .arg(&source)
        .output()
        .expect("cc");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let bits: Vec<u8> = samples
        .iter()
        .flat_map(|(raw, warmth)| [raw[0], raw[1], raw[2], *warmth])
        .flat_map(|v| v.to_bits().to_ne_bytes())
        .collect();
    fs::write(folder.join("in"), bits).expect("room");
    let input = fs::File::open(folder.join("in")).expect("a file");
    let output = Command::new(&program).stdin(input).output().expect("it runs").stdout;
    let words: Vec<u32> =
        output.chunks_exact(4).map(|b| u32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect();
    words.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
}

#[test]
fn the_c_header_compiles_and_has_the_bits_of_the_core() {
    if !available("cc", &["--version"], "C compiler `cc`", true) {
        return;
    }
    let folder = tempfile::tempdir().expect("room");
    for calibration in [everything(), plain()] {
        fs::write(folder.path().join("imu.h"), text(Target::CHeader, &calibration)).expect("room");
        let record = calibration.to_record(Path::new("cal.toml")).expect("a record");
        for kind in SensorKind::ALL {
            let samples = samples(kind, 20_000);
            let found = corrected_in_c(folder.path(), kind, &samples);
            assert_eq!(found.len(), samples.len());
            let own = record.triad(kind.into()).expect("calibrated");
            let mut core = Compensator::new(FullCorrector::<f32>::try_from(own).expect("not too steep"));
            for ((raw, warmth), found) in samples.iter().zip(&found) {
                let expected = core.apply_at(&Vector3::from(*raw), *warmth).map(f32::to_bits);
                assert_eq!(*found, <[u32; 3]>::from(expected), "{kind} {raw:?} {warmth}");
            }
        }
    }
}

#[test]
fn the_python_module_has_the_core_s_values_both_ways() {
    let python = std::env::var("IMUCAL_PYTHON").unwrap_or_else(|_| "python3".into());
    if !available(&python, &["-c", "import numpy"], "Python with numpy (IMUCAL_PYTHON names one)", false) {
        return;
    }
    let folder = tempfile::tempdir().expect("room");
    let calibration = everything();
    fs::write(folder.path().join("unit.py"), text(Target::Python, &calibration)).expect("room");
    let record = calibration.to_record(Path::new("cal.toml")).expect("a record");
    for kind in SensorKind::ALL {
        let samples: Vec<([f32; 3], f32)> =
            samples(kind, 300).into_iter().filter(|(_, t)| !t.is_infinite()).collect();
        let script = "import json, sys, numpy as np, unit\nkind, rows = json.load(sys.stdin)\nrows = np.array([[np.nan if v is None else v \
                      for v in row] for row in rows], float)\nt = unit.UNIT[kind]\nc = unit.correct_triad(t, rows[:, :3], rows[:, 3])\n\
                      r = unit.corrupt_triad(t, c, rows[:, 3])\nd = unit.sample_unit(np.random.default_rng(1))[kind]['bias']\n\
                      print(json.dumps([c.tolist(), r.tolist(), d.tolist()]))";
        let rows: Vec<serde_json::Value> = samples
            .iter()
            .map(|(raw, t)| {
                let [x, y, z] = raw.map(f64::from);
                serde_json::json!([x, y, z, Some(f64::from(*t)).filter(|t| t.is_finite())])
            })
            .collect();
        fs::write(folder.path().join("in"), serde_json::json!([kind.prefix(), rows]).to_string())
            .expect("room");
        let output = Command::new(&python)
            .current_dir(folder.path())
            .args(["-c", script])
            .stdin(fs::File::open(folder.path().join("in")).expect("a file"))
            .output()
            .expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let [corrected, raw, drawn]: [serde_json::Value; 3] =
            serde_json::from_slice(&output.stdout).expect("JSON");
        let own = record.triad(kind.into()).expect("calibrated");
        let core = FullCorrector::<f64>::try_from(own).expect("not too steep");
        for (row, (value, temperature)) in samples.iter().enumerate() {
            let value = Vector3::from(*value).cast::<f64>();
            let expected = core.apply_at(&value, f64::from(*temperature));
            let found = imucal_tests::golden::vector(&corrected[row]);
            // The record's constants are f32, the module's are not.
            assert!((found - expected).norm() < 2e-6 * expected.norm().max(1.0), "{kind} {found} {expected}");
            let back = imucal_tests::golden::vector(&raw[row]);
            assert!((back - value).norm() < 1e-9 * value.norm(), "{kind} {back} {value}");
        }
        assert_ne!(drawn[0].as_f64(), calibration.triad(kind).map(|triad| triad.bias[0]));
    }
}
