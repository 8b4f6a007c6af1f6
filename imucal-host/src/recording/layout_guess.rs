//! What the columns of an unknown file probably are, and the options that read it so.

use std::path::Path;

use super::{
    epoch::Epoch,
    format::Format,
    mapping::unit_of_time,
    order_statistics::median,
    read::{
        self,
        column_guess::{meant, unit_behind},
        columns::NAMES,
        csv_rows::Rows,
        date, number,
    },
    unit::{TimeUnit, Unit},
};
use crate::{file::Limits, recording::sensor_kind::SensorKind};

/// Rows that are looked at.
const ROWS: usize = 5_000;
/// Faster than this nothing is turned by hand, rad/s: such numbers are °/s.
const FASTEST: f64 = 35.0;

/// A column of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct GuessedColumn {
    /// Its name in the file.
    pub name: String,
    /// The column of a recording that it probably is.
    pub meaning: Option<&'static str>,
    /// Its first value, as the file has it.
    pub first: String,
}

/// A file's columns, and how to read them.
#[derive(Clone, Debug, PartialEq)]
pub struct LayoutGuess {
    /// In the file's order.
    pub columns: Vec<GuessedColumn>,
    /// `--time`, `--map` and `--unit`, each followed by its value.
    pub options: Vec<String>,
    /// Sensors whose unit neither name nor numbers say.
    pub unknown_units: Vec<SensorKind>,
}

/// Looks at the beginning of a file; `None` where it cannot be read, or no sensor is recognised.
#[must_use]
pub fn guess(path: &Path, limits: &Limits) -> Option<LayoutGuess> {
    let table = Beginning::read(path, limits)?;
    let time = table.time()?;
    let meanings = table.meanings(time);
    let mut options = Vec::new();
    let mut units = Vec::new();
    let mut unknown_units = Vec::new();
    if table.names[time] != "t" {
        options.extend(["--time".to_owned(), table.names[time].clone()]);
    }
    let unit = table.time_unit(time);
    if unit_of_time(&table.names[time]) != Some(unit) && unit != TimeUnit::Second {
        units.push(format!("t={unit}"));
    }
    let mut any = false;
    for kind in SensorKind::ALL {
        let Some(places) = table.places(&meanings, kind) else { continue };
        any = true;
        let names = places.map(|at| table.names[at].as_str());
        if names.iter().zip(places).any(|(name, at)| meanings[at] != Some(*name)) {
            options.extend(["--map".to_owned(), format!("{kind}={}", names.join(","))]);
        }
        match table.unit(kind, places) {
            Some(unit) => units.push(format!("{kind}={unit}")),
            None => unknown_units.push(kind),
        }
    }
    if let Some(at) = meanings.iter().position(|meaning| *meaning == Some("temp"))
        && table.names[at] != "temp"
    {
        options.extend(["--map".to_owned(), format!("temp={}", table.names[at])]);
    }
    if !any {
        return None;
    }
    if !units.is_empty() {
        options.extend(["--unit".to_owned(), units.join(",")]);
    }
    let columns = table.names.iter().zip(&meanings).zip(&table.first);
    let columns = columns.map(|((name, meaning), first)| GuessedColumn {
        name: name.clone(),
        meaning: *meaning,
        first: first.clone(),
    });
    Some(LayoutGuess { columns: columns.collect(), options, unknown_units })
}

/// Number of fields of a file's first line, where they are numbers instead of names.
#[must_use]
pub fn nameless(path: &Path, limits: &Limits) -> Option<usize> {
    let table = Beginning::read(path, limits)?;
    let is_value = |name: &String| !value(name.as_bytes()).is_nan();
    table.names.iter().all(is_value).then_some(table.names.len())
}

/// Names and first rows of a file.
struct Beginning {
    names: Vec<String>,
    first: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Beginning {
    fn read(path: &Path, limits: &Limits) -> Option<Self> {
        match Format::of(path).ok()? {
            Format::Csv | Format::CsvGz => Self::of_text(path, limits),
            #[cfg(feature = "parquet")]
            Format::Parquet => Self::of_numbers(read::parquet::beginning(path, ROWS, limits)?),
            #[cfg(not(feature = "parquet"))]
            Format::Parquet => None,
            Format::Mat => Self::of_numbers(read::matlab::beginning(path, ROWS, limits)?),
            Format::Log => None,
        }
    }

    fn of_numbers(of: Vec<(String, Vec<f64>)>) -> Option<Self> {
        let (names, columns): (Vec<String>, Vec<Vec<f64>>) = of.into_iter().unzip();
        let text = |column: &Vec<f64>| column.first().filter(|value| !value.is_nan()).map(f64::to_string);
        let first = columns.iter().map(|column| text(column).unwrap_or_default()).collect();
        (columns.first()?.len() > 1).then_some(Self { names, first, columns })
    }

    fn of_text(path: &Path, limits: &Limits) -> Option<Self> {
        let mut rows = Rows::open(path, limits).ok()?;
        rows.skip_comments().ok()?;
        rows.find_separator().ok()?;
        if !rows.advance().ok()? {
            return None;
        }
        let text = |field: &[u8]| String::from_utf8_lossy(field).trim().to_owned();
        let names: Vec<String> = rows.fields().map(text).collect();
        let mut table = Self { first: Vec::new(), columns: vec![Vec::new(); names.len()], names };
        // A line that is damaged ends what is looked at.
        while table.columns.first()?.len() < ROWS && rows.advance().unwrap_or(false) {
            if rows.len() != table.names.len() {
                break;
            }
            if table.first.is_empty() {
                table.first = rows.fields().map(text).collect();
            }
            for (column, field) in table.columns.iter_mut().zip(rows.fields()) {
                let pointed = rows.pointed(field);
                column.push(value(pointed.as_deref().unwrap_or(field)));
            }
        }
        (table.columns.first()?.len() > 1).then_some(table)
    }

    /// The column of times: by its name, or else the first that rises all the time.
    fn time(&self) -> Option<usize> {
        let named = |name: &String| name == "t" || meant(name, &["t"]).is_some() || is_time(name);
        let rises = |at: &usize| self.columns[*at].windows(2).all(|pair| pair[1] > pair[0]);
        let all = 0..self.names.len();
        let both = all.clone().find(|at| named(&self.names[*at]) && rises(at));
        // One that is not understood is said so when it is read.
        both.or_else(|| all.clone().find(rises)).or_else(|| all.clone().find(|at| named(&self.names[*at])))
    }

    fn time_unit(&self, time: usize) -> TimeUnit {
        if let Some(unit) = unit_of_time(&self.names[time]) {
            return unit;
        }
        let steps = self.columns[time].windows(2).map(|pair| pair[1] - pair[0]);
        match median(steps.filter(|step| step.is_finite()).collect()).unwrap_or(0.0) {
            step if step < 0.5 => TimeUnit::Second,
            step if step < 200.0 => TimeUnit::Millisecond,
            step if step < 2e5 => TimeUnit::Microsecond,
            _ => TimeUnit::Nanosecond,
        }
    }

    /// What each column is; none twice.
    fn meanings(&self, time: usize) -> Vec<Option<&'static str>> {
        let mut absent: Vec<&'static str> = NAMES
            .into_iter()
            .filter(|known| *known != "t" && !self.names.iter().any(|name| name == known))
            .collect();
        let mut meanings = Vec::new();
        for (at, name) in self.names.iter().enumerate() {
            let own = NAMES.into_iter().find(|known| known == name);
            let meaning = if at == time {
                Some("t")
            } else {
                own.filter(|known| *known != "t").or_else(|| meant(name, &absent).map(|(known, _)| known))
            };
            absent.retain(|known| Some(*known) != meaning);
            meanings.push(meaning);
        }
        meanings
    }

    /// Where a sensor's three columns are.
    fn places(&self, meanings: &[Option<&'static str>], kind: SensorKind) -> Option<[usize; 3]> {
        let at = |axis: &str| {
            let name = format!("{kind}_{axis}");
            meanings.iter().position(|meaning| *meaning == Some(name.as_str()))
        };
        Some([at("x")?, at("y")?, at("z")?])
    }

    /// The unit that a sensor's names state, or its numbers show.
    fn unit(&self, kind: SensorKind, places: [usize; 3]) -> Option<Unit> {
        let stated = unit_behind(kind.prefix(), &self.names[places[0]]).and_then(|unit| unit.parse().ok());
        stated.or_else(|| self.shown_unit(kind, places)).filter(|unit| *unit != Unit::Counts)
    }

    fn shown_unit(&self, kind: SensorKind, [x, y, z]: [usize; 3]) -> Option<Unit> {
        let rows = self.columns[x].iter().zip(&self.columns[y]).zip(&self.columns[z]);
        let mut norms: Vec<f64> =
            rows.map(|((x, y), z)| x.hypot(*y).hypot(*z)).filter(|n| n.is_finite()).collect();
        norms.sort_unstable_by(f64::total_cmp);
        let (middle, high) = (*norms.get(norms.len() / 2)?, *norms.get(norms.len() * 99 / 100)?);
        let within = |low: f64, high: f64| (low..high).contains(&middle);
        match kind {
            SensorKind::Acc if within(8.0, 12.0) => Some(Unit::MetrePerSecondSquared),
            SensorKind::Acc if within(0.8, 1.25) => Some(Unit::Gravity),
            SensorKind::Acc if within(800.0, 1250.0) => Some(Unit::MilliGravity),
            SensorKind::Gyr if high > FASTEST && high < 4_000.0 => Some(Unit::DegreePerSecond),
            SensorKind::Mag if within(20.0, 70.0) => Some(Unit::MicroTesla),
            SensorKind::Mag if within(200.0, 700.0) => Some(Unit::MilliGauss),
            SensorKind::Mag if within(0.2, 0.7) => Some(Unit::Gauss),
            SensorKind::Mag if within(2e4, 7e4) => Some(Unit::NanoTesla),
            _ => None,
        }
    }
}

/// A number, or of a date the seconds since 1970; NaN where it is neither.
fn value(field: &[u8]) -> f64 {
    let date = || Some(date::parse(field)?.since(Epoch::of_picoseconds(0)));
    number::parse(field).ok().or_else(date).unwrap_or(f64::NAN)
}

/// A name of times that has more than the word in it, such as `#timestamp [ns]` or `sensor_time`.
fn is_time(name: &str) -> bool {
    let name = name.to_lowercase();
    name.split(|c: char| !c.is_alphabetic()).any(|word| matches!(word, "time" | "timestamp" | "stamp"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Mapping, Recording};

    fn guessed(text: &str) -> Option<LayoutGuess> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log.csv");
        std::fs::write(&path, text).expect("room");
        guess(&path, &Limits::default())
    }

    fn options(text: &str) -> String {
        guessed(text).expect("a guess").options.join(" ")
    }

    #[test]
    fn names_and_numbers_say_what_the_columns_are_and_in_which_unit() {
        let said =
            options("timestamp_ms,ax,ay,az,gx,gy,gz\n10,0,0,1,0,0,200\n20,0,1,0,0,0,-250\n30,0,1,0,0,0,9\n");
        assert_eq!(said, "--time timestamp_ms --map acc=ax,ay,az --map gyr=gx,gy,gz --unit acc=g,gyr=deg/s");
        let said =
            options("Time;Acc X [mg];Acc Y [mg];Acc Z [mg];Temperature\n0,00;1;2;999;20\n0,01;1;2;1000;20\n");
        assert_eq!(
            said,
            "--time Time --map acc=Acc X [mg],Acc Y [mg],Acc Z [mg] --map temp=Temperature --unit acc=mg"
        );
    }

    #[test]
    fn a_first_line_of_numbers_has_no_names() {
        let of = |text: &str| {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("log.csv");
            std::fs::write(&path, text).expect("room");
            nameless(&path, &Limits::default())
        };
        assert_eq!(of("0,0,0,1\n0.01,0,0,1\n0.02,0,0,1\n"), Some(4));
        assert_eq!(of("12:00:00;0.5;0;1\n12:00:01;0;0;1\n12:00:02;0;0;1\n"), Some(4));
        assert_eq!(of("t,ax,ay,az\n0.01,0,0,1\n0.02,0,0,1\n"), None);
    }

    #[test]
    fn dates_are_times() {
        let rows =
            "2026-05-01T12:00:00.00Z,0,0,1\n2026-05-01T12:00:00.01Z,0,1,0\n2026-05-01T12:00:00.02Z,0,0,1\n";
        let said = options(&format!("timestamp,ax,ay,az\n{rows}"));
        assert_eq!(said, "--time timestamp --map acc=ax,ay,az --unit acc=g");
    }

    #[test]
    fn a_unit_that_nothing_says_is_asked_for() {
        let guess =
            guessed("t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n0,1,2,16000,0,0,1\n0.01,1,2,16384,0,0,1\n");
        let guess = guess.expect("a guess");
        assert_eq!(guess.unknown_units, [SensorKind::Acc, SensorKind::Gyr]);
        assert!(guess.options.is_empty(), "{:?}", guess.options);
    }

    #[test]
    fn a_table_without_a_sensor_is_none() {
        assert_eq!(guessed("t,speed\n0,1\n1,2\n"), None);
        assert_eq!(guessed("acc_x,acc_y,acc_z\n0,0,1\n0,0,1\n"), None);
        // Times that are not understood are named by what they are called.
        let said = options("date time;ax;ay;az\n05/01/2026 12:00:00;0;0;1\n05/01/2026 12:00:01;0;0;1\n");
        assert_eq!(said, "--time date time --map acc=ax,ay,az --unit acc=g");
        assert_eq!(guessed("t,acc_x,acc_y,acc_z\n"), None);
    }

    #[test]
    fn what_is_guessed_reads_the_file() {
        let text = "#timestamp [ns],w_x,w_y,w_z,accel_x,accel_y,accel_z\n1403636579758555392,0,0,0.1,0,0,9.81\n\
                    1403636579763555392,0,0,0.1,0,9.81,0\n1403636579768555392,0,0,0.1,0,9.81,0\n";
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("data.csv");
        std::fs::write(&path, text).expect("room");
        let options = guess(&path, &Limits::default()).expect("a guess").options;
        let of = |option: &str| -> Vec<String> {
            let pairs = options.chunks(2).filter(|pair| pair[0] == option);
            pairs.flat_map(|pair| pair[1..].to_vec()).collect()
        };
        let units: Vec<String> =
            of("--unit").iter().flat_map(|all| all.split(',')).map(str::to_owned).collect();
        let mapping = Mapping::parse(&of("--map"), &units, of("--time").first().map(String::as_str));
        let recording = Recording::read_as(&path, &mapping.expect("a mapping"), &Limits::default());
        let recording = recording.expect("it reads");
        assert!((recording.time[1] - recording.time[0] - 0.005).abs() < 1e-9);
        assert_eq!(recording.acc.expect("mapped").values[0].z, 9.81);
    }
}
