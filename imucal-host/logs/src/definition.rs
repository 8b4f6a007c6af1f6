//! The definitions of messages: which are read, and whether a log's is the same.
//!
//! A definition is a text of `TYPE NAME` lines; those of the types that it uses follow, each under `MSG: NAME`. Two are the
//! same if their fields of elementary types are, in order, name and type. Comments, constants and defaults do not count.

use std::collections::BTreeMap;

use crate::{warning::Refusal, wire::Encoding};

/// A definition nests at most so deep, and has at most so many fields; those that are read have 6 and some 20.
const DEEPEST: usize = 8;
const MOST: usize = 200;

/// The types of messages that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MessageType {
    Imu,
    MagneticField,
    Temperature,
    PoseStamped,
    PoseWithCovarianceStamped,
    Odometry,
}

impl MessageType {
    const ALL: [Self; 6] = [
        Self::Imu,
        Self::MagneticField,
        Self::Temperature,
        Self::PoseStamped,
        Self::PoseWithCovarianceStamped,
        Self::Odometry,
    ];

    /// By a name as in ROS 1 (`sensor_msgs/Imu`) or ROS 2 (`sensor_msgs/msg/Imu`).
    pub(crate) fn of(name: &str) -> Option<Self> {
        let (package, rest) = name.split_once('/')?;
        let rest = rest.strip_prefix("msg/").unwrap_or(rest);
        Self::ALL.into_iter().find(|each| each.name().split_once('/') == Some((package, rest)))
    }

    /// Its name in ROS 1.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Imu => "sensor_msgs/Imu",
            Self::MagneticField => "sensor_msgs/MagneticField",
            Self::Temperature => "sensor_msgs/Temperature",
            Self::PoseStamped => "geometry_msgs/PoseStamped",
            Self::PoseWithCovarianceStamped => "geometry_msgs/PoseWithCovarianceStamped",
            Self::Odometry => "nav_msgs/Odometry",
        }
    }

    /// Its name in ROS 2.
    pub(crate) fn name_in_ros2(self) -> String {
        self.name().replace('/', "/msg/")
    }

    /// Sum of its definition in ROS 1.
    fn md5(self) -> &'static str {
        match self {
            Self::Imu => "6a62c6daae103f4ff57a132d6f95cec2",
            Self::MagneticField => "2f3b0b43eed0c9501de0fa3ff89a45aa",
            Self::Temperature => "ff71b307acdbe7c871a5a6d7ed359100",
            Self::PoseStamped => "d3812c3cbc69362b77dc0b19b345f8f5",
            Self::PoseWithCovarianceStamped => "953b798c0f514ff060a53a3498ce6246",
            Self::Odometry => "cd5e73d190d741a2f92e81eda573aca7",
        }
    }

    fn definition(self) -> &'static str {
        match self {
            Self::Imu => {
                "std_msgs/Header header
                geometry_msgs/Quaternion orientation
                float64[9] orientation_covariance
                geometry_msgs/Vector3 angular_velocity
                float64[9] angular_velocity_covariance
                geometry_msgs/Vector3 linear_acceleration
                float64[9] linear_acceleration_covariance"
            }
            Self::MagneticField => {
                "std_msgs/Header header
                geometry_msgs/Vector3 magnetic_field
                float64[9] magnetic_field_covariance"
            }
            Self::Temperature => "std_msgs/Header header\nfloat64 temperature\nfloat64 variance",
            Self::PoseStamped => "std_msgs/Header header\ngeometry_msgs/Pose pose",
            Self::PoseWithCovarianceStamped => {
                "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose"
            }
            Self::Odometry => {
                "std_msgs/Header header
                string child_frame_id
                geometry_msgs/PoseWithCovariance pose
                geometry_msgs/TwistWithCovariance twist"
            }
        }
    }
}

/// The types that those above use, by their names in ROS 1.
const USED: [(&str, &str); 7] = [
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z"),
    ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"),
    ("geometry_msgs/Pose", "Point position\nQuaternion orientation"),
    ("geometry_msgs/PoseWithCovariance", "Pose pose\nfloat64[36] covariance"),
    ("geometry_msgs/Twist", "Vector3 linear\nVector3 angular"),
    ("geometry_msgs/TwistWithCovariance", "Twist twist\nfloat64[36] covariance"),
];
const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec");
/// What separates a definition from one that it uses.
const RULE: &str = "================================================================================";

fn header(encoding: Encoding) -> (&'static str, &'static str) {
    let definition = match encoding {
        Encoding::Ros1 => "uint32 seq\ntime stamp\nstring frame_id",
        Encoding::Cdr => "builtin_interfaces/Time stamp\nstring frame_id",
    };
    ("std_msgs/Header", definition)
}

/// The types that messages of an encoding use, each by the last part of its name.
fn used(encoding: Encoding) -> impl Iterator<Item = (&'static str, (&'static str, &'static str))> {
    let all = USED.into_iter().chain([TIME, header(encoding)]);
    all.map(|(name, definition)| (last(name), (name, definition)))
}

/// The last part of a type's name.
fn last(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// The definition of a type in CDR and of all those that it uses, in the language `ros2msg`.
pub(crate) fn text(known: MessageType) -> String {
    let used: BTreeMap<_, _> = used(Encoding::Cdr).collect();
    let mut parts = vec![("", known.definition())];
    let mut at = 0;
    while let Some((_, definition)) = parts.get(at).copied() {
        let of_line = |line: &str| used.get(last(line.split_whitespace().next()?)).copied();
        for part in definition.lines().filter_map(of_line) {
            if !parts.contains(&part) {
                parts.push(part);
            }
        }
        at += 1;
    }
    let trimmed = |text: &str| text.lines().map(|line| format!("{}\n", line.trim())).collect::<String>();
    let used = |(name, text): &(&str, &str)| format!("{RULE}\nMSG: {name}\n{}", trimmed(text));
    trimmed(known.definition()) + &parts.iter().skip(1).map(used).collect::<String>()
}

/// Whether a log's definition is that of a type, as messages of an encoding have it; an error names the first difference.
pub(crate) fn check(known: MessageType, encoding: Encoding, definition: &str) -> Result<(), Refusal> {
    let used = used(encoding).map(|(name, (_, definition))| (name, definition)).collect();
    let expected = fields(known.definition(), &used);
    let (main, used) = parts(definition);
    let found = fields(main, &used);
    for at in 0..expected.len().max(found.len()) {
        let (found, expected) = (found.get(at), expected.get(at));
        if found != expected {
            let named = |field: Option<&String>| {
                field.map_or("no further field".to_owned(), |field| format!("`{field}`"))
            };
            return Err(Refusal::Definition {
                type_name: known.name().to_owned(),
                found: named(found),
                expected: named(expected),
            });
        }
    }
    Ok(())
}

/// The same by the definition's sum.
pub(crate) fn check_sum(known: MessageType, md5: &str) -> Result<(), Refusal> {
    // `*` is any definition.
    if md5 == known.md5() || md5 == "*" {
        return Ok(());
    }
    Err(Refusal::Sum { type_name: known.name().to_owned(), found: md5.to_owned(), expected: known.md5() })
}

/// The definition itself, and those that it uses by the last part of their names.
fn parts(definition: &str) -> (&str, BTreeMap<&str, &str>) {
    let mut sections = definition.split("\nMSG:");
    let main = sections.next().unwrap_or_default();
    let named = sections.map(|section| {
        let (name, body) = section.split_once('\n').unwrap_or((section, ""));
        (last(name.trim()), body)
    });
    (main, named.collect())
}

/// Fields of elementary types as `TYPE NAME`, with the path of their names.
fn fields(main: &str, used: &BTreeMap<&str, &str>) -> Vec<String> {
    let mut all = Vec::new();
    flatten(main, used, "", 0, &mut all);
    all
}

fn flatten(definition: &str, used: &BTreeMap<&str, &str>, path: &str, depth: usize, all: &mut Vec<String>) {
    for line in definition.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let mut words = line.split_whitespace();
        let (Some(kind), Some(name)) = (words.next(), words.next()) else { continue };
        if kind.starts_with("===") || is_constant(line) {
            continue;
        }
        if all.len() >= MOST {
            return;
        }
        let name = format!("{path}{name}");
        match used.get(last(kind)) {
            Some(inner) if depth < DEEPEST => {
                flatten(inner, used, &format!("{name}."), depth + 1, all);
            }
            _ => all.push(format!("{kind} {name}")),
        }
    }
}

/// `TYPE NAME=VALUE`; a default has no such sign.
fn is_constant(line: &str) -> bool {
    line.split_once('=')
        .is_some_and(|(before, _)| before.split_whitespace().count() <= 2 && !before.contains('<'))
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMU: &str = "# a comment\nHeader header\n\nuint8 KIND=3\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance # row major\n\
        geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n\
        float64[9] linear_acceleration_covariance\n================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n\
        ================\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n\
        ================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";

    #[test]
    fn names_of_ros_1_and_ros_2_are_of_one_type() {
        for known in MessageType::ALL {
            assert_eq!(MessageType::of(known.name()), Some(known));
            let (package, name) = known.name().split_once('/').unwrap();
            assert_eq!(MessageType::of(&format!("{package}/msg/{name}")), Some(known));
        }
        assert_eq!(MessageType::of("my_msgs/Imu"), None);
        assert_eq!(MessageType::of("Imu"), None);
    }

    #[test]
    fn comments_constants_and_defaults_are_no_difference() {
        assert_eq!(check(MessageType::Imu, Encoding::Ros1, IMU), Ok(()));
    }

    #[test]
    fn a_difference_is_named() {
        let said = |text: &str| check(MessageType::Imu, Encoding::Ros1, text).unwrap_err().to_string();
        let narrow = IMU.replace("geometry_msgs/Vector3\nfloat64 x", "geometry_msgs/Vector3\nfloat32 x");
        assert!(
            said(&narrow).contains("`float32 angular_velocity.x` where `float64 angular_velocity.x`"),
            "{}",
            said(&narrow)
        );
        let longer = IMU.replace(
            "float64[9] linear_acceleration_covariance",
            "float64[9] linear_acceleration_covariance\nfloat32 temperature",
        );
        assert!(said(&longer).contains("`float32 temperature` where no further field"), "{}", said(&longer));
        let swapped = IMU.replace(
            "angular_velocity\nfloat64[9] angular_velocity_covariance",
            "rate\nfloat64[9] rate_covariance",
        );
        assert!(
            said(&swapped).contains("`float64 rate.x` where `float64 angular_velocity.x`"),
            "{}",
            said(&swapped)
        );
        // ROS 1's header in a message of ROS 2.
        let error = check(MessageType::Imu, Encoding::Cdr, IMU).unwrap_err().to_string();
        assert!(error.contains("`uint32 header.seq` where `int32 header.stamp.sec`"), "{error}");
    }

    #[test]
    fn a_definition_that_is_written_is_the_one_that_is_read() {
        for known in MessageType::ALL {
            assert_eq!(check(known, Encoding::Cdr, &text(known)), Ok(()), "{}", text(known));
        }
        let field = text(MessageType::MagneticField);
        assert!(
            field.starts_with("std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\n"),
            "{field}"
        );
        assert_eq!(field.matches("\nMSG: ").count(), 3, "{field}");
    }

    #[test]
    fn a_definition_that_uses_itself_ends() {
        let endless = "A a\nA b\n===\nMSG: p/A\nA a\nA b\n";
        assert!(check(MessageType::Imu, Encoding::Ros1, endless).is_err());
    }

    #[test]
    fn another_sum_is_another_definition() {
        assert_eq!(check_sum(MessageType::Imu, "6a62c6daae103f4ff57a132d6f95cec2"), Ok(()));
        assert!(check_sum(MessageType::Temperature, "6a62c6daae103f4ff57a132d6f95cec2").is_err());
    }
}
