//! Logs of other programs: columns of other names, other units, other separators.

use imucal_host::recording::SensorKind;
use imucal_tests::simulated;

use super::Folder;

/// Options that read the log.
const MAPPED: &str = "--time timestamp_ms --map acc=ax,ay,az --map gyr=gx,gy,gz --map mag=mx,my,mz --unit acc=g,gyr=deg/s,mag=uT";

/// The small recording as somebody's own log: milliseconds, g and °/s, and other names.
pub(super) fn log(separator: char) -> String {
    let small = simulated::small();
    let names = ["timestamp_ms", "ax", "ay", "az", "gx", "gy", "gz", "mx", "my", "mz"];
    let mut text = names.join(&separator.to_string()) + "\n";
    for (row, time) in small.time.iter().enumerate() {
        let mut fields = vec![format!("{:.3}", time * 1e3)];
        let per_si = [1.0 / 9.80665, 180.0 / std::f64::consts::PI, 1.0];
        for (kind, per_si) in SensorKind::ALL.into_iter().zip(per_si) {
            let value = small.sensor(kind).expect("it has all").values[row];
            fields.extend((0..3).map(|axis| format!("{}", value[axis] * per_si)));
        }
        if separator == ';' {
            fields.iter_mut().for_each(|field| *field = field.replace('.', ","));
        }
        text += &(fields.join(&separator.to_string()) + "\n");
    }
    text
}

fn parameters(folder: &Folder, name: &str) -> serde_json::Value {
    let json: serde_json::Value = serde_json::from_str(&folder.text(name)).expect("JSON");
    json["sensors"].clone()
}

#[test]
fn an_unknown_log_is_answered_with_its_columns_and_the_command_that_calibrates_it() {
    let folder = Folder::new();
    folder.write("log.csv", log(','));
    let first = folder.run("calibrate log.csv").with(2);
    let first = first.telling(&["ax", "acc_x, first", "gz", "Then this reads it:"]);
    let command =
        first.err.lines().last().expect("a command").trim().strip_prefix("imucal ").expect("a command");
    assert!(command.contains("--map acc=ax,ay,az") && command.contains("acc=g"), "{command}");
    let arguments = command.replace(&folder.path("log.csv").display().to_string(), "log.csv");
    folder.run(&arguments).with(0).printing(&["accelerometer", "accepted"]);
}

#[test]
fn a_mapped_log_gives_what_the_recording_made_of_it_gives() {
    let folder = Folder::new();
    folder.write("log.csv", log(','));
    folder.write("semicolons.csv", log(';'));
    folder.run(&format!("calibrate log.csv {MAPPED} --json direct.json")).with(0);
    folder.run(&format!("calibrate semicolons.csv {MAPPED} --json semicolons.json")).with(0);
    folder.run(&format!("import log.csv {MAPPED} --out made.csv")).with(0);
    folder.run("calibrate made.csv --json made.json").with(0);
    let direct = parameters(&folder, "direct.json");
    // Values went to SI and back, which rounds, and a fit ends within its tolerance.
    let made = parameters(&folder, "made.json");
    for sensor in ["acc", "gyr", "mag"] {
        let three = |json: &serde_json::Value, key: &str| -> Vec<f64> {
            (0..3).map(|axis| json[sensor][key][axis].as_f64().expect("a number")).collect()
        };
        let (bias, std) = (three(&direct, "bias"), three(&direct, "bias_std"));
        for ((one, other), std) in bias.iter().zip(three(&made, "bias")).zip(std) {
            assert!((one - other).abs() < 1e-3 * std, "{sensor}: {one} {other} {std}");
        }
    }
    assert_eq!(direct, parameters(&folder, "semicolons.json"));
    assert_eq!(direct["acc"]["unit_in"], "g");
}

#[test]
fn a_mapping_that_contradicts_itself_the_file_or_the_numbers_is_bad_usage() {
    let folder = Folder::new();
    folder.write("log.csv", log(','));
    let says = |options: &str, parts: &[&str]| {
        folder.run(&format!("calibrate log.csv --time timestamp_ms {options}")).with(2).telling(parts);
    };
    says("--map acc=ax,ay,ay", &["`ay` mapped twice"]);
    says("--map acc=ax,ay,aw", &["no column `aw`", "Then this reads it"]);
    says("--map force=ax,ay,az", &["`force`", "`acc`, `gyr`"]);
    says("--map acc=ax,ay,az --unit acc=deg/s", &["--unit acc", "m/s^2"]);
    let all = "--map acc=ax,ay,az --map gyr=gx,gy,gz --map mag=mx,my,mz";
    says(&format!("{all} --unit acc=mg,gyr=deg/s"), &["median length", "look like `g`"]);
}
