//! What a result comes from: what was read, its hash, by which version, and when.

use std::{io, path::Path};

use imucal_core::record::Date;
use maud::{Markup, html};

use crate::{
    file::digest::sha256,
    recording::{Recording, files_of, manifest::site::Site},
    report::measure::plain,
};

/// Facts about where a result comes from, in the order in which they are shown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Provenance {
    facts: Vec<(String, String)>,
}

impl Provenance {
    /// Of a result made on this day.
    #[must_use]
    pub fn new(made: Date) -> Self {
        let version = format!("imucal {}", env!("CARGO_PKG_VERSION"));
        Self::default().with("made", &format!("{made}, by {version}"))
    }

    /// With one fact more; none where its text is empty.
    #[must_use]
    pub fn with(mut self, name: &str, text: &str) -> Self {
        if !text.is_empty() {
            self.facts.push((name.to_owned(), text.to_owned()));
        }
        self
    }

    /// With a file by its name, size and SHA-256; of a bag that is a folder, those of its files one behind the other.
    ///
    /// # Errors
    ///
    /// What the system says of a file that cannot be read.
    pub fn with_file(self, what: &str, path: &Path) -> io::Result<Self> {
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let files = files_of(path).map_err(io::Error::other)?;
        let (bytes, hash) = sha256(&files)?;
        let among = if files.len() > 1 { format!(" in {} files", files.len()) } else { String::new() };
        Ok(self.with(what, &format!("{name}, {bytes} bytes{among}")).with("its SHA-256", &hash))
    }

    /// With what was recorded: unit, when, for how long, where.
    #[must_use]
    pub fn with_recording(self, recording: &Recording) -> Self {
        let unit = &recording.manifest.sensor;
        let mut provenance = self
            .with("unit", unit.name.as_deref().unwrap_or_default())
            .with("serial number", unit.serial.as_deref().unwrap_or_default());
        if let (Some(first), Some(last)) = (recording.time.first(), recording.time.last()) {
            let rate =
                recording.median_interval().filter(|interval| *interval > 0.0).map(|interval| 1.0 / interval);
            let rate = rate.map_or_else(String::new, |rate| format!(", {} Hz", plain(rate)));
            let span = format!("{} rows in {} s{rate}", recording.rows(), plain(last - first));
            provenance = provenance.with("recorded", &span).with("begun", &begun(recording));
        }
        provenance.with("temperature", &temperature(recording)).with("site", &site(&recording.manifest.site))
    }

    /// The facts as a table.
    #[must_use]
    pub fn facts(&self) -> Markup {
        html! {
            table class="facts" { tbody {
                @for (name, text) in &self.facts { tr { td { (name) } td { (text) } } }
            } }
        }
    }
}

/// The day of an absolute clock that counts from 1970; empty for any other.
fn begun(recording: &Recording) -> String {
    /// From 2000 to 2100, s since 1970.
    const PLAUSIBLE: std::ops::Range<i128> = 946_684_800..4_102_444_800;
    let seconds = recording.epoch.map(|epoch| epoch.picoseconds() / 1_000_000_000_000);
    let Some(seconds) = seconds.filter(|seconds| PLAUSIBLE.contains(seconds)) else { return String::new() };
    let day = Date::from_unix(u64::try_from(seconds).unwrap_or(0));
    let of_day = seconds % 86_400;
    format!("{day} {:02}:{:02}:{:02} by the recording's clock", of_day / 3600, of_day / 60 % 60, of_day % 60)
}

fn temperature(recording: &Recording) -> String {
    let measured = recording.temperature.iter().flatten().copied().filter(|value| value.is_finite());
    let ends = measured.fold(None, |ends: Option<(f64, f64)>, value| {
        Some(ends.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
    });
    ends.map_or_else(String::new, |(low, high)| format!("{low:.1} to {high:.1} °C"))
}

fn site(site: &Site) -> String {
    let mut parts = Vec::new();
    if let Some(gravity) = site.gravity() {
        parts.push(format!("gravity {gravity:.5} m/s²"));
    }
    if let Some([north, east, down]) = site.field_ned_ut {
        parts.push(format!("field {north:.2}, {east:.2}, {down:.2} µT north, east, down"));
    }
    parts.join("; ")
}
