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
fn a_log_whose_times_are_dates_and_that_begins_with_comments_is_answered_with_the_command_too() {
    let folder = Folder::new();
    let plain = log(',');
    let dated = plain.lines().skip(1).map(|line| {
        let (time, values) = line.split_once(',').expect("several fields");
        let milliseconds: f64 = time.parse().expect("a time");
        let seconds = (1e3 * milliseconds).round() / 1e6;
        let (minute, second) = ((seconds / 60.0).floor(), seconds % 60.0);
        format!("2026-05-01T14:{minute:02}:{second:09.6}+02:00,{values}\n")
    });
    let header = plain.lines().next().expect("a header");
    folder.write("dated.csv", format!("# of a logger\n# 100 Hz\n{header}\n{}", dated.collect::<String>()));
    let first = folder.run("calibrate dated.csv").with(2).telling(&["first 2026-05-01T14:00:00.0"]);
    let command =
        first.err.lines().last().expect("a command").trim().strip_prefix("imucal ").expect("a command");
    let arguments = command.replace(&folder.path("dated.csv").display().to_string(), "dated.csv");
    let read = folder
        .run(&format!("{arguments} --json dated.json"))
        .with(0)
        .telling(&["comments before the header were passed over", "# or %: 2)"]);
    assert!(!read.err.contains("assumed: t"), "{}", read.err);
    folder.write("log.csv", &plain);
    folder.run(&format!("calibrate log.csv {MAPPED} --json log.json")).with(0);
    // Equal times in other digits: the last ones of a fit differ.
    let [dated, plain] = ["dated.json", "log.json"].map(|name| parameters(&folder, name));
    for row in 0..3 {
        let of = |json: &serde_json::Value| json["gyr"]["gain"][row][row].as_f64().expect("a number");
        assert!((of(&dated) - of(&plain)).abs() < 1e-6, "{dated} {plain}");
    }
    let times = format!("import dated.csv {} --out made.csv", &arguments["calibrate dated.csv".len()..]);
    folder.run(&times).with(0);
    assert!(folder.text("made.csv").lines().nth(1).expect("a row").starts_with("17776368"));
}

#[test]
fn a_log_without_names_or_with_another_ending_is_answered_with_what_to_do() {
    let folder = Folder::new();
    let plain = log(',');
    let rows = plain.split_once('\n').expect("a header").1;
    folder.write("numbers.csv", rows);
    let names = "t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,mag_x,mag_y,mag_z";
    folder.run("calibrate numbers.csv").with(2).telling(&[
        "holds numbers, not names",
        "each of its 10 columns",
        &format!("  {names}\n"),
    ]);
    folder.write("named.csv", format!("{names}\n{rows}"));
    folder.run("calibrate named.csv --unit t=ms,acc=g,gyr=deg/s,mag=uT").with(0);
    for (name, remedy) in
        [("log.txt", "let its name end in .csv"), ("log.mat", "found text"), ("log.xlsx", "as CSV")]
    {
        folder.write(name, &plain);
        for command in ["calibrate", "import --out out.csv"] {
            folder.run(&format!("{command} {name}")).with(2).telling(&[name, remedy]);
        }
    }
}

#[test]
fn a_mapped_log_gives_what_the_recording_made_of_it_gives() {
    let folder = Folder::new();
    folder.write("log.csv", log(','));
    folder.write("semicolons.csv", log(';'));
    folder.run(&format!("calibrate log.csv {MAPPED} --json direct.json")).with(0);
    folder.run(&format!("calibrate semicolons.csv {MAPPED} --json semicolons.json")).with(0);
    folder.write("blanks.csv", format!("# {}", log(' ')));
    folder.run(&format!("calibrate blanks.csv {MAPPED} --json blanks.json")).with(0);
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
    assert_eq!(direct, parameters(&folder, "blanks.json"));
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
