//! What a simulator says that ideal sensors would read.

use nalgebra::Vector3;

use super::{
    Recording,
    sensor_kind::SensorKind,
    topic::{self, TopicError},
};

/// Values of ideal sensors, in the simulated sensor's axes. All columns that are there are of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simulated {
    /// Specific force, m/s²; NaN where not known.
    pub acc: Option<Vec<Vector3<f64>>>,
    /// Rate, rad/s; NaN where not known.
    pub gyr: Option<Vec<Vector3<f64>>>,
    /// Field, µT; NaN where not known.
    pub mag: Option<Vec<Vector3<f64>>>,
    /// Temperature, °C; NaN where not known.
    pub temperature: Option<Vec<f64>>,
}

impl Simulated {
    /// The values of a sensor, if the simulator has it.
    #[must_use]
    pub fn sensor(&self, kind: SensorKind) -> Option<&[Vector3<f64>]> {
        match kind {
            SensorKind::Acc => self.acc.as_deref(),
            SensorKind::Gyr => self.gyr.as_deref(),
            SensorKind::Mag => self.mag.as_deref(),
        }
    }

    /// Whether there is no column at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.temperature.is_none() && SensorKind::ALL.iter().all(|kind| self.sensor(*kind).is_none())
    }

    /// Whether anything is known at a row.
    fn knows(&self, row: usize) -> bool {
        let of_sensor = |kind: &SensorKind| {
            self.sensor(*kind).is_some_and(|values| values[row].iter().any(|value| !value.is_nan()))
        };
        SensorKind::ALL.iter().any(of_sensor)
            || self.temperature.as_ref().is_some_and(|temperature| !temperature[row].is_nan())
    }

    /// Whether a row, other than the first, holds the same as the one before.
    #[must_use]
    pub fn is_repeated(&self, row: usize) -> bool {
        let same = |kind: &SensorKind| self.sensor(*kind).is_none_or(|values| values[row] == values[row - 1]);
        SensorKind::ALL.iter().all(same)
    }

    /// Without sensors that no row knows anything of.
    #[must_use]
    pub fn without_empty(self) -> Self {
        let known = |values: &Vec<Vector3<f64>>| values.iter().flatten().any(|value| !value.is_nan());
        let [acc, gyr, mag] = [self.acc, self.gyr, self.mag].map(|values| values.filter(known));
        Self { acc, gyr, mag, temperature: self.temperature }
    }

    /// Some of the rows.
    #[must_use]
    pub fn at(&self, rows: &[usize]) -> Self {
        let values = |column: &Option<Vec<Vector3<f64>>>| -> Option<Vec<Vector3<f64>>> {
            column.as_ref().map(|column| rows.iter().map(|row| column[*row]).collect())
        };
        let temperature = |column: &Vec<f64>| rows.iter().map(|row| column[*row]).collect();
        Self {
            acc: values(&self.acc),
            gyr: values(&self.gyr),
            mag: values(&self.mag),
            temperature: self.temperature.as_ref().map(temperature),
        }
    }
}

/// What a simulator puts out, on its own clock.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// Name of the simulator or, where the manifest has none, of the file.
    pub name: String,
    /// Times, s, strictly increasing.
    pub time: Vec<f64>,
    /// The values at these times.
    pub values: Simulated,
}

impl Stream {
    /// The simulator's stream of a recording: its `sim_*` columns or, where it has none, those of the sensors, which a
    /// simulator's own file may be in. Rows that know nothing are left out; `None` where none is left.
    #[must_use]
    pub fn of(recording: &Recording) -> Option<Self> {
        let ideal;
        let values = match &recording.simulated {
            Some(simulated) => simulated,
            None => {
                ideal = of_sensors(recording)?;
                &ideal
            }
        };
        let rows: Vec<usize> = (0..recording.rows()).filter(|row| values.knows(*row)).collect();
        if rows.is_empty() {
            return None;
        }
        let named = recording.manifest.reference.as_ref().and_then(|reference| reference.name.clone());
        Some(Self {
            name: named.unwrap_or_else(|| recording.name.clone()),
            time: rows.iter().map(|row| recording.time[*row]).collect(),
            values: if rows.len() == recording.rows() { values.clone() } else { values.at(&rows) }
                .without_empty(),
        })
    }
}

impl Stream {
    /// The simulator's stream of a file of its own for a recording: as [`Stream::of`]; where both files have absolute times,
    /// on those of the recording.
    #[must_use]
    pub fn of_pair(simulated: &Recording, recording: &Recording) -> Option<Self> {
        Some(Self::of(simulated)?.on_times_of(simulated, recording))
    }

    /// The stream of a topic of such a file.
    ///
    /// # Errors
    ///
    /// [`TopicError`].
    pub fn of_topic(simulated: &Recording, recording: &Recording, name: &str) -> Result<Self, TopicError> {
        let values = topic::simulated(simulated, name)?;
        let rows: Vec<usize> = (0..simulated.rows()).filter(|row| values.knows(*row)).collect();
        let stream = Self {
            name: name.to_owned(),
            time: rows.iter().map(|row| simulated.time[*row]).collect(),
            values: values.at(&rows).without_empty(),
        };
        Ok(stream.on_times_of(simulated, recording))
    }

    /// The stream that a topic names or, without one, as [`Stream::of_pair`].
    ///
    /// # Errors
    ///
    /// [`TopicError`].
    pub fn chosen(
        simulated: &Recording,
        recording: &Recording,
        topic: Option<&str>,
    ) -> Result<Self, TopicError> {
        match topic {
            Some(topic) => Self::of_topic(simulated, recording, topic),
            None => Self::of_pair(simulated, recording)
                .ok_or_else(|| TopicError::NoStream { there: topic::names(simulated) }),
        }
    }

    /// On the times of a recording, where both files have absolute times.
    fn on_times_of(mut self, simulated: &Recording, recording: &Recording) -> Self {
        if let (Some(own), Some(others)) = (simulated.epoch, recording.epoch) {
            let later = own.since(others);
            self.time.iter_mut().for_each(|time| *time += later);
        }
        self
    }
}

/// The sensors of a recording for ideal ones; `None` if there is none.
fn of_sensors(recording: &Recording) -> Option<Simulated> {
    let values = |kind| recording.sensor(kind).map(|triple| triple.values.clone());
    let [acc, gyr, mag] = SensorKind::ALL.map(values);
    let any = acc.is_some() || gyr.is_some() || mag.is_some();
    any.then(|| Simulated { acc, gyr, mag, temperature: recording.temperature.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture::Fixture;

    fn read(sections: &str, samples: &str) -> Recording {
        Fixture::new("run.csv", sections, samples).read()
    }

    #[test]
    fn a_stream_is_of_the_simulator_s_columns_without_the_rows_that_know_nothing() {
        let samples = "t,acc_x,acc_y,acc_z,sim_acc_x,sim_acc_y,sim_acc_z,sim_temp\n\
            0,0,0,9.8,,,,\n0.01,0,0,9.8,1,,,\n0.02,0,0,9.8,,,,20\n0.03,0,0,9.8,,,,\n";
        let stream = Stream::of(&read("", samples)).unwrap();
        assert_eq!((stream.name.as_str(), stream.time), ("run.csv", vec![0.01, 0.02]));
        let acc = stream.values.sensor(SensorKind::Acc).unwrap();
        assert!(acc.len() == 2 && acc[0].x == 1.0 && acc[1].x.is_nan());
        assert_eq!(stream.values.temperature.unwrap()[1], 20.0);
        assert_eq!(stream.values.gyr, None);
    }

    #[test]
    fn a_simulator_s_file_may_call_its_columns_as_a_sensor_s() {
        let sections = "[units]\nacc = \"g\"\n[reference]\nkind = \"simulator\"\nname = \"gazebo\"\n";
        let recording = read(sections, "t,acc_x,acc_y,acc_z,temp\n0,0,0,1,20\n0.01,0,0,1,\n");
        let stream = Stream::of(&recording).unwrap();
        assert_eq!((stream.name.as_str(), &stream.time), ("gazebo", &recording.time));
        assert_eq!(stream.values.acc.unwrap()[0].z, 9.80665);
        assert_eq!(stream.values.temperature.unwrap()[0], 20.0);
    }

    #[test]
    fn there_is_no_stream_where_nothing_is_known() {
        // Real samples are no stand-in for a simulator that says nothing.
        let silent = "t,acc_x,acc_y,acc_z,sim_acc_x,sim_acc_y,sim_acc_z\n0,0,0,9.8,,,\n";
        assert_eq!(Stream::of(&read("", silent)), None);
        assert_eq!(Stream::of(&read("", "t,temp\n0,20\n")), None);
        assert!(Simulated::default().is_empty());
    }
}
