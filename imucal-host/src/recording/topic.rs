//! Several streams of a simulator in one file: the columns `sim_NAME_acc_x …` are those of the topic NAME.
//!
//! They are in the units of `sim_acc_x …`: m/s², rad/s, µT.

use nalgebra::Vector3;

use super::{Recording, SensorKind, Simulated};

/// Why a topic gives no stream.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TopicError {
    /// No column has its name.
    #[error("found no topic `{name}`, expected {}", listed(.there))]
    Unknown {
        /// The name that was asked for.
        name: String,
        /// Topics of the file.
        there: Vec<String>,
    },
    /// Neither columns of a simulator nor the name of a topic.
    #[error(
        "found no stream of a simulator, expected columns sim_acc_*, sim_gyr_* or sim_mag_*; {}",
        remedy(.there)
    )]
    NoStream {
        /// Topics of the file.
        there: Vec<String>,
    },
    /// A sensor lacks an axis.
    #[error("topic `{name}`: column `{column}` is missing; add it, or leave the sensor's other axes out")]
    Incomplete {
        /// The topic.
        name: String,
        /// The column.
        column: String,
    },
    /// A field that is no number.
    #[error("column `{column}`, row {row}: found `{found}`, expected a number or an empty field")]
    NotANumber {
        /// The column.
        column: String,
        /// Row, from 1.
        row: usize,
        /// The field.
        found: String,
    },
}

fn remedy(there: &[String]) -> String {
    match there {
        [] => "export what an ideal sensor would read".to_owned(),
        topics => format!("choose a topic with --sim-topic: {}", topics.join(", ")),
    }
}

fn listed(there: &[String]) -> String {
    match there {
        [] => "columns such as sim_NAME_acc_x; leave --sim-topic out for the columns sim_acc_x".to_owned(),
        names => format!("one of {}", names.join(", ")),
    }
}

/// Topic and sensor of a column: `sim_torso_acc_x` is of `torso`.
pub fn split(column: &str) -> Option<(&str, SensorKind)> {
    let rest = column.strip_prefix("sim_")?;
    SensorKind::ALL.into_iter().find_map(|kind| {
        let names = ["x", "y", "z"].map(|axis| format!("_{kind}_{axis}"));
        let topic = names.iter().find_map(|end| rest.strip_suffix(end.as_str()))?;
        (!topic.is_empty()).then_some((topic, kind))
    })
}

/// Topics of a file, in the order of its columns.
pub fn names(recording: &Recording) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (name, _) in recording.extra.iter().filter_map(|column| split(&column.name)) {
        if names.iter().all(|other| other != name) {
            names.push(name.to_owned());
        }
    }
    names
}

/// What a topic says.
///
/// # Errors
///
/// [`TopicError`].
pub fn simulated(recording: &Recording, name: &str) -> Result<Simulated, TopicError> {
    let there = names(recording);
    if !there.iter().any(|other| other == name) {
        return Err(TopicError::Unknown { name: name.to_owned(), there });
    }
    let [acc, gyr, mag] = SensorKind::ALL.map(|kind| sensor(recording, name, kind));
    Ok(Simulated { acc: acc?, gyr: gyr?, mag: mag?, temperature: None })
}

/// A sensor's columns; `None` where there is none of them.
fn sensor(
    recording: &Recording,
    name: &str,
    kind: SensorKind,
) -> Result<Option<Vec<Vector3<f64>>>, TopicError> {
    let columns = ["x", "y", "z"].map(|axis| format!("sim_{name}_{kind}_{axis}"));
    let found = columns.each_ref().map(|column| recording.extra.iter().find(|extra| extra.name == *column));
    if found.iter().all(Option::is_none) {
        return Ok(None);
    }
    let mut values = vec![Vector3::repeat(f64::NAN); recording.rows()];
    for (axis, (column, extra)) in columns.iter().zip(found).enumerate() {
        let missing = || TopicError::Incomplete { name: name.to_owned(), column: column.clone() };
        for (row, field) in extra.ok_or_else(missing)?.values.iter().enumerate() {
            let field = field.trim();
            let Some(value) = values.get_mut(row).filter(|_| !field.is_empty()) else { continue };
            value[axis] = field.parse().map_err(|_| TopicError::NotANumber {
                column: column.clone(),
                row: row + 1,
                found: field.to_owned(),
            })?;
        }
    }
    Ok(Some(values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture::Fixture;

    const HEADER: &str = "t,sim_torso_acc_x,sim_torso_acc_y,sim_torso_acc_z,sim_left_foot_gyr_x,sim_left_foot_gyr_y,\
        sim_left_foot_gyr_z\n";

    #[test]
    fn each_topic_has_its_own_columns() {
        let recording =
            Fixture::new("run.csv", "", format!("{HEADER}0,0,0,9.8,1,2,3\n0.01,,,,4,5,6\n")).read();
        assert_eq!(names(&recording), ["torso", "left_foot"]);
        let torso = simulated(&recording, "torso").unwrap();
        let acc = torso.acc.unwrap();
        assert!(acc[0].z == 9.8 && acc[1].x.is_nan() && torso.gyr.is_none());
        assert_eq!(simulated(&recording, "left_foot").unwrap().gyr.unwrap()[1].z, 6.0);
    }

    #[test]
    fn what_is_wrong_with_a_topic_is_said() {
        let recording = Fixture::new("run.csv", "", format!("{HEADER}0,0,0,up,1,2,3\n")).read();
        let said = |name: &str| simulated(&recording, name).unwrap_err().to_string();
        assert!(
            said("feet").contains("no topic `feet`, expected one of torso, left_foot"),
            "{}",
            said("feet")
        );
        assert!(said("torso").contains("`sim_torso_acc_z`, row 1: found `up`"), "{}", said("torso"));
        let plain = Fixture::new("run.csv", "", "t,sim_acc_x,sim_acc_y,sim_acc_z\n0,0,0,9\n").read();
        assert!(simulated(&plain, "torso").unwrap_err().to_string().contains("leave --sim-topic out"));
        let cut = Fixture::new("run.csv", "", "t,sim_torso_acc_x,sim_torso_acc_y\n0,0,0\n").read();
        assert!(simulated(&cut, "torso").unwrap_err().to_string().contains("`sim_torso_acc_z` is missing"));
    }

    #[test]
    fn columns_without_a_name_are_of_no_topic() {
        assert_eq!(split("sim_acc_x"), None);
        assert_eq!(split("sim_torso_acc"), None);
        assert_eq!(split("sim_left_foot_mag_z"), Some(("left_foot", SensorKind::Mag)));
    }
}
