//! What a simulator says that ideal sensors would read.

use nalgebra::Vector3;

use super::{Recording, sensor_kind::SensorKind};

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

    /// Some of the rows.
    fn at(&self, rows: &[usize]) -> Self {
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
            values: if rows.len() == recording.rows() { values.clone() } else { values.at(&rows) },
        })
    }
}

/// The sensors of a recording for ideal ones; `None` if there is none.
fn of_sensors(recording: &Recording) -> Option<Simulated> {
    let values = |kind| recording.sensor(kind).map(|triple| triple.values.clone());
    let [acc, gyr, mag] = SensorKind::ALL.map(values);
    let any = acc.is_some() || gyr.is_some() || mag.is_some();
    any.then(|| Simulated { acc, gyr, mag, temperature: recording.temperature.clone() })
}
