//! Robots' logs: MCAP files and bags in place of a recording.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use imucal_host::recording::{Recording, SensorKind};
use imucal_tests::robot_log::{Content, Logged, write_bag, write_db3, write_mcap};
use imucal_tests::simulated;
use serde_json::Value;

use super::{Folder, imucal, imucal_on_a_day};

/// The first stamp, ns since 1970: beyond the digits of a double.
const BEGIN: i64 = 1_700_000_000_123_456_789;
const SECTIONS: &str =
    "[site]\nlatitude_deg = 39.87\nheight_m = 938.0\n\n[sensor]\nname = \"MTx\"\nserial = \"7\"\n";
const TOPICS: &str = "--topic imu=/imu/data --topic mag=/imu/mag";

/// The small recording as messages: force and rate, then the field, of one stamp.
fn messages() -> Vec<Logged> {
    let small = simulated::small();
    let mut all = Vec::new();
    for (row, time) in small.time.iter().enumerate() {
        let stamp_ns = BEGIN + (time * 1e9).round() as i64;
        let value = |kind| -> [f64; 3] { small.sensor(kind).expect("it has all").values[row].into() };
        let imu = Content::Imu(value(SensorKind::Acc), value(SensorKind::Gyr));
        let field = Content::Field(value(SensorKind::Mag).map(|field| field * 1e-6));
        all.push(Logged { topic: "/imu/data", stamp_ns, content: imu });
        all.push(Logged { topic: "/imu/mag", stamp_ns, content: field });
    }
    all
}

/// The same as a recording in CSV.
fn csv(messages: &[Logged]) -> String {
    let mut text = "t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,mag_x,mag_y,mag_z\n".to_owned();
    for pair in messages.chunks(2) {
        let (Content::Imu(force, rate), Content::Field(field)) = (pair[0].content, pair[1].content) else {
            panic!("a message of each kind");
        };
        let numbers = force.into_iter().chain(rate).chain(field.map(|field| field * 1e6));
        let numbers: Vec<String> = numbers.map(|number| number.to_string()).collect();
        writeln!(text, "{},{}", pair[0].stamp_ns, numbers.join(",")).expect("a String takes every line");
    }
    text
}

const MANIFEST: &str = "format = \"imucal-recording/1\"\n\n";
const UNITS: &str = "[units]\nt = \"ns\"\nacc = \"m/s^2\"\ngyr = \"rad/s\"\nmag = \"uT\"\n\n";

/// A folder with `run.mcap`, `run.db3`, `run.bag` and, below other names that are as long, the same as CSV.
fn folder() -> Folder {
    let folder = Folder::new();
    let messages = messages();
    write_mcap(&folder.path("run.mcap"), &messages);
    write_db3(&folder.path("run.db3"), &messages);
    write_bag(&folder.path("run.bag"), &messages);
    folder.write("run.toml", format!("{MANIFEST}{SECTIONS}"));
    folder.write("rows.csv", csv(&messages));
    folder.write("rows.toml", format!("{MANIFEST}{UNITS}{SECTIONS}"));
    folder
}

/// A JSON file without the names of the recordings that it is of.
fn nameless(folder: &Folder, name: &str) -> String {
    ["rows.csv", "run.mcap", "run.db3", "run.bag"]
        .iter()
        .fold(folder.text(name), |text, other| text.replace(other, "NAME"))
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../imucal-host/logs/tests/fixtures").join(name)
}

#[test]
fn a_log_gives_the_calibration_of_the_same_data_as_csv_to_the_last_digit() {
    let folder = folder();
    let calibrate =
        |arguments: &str| imucal_on_a_day(&folder.arguments(&format!("calibrate {arguments}"))).with(0);
    calibrate("rows.csv --json csv.json --record csv.bin").printing(&["accelerometer (T9): accepted"]);
    calibrate(&format!("run.mcap {TOPICS} --json mcap.json --record mcap.bin"));
    calibrate(&format!("run.bag {TOPICS} --json bag.json --record bag.bin"));
    calibrate(&format!("run.db3 {TOPICS} --json db3.json --record db3.bin"));
    let expected = nameless(&folder, "csv.json");
    for log in ["mcap", "bag"] {
        assert_eq!(nameless(&folder, &format!("{log}.json")), expected, "{log}");
        assert_eq!(folder.bytes(&format!("{log}.bin")), folder.bytes("csv.bin"), "{log}");
    }
    // A bag of Humble in SQLite has no definitions, which is all that differs.
    assert_eq!(folder.bytes("db3.bin"), folder.bytes("csv.bin"));
    let [mut found, mut expected] = ["db3.json", "csv.json"]
        .map(|name| serde_json::from_str::<Value>(&nameless(&folder, name)).expect("a report"));
    let warnings = found["warnings"].take().to_string();
    assert_eq!(warnings.matches("carries no definition of its messages").count(), 2, "{warnings}");
    expected["warnings"].take();
    assert_eq!(found, expected);
}

#[test]
fn a_bag_in_sqlite_is_read_by_every_command_that_reads_logs() {
    let folder = folder();
    folder.run(&format!("import run.db3 {TOPICS} --out straight.csv")).with(0);
    assert_eq!(folder.text("straight.csv"), folder.text("rows.csv"));
    folder.run("calibrate run.db3 --topic imu=/imu/dta").with(2).telling(&["did you mean `/imu/data`?"]);
    folder.run("noise run.db3 --topic imu=/imu/data").with(1).telling(&["run.db3"]);
    folder.run(&format!("calibrate run.db3 {TOPICS} --record unit.bin")).with(0);
    folder.run(&format!("apply run.db3 {TOPICS} --calibration unit.bin")).with(0);
    assert!(folder.text("run-calibrated.csv").starts_with("t,acc_x"));
}

/// A bag's folder `walk`: the messages in two files, and what lists them.
fn write_walk(folder: &Folder) {
    let (bag, messages) = (folder.path("walk"), messages());
    std::fs::create_dir(&bag).expect("room");
    let (first, second) = messages.split_at(messages.len() / 2);
    write_mcap(&bag.join("walk_0.mcap"), first);
    write_mcap(&bag.join("walk_1.mcap"), second);
    let metadata = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - walk_0.mcap\n    - walk_1.mcap\n";
    std::fs::write(bag.join("metadata.yaml"), metadata).expect("room");
    folder.write("walk.toml", folder.text("run.toml"));
}

#[test]
fn a_bag_of_several_files_is_one_log() {
    let folder = folder();
    write_walk(&folder);
    let walk = folder.path("walk").display().to_string();
    for (log, record) in [("run.mcap", "one.bin"), (walk.as_str(), "all.bin")] {
        let record = folder.path(record).display().to_string();
        let log = if log == walk { walk.clone() } else { folder.path(log).display().to_string() };
        imucal(&[
            "calibrate",
            &log,
            "--topic",
            "imu=/imu/data",
            "--topic",
            "mag=/imu/mag",
            "--record",
            &record,
        ])
        .with(0);
    }
    assert_eq!(folder.bytes("all.bin"), folder.bytes("one.bin"));
    let page = folder.path("walk.html").display().to_string();
    imucal(&["calibrate", &walk, "--html", &page]).with(0);
    let both = ["walk_0.mcap", "walk_1.mcap"].map(|name| folder.path("walk").join(name));
    let (bytes, hash) = imucal_host::file::digest::sha256(&both).expect("they are there");
    let page = folder.text("walk.html");
    assert!(page.contains(&hash) && page.contains(&format!("walk, {bytes} bytes in 2 files")));
    let record = folder.path("all.bin").display().to_string();
    imucal(&["apply", &walk, "--calibration", &record]).with(0);
    assert!(folder.text("walk-calibrated.csv").starts_with("t,acc_x"));
    let first = folder.path("walk").join("walk_0.mcap").display().to_string();
    imucal(&["check", &first, "--calibration", &record])
        .telling(&["one of the 2 files of a bag", "give the folder"]);
    // In a folder of recordings it is one of them.
    imucal(&["batch", &walk, "--out", &folder.path("out").display().to_string()]).with(0).printing(&["1 "]);
}

#[test]
fn of_a_folder_without_metadata_the_files_that_are_read_are_named() {
    let folder = folder();
    let bag = folder.path("walk");
    std::fs::create_dir(&bag).expect("room");
    folder.run("calibrate ./walk").with(2).telling(&["found a folder, expected a file", "imucal import"]);
    std::fs::copy(folder.path("run.db3"), bag.join("walk_0.db3")).expect("room");
    folder.run("calibrate ./walk").with(2).telling(&["give the one in it that is read", "walk_0.db3"]);
    std::fs::write(bag.join("metadata.yaml"), "rosbag2_bagfile_information:\n").expect("room");
    folder.run("calibrate ./walk").with(2).telling(&["metadata.yaml", "ros2 bag reindex"]);
}

#[test]
fn a_log_needs_no_manifest_and_no_topic_where_there_is_no_choice() {
    let folder = folder();
    std::fs::remove_file(folder.path("run.toml")).expect("it is there");
    folder.run("calibrate run.mcap").with(0).printing(&["accelerometer (T9): accepted"]).telling(&[
        "took /imu/data (sensor_msgs/msg/Imu, ",
        "as imu, /imu/mag (sensor_msgs/msg/MagneticField, ",
        "as mag",
        "--topic",
    ]);
    folder.run("calibrate run.bag --topic mag=none --topic imu=/imu/data").with(0);
}

#[test]
fn several_and_misspelt_topics_are_answered_with_the_list_and_the_command() {
    let folder = Folder::new();
    let twice: Vec<Logged> = messages()
        .into_iter()
        .map(|message| match message.content {
            Content::Field(_) => {
                Logged { topic: "/head/imu", content: Content::Imu([0.0, 0.0, 9.8], [0.0; 3]), ..message }
            }
            _ => message,
        })
        .collect();
    write_mcap(&folder.path("run.mcap"), &twice);
    let count = format!("{} messages", twice.len() / 2);
    let command = |ended: &str| -> String {
        let last = ended.lines().last().expect("a command").trim();
        let arguments = last.strip_prefix("imucal ").expect("a command");
        arguments.replace(&folder.path("run.mcap").display().to_string(), "run.mcap")
    };
    let several = folder.run("calibrate run.mcap").with(2).telling(&[
        "several topics of sensor_msgs/Imu",
        "/head/imu  sensor_msgs/msg/Imu",
        &count,
    ]);
    assert_eq!(command(&several.err), "calibrate run.mcap --topic imu=/head/imu");
    let misspelt = folder
        .run("calibrate run.mcap --topic imu=/imu/dta")
        .with(2)
        .telling(&["no topic `/imu/dta`; did you mean `/imu/data`?"]);
    assert_eq!(command(&misspelt.err), "calibrate run.mcap --topic imu=/imu/data");
    folder.run(&command(&misspelt.err)).with(0).printing(&["accelerometer (T9): accepted"]);
    folder
        .run("calibrate run.mcap --topic mag=/imu/data")
        .with(2)
        .telling(&["found sensor_msgs/msg/Imu, expected messages of sensor_msgs/MagneticField"]);
}

#[test]
fn another_definition_an_unknown_container_and_options_of_other_files_are_bad_usage() {
    let folder = folder();
    let other = fixture("other-definition.mcap").display().to_string();
    imucal(&["calibrate", &other]).with(2).telling(&[
        "`/imu/data`",
        "`float32 angular_velocity.x` where `float64 angular_velocity.x` is expected",
    ]);
    folder.write("cut.db3", &folder.bytes("run.db3")[..9000]);
    folder.run("calibrate cut.db3").with(2).telling(&["cannot be read", "cut.db3 .recover"]);
    folder.write("bad.mcap", "t,acc_x\n");
    folder.run("calibrate bad.mcap").with(2).telling(&["begins with `t,acc_x", "expected MCAP"]);
    folder.run("calibrate rows.csv --topic imu=/imu/data").with(2).telling(&["--topic", "no log"]);
    folder.run("calibrate run.mcap --map acc=x,y,z").with(2).telling(&["--map", "choose topics"]);
    folder.run("calibrate run.mcap --topic /imu/data").with(2).telling(&["such as imu=/imu/data"]);
    folder.run("calibrate run.mcap --max-size 20K").with(2).telling(&["20 KiB", "--max-size"]);
    folder.run("import rows.csv --out made.db3").with(2).telling(&["`.db3`", "expected .csv"]);
}

#[test]
fn a_cut_log_is_read_as_far_as_it_goes() {
    let folder = folder();
    for name in ["run.mcap", "run.bag"] {
        let whole = folder.bytes(name);
        folder.write(name, &whole[..whole.len() * 9 / 10]);
        folder
            .run(&format!("calibrate {name} {TOPICS}"))
            .with(0)
            .printing(&["accelerometer (T9): accepted"])
            .telling(&[name, "is cut at byte"]);
    }
}

#[test]
fn messages_out_of_order_are_sorted() {
    let folder = folder();
    let mut messages = messages();
    let half = messages.len() / 2;
    messages.rotate_left(half - half % 2);
    write_mcap(&folder.path("run.mcap"), &messages);
    folder
        .run(&format!("import run.mcap {TOPICS} --out sorted.csv"))
        .with(0)
        .telling(&["sorted by their stamps"]);
    folder.run(&format!("import run.bag {TOPICS} --out straight.csv")).with(0);
    assert_eq!(folder.text("sorted.csv"), folder.text("straight.csv"));
    assert_eq!(folder.text("sorted.csv"), folder.text("rows.csv"));
}

#[test]
fn units_that_a_manifest_states_of_a_log_are_warned_of() {
    let folder = folder();
    folder.write("run.toml", format!("{MANIFEST}[units]\nt = \"ms\"\nacc = \"g\"\n"));
    folder
        .run(&format!("calibrate run.mcap {TOPICS}"))
        .with(2)
        .telling(&["the median length is 102", "m/s^2"]);
    folder.write("run.toml", format!("{MANIFEST}[units]\nt = \"ms\"\ngyr = \"deg/s\"\n"));
    let said = ["gyr: deg/s is stated, where messages of ROS are in rad/s", "t = \"ms\" is stated"];
    folder.run(&format!("import run.mcap {TOPICS} --out made.csv")).with(0).telling(&said);
}

#[test]
fn apply_noise_and_diagnose_take_logs_and_a_simulator_s_topic_of_the_same_one() {
    let folder = folder();
    folder.run("calibrate rows.csv --out cal.toml").with(0);
    folder
        .run(&format!("apply run.mcap --calibration cal.toml {TOPICS}"))
        .with(0)
        .printing(&["run-calibrated.csv"]);
    let noise =
        |name: &str, topics: &str| folder.run(&format!("noise {name} {topics}")).err.replace(name, "NAME");
    assert_eq!(noise("run.mcap", TOPICS), noise("rows.csv", ""));

    // A simulator that lacks nothing but the noise: its topic is what the sensors read, without the field.
    let mut messages = messages();
    let ideal: Vec<Logged> = messages
        .iter()
        .filter(|message| matches!(message.content, Content::Imu(..)))
        .map(|message| Logged { topic: "/imu/ideal", ..*message })
        .collect();
    messages.extend(&ideal);
    messages.sort_by_key(|message| message.stamp_ns);
    write_mcap(&folder.path("both.mcap"), &messages);
    folder.write("both.toml", format!("{MANIFEST}{SECTIONS}"));
    let rows: String = csv(&self::messages()).lines().fold(String::new(), |text, line| {
        text + &line.split(',').take(7).collect::<Vec<_>>().join(",") + "\n"
    });
    folder.write("ideal.csv", rows);
    folder.write("ideal.toml", format!("{MANIFEST}{UNITS}"));
    let log = folder
        .run(&format!("diagnose both.mcap {TOPICS} --sim both.mcap --sim-topic /imu/ideal --json log.json"));
    let rows = folder.run("diagnose rows.csv --sim ideal.csv --json rows.json");
    assert_eq!(log.status, rows.status, "{}\n{}", log.err, rows.err);
    let nameless = |name: &str| {
        ["both.mcap", "rows.csv", "ideal.csv"]
            .iter()
            .fold(folder.text(name), |text, other| text.replace(other, "NAME"))
    };
    assert_eq!(nameless("log.json"), nameless("rows.json"));
}

#[test]
fn calibrated_data_are_written_as_a_log_that_has_the_numbers_of_csv() {
    let folder = folder();
    folder.run("calibrate rows.csv --out cal.toml").with(0);
    let apply =
        |out: &str| folder.run(&format!("apply run.mcap --calibration cal.toml {TOPICS} --out {out}"));
    apply("si.csv").with(0);
    apply("log.mcap").with(0).printing(&["log.mcap"]);
    assert!(folder.text("log.toml").contains("[site]") && !folder.text("log.toml").contains("[units]"));
    folder
        .run("import log.mcap --out back.csv")
        .with(0)
        .telling(&["took /imu/data_raw (sensor_msgs/msg/Imu"]);
    let [si, back] = ["si.csv", "back.csv"].map(|name| folder.text(name));
    assert!(si.lines().count() > 1000 && si.lines().count() == back.lines().count());
    for (a, b) in si.lines().zip(back.lines()).skip(1) {
        let of = |line: &str| -> Vec<f64> {
            line.split(',').map(|field| field.parse().unwrap_or(f64::NAN)).collect()
        };
        let (a, b) = (of(a), of(b));
        assert_eq!(a.len(), b.len());
        // The field went to T and back.
        let same = |(a, b): (&f64, &f64)| (a.is_nan() && b.is_nan()) || *a as f32 == *b as f32;
        assert!(a.iter().zip(&b).all(same), "{a:?} {b:?}");
    }
    let said = ["less.mcap: left out `note`", "write CSV"];
    let rows = folder.text("rows.csv").lines().fold(String::new(), |text, line| text + line + ",note\n");
    folder.write("noted.csv", rows);
    folder.write("noted.toml", folder.bytes("rows.toml"));
    folder.run("apply noted.csv --calibration cal.toml --out less.mcap").with(0).telling(&said);
}

/// Rows of six numbers in SI as messages of a topic.
fn imu_messages<'a>(
    topic: &'static str,
    rows: impl Iterator<Item = (f64, [f64; 3], [f64; 3])> + 'a,
) -> impl Iterator<Item = Logged> + 'a {
    rows.map(move |(time, force, rate)| Logged {
        topic,
        stamp_ns: BEGIN + (time * 1e9).round() as i64,
        content: Content::Imu(force, rate),
    })
}

#[test]
fn a_bag_with_a_simulated_topic_becomes_the_page_of_a_diagnosis() {
    let folder = Folder::new();
    let out = folder.path("run.csv").display().to_string();
    let effect = ["--effect", "clk.time_offset=2"];
    imucal(&[&["simulate", "--robot", "wheeled", "--duration", "60", "--out", &out][..], &effect].concat())
        .with(0);
    let real = Recording::read(&folder.path("run-real.csv")).expect("just written");
    let measured = real.time.iter().enumerate().map(|(row, time)| {
        let value = |kind| -> [f64; 3] { real.sensor(kind).expect("it has it").values[row].into() };
        (*time, value(SensorKind::Acc), value(SensorKind::Gyr))
    });
    let simulated = folder.text("run-sim.csv");
    let ideal = simulated.lines().skip(1).map(|line| {
        let n: Vec<f64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
        (n[0], [n[1], n[2], n[3]], [n[4], n[5], n[6]])
    });
    let mut messages: Vec<Logged> =
        imu_messages("/imu/data", measured).chain(imu_messages("/imu/ideal", ideal)).collect();
    messages.sort_by_key(|message| message.stamp_ns);
    write_bag(&folder.path("run.bag"), &messages);
    folder.write("run.toml", format!("{MANIFEST}{SECTIONS}"));

    let streams = "--topic imu=/imu/data --sim run.bag --sim-topic /imu/ideal";
    let ended = folder.run(&format!("diagnose run.bag {streams} --html page.html --json gap.json"));
    let gap: Value = serde_json::from_str(&folder.text("gap.json")).expect("JSON");
    let causes: Vec<&str> = gap["causes"]
        .as_array()
        .expect("causes")
        .iter()
        .filter_map(|cause| cause["effect"].as_str())
        .collect();
    assert_eq!(causes, ["clk.time_offset"], "{}\n{}", ended.out, ended.err);
    super::pages::is_laid_out(&folder, "page.html", 4, &["clk.time_offset", "From the gap to the noise"]);
}

#[test]
fn a_folder_of_euroc_becomes_a_recording_with_its_reference() {
    let folder = Folder::new();
    std::fs::create_dir_all(folder.path("mav0/imu0")).expect("room");
    std::fs::create_dir_all(folder.path("mav0/vicon0")).expect("room");
    let (mut imu, mut pose) = (
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n".to_owned(),
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n".to_owned(),
    );
    for k in 0..400 {
        let at = BEGIN + 5_000_000 * k;
        writeln!(imu, "{at},0.01,-0.02,0.03,{},0.1,9.7", 0.01 * k as f64).expect("a String");
        if k % 2 == 0 {
            writeln!(pose, "{at},1,2,3,1,0,0,0").expect("a String");
        }
    }
    folder.write("mav0/imu0/data.csv", imu);
    folder.write("mav0/vicon0/data.csv", pose);
    let [within, out] = [folder.0.path().to_path_buf(), folder.path("made.csv")];
    let [within, out] = [within, out].map(|path| path.display().to_string());
    imucal(&["import", &within, "--from", "euroc", "--out", &out]).with(0).printing(&["400 rows"]);
    let made = folder.text("made.csv");
    assert!(made.starts_with("t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_qw"), "{}", &made[..100]);
    assert!(
        made.lines().nth(3).expect("a row").starts_with("1700000000133456789,0.02,0.1,9.7,0.01,-0.02,0.03,")
    );
    assert!(made.lines().nth(2).expect("a row").ends_with(",,,,,,,"), "{made:.600}");
}
