//! The keys of a manifest's text and their lines, for messages.

use std::path::Path;

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::spelling;
use crate::recording::{read_error::ReadError, warning::Warning};

/// Sections of the contract and their keys.
const KNOWN: [(&str, &[&str]); 8] = [
    ("units", &["t", "acc", "gyr", "mag", "temp", "gimbal"]),
    ("site", &["latitude_deg", "height_m", "gravity", "field_ned_ut"]),
    ("rig", &["kind", "axes"]),
    ("reference", &["kind", "noise", "name"]),
    ("ranges", &["acc", "gyr", "mag"]),
    ("counts", &["acc", "gyr", "mag"]),
    ("calibrated", &["acc", "gyr", "mag"]),
    ("sensor", &["name", "serial"]),
];

/// A manifest's text as a tree that knows where each key stands.
pub(crate) struct KeyMap<'a> {
    text: &'a str,
    table: Spanned<DeTable<'a>>,
}

impl<'a> KeyMap<'a> {
    pub(crate) fn parse(text: &'a str) -> Result<Self, toml::de::Error> {
        Ok(Self { text, table: DeTable::parse(text)? })
    }

    /// Line, from 1, of a byte of `text`.
    pub(crate) fn line_at(text: &str, byte: usize) -> usize {
        let before = text.as_bytes().iter().take(byte);
        1 + before.filter(|byte| **byte == b'\n').count()
    }

    /// Whether there is a section.
    pub(crate) fn has_section(&self, section: &str) -> bool {
        self.table.get_ref().iter().any(|(name, _)| name.get_ref() == section)
    }

    /// Whether a section has a key.
    pub(crate) fn has(&self, section: &str, key: &str) -> bool {
        let sections = self.table.get_ref().iter().filter(|(name, _)| name.get_ref() == section);
        let mut tables = sections.filter_map(|(_, value)| value.get_ref().as_table());
        tables.any(|table| table.iter().any(|(name, _)| name.get_ref() == key))
    }

    /// Line of a key, or of its section, or the first line.
    pub(crate) fn line_of(&self, section: &str, key: &str) -> usize {
        let top = self.table.get_ref();
        let Some((name, value)) = top.iter().find(|(name, _)| name.get_ref() == section) else {
            return 1;
        };
        let inside = value.get_ref().as_table().and_then(|table| {
            table.iter().find(|(name, _)| name.get_ref() == key).map(|(name, _)| name.span().start)
        });
        Self::line_at(self.text, inside.unwrap_or(name.span().start))
    }

    /// The format string comes first: what another format means by its keys is not known.
    pub(crate) fn check_format(&self, expected: &str, path: &Path) -> Result<(), ReadError> {
        let entry = self.table.get_ref().iter().find(|(name, _)| name.get_ref() == "format");
        let found = match entry.map(|(_, value)| value.get_ref()) {
            Some(DeValue::String(text)) if text == expected => return Ok(()),
            Some(DeValue::String(text)) => format!("\"{text}\""),
            Some(other) => format!("of type {}", other.type_str()),
            None => "missing".to_owned(),
        };
        Err(ReadError::ManifestFormat { path: path.to_path_buf(), line: self.line_of("format", ""), found })
    }

    /// A warning for each key that the contract does not have.
    pub(crate) fn unknown(&self, path: &Path) -> Vec<Warning> {
        let mut warnings = Vec::new();
        for (name, value) in self.table.get_ref() {
            let section = name.get_ref().as_ref();
            if section == "format" {
                continue;
            }
            match KNOWN.iter().find(|(known, _)| *known == section) {
                Some((_, keys)) => self.unknown_of(path, section, keys, value.get_ref(), &mut warnings),
                None => {
                    let sections = KNOWN.iter().map(|(known, _)| *known).chain(["format"]);
                    let nearest = spelling::nearest(section, sections, 2);
                    warnings.push(self.warning(path, name.span().start, section, nearest));
                }
            }
        }
        warnings
    }

    fn unknown_of(
        &self,
        path: &Path,
        section: &str,
        known: &[&str],
        value: &DeValue<'_>,
        out: &mut Vec<Warning>,
    ) {
        for (name, entry) in value.as_table().into_iter().flatten() {
            let key = name.get_ref().as_ref();
            let whole = format!("{section}.{key}");
            if !known.contains(&key) {
                let nearest = nearest_key(key, known);
                out.push(self.warning(path, name.span().start, &whole, nearest));
            } else if section == "counts" {
                self.unknown_of(path, &whole, &["offset", "per_unit"], entry.get_ref(), out);
            }
        }
    }

    fn warning(&self, path: &Path, byte: usize, key: &str, nearest: Option<&str>) -> Warning {
        Warning::UnknownKey {
            path: path.to_path_buf(),
            line: Self::line_at(self.text, byte),
            key: key.to_owned(),
            nearest: nearest.map(str::to_owned),
        }
    }
}

/// A key is often misspelt by leaving its unit away (`latitude`, `height`), which is many edits.
fn nearest_key<'a>(key: &str, known: &[&'a str]) -> Option<&'a str> {
    let longer = known.iter().copied().find(|name| key.len() > 3 && name.starts_with(key));
    longer.or_else(|| spelling::nearest(key, known.iter().copied(), 1 + key.len() / 4))
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use super::super::Manifest;
    use crate::recording::fixture::{Fixture, assert_says};

    const SAMPLES: &str = "t,acc_x,acc_y,acc_z\n0,0,0,9.8\n";

    #[test]
    fn unknown_keys_are_warned_about_with_the_nearest_one() {
        let sections =
            "[site]\nlatitude = 1.0\ncolour = 1\n[unit]\n[counts]\nacc = { per_unit = 1, ofset = 2 }\n";
        let warnings = Fixture::new("run.csv", sections, SAMPLES).warnings();
        assert_eq!(warnings.len(), 4, "{warnings:?}");
        let all = warnings.join("\n");
        assert_says(&all, &["run.toml, line 3: unknown key `site.latitude`", "write `latitude_deg`"]);
        assert_says(&all, &["line 4: unknown key `site.colour` is ignored; remove it"]);
        assert_says(&all, &["line 5: unknown key `unit`", "write `units`"]);
        assert_says(&all, &["line 7: unknown key `counts.acc.ofset`", "write `offset`"]);
    }

    #[test]
    fn another_or_no_format_is_refused() {
        let parse = |text: &str| Manifest::parse(text, Path::new("a.toml")).unwrap_err().to_string();
        assert_says(
            &parse("# two\nformat = \"imucal-recording/2\"\n"),
            &[
                "a.toml, line 2",
                "\"imucal-recording/2\"",
                "expected format = \"imucal-recording/1\"",
                "convert",
            ],
        );
        assert_says(&parse("[units]\n"), &["the format missing", "write it so"]);
        assert_says(&parse("format = 1\n"), &["line 1", "of type integer"]);
    }

    #[test]
    fn text_that_is_no_toml_names_its_line() {
        let parse = |text: &str| Manifest::parse(text, Path::new("a.toml")).unwrap_err().to_string();
        assert_says(
            &parse("format = \"imucal-recording/1\"\n[units\n"),
            &["a.toml, line 2", "correct the line"],
        );
        let wrong_type = parse("format = \"imucal-recording/1\"\n[sensor]\nserial = 7\n");
        assert_says(&wrong_type, &["a.toml, line 3", "integer", "string"]);
        let kind = parse("format = \"imucal-recording/1\"\n[rig]\nkind = \"table\"\n");
        assert_says(&kind, &["line 3", "table", "rate-table"]);
        let kind = parse("format = \"imucal-recording/1\"\n[reference]\nkind = \"optical\"\n");
        assert_says(&kind, &["line 3", "optical", "attitude", "pose", "simulator"]);
    }

    #[test]
    fn a_missing_manifest_says_what_to_write() {
        let fixture = Fixture::new("run.csv", "", SAMPLES);
        fs::remove_file(fixture.folder.path().join("run.toml")).unwrap();
        let message = fixture.error();
        assert_says(
            &message,
            &[
                "run.toml: not found",
                "the manifest of the recording run there",
                "format = \"imucal-recording/1\"",
                "[units]",
            ],
        );
    }

    #[test]
    fn a_misspelt_key_of_the_reference_is_reported_with_the_one_meant() {
        let sections = "[reference]\nkind = \"pose\"\nnoize = 1\n[refrence]\n";
        let warnings = Fixture::new("run.csv", sections, SAMPLES).warnings();
        assert_says(&warnings[0], &["line 4: unknown key `reference.noize`", "write `noise`"]);
        assert_says(&warnings[1], &["line 5: unknown key `refrence`", "write `reference`"]);
    }

    #[test]
    fn unusual_gravity_is_warned_about() {
        let warnings = Fixture::new("run.csv", "[site]\ngravity = 1.62\n", SAMPLES).warnings();
        assert_says(&warnings[0], &["run.toml, line 3", "1.62", "9.76 to 9.84", "correct it"]);
    }
}
