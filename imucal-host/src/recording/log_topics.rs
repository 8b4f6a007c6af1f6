//! Which topics of a robot's log a recording is made of.

use super::mapping::MappingFault;

/// Needs a reader of logs.
#[cfg(feature = "logs")]
mod choice;

/// Topics that a message lists.
const LISTED: usize = 40;

/// What a topic is to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Accelerometer and gyroscope.
    Imu,
    /// Magnetometer.
    Mag,
    /// Reference attitude and position.
    Reference,
    /// Temperature of the sensor.
    Temperature,
}

impl Role {
    pub(crate) const ALL: [Self; 4] = [Self::Imu, Self::Mag, Self::Reference, Self::Temperature];

    /// As the option `--topic` has it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Imu => "imu",
            Self::Mag => "mag",
            Self::Reference => "ref",
            Self::Temperature => "temp",
        }
    }

    /// The types of messages that can be it.
    #[must_use]
    pub fn types(self) -> &'static str {
        match self {
            Self::Imu => "sensor_msgs/Imu",
            Self::Mag => "sensor_msgs/MagneticField",
            Self::Reference => {
                "geometry_msgs/PoseStamped or PoseWithCovarianceStamped, nav_msgs/Odometry or sensor_msgs/Imu"
            }
            Self::Temperature => "sensor_msgs/Temperature",
        }
    }
}

/// A topic of a log, as far as a message needs it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicLine {
    /// Its name.
    pub name: String,
    /// The type of its messages.
    pub type_name: String,
    /// How many there are.
    pub count: u64,
    /// What it can be, or why it can be nothing.
    pub roles: Result<Vec<Role>, String>,
}

impl TopicLine {
    fn can_be(&self, role: Role) -> bool {
        self.roles.as_ref().is_ok_and(|roles| roles.contains(&role))
    }
}

/// Topics that are not there, or not those that are asked for; its text says what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum TopicFault {
    /// Topics are chosen of a file that has none.
    #[error("found --topic with a file that is no log, expected .mcap, .db3 or .bag; leave --topic out")]
    NotALog,
    /// Columns are mapped of a file that has none.
    #[error(
        "found --map or --time with a log, expected none, since its topics say what they are; choose topics with --topic imu=TOPIC"
    )]
    Columns,
    /// A role that several topics can have.
    #[error(
        "found several topics of {}, expected one or a choice; choose with --topic {}=TOPIC, or {}=none:\n{}", .role.types(), .role.name(), .role.name(), listed(.there)
    )]
    Several { role: Role, there: Vec<TopicLine> },
    /// A topic that the log has not.
    #[error("--topic {}: found no topic `{topic}`{}:\n{}", .role.name(), meant(.nearest), listed(.there))]
    Absent { role: Role, topic: String, nearest: Option<String>, there: Vec<TopicLine> },
    /// A topic that cannot be what it is chosen for.
    #[error("--topic {}={topic}: {found}, expected messages of {}; choose another one:\n{}", .role.name(), .role.types(), listed(.there))]
    Type { role: Role, topic: String, found: String, there: Vec<TopicLine> },
    /// A topic without a message.
    #[error("--topic {}={topic}: found no message, expected at least one; choose another one:\n{}", .role.name(), listed(.there))]
    Silent { role: Role, topic: String, there: Vec<TopicLine> },
    /// A topic whose messages are not known to be usable.
    #[error("topic `{topic}`: {why}; leave it out with --topic {}=none", .role.name())]
    Refused { role: Role, topic: String, why: String },
    /// No sensor at all.
    #[error(
        "found no topic of sensor_msgs/Imu or sensor_msgs/MagneticField that can be read, expected one of a sensor; record it too:\n{}", listed(.there)
    )]
    NoSensor { there: Vec<TopicLine> },
}

impl TopicFault {
    /// The options that would choose, if there is a choice.
    #[must_use]
    pub fn remedy(&self) -> Option<[String; 2]> {
        let (role, topic) = match self {
            Self::Several { role, there } => (role, &there.iter().find(|line| line.can_be(*role))?.name),
            Self::Absent { role, nearest, .. } => (role, nearest.as_ref()?),
            _ => return None,
        };
        Some(["--topic".to_owned(), format!("{}={topic}", role.name())])
    }
}

fn meant(nearest: &Option<String>) -> String {
    match nearest {
        Some(name) => format!("; did you mean `{name}`? There are"),
        None => ", expected one of these".to_owned(),
    }
}

fn listed(there: &[TopicLine]) -> String {
    if there.is_empty() {
        return "  the log has no topic".to_owned();
    }
    let width = |of: fn(&TopicLine) -> &str| {
        there.iter().take(LISTED).map(|line| of(line).chars().count()).max().unwrap_or(0)
    };
    let (names, types) = (width(|line| &line.name), width(|line| &line.type_name));
    let line = |line: &TopicLine| {
        let note = match &line.roles {
            Ok(_) => String::new(),
            Err(why) => format!(", not read: {why}"),
        };
        format!("  {:<names$}  {:<types$}  {} messages{note}", line.name, line.type_name, line.count)
    };
    let mut lines: Vec<String> = there.iter().take(LISTED).map(line).collect();
    if there.len() > LISTED {
        lines.push(format!("  and {} more", there.len() - LISTED));
    }
    lines.join("\n")
}

/// Topics that are asked for. Empty: those that there is no choice of.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogTopics {
    asked: Vec<(Role, String)>,
}

impl LogTopics {
    /// Understands `imu=/imu/data`, and `mag=none`.
    ///
    /// # Errors
    ///
    /// The first fault found.
    pub fn parse(options: &[String]) -> Result<Self, MappingFault> {
        let mut asked: Vec<(Role, String)> = Vec::new();
        for text in options {
            let expected = "such as imu=/imu/data";
            let form = || MappingFault::Form { option: "topic", found: text.clone(), expected };
            let (name, topic) = text.split_once('=').ok_or_else(form)?;
            let (name, topic) = (name.trim(), topic.trim());
            if topic.is_empty() {
                return Err(form());
            }
            let role = Role::ALL.into_iter().find(|role| role.name() == name);
            let role = role.ok_or_else(|| MappingFault::Quantity {
                option: "topic",
                found: name.to_owned(),
                expected: "`imu`, `mag`, `temp`, `ref`".to_owned(),
            })?;
            if asked.iter().any(|(other, _)| *other == role) {
                return Err(MappingFault::Twice { what: name.to_owned() });
            }
            asked.push((role, topic.to_owned()));
        }
        Ok(Self { asked })
    }

    /// Nothing is asked for.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.asked.is_empty()
    }
}
