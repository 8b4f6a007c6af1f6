//! Which topics are read: those that are asked for, and those that there is no choice of.

use super::{LogTopics, Role, TopicFault, TopicLine};
use crate::recording::manifest::spelling::nearest;

/// A name that is so many edits away is probably meant.
const NEAR: usize = 4;
/// In place of a topic: none is taken.
const NONE: &str = "none";

/// What was chosen, and what of it nobody had asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Choice {
    pub(crate) taken: Vec<(Role, String)>,
    pub(crate) unasked: Vec<(Role, TopicLine)>,
    /// References that nobody has asked for; none of them is taken.
    pub(crate) references: Vec<String>,
}

impl TopicLine {
    /// Name, type and number, as a message says them.
    pub(crate) fn described(&self) -> String {
        format!("{} ({}, {} messages)", self.name, self.type_name, self.count)
    }
}

impl LogTopics {
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
    use crate::recording::mapping::MappingFault;

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
