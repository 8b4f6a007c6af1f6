//! What the watch cannot know from the record.

/// Earth's rate, rad/s.
const EARTH_RATE: f32 = 7.292e-5;

/// Standard deviation of gravity over the Earth's surface about 9.80665 m/s², m/s²: from 9.764 to 9.834.
pub const GRAVITY_ANYWHERE: f32 = 0.02;

/// What is expected at the place, and how steady a healthy sensor is. All in the unit that the record's triad gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WatchSettings {
    /// Local gravity.
    pub gravity: f32,
    /// Standard deviation of its error; 0 where it is known as well as the record was made with, [`GRAVITY_ANYWHERE`] where the place is not
    /// known.
    pub gravity_error: f32,
    /// Length of the field; `None`: the record's, if it has one in the unit that it gives.
    pub field: Option<f32>,
    /// Dip of the field below the horizon, rad; `None`: not known.
    pub dip: Option<f32>,
    /// In-run bias instability of accelerometer, gyroscope and magnetometer: standard deviation of what the bias does slowly. Larger:
    /// small drifts are taken for it.
    pub instability: [f32; 3],
    /// Correlation time of that, s.
    pub memory: f32,
    /// Earth's rate; 0 where the caller takes it off beforehand.
    pub earth_rate: f32,
    /// Share by which the field's length and direction differ between places where the device is put down; 0 for a device that
    /// stays.
    pub place: f32,
    /// Temperatures for which the record was made, °C; seconds outside are counted and not judged.
    pub span: Option<[f32; 2]>,
    /// False alarms allowed a day of rest, of all statistics together.
    pub false_alarms: f32,
}

impl Default for WatchSettings {
    /// A consumer's sensors in m/s², rad/s and µT, carried about, and one false alarm in 100 days of rest.
    fn default() -> Self {
        Self {
            gravity: 9.806_65,
            gravity_error: 0.0,
            field: None,
            dip: None,
            instability: [5e-4, 5e-5, 0.05],
            memory: 300.0,
            earth_rate: EARTH_RATE,
            place: 0.05,
            span: None,
            false_alarms: 0.01,
        }
    }
}
