//! Which topics of a robot's log a recording is made of.

use super::{manifest::spelling::nearest, mapping::MappingFault};

/// A name that is so many edits away is probably meant.
const NEAR: usize = 4;
/// Topics that a message lists.
const LISTED: usize = 40;
/// In place of a topic: none is taken.
const NONE: &str = "none";

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

    /// Name, type and number, as a message says them.
    pub(crate) fn described(&self) -> String {
        format!("{} ({}, {} messages)", self.name, self.type_name, self.count)
    }
}

/// Topics that are not there, or not those that are asked for; its text says what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum TopicFault {
    /// Topics are chosen of a file that has none.
    #[error("found --topic with a file that is no log, expected .mcap or .bag; leave --topic out")]
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

/// What was chosen, and what of it nobody had asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Choice {
    pub(crate) taken: Vec<(Role, String)>,
    pub(crate) unasked: Vec<(Role, TopicLine)>,
    /// References that nobody has asked for; none of them is taken.
    pub(crate) references: Vec<String>,
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

    /// The topics to read. Of a sensor that nobody has named the only topic is taken, of a reference none: that something publishes
    /// poses does not make it one.
    pub(crate) fn choose(&self, there: &[TopicLine]) -> Result<Choice, TopicFault> {
        let mut choice = Choice { taken: Vec::new(), unasked: Vec::new(), references: Vec::new() };
        // What is asked for wrongly is said first.
        for (role, topic) in self.asked.iter().filter(|(_, topic)| topic != NONE) {
            asked(*role, topic, there)?;
        }
        for role in Role::ALL {
            match self.asked.iter().find(|(other, _)| *other == role) {
                Some((_, topic)) if topic == NONE => {}
                Some((_, topic)) => choice.taken.push((role, topic.clone())),
                None if role == Role::Reference => {
                    let poses = there.iter().filter(|line| line.can_be(role) && !line.can_be(Role::Imu));
                    choice.references = poses.map(|line| line.name.clone()).collect();
                }
                None => {
                    if let Some(line) = only(role, there)? {
                        choice.taken.push((role, line.name.clone()));
                        choice.unasked.push((role, line.clone()));
                    }
                }
            }
        }
        if choice.taken.iter().all(|(role, _)| *role == Role::Temperature) {
            return Err(TopicFault::NoSensor { there: there.to_vec() });
        }
        Ok(choice)
    }
}

/// Whether a topic that is asked for can be it.
fn asked(role: Role, topic: &str, there: &[TopicLine]) -> Result<(), TopicFault> {
    let same: Vec<&TopicLine> = there.iter().filter(|line| line.name == topic).collect();
    let (Some(first), all) = (same.first(), || there.to_vec()) else {
        let names = there.iter().map(|line| line.name.as_str());
        return Err(TopicFault::Absent {
            role,
            topic: topic.to_owned(),
            nearest: nearest(topic, names, NEAR).map(str::to_owned),
            there: there.to_vec(),
        });
    };
    let name = topic.to_owned();
    match &first.roles {
        Err(why) => Err(TopicFault::Refused { role, topic: name, why: why.clone() }),
        Ok(_) if !first.can_be(role) => {
            let found = format!("found {}", first.type_name);
            Err(TopicFault::Type { role, topic: name, found, there: all() })
        }
        Ok(_) if same.iter().all(|line| line.count == 0) => {
            Err(TopicFault::Silent { role, topic: name, there: all() })
        }
        Ok(_) => Ok(()),
    }
}

/// The only topic that can be it.
fn only(role: Role, there: &[TopicLine]) -> Result<Option<&TopicLine>, TopicFault> {
    let of_type = |line: &&TopicLine| {
        let short = line.type_name.replace("/msg/", "/");
        line.count > 0 && (line.can_be(role) || short == role.types())
    };
    let mut found = there.iter().filter(of_type);
    match (found.next(), found.next()) {
        (Some(_), Some(_)) => Err(TopicFault::Several { role, there: there.to_vec() }),
        (Some(TopicLine { name, roles: Err(why), .. }), None) => {
            Err(TopicFault::Refused { role, topic: name.clone(), why: why.clone() })
        }
        (one, _) => Ok(one),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture::assert_says;

    fn line(name: &str, type_name: &str, count: u64, role: Option<Role>) -> TopicLine {
        let roles = role.map(|role| vec![role]).ok_or_else(|| "another definition".to_owned());
        TopicLine { name: name.to_owned(), type_name: type_name.to_owned(), count, roles }
    }

    fn topics(options: &[&str]) -> Result<LogTopics, MappingFault> {
        LogTopics::parse(&options.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>())
    }

    fn chosen(options: &[&str], there: &[TopicLine]) -> Result<Choice, String> {
        topics(options).expect("options").choose(there).map_err(|fault| fault.to_string())
    }

    fn robot() -> Vec<TopicLine> {
        vec![
            line("/base/imu", "sensor_msgs/msg/Imu", 100, Some(Role::Imu)),
            line("/goal", "geometry_msgs/msg/PoseStamped", 1, Some(Role::Reference)),
            line("/imu/mag", "sensor_msgs/msg/MagneticField", 50, Some(Role::Mag)),
        ]
    }

    #[test]
    fn the_only_topic_of_a_sensor_is_taken_and_no_reference() {
        let choice = chosen(&[], &robot()).unwrap();
        let taken = [(Role::Imu, "/base/imu".to_owned()), (Role::Mag, "/imu/mag".to_owned())];
        assert_eq!(choice.taken, taken);
        assert_eq!((choice.unasked.len(), choice.references), (2, vec!["/goal".to_owned()]));
        let choice = chosen(&["ref=/goal", "mag=none"], &robot()).unwrap();
        assert_eq!(choice.taken[1], (Role::Reference, "/goal".to_owned()));
        assert_eq!((choice.taken.len(), choice.unasked.len()), (2, 1));
    }

    #[test]
    fn several_are_refused_with_the_list_and_the_option() {
        let mut there = robot();
        there.push(line("/head/imu", "sensor_msgs/msg/Imu", 70, Some(Role::Imu)));
        let fault = LogTopics::default().choose(&there).unwrap_err();
        assert_says(
            &fault.to_string(),
            &["several topics of sensor_msgs/Imu", "/head/imu", "70 messages", "--topic imu=TOPIC"],
        );
        assert_eq!(fault.remedy(), Some(["--topic".to_owned(), "imu=/base/imu".to_owned()]));
        assert!(chosen(&["imu=/head/imu"], &there).is_ok());
    }

    #[test]
    fn a_misspelt_another_and_a_silent_topic_are_refused_with_what_there_is() {
        let fault = topics(&["imu=/bose/imu"]).unwrap().choose(&robot()).unwrap_err();
        assert_says(&fault.to_string(), &["no topic `/bose/imu`; did you mean `/base/imu`?", "/imu/mag"]);
        assert_eq!(fault.remedy(), Some(["--topic".to_owned(), "imu=/base/imu".to_owned()]));
        assert_says(
            &chosen(&["mag=/base/imu"], &robot()).unwrap_err(),
            &["found sensor_msgs/msg/Imu, expected messages of sensor_msgs/MagneticField"],
        );
        let silent = [line("/imu", "sensor_msgs/Imu", 0, Some(Role::Imu))];
        assert_says(&chosen(&["imu=/imu"], &silent).unwrap_err(), &["no message"]);
        assert_says(&chosen(&[], &silent).unwrap_err(), &["no topic of sensor_msgs/Imu"]);
        let other = [line("/imu", "sensor_msgs/Imu", 5, None)];
        assert_says(
            &chosen(&[], &other).unwrap_err(),
            &["topic `/imu`: another definition", "--topic imu=none"],
        );
    }

    #[test]
    fn what_is_no_choice_is_said() {
        let said = |option: &str| topics(&[option]).unwrap_err().to_string();
        assert_says(&said("/imu/data"), &["--topic: found `/imu/data`", "such as imu=/imu/data"]);
        assert_says(&said("accel=/imu"), &["quantity `accel`", "`imu`, `mag`"]);
        assert_says(&topics(&["imu=/a", "imu=/b"]).unwrap_err().to_string(), &["`imu` mapped twice"]);
    }
}
