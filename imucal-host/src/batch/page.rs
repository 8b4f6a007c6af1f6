//! The page of a batch: which recordings are calibrated, how the units of a kind spread, and which are unlike the others.

use maud::{Markup, html};

use super::{
    entry::{Entry, Sensor, Standing},
    outlier::{Outlier, Outliers, Population, Spread},
    report::Counts,
};
use crate::{
    page::{
        Answer, Part, Tone,
        dot_rows::{DotRow, dot_rows},
        figure,
        scale::Scale,
    },
    report::{
        measure::{measure, plain, rounded},
        table::words,
    },
};

/// Rows of a table at most, so that a page of any batch stays short.
const ROWS: usize = 200;
/// Units that a row of a drawing shows at most, apart from those beyond the limit.
const DOTS: usize = 30;
/// Digits of a hash that tell recordings of a batch apart.
const DIGITS: usize = 12;
/// How the title of such a page begins.
const TITLE: &str = "Batch of ";

/// The title of the page.
#[must_use]
pub fn title(entries: &[Entry]) -> String {
    format!("{TITLE}{} recording{}", entries.len(), if entries.len() == 1 { "" } else { "s" })
}

/// Whether this is the beginning of such a page.
#[must_use]
pub fn is_page(head: &str) -> bool {
    head.contains(&format!("<title>{TITLE}"))
}

/// What a page says of a batch.
#[must_use]
pub fn batch(entries: &[Entry], found: &Outliers) -> Part {
    let body = html! {
        (not_calibrated(entries))
        (unlike(&found.outliers))
        @if !found.populations.is_empty() { h2 { "Units of a kind" } }
        div class="figures" { @for population in &found.populations { (spread(population)) } }
        (units(entries))
    };
    Part { answer: answer(entries, found), body }
}

fn answer(entries: &[Entry], found: &Outliers) -> Answer {
    let counts = Counts::of(entries);
    let missing = counts.recordings - counts.calibrated;
    let tone = match (missing, found.outliers.is_empty()) {
        (0, true) => Tone::Good,
        (0, false) => Tone::Doubt,
        _ => Tone::Bad,
    };
    let outliers = match found.outliers.len() {
        0 => "no parameter of a unit is unlike the others".to_owned(),
        1 => "one parameter of a unit is unlike the others".to_owned(),
        many => format!("{many} parameters of units are unlike the others"),
    };
    Answer { tone, words: format!("{}; {outliers}.", counts.line()) }
}

fn not_calibrated(entries: &[Entry]) -> Markup {
    let missing: Vec<&Entry> =
        entries.iter().filter(|entry| entry.standing != Standing::Calibrated).collect();
    let rows = missing
        .iter()
        .map(|entry| html! { td { (entry.name) } td { (entry.standing.name()) } td { (why(entry)) } });
    html! { @if !missing.is_empty() {
        h2 { "Not calibrated" }
        (table(&["recording", "ended", "why"], "list", rows, missing.len()))
    } }
}

fn why(entry: &Entry) -> String {
    let refused =
        entry.sensors.iter().filter(|sensor| !sensor.passed).map(status).collect::<Vec<_>>().join("; ");
    entry.error.clone().unwrap_or(refused)
}

fn status(sensor: &Sensor) -> String {
    let reason = sensor.reason.as_deref().map_or_else(String::new, |reason| format!(" ({reason})"));
    format!("{} {}{reason}", words(sensor.sensor), sensor.status)
}

fn unlike(outliers: &[Outlier]) -> Markup {
    let row = |outlier: &Outlier| {
        html! {
            td { (outlier.name) } td { (words(outlier.sensor)) } td { (outlier.parameter) }
            td { (measure(outlier.value, outlier.std_error)) } td { (plain(outlier.median)) } td { (format!("{:+.1}", outlier.z)) }
        }
    };
    let heads = ["recording", "sensor", "parameter", "value", "median of the others", "z"];
    html! { @if !outliers.is_empty() {
        h2 { "Unlike the others" }
        (table(&heads, "", outliers.iter().map(row), outliers.len()))
    } }
}

fn spread(population: &Population) -> Markup {
    let name = format!(
        "{} by {} from {}: {} units",
        words(population.sensor),
        population.model,
        population.unit_in,
        population.units
    );
    let Some(limit) = population.limit else {
        return html! { figure { figcaption { b { (name) } "Too few to be compared." } } };
    };
    let rows: Vec<DotRow> = population.spreads.iter().map(row).collect();
    let reached = population.spreads.iter().flat_map(|spread| &spread.z).copied();
    let scale = Scale::linear(reached.chain([-1.1 * limit, 1.1 * limit]));
    let drawing =
        dot_rows(&scale, &rows, &[("limit", -limit), ("limit", limit)], "z against the others", &name);
    let keys = html! {
        span class="key after" { "alike" } span class="key before" { "unlike" }
        br;
        "Limit of chance: " (rounded(limit, 1)) "."
    };
    figure(&name, &drawing, &keys)
}

/// Units evenly by rank, the first and the last among them, and all that are beyond the limit.
fn row(spread: &Spread) -> DotRow {
    let last = spread.z.len().saturating_sub(1);
    let step = spread.z.len().div_ceil(DOTS).max(1);
    let shown = |(rank, z): &(usize, &f64)| rank % step == 0 || *rank == last || z.abs() > spread.limit;
    let dot = |(_, z): (usize, &f64)| (if z.abs() > spread.limit { "before" } else { "after" }, *z);
    let dots = spread.z.iter().enumerate().filter(shown).map(dot).collect();
    DotRow { name: spread.parameter.into(), from: spread.z.first().copied().unwrap_or_default(), dots }
}

fn units(entries: &[Entry]) -> Markup {
    let calibrated: Vec<&Entry> =
        entries.iter().filter(|entry| entry.standing == Standing::Calibrated).collect();
    let row = |entry: &&Entry| {
        let hash = entry.input.as_ref().map_or("", |input| input.sha256.get(..DIGITS).unwrap_or_default());
        let residual = |sensor: &Sensor| {
            let rms = sensor.held_out_rms.map_or_else(String::new, |rms| format!(", {}", plain(rms)));
            format!("{} {}{rms}", sensor.sensor, sensor.status)
        };
        let sensors = entry.sensors.iter().map(residual).collect::<Vec<_>>().join("; ");
        html! { td { (entry.name) } td { (hash) } td { (sensors) } }
    };
    let heads = [
        "recording",
        "SHA-256 begins",
        "sensors, with the rms residual of observations left out (calibrated unit; rad a turn)",
    ];
    html! { @if !calibrated.is_empty() {
        h2 { "Calibrated" }
        (table(&heads, "list", calibrated.iter().map(row), calibrated.len()))
    } }
}

fn table(heads: &[&str], class: &str, rows: impl Iterator<Item = Markup>, of: usize) -> Markup {
    html! {
        div class="wide" { table class=(class) {
            thead { tr { @for head in heads { th { (head) } } } }
            tbody { @for row in rows.take(ROWS) { tr { (row) } } }
        } }
        @if of > ROWS { p class="note" { "The first " (ROWS) " of " (of) "; the summary has all." } }
    }
}

#[cfg(test)]
mod tests {
    use imucal_core::record::Date;

    use super::*;
    use crate::{
        batch::{
            outlier::{outliers, tests::unit},
            parameter::OF_SENSOR,
        },
        page::{Provenance, page},
    };

    /// Units whose parameters spread by one, the last far from the others.
    fn units(count: usize) -> Vec<Entry> {
        let value = |unit: usize, parameter: usize| ((unit * 7 + parameter * 3) % 19) as f64 / 9.0 - 1.0;
        let values = |unit: usize| std::array::from_fn::<f64, 12, _>(|parameter| value(unit, parameter));
        let mut units: Vec<Entry> = (0..count).map(|k| unit(k, "a", &values(k), 0.01)).collect();
        if let Some(last) = units.last_mut() {
            last.sensors[0].of_sensor[4].value = Some(40.0);
        }
        units
    }

    #[test]
    fn a_page_of_a_thousand_units_is_short_and_shows_the_one_unlike_the_others() {
        let units = units(1000);
        let title = title(&units);
        let page =
            page(&title, &Provenance::new(Date::from_days(20_000)), &[batch(&units, &outliers(&units))]);
        assert!(page.len() <= 300_000, "{} bytes", page.len());
        for words in ["unit 0999", OF_SENSOR[4], "one parameter of a unit is unlike", "The first 200 of 1000"]
        {
            assert!(page.contains(words), "{words}");
        }
        assert_eq!(page.matches("circle class=\"before\"").count(), 1);
        assert!(is_page(&page) && !is_page("<title>unit.csv</title>"));
    }

    #[test]
    fn a_recording_that_is_not_calibrated_is_named_with_the_reason() {
        let mut units = units(3);
        units[1].standing = Standing::Unreadable;
        units[1].error = Some("a.csv: no header <x>".into());
        let part = batch(&units, &outliers(&units));
        let body = part.body.into_string();
        assert_eq!(part.answer.tone, Tone::Bad);
        assert!(body.contains("a.csv: no header &lt;x&gt;") && body.contains("Too few"), "{body}");
    }
}
