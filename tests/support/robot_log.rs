//! Robots' logs as a recorder writes them: MCAP and SQLite of ROS 2 and a ROS 1 bag, of the same messages.

use std::collections::BTreeMap;
use std::fs;
use std::io::BufWriter;
use std::path::Path;

/// What a message says, in ROS's units.
#[derive(Clone, Copy, Debug)]
pub enum Content {
    /// Specific force (m/s²) and rate (rad/s), without an attitude.
    Imu([f64; 3], [f64; 3]),
    /// Field, T.
    Field([f64; 3]),
    /// Temperature, °C.
    Temperature(f64),
    /// Position (m) and attitude x, y, z, w.
    Pose([f64; 3], [f64; 4]),
}

/// A message of a topic; it is recorded a millisecond after its stamp.
#[derive(Clone, Copy, Debug)]
pub struct Logged {
    /// The topic.
    pub topic: &'static str,
    /// Its stamp, ns since 1970.
    pub stamp_ns: i64,
    /// What it says.
    pub content: Content,
}

impl Logged {
    fn recorded_ns(&self) -> u64 {
        (self.stamp_ns + 1_000_000).cast_unsigned()
    }
}

const VECTOR3: &str = "===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const POINT: &str = "===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
const QUATERNION: &str =
    "===\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
const HEADER_1: &str = "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
const HEADER_2: &str = "===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

impl Content {
    /// Package and name.
    fn type_name(&self) -> (&'static str, &'static str) {
        match self {
            Self::Imu(..) => ("sensor_msgs", "Imu"),
            Self::Field(_) => ("sensor_msgs", "MagneticField"),
            Self::Temperature(_) => ("sensor_msgs", "Temperature"),
            Self::Pose(..) => ("geometry_msgs", "PoseStamped"),
        }
    }

    fn definition(&self, header: &str) -> String {
        let header = format!("{header}{VECTOR3}{QUATERNION}{POINT}");
        let main = match self {
            Self::Imu(..) => {
                "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
                geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
                geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
            }
            Self::Field(_) => "geometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n",
            Self::Temperature(_) => "float64 temperature\nfloat64 variance\n",
            Self::Pose(..) => "geometry_msgs/Pose pose\n",
        };
        let pose = "===\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n";
        format!("std_msgs/Header header\n{main}{header}{pose}")
    }

    fn md5(&self) -> &'static str {
        match self {
            Self::Imu(..) => "6a62c6daae103f4ff57a132d6f95cec2",
            Self::Field(_) => "2f3b0b43eed0c9501de0fa3ff89a45aa",
            Self::Temperature(_) => "ff71b307acdbe7c871a5a6d7ed359100",
            Self::Pose(..) => "d3812c3cbc69362b77dc0b19b345f8f5",
        }
    }

    fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Imu(force, rate) => {
                let without = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                [&[0.0; 4][..], &without, rate, &[0.0; 9], force, &[0.0; 9]].concat()
            }
            Self::Field(field) => [&field[..], &[0.0; 9]].concat(),
            Self::Temperature(temperature) => vec![*temperature, 0.0],
            Self::Pose(position, attitude) => [&position[..], attitude].concat(),
        }
    }
}

const FRAME: &[u8] = b"imu_link";

/// Little-endian CDR.
fn cdr(message: &Logged) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    let (seconds, nanoseconds) = (message.stamp_ns / 1_000_000_000, message.stamp_ns % 1_000_000_000);
    bytes.extend((seconds as i32).to_le_bytes());
    bytes.extend((nanoseconds as u32).to_le_bytes());
    bytes.extend((FRAME.len() as u32 + 1).to_le_bytes());
    bytes.extend(FRAME);
    bytes.push(0);
    bytes.resize(4 + (bytes.len() - 4).next_multiple_of(8), 0);
    message.content.numbers().iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes
}

fn ros1(message: &Logged, sequence: u32) -> Vec<u8> {
    let mut bytes = sequence.to_le_bytes().to_vec();
    bytes.extend(time(message.stamp_ns));
    bytes.extend((FRAME.len() as u32).to_le_bytes());
    bytes.extend(FRAME);
    message.content.numbers().iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes
}

/// ROS 1's time.
fn time(stamp_ns: i64) -> Vec<u8> {
    let parts = [stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000];
    parts.iter().flat_map(|part| (*part as u32).to_le_bytes()).collect()
}

/// Topics in the order of their first message.
fn topics(messages: &[Logged]) -> Vec<Logged> {
    let mut topics: Vec<Logged> = Vec::new();
    for message in messages {
        if topics.iter().all(|other| other.topic != message.topic) {
            topics.push(*message);
        }
    }
    topics
}

/// Writes messages in the order in which they are given.
///
/// # Panics
///
/// Where the file cannot be written.
pub fn write_mcap(path: &Path, messages: &[Logged]) {
    let file = BufWriter::new(fs::File::create(path).expect("the folder takes files"));
    let options = mcap::WriteOptions::new().compression(None).chunk_size(Some(1 << 16)).profile("ros2");
    let mut writer = options.create(file).expect("a header");
    let mut channels = BTreeMap::new();
    for message in topics(messages) {
        let (package, name) = message.content.type_name();
        let definition = message.content.definition(HEADER_2);
        let schema = writer.add_schema(&format!("{package}/msg/{name}"), "ros2msg", definition.as_bytes());
        let channel = writer.add_channel(schema.expect("a schema"), message.topic, "cdr", &BTreeMap::new());
        channels.insert(message.topic, channel.expect("a channel"));
    }
    for message in messages {
        let log_time = message.recorded_ns();
        let header = mcap::records::MessageHeader {
            channel_id: channels[message.topic],
            sequence: 0,
            log_time,
            publish_time: log_time,
        };
        writer.write_to_known_channel(&header, &cdr(message)).expect("room");
    }
    writer.finish().expect("room");
}

/// The tables of a bag of ROS 2 Humble.
const TABLES: &str = "
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
        serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
        data BLOB NOT NULL);
    CREATE INDEX timestamp_idx ON messages (timestamp ASC);";

/// Writes a bag of ROS 2 in SQLite, without definitions.
///
/// # Panics
///
/// Where the file cannot be written.
pub fn write_db3(path: &Path, messages: &[Logged]) {
    let mut bag = rusqlite::Connection::open(path).expect("the folder takes files");
    let rows = bag.transaction().expect("the bag is not in use");
    rows.execute_batch(TABLES).expect("room");
    let mut ids = BTreeMap::new();
    for (id, message) in (1i64..).zip(topics(messages)) {
        let (package, name) = message.content.type_name();
        let topic = (id, message.topic, format!("{package}/msg/{name}"));
        rows.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')", topic).expect("room");
        ids.insert(message.topic, id);
    }
    for message in messages {
        let row = (ids[message.topic], message.recorded_ns().cast_signed(), cdr(message));
        rows.execute("INSERT INTO messages VALUES (NULL, ?1, ?2, ?3)", row).expect("room");
    }
    rows.commit().expect("room");
}

/// A record of named fields and a body.
fn record(fields: &[(&str, &[u8])], body: &[u8]) -> Vec<u8> {
    let mut head = Vec::new();
    for (name, value) in fields {
        head.extend((name.len() as u32 + 1 + value.len() as u32).to_le_bytes());
        head.extend(name.as_bytes());
        head.push(b'=');
        head.extend(*value);
    }
    let length = |bytes: &[u8]| (bytes.len() as u32).to_le_bytes();
    [&length(&head)[..], &head, &length(body), body].concat()
}

/// Writes a bag of chunks of 500 messages, with its index.
///
/// # Panics
///
/// Where the file cannot be written.
pub fn write_bag(path: &Path, messages: &[Logged]) {
    let topics = topics(messages);
    let id_of =
        |topic: &str| topics.iter().position(|other| other.topic == topic).expect("it is listed") as u32;
    let (mut chunks, mut infos) = (Vec::new(), Vec::new());
    let begin = MAGIC.len() + bag_header(0, 0, 0).len();
    for (number, messages) in messages.chunks(500).enumerate() {
        let mut chunk = Vec::new();
        if number == 0 {
            topics.iter().enumerate().for_each(|(id, first)| chunk.extend(connection(id as u32, first)));
        }
        let mut counts = vec![0u32; topics.len()];
        for (at, message) in messages.iter().enumerate() {
            let id = id_of(message.topic);
            counts[id as usize] += 1;
            let recorded = time(message.recorded_ns().cast_signed());
            let fields: [(&str, &[u8]); 3] = [("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &recorded)];
            chunk.extend(record(&fields, &ros1(message, at as u32)));
        }
        infos.extend(chunk_info((begin + chunks.len()) as u64, messages, &counts));
        let size = (chunk.len() as u32).to_le_bytes();
        chunks.extend(record(&[("op", &[5]), ("compression", b"none"), ("size", &size)], &chunk));
    }
    let connections: Vec<u8> =
        topics.iter().enumerate().flat_map(|(id, first)| connection(id as u32, first)).collect();
    let head =
        bag_header((begin + chunks.len()) as u64, topics.len() as u32, messages.len().div_ceil(500) as u32);
    let bag = [MAGIC, &head, &chunks, &connections, &infos].concat();
    fs::write(path, bag).expect("the folder takes files");
}

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

fn bag_header(index: u64, connections: u32, chunks: u32) -> Vec<u8> {
    let (connections, chunks) = (connections.to_le_bytes(), chunks.to_le_bytes());
    let fields: [(&str, &[u8]); 4] = [
        ("op", &[3]),
        ("index_pos", &index.to_le_bytes()),
        ("conn_count", &connections),
        ("chunk_count", &chunks),
    ];
    record(&fields, &[b' '; 100])
}

fn chunk_info(place: u64, messages: &[Logged], counts: &[u32]) -> Vec<u8> {
    let at =
        |message: Option<&Logged>| time(message.expect("a chunk is not empty").recorded_ns().cast_signed());
    let (first, last, count) =
        (at(messages.first()), at(messages.last()), (counts.len() as u32).to_le_bytes());
    let body: Vec<u8> = counts
        .iter()
        .enumerate()
        .flat_map(|(id, count)| [(id as u32).to_le_bytes(), count.to_le_bytes()].concat())
        .collect();
    let fields: [(&str, &[u8]); 6] = [
        ("op", &[6]),
        ("ver", &1u32.to_le_bytes()),
        ("chunk_pos", &place.to_le_bytes()),
        ("start_time", &first),
        ("end_time", &last),
        ("count", &count),
    ];
    record(&fields, &body)
}

fn connection(id: u32, first: &Logged) -> Vec<u8> {
    let (package, name) = first.content.type_name();
    let (type_name, definition) = (format!("{package}/{name}"), first.content.definition(HEADER_1));
    let body = record(
        &[
            ("topic", first.topic.as_bytes()),
            ("type", type_name.as_bytes()),
            ("md5sum", first.content.md5().as_bytes()),
            ("message_definition", definition.as_bytes()),
        ],
        &[],
    );
    // The body is fields alone, without the lengths of a record.
    let body = &body[4..body.len() - 4];
    record(&[("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", first.topic.as_bytes())], body)
}
