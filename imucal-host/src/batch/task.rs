//! One recording: read, calibrated and written as `imucal calibrate` does, whatever happens on the way.

use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
};

use super::{
    entry::{self, Entry, Input, Standing, ending, output_path},
    source::Source,
};
use crate::{
    calibrate::{Calibration, calibrate},
    file::OutputSet,
    recording::{Manifest, Recording, SensorKind},
    report,
    store::{StoredCalibration, form::Form},
};

/// Opens the set of a recording's outputs, after what was read and the outputs themselves; or says why one of them may not be
/// replaced.
pub type Place<'a> = dyn Fn(&[PathBuf], &[(PathBuf, Form)]) -> Result<OutputSet, String> + Sync + 'a;

/// A recording that is done.
#[derive(Clone, Debug)]
pub struct Done {
    /// What is known of it.
    pub entry: Entry,
    /// It was done before this run.
    pub before: bool,
    /// Why it was done again.
    pub again: Option<&'static str>,
}

/// What all recordings of a batch share.
pub struct Task<'a> {
    /// Folder of the outputs.
    pub out: &'a Path,
    /// Which files may be replaced.
    pub place: &'a Place<'a>,
    /// Where recordings are read and fitted; they are written outside of it.
    pub pool: &'a rayon::ThreadPool,
}

/// What a recording came to.
struct Outcome {
    entry: Entry,
    /// Its outputs, each in its form.
    outputs: Vec<(Form, Vec<u8>)>,
}

const FORMS: [Form; 3] = [Form::Json, Form::Toml, Form::Record];

impl Task<'_> {
    /// Does a recording, unless an earlier run has.
    pub(super) fn run(&self, source: &Source) -> Done {
        let (begun, former, again) = self.pool.install(|| {
            let begun = Entry::begun(source, Input::of(&source.path).ok());
            let former = Entry::read(self.out, &source.name);
            let again = former.as_ref().and_then(|former| former.outdated(&begun, self.out));
            (begun, former, again)
        });
        if let Some(entry) = former.filter(|former| again.is_none() && former.input.is_some()) {
            return Done { entry, before: true, again: None };
        }
        let entry = match guarded(|| self.pool.install(|| self.outcome(source, begun.clone()))) {
            Ok(outcome) => self.write(source, outcome),
            Err(panic) => {
                let why =
                    format!("{}: the program failed ({panic}); please report it", source.path.display());
                let failed = begun.without(Standing::Failed, why);
                self.write(source, Outcome { entry: failed, outputs: Vec::new() })
            }
        };
        Done { entry, before: false, again }
    }

    fn outcome(&self, source: &Source, begun: Entry) -> Outcome {
        let method = &source.method;
        let recording = Recording::read_as(&source.path, &method.mapping, &method.limits);
        let checked = recording.map_err(|error| error.to_string()).and_then(|recording| {
            match method.request.check(&recording) {
                Ok(()) => Ok(recording),
                Err(fault) => Err(fault.to_string()),
            }
        });
        let recording = match checked {
            Ok(recording) => recording,
            Err(why) => {
                return Outcome { entry: begun.without(Standing::Unreadable, why), outputs: Vec::new() };
            }
        };
        let calibration = calibrate(&recording, &method.request.options(), &|_| {});
        self.calibrated(source, begun, &calibration)
    }

    fn calibrated(&self, source: &Source, mut entry: Entry, calibration: &Calibration) -> Outcome {
        let request = &source.method.request;
        entry.sensors = entry::sensors(calibration, request);
        entry.standing = if request.is_met(calibration) { Standing::Calibrated } else { Standing::Refused };
        match self.outputs(source, calibration) {
            Ok(outputs) => {
                outputs.iter().for_each(|(form, content)| entry.add_output(*form, content));
                Outcome { entry, outputs }
            }
            Err(why) => Outcome { entry: entry.without(Standing::Failed, why), outputs: Vec::new() },
        }
    }

    /// The files that `imucal calibrate` would write.
    fn outputs(&self, source: &Source, calibration: &Calibration) -> Result<Vec<(Form, Vec<u8>)>, String> {
        let method = &source.method;
        let mut outputs = vec![(Form::Json, report::json::text(calibration).into_bytes())];
        let of = if method.request.accept_suspect {
            StoredCalibration::with_suspects
        } else {
            StoredCalibration::of
        };
        let stored = of(calibration, method.date);
        if SensorKind::ALL.into_iter().any(|kind| stored.triad(kind).is_some()) {
            let path = |form| output_path(self.out, &source.name, ending(form));
            let toml = stored.toml(&path(Form::Toml)).map_err(|fault| fault.to_string())?;
            let record = stored.record(&path(Form::Record)).map_err(|fault| fault.to_string())?;
            outputs.extend([(Form::Toml, toml.into_bytes()), (Form::Record, record)]);
        }
        Ok(outputs)
    }

    /// Puts outputs and entry in place; an entry of what could not be written or read is not kept, so that the next run tries again.
    fn write(&self, source: &Source, Outcome { entry, outputs }: Outcome) -> Entry {
        match self.placed(source, &entry, &outputs) {
            Ok(()) => entry,
            Err(why) => entry.without(Standing::Failed, why),
        }
    }

    fn placed(&self, source: &Source, entry: &Entry, outputs: &[(Form, Vec<u8>)]) -> Result<(), String> {
        let own = Entry::path(self.out, &source.name);
        let path = |form: Form| output_path(self.out, &source.name, ending(form));
        for folder in [own.parent(), path(Form::Json).parent()].into_iter().flatten() {
            fs::create_dir_all(folder)
                .map_err(|cause| format!("{}: cannot be made ({cause})", folder.display()))?;
        }
        let inputs: Vec<PathBuf> =
            std::iter::once(source.path.clone()).chain(Manifest::path_for(&source.path)).collect();
        let planned: Vec<(PathBuf, Form)> = outputs.iter().map(|(form, _)| (path(*form), *form)).collect();
        let mut files = (self.place)(&inputs, &planned)?;
        // First of all: what is half done must not be taken for done.
        remove(&own)?;
        for form in FORMS.into_iter().filter(|form| outputs.iter().all(|(other, _)| other != form)) {
            // What an earlier run has left and this one does not have.
            let path = path(form);
            if Form::of_file(&path) == Some(form) {
                remove(&path)?;
            }
        }
        for (form, content) in outputs {
            files.add(&path(*form), content).map_err(|fault| fault.to_string())?;
        }
        if entry.standing != Standing::Failed && entry.input.is_some() {
            files.add(&own, entry.text().as_bytes()).map_err(|fault| fault.to_string())?;
        }
        files.commit().map_err(|fault| fault.to_string())
    }
}

fn remove(path: &Path) -> Result<(), String> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => {
            Err(format!("{}: cannot be removed ({cause})", path.display()))
        }
        _ => Ok(()),
    }
}

/// What work came to, or the message that it panicked with.
fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    // What a panic has left half done is not used: all that the work has made is dropped with it.
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "without a message".into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_with_its_message() {
        let of = |text: &str| guarded(|| -> () { panic!("index {text}") });
        assert_eq!(of("7"), Err("index 7".to_owned()));
        assert_eq!(guarded(|| -> () { panic!("plain") }), Err("plain".to_owned()));
        assert_eq!(guarded(|| 5), Ok(5));
    }
}
