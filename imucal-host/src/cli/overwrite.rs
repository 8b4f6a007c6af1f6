//! Which files a command may replace.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::{
    file::{OutputSet, Target},
    recording::Manifest,
    store::form::Form,
};

/// What existing files are to a command that writes some.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct Overwrite {
    /// Overwrite files that exist
    #[arg(long)]
    force: bool,
}

/// A file that a command is going to write.
#[derive(Clone, Debug)]
pub(super) struct Planned {
    path: PathBuf,
    /// A file that holds this form of a calibration may be replaced without being asked.
    own: Option<Form>,
}

impl Planned {
    /// A file that replaces none.
    pub(super) fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), own: None }
    }

    /// A form of a calibration, which replaces one of its kind.
    pub(super) fn calibration(path: impl Into<PathBuf>, form: Form) -> Self {
        Self { path: path.into(), own: Some(form) }
    }

    /// The samples of a recording and the manifest next to them.
    pub(super) fn recording(samples: &Path) -> Vec<Self> {
        files_of(samples).into_iter().map(Self::new).collect()
    }
}

/// The samples of a recording and the manifest next to them.
pub(super) fn files_of(recording: &Path) -> Vec<PathBuf> {
    let manifest = Manifest::path_for(recording);
    std::iter::once(recording.to_path_buf()).chain(manifest).collect()
}

impl Overwrite {
    /// Where files of an earlier run are the command's own.
    pub(super) fn or(self, own: bool) -> Self {
        Self { force: self.force || own }
    }

    /// Refuses outputs that would replace what was read, each other, or an existing file. To be asked before
    /// anything is computed; the set that it gives replaces nothing else later.
    pub(super) fn plan(self, inputs: &[PathBuf], outputs: &[Planned]) -> anyhow::Result<OutputSet> {
        let inputs: Vec<(&PathBuf, PathBuf)> =
            inputs.iter().filter_map(|input| Some((input, input.canonicalize().ok()?))).collect();
        let (mut places, mut replaceable) = (Vec::new(), Vec::new());
        for output in outputs {
            anyhow::ensure!(
                output.path.as_os_str() != "-",
                "found `-`, expected the name of a file: `--json -` alone writes to the screen; for a file of this name, give ./-"
            );
            // What is written through replaces nothing.
            let Target::File { path: target, found } = Target::of(&output.path)? else { continue };
            let place = place(&target);
            refuse_input(&output.path, &place, &inputs)?;
            refuse_twice(&output.path, &place, &places)?;
            if found.is_some_and(|found| found.len() > 0) {
                self.refuse_existing(output, &target)?;
                replaceable.push(target);
            }
            places.push(place);
        }
        // A folder that takes no files is found now, and not once all is computed.
        let mut tried = OutputSet::default();
        for output in outputs {
            tried.create(&output.path)?;
        }
        Ok(OutputSet::sparing_all_but(replaceable))
    }

    fn refuse_existing(self, output: &Planned, target: &Path) -> anyhow::Result<()> {
        if self.force {
            return Ok(());
        }
        let held = Form::of_file(target);
        if held.is_some() && held == output.own {
            return Ok(());
        }
        anyhow::bail!(
            "{}: found {} of this name, expected none, since it would be lost; choose another name, or add --force \
             to overwrite it; nothing was written",
            output.path.display(),
            held.map_or_else(|| kind_of(target), name)
        )
    }
}

fn name(form: Form) -> &'static str {
    match form {
        Form::Toml => "a calibration",
        Form::Record => "a calibration's record",
        Form::Json => "a calibration's report",
    }
}

/// What a file is, for a message.
fn kind_of(path: &Path) -> &'static str {
    match Manifest::path_for(path) {
        Some(_) => "a recording",
        None if Manifest::is_manifest(path) => "a recording's manifest",
        None => "a file",
    }
}

fn refuse_input(output: &Path, place: &Path, inputs: &[(&PathBuf, PathBuf)]) -> anyhow::Result<()> {
    match inputs.iter().find(|(_, input)| input == place) {
        Some((input, _)) => anyhow::bail!(
            "{}: found an output of the same name as the input {}, expected another, since that one would be \
             lost; choose another name; nothing was written",
            output.display(),
            input.display()
        ),
        None => Ok(()),
    }
}

fn refuse_twice(output: &Path, place: &PathBuf, places: &[PathBuf]) -> anyhow::Result<()> {
    anyhow::ensure!(
        !places.contains(place),
        "{}: found two outputs of this name, expected one; choose another name for one of them; nothing was written",
        output.display()
    );
    Ok(())
}

/// Where a path leads, whether or not a file is there.
fn place(path: &Path) -> PathBuf {
    if let Ok(real) = path.canonicalize() {
        return real;
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const ASK: Overwrite = Overwrite { force: false };

    #[test]
    fn a_calibration_replaces_one_of_its_kind_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("cal.toml"), "format = \"imucal-calibration/1\"\n").unwrap();
        fs::write(at("cal.json"), "{\"format\": \"imucal-calibration/2\", \"sensors\": {}}").unwrap();
        fs::write(at("run.toml"), "format = \"imucal-recording/1\"\n").unwrap();
        fs::write(at("notes.toml"), "title = \"notes\"\n").unwrap();
        fs::write(at("run.csv"), "t\n0\n").unwrap();
        fs::write(at("empty"), "").unwrap();
        for (name, form, allowed) in [
            ("cal.toml", Form::Toml, true),
            ("cal.json", Form::Json, true),
            ("cal.toml", Form::Json, false),
            ("cal.json", Form::Toml, false),
            ("cal.toml", Form::Record, false),
            ("run.toml", Form::Toml, false),
            ("notes.toml", Form::Toml, false),
            ("run.csv", Form::Record, false),
            ("empty", Form::Record, true),
            ("new", Form::Record, true),
        ] {
            let planned = [Planned::calibration(at(name), form)];
            assert_eq!(ASK.plan(&[], &planned).is_ok(), allowed, "{name} {form:?}");
            assert!(Overwrite { force: true }.plan(&[], &planned).is_ok());
            assert_eq!(ASK.plan(&[], &[Planned::new(at(name))]).is_ok(), ["empty", "new"].contains(&name));
        }
        let message = |name: &str| ASK.plan(&[], &[Planned::new(at(name))]).unwrap_err().to_string();
        assert!(message("run.toml").contains("run.toml: found a recording's manifest of this name"));
        assert!(message("run.csv").contains("found a recording of this name"));
        assert!(message("notes.toml").contains("found a file") && message("cal.toml").contains("--force"));
    }

    #[test]
    fn neither_an_input_nor_another_output_is_replaced_even_by_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, "read").unwrap();
        let force = Overwrite { force: true };
        assert!(force.plan(std::slice::from_ref(&path), &[Planned::new(&path)]).is_err());
        assert!(force.plan(&[], &[Planned::new(&path), Planned::new(folder.path().join("./a"))]).is_err());
    }
}
