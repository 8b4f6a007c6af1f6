//! Logs that other writers wrote are read as they were said; see `fixtures/generate.py`, whose formulas stand here again.

use std::{
    fs,
    path::{Path, PathBuf},
};

use imucal_logs::{Kind, Log, LogError, LogWarning, Place, Reading, Refusal, Stream};

const BEGIN: i64 = 1_700_000_000_123_456_789;
const SIZE: u64 = 1 << 30;
/// Logs of records in a row, whose content is one and the same.
const RECORDS: [&str; 8] = [
    "ros2-none.mcap",
    "ros2-lz4.mcap",
    "ros2-zstd.mcap",
    "rosbag2.mcap",
    "ros1.mcap",
    "none.bag",
    "bz2.bag",
    "lz4.bag",
];

/// Databases of the same content: with definitions, with messages that are compressed too, and without definitions.
const DATABASES: [&str; 3] = ["iron.db3", "compressed.db3", "foxy.db3"];
/// A folder of two files that together are the same.
const FOLDER: &str = "split";

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn read(path: &Path, topics: &[&str]) -> Reading {
    Log::open(path, SIZE).and_then(|log| log.read(topics)).expect("it reads")
}

fn stamp(k: usize) -> i64 {
    BEGIN + 10_000_000 * k as i64
}

fn assert_imu(stream: &Stream, rows: usize) {
    assert_eq!((stream.kind, stream.frame.as_str(), stream.stamps_ns.len()), (Kind::Imu, "imu_link", rows));
    for k in 0..rows {
        assert_eq!(stream.stamps_ns[k], stamp(k));
        let (row, at) = (stream.row(k), k as f64);
        assert_eq!(row[..6], [0.25 * (k % 4) as f64, -0.5, 9.75, 0.125 * at, -0.25 * at, 0.5], "{k}");
        match k % 2 {
            0 => assert_eq!(row[6..], [0.8, 0.0, 0.0, 0.6]),
            _ => assert!(row[6..].iter().all(|part| part.is_nan())),
        }
    }
}

fn damaged(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("room");
    (folder, path)
}

#[test]
fn each_container_and_compression_gives_the_numbers_and_stamps_that_were_written() {
    let topics = ["/imu/data", "/imu/mag", "/imu/temperature", "/vicon/pose", "/pose_cov", "/odom"];
    for name in RECORDS.into_iter().chain(DATABASES).chain([FOLDER]) {
        let reading = read(&fixture(name), &topics);
        let undefined = |warning: &LogWarning| matches!(warning, LogWarning::NoDefinition { .. });
        let expected = if name == "foxy.db3" { topics.len() } else { 0 };
        assert_eq!(reading.warnings.iter().filter(|warning| undefined(warning)).count(), expected, "{name}");
        assert_eq!(reading.warnings.len(), expected, "{name}: {:?}", reading.warnings);
        assert_imu(&reading.streams[0], 40);
        let mag = &reading.streams[1];
        assert_eq!((mag.kind, mag.stamps_ns.len(), mag.stamps_ns[3]), (Kind::MagneticField, 20, stamp(6)));
        assert_eq!(mag.row(3), [2e-5, 1e-6 * 6.0, -4e-5]);
        let warm = &reading.streams[2];
        assert_eq!(
            (warm.kind, warm.values.as_slice()),
            (Kind::Temperature, [20.0, 30.0, 40.0, 50.0].as_slice())
        );
        for pose in &reading.streams[3..] {
            assert_eq!((pose.kind, pose.frame.as_str(), pose.stamps_ns.len()), (Kind::Pose, "world", 20));
            assert_eq!(pose.row(19), [19.0, 2.0, 3.0, 0.8, 0.1, 0.5, 0.1]);
        }
        assert_eq!(reading.streams[5].child_frame.as_deref(), Some("base_link"));
    }
}

#[test]
fn topics_are_listed_with_type_count_and_why_they_are_not_read() {
    for name in RECORDS.into_iter().chain(DATABASES).chain([FOLDER]) {
        let log = Log::open(&fixture(name), SIZE).expect("it opens");
        let counts: Vec<(&str, u64)> =
            log.topics().iter().map(|topic| (topic.name.as_str(), topic.count)).collect();
        let expected = [
            ("/imu/data", 40),
            ("/imu/mag", 20),
            ("/imu/temperature", 4),
            ("/note", 4),
            ("/odom", 20),
            ("/pose_cov", 20),
            ("/vicon/pose", 20),
        ];
        assert_eq!(counts, expected, "{name}");
        let note = &log.topics()[3];
        assert!(matches!(&note.kind, Err(Refusal::Type { found }) if found.ends_with("String")), "{note:?}");
        assert_eq!(log.topics()[0].kind, Ok(Kind::Imu));
        assert!(log.topics()[0].type_name.ends_with("/Imu"));
    }
}

#[test]
fn a_topic_that_is_not_there_or_not_readable_is_refused_with_what_there_is() {
    let log = Log::open(&fixture("none.bag"), SIZE).expect("it opens");
    let error = log.read(&["/imu/dta"]).unwrap_err().to_string();
    assert!(error.contains("no topic `/imu/dta`") && error.contains("`/imu/data`, `/imu/mag`"), "{error}");
    let error = log.read(&["/note"]).unwrap_err().to_string();
    assert!(error.contains("`/note`") && error.contains("expected sensor_msgs/Imu"), "{error}");
}

#[test]
fn another_definition_under_the_same_name_is_refused_with_the_field() {
    let log = Log::open(&fixture("other-definition.mcap"), SIZE).expect("it opens");
    let error = log.read(&["/imu/data"]).unwrap_err().to_string();
    let field = "`float32 angular_velocity.x` where `float64 angular_velocity.x` is expected";
    assert!(error.contains("other-definition.mcap") && error.contains(field), "{error}");
    // Its other topics are what they were.
    assert!(log.read(&["/imu/mag"]).is_ok());
}

#[test]
fn chunks_out_of_order_are_sorted_by_stamp() {
    let reading = read(&fixture("unordered.mcap"), &["/imu/data"]);
    assert_imu(&reading.streams[0], 40);
    let sorted = |warning: &LogWarning| matches!(warning, LogWarning::Reordered { count: 1, .. });
    assert!(reading.warnings.iter().any(sorted), "{:?}", reading.warnings);
}

#[test]
fn of_a_cut_file_what_is_whole_is_read_with_a_warning() {
    for name in RECORDS {
        let whole = fs::read(fixture(name)).expect("a fixture");
        let mut before = 0;
        // The index, where there is one, stands in the last part.
        for percent in [10, 35, 60, 75] {
            let (_folder, path) = damaged(name, &whole[..whole.len() * percent / 100]);
            let log = Log::open(&path, SIZE).expect("it opens");
            let Ok(reading) = log.read(&["/imu/data"]) else {
                assert!(percent < 35, "{name} at {percent} %");
                continue;
            };
            let rows = reading.streams[0].stamps_ns.len();
            assert_imu(&reading.streams[0], rows);
            assert!(rows >= before, "{name} at {percent} %: {rows}");
            before = rows;
            let cut = |warning: &LogWarning| matches!(warning, LogWarning::Truncated { .. });
            assert!(reading.warnings.iter().any(cut) || rows == 40, "{name} at {percent} %");
        }
        assert!(before >= 20, "{name}: {before}");
    }
}

#[test]
fn an_mcap_without_a_summary_and_a_bag_without_an_index_are_read_from_their_beginning() {
    let whole = fs::read(fixture("ros2-zstd.mcap")).expect("a fixture");
    // The footer alone: the records before it are whole.
    let (_folder, path) = damaged("a.mcap", &whole[..whole.len() - 37]);
    let log = Log::open(&path, SIZE).expect("it opens");
    assert_eq!(log.topics()[0].count, 40);
    assert_imu(&log.read(&["/imu/data"]).expect("it reads").streams[0], 40);

    let mut bag = fs::read(fixture("bz2.bag")).expect("a fixture");
    let name = b"index_pos=";
    let at = bag.windows(name.len()).position(|bytes| bytes == name).expect("a bag has it") + name.len();
    let index: [u8; 8] = bag[at..at + 8].try_into().expect("eight bytes");
    bag[at..at + 8].fill(0);
    bag.truncate(u64::from_le_bytes(index) as usize);
    let (_folder, path) = damaged("a.bag", &bag);
    let reading = read(&path, &["/imu/data"]);
    assert_imu(&reading.streams[0], 40);
    assert_eq!(reading.warnings, [LogWarning::NoIndex]);
}

#[test]
fn a_damaged_chunk_is_refused_with_its_place() {
    for (name, at) in
        [("ros2-none.mcap", 2000), ("ros2-zstd.mcap", 1000), ("bz2.bag", 6000), ("lz4.bag", 6000)]
    {
        let mut bytes = fs::read(fixture(name)).expect("a fixture");
        bytes[at..at + 40].iter_mut().for_each(|byte| *byte ^= 0x55);
        let (_folder, path) = damaged(name, &bytes);
        let error = Log::open(&path, SIZE).and_then(|log| log.read(&["/imu/data"])).unwrap_err();
        let LogError::Damaged { place, .. } = &error else { panic!("{name}: {error}") };
        assert!(*place < Place::Byte(at as u64), "{name}: {error}");
    }
}

#[test]
fn a_database_that_was_cut_is_refused_with_the_way_to_recover_it() {
    let whole = fs::read(fixture("iron.db3")).expect("a fixture");
    for length in [whole.len() - 4096, whole.len() / 2, 4096, 200, 20] {
        let (_folder, path) = damaged("cut.db3", &whole[..length]);
        let error = Log::open(&path, SIZE).and_then(|log| log.read(&["/imu/data"])).unwrap_err();
        assert!(matches!(error, LogError::Database { .. } | LogError::NotABag { .. }), "{length}: {error}");
        let text = error.to_string();
        assert!(text.contains("cut.db3") && text.contains("expected"), "{text}");
    }
}

#[test]
fn a_database_of_something_else_is_no_bag() {
    let (_folder, path) = damaged("other.db3", b"");
    let database = rusqlite::Connection::open(&path).expect("room");
    database.execute_batch("CREATE TABLE topics(id INTEGER PRIMARY KEY);").expect("a table");
    let error = Log::open(&path, SIZE).unwrap_err().to_string();
    assert!(error.contains("without the table `messages`"), "{error}");
    // A view could be anything.
    database.execute_batch("CREATE VIEW messages AS SELECT 1 AS id;").expect("a view");
    assert_eq!(Log::open(&path, SIZE).unwrap_err().to_string(), error);
}

#[test]
fn a_message_of_a_database_that_is_damaged_is_refused_with_its_row() {
    let change = |change: &str, topic: &str| {
        let (_folder, path) = damaged("bag.db3", &fs::read(fixture("iron.db3")).expect("a fixture"));
        rusqlite::Connection::open(&path).and_then(|bag| bag.execute_batch(change)).expect("it changes");
        Log::open(&path, SIZE).and_then(|log| log.read(&[topic])).unwrap_err().to_string()
    };
    let error = change("UPDATE messages SET data = 'text' WHERE id = 9;", "/imu/data");
    assert!(error.contains("bag.db3, message 9 of the database: found content of the type Text"), "{error}");
    let error = change("UPDATE messages SET topic_id = 99 WHERE id = 11;", "/imu/data");
    assert!(error.contains("message 11 of the database: found a message of topic 99"), "{error}");
    let error = change("UPDATE messages SET data = substr(data, 1, 100) WHERE id = 1;", "/imu/data");
    assert!(error.contains("`/imu/data`, its message 1, message 1 of the database"), "{error}");
    let error = change("UPDATE messages SET data = x'28b52ffd00' WHERE id = 1;", "/imu/data");
    assert!(error.contains("message 1 of the database: found a damaged zstd stream"), "{error}");
    let error = change("UPDATE message_definitions SET encoding = 'ros2idl';", "/imu/data");
    assert!(error.contains("`/imu/data`") && error.contains("ros2idl"), "{error}");
}

#[test]
fn other_files_are_no_logs() {
    for bytes in [&b""[..], b"t,acc_x\n", b"SQLite format 2\0", b"#ROSBAG V1.2\n"] {
        let (_folder, path) = damaged("a.mcap", bytes);
        let error = Log::open(&path, SIZE).unwrap_err();
        assert!(matches!(error, LogError::Container { .. }), "{error}");
    }
    assert!(matches!(Log::open(Path::new("/no/such.mcap"), SIZE), Err(LogError::Unreadable { .. })));
}

#[test]
fn more_than_the_limit_is_refused() {
    let path = fixture("ros2-zstd.mcap");
    let error = Log::open(&path, 4096).and_then(|log| log.read(&["/imu/data"])).unwrap_err();
    assert!(matches!(error, LogError::TooLarge { limit: 4096, .. }), "{error}");
    // Forty messages of 13 numbers, and chunks of some 5 kB.
    let error = Log::open(&path, 8_000)
        .and_then(|log| log.read(&["/imu/data", "/imu/mag", "/vicon/pose", "/odom", "/pose_cov"]));
    assert!(matches!(error, Err(LogError::TooMany { limit: 8_000, .. })), "{error:?}");
    for name in DATABASES {
        let error = Log::open(&fixture(name), 50).and_then(|log| log.read(&["/imu/data"])).unwrap_err();
        let text = error.to_string();
        let too_long =
            matches!(error, LogError::TooLarge { limit: 50, .. }) || text.contains("more than 50 bytes");
        assert!(too_long && text.contains("message 1 of the database"), "{text}");
    }
}

/// The folder of two files, to be damaged.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["metadata.yaml", "split_0.mcap", "split_1.mcap"] {
        fs::copy(fixture(FOLDER).join(name), folder.path().join(name)).expect("room");
    }
    folder
}

#[test]
fn what_is_wrong_with_a_file_of_a_folder_is_said_with_its_name() {
    let folder = folder();
    let second = folder.path().join("split_1.mcap");
    let whole = fs::read(&second).expect("it is there");
    fs::write(&second, &whole[..whole.len() / 3]).expect("room");
    let reading = read(folder.path(), &["/imu/data"]);
    assert!(reading.streams[0].stamps_ns.len() > 20, "{}", reading.streams[0].stamps_ns.len());
    let said: Vec<String> = reading.warnings.iter().map(ToString::to_string).collect();
    assert!(said[0].starts_with("split_1.mcap: the file is cut at byte"), "{said:?}");
    fs::write(&second, [&b"\x28\xb5\x2f\xfd"[..], &whole].concat()).expect("room");
    let packed = Log::open(folder.path(), SIZE).expect_err("it is packed");
    assert_eq!(packed, LogError::Packed { path: second.clone() });
    fs::remove_file(&second).expect("it is there");
    let missing = Log::open(folder.path(), SIZE).expect_err("one is missing").to_string();
    assert!(missing.contains("split_1.mcap") && missing.contains("cannot be read"), "{missing}");
}

#[test]
fn a_folder_in_another_order_is_sorted_by_its_stamps() {
    let folder = folder();
    let metadata = folder.path().join("metadata.yaml");
    let text = fs::read_to_string(&metadata).expect("it is there");
    fs::write(
        &metadata,
        text.replace("- split_0.mcap\n  - split_1.mcap", "- split_1.mcap\n  - split_0.mcap"),
    )
    .expect("room");
    let reading = read(folder.path(), &["/imu/data"]);
    assert_imu(&reading.streams[0], 40);
    assert!(matches!(reading.warnings[0], LogWarning::Reordered { .. }), "{:?}", reading.warnings);
}
