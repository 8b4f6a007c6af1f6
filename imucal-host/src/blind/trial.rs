//! Runs a set of sealed trials, over threads, and goes on where it was interrupted.
//!
//! A folder holds `set.json`, which set it is; `seals.jsonl`, a label's hash a line, written before that case's
//! recording is diagnosed; and `answers.jsonl`, a finished trial a line, with the label opened.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use serde::{Deserialize, Serialize};

use super::{
    answer::Finished,
    case::Case,
    seal::{Nonce, digest},
    trial_error::TrialError,
    world::{Outcome, RigWorld, World, WorldKind},
};
use crate::{
    diagnosis::Diagnosis,
    effect::{Act, Effect},
    file::{Limits, OutputSet, ReadFault},
    recording::Recording,
};

/// Labels' hashes.
const SEALS: &str = "seals.jsonl";
/// Finished trials.
const ANSWERS: &str = "answers.jsonl";

/// Which set a folder holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Set {
    format: String,
    nonce: String,
    #[serde(default, skip_serializing_if = "WorldKind::is_rig")]
    world: WorldKind,
    /// Hash of the user's own effects that are drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drawn: Option<String>,
}

/// A user's own effects in a set of trials.
#[derive(Clone, Debug, Default)]
pub struct OwnEffects {
    /// Candidates of the diagnosis.
    pub effects: Vec<&'static Effect>,
    /// They are drawn for recordings as well.
    pub are_drawn: bool,
}

impl OwnEffects {
    /// Those that are drawn.
    pub fn drawn(&self) -> &[&'static Effect] {
        if self.are_drawn { &self.effects } else { &[] }
    }

    fn digest(&self) -> Option<String> {
        let formula = |effect: &Effect| match effect.act {
            Act::Formula(_, formula) => formula.to_string(),
            _ => String::new(),
        };
        let text =
            |effect: &&'static Effect| format!("{} {} {:?}\n", effect.id, formula(effect), effect.parameters);
        self.are_drawn.then(|| digest(&self.effects.iter().map(text).collect::<String>()))
    }
}

/// What a folder's set is.
struct FolderSet {
    nonce: Nonce,
    world: WorldKind,
    drawn: Option<String>,
}

/// The seal of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Seal {
    case: String,
    sha256: String,
}

/// A folder with a set of trials.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    nonce: Nonce,
    world: WorldKind,
    drawn: Option<String>,
    own: OwnEffects,
}

impl Folder {
    /// Opens a folder of trials with the rig or makes it, with this nonce, or its own, or a fresh one.
    ///
    /// # Errors
    ///
    /// As [`Self::open_of`].
    pub fn open(path: &Path, nonce: Option<Nonce>) -> Result<Self, TrialError> {
        Self::open_of(WorldKind::Rig, path, nonce, OwnEffects::default())
    }

    /// The folder of a set that is there, of whichever world.
    ///
    /// # Errors
    ///
    /// [`TrialError::Damaged`], [`TrialError::File`].
    pub fn existing(path: &Path) -> Result<Option<Self>, TrialError> {
        let own = OwnEffects::default();
        let of = |set: FolderSet| Self {
            path: path.to_owned(),
            nonce: set.nonce,
            world: set.world,
            drawn: set.drawn,
            own,
        };
        Ok(Self::set_of(path)?.map(of))
    }

    /// Opens a folder of trials of a world or makes it, with this nonce, or its own, or a fresh one, to be
    /// run with a user's own effects.
    ///
    /// # Errors
    ///
    /// [`TrialError::OtherSet`], [`TrialError::OtherWorld`], [`TrialError::File`].
    pub fn open_of(
        world: WorldKind,
        path: &Path,
        nonce: Option<Nonce>,
        own: OwnEffects,
    ) -> Result<Self, TrialError> {
        let set_path = path.join("set.json");
        let failed = |cause| TrialError::File { path: set_path.clone(), cause };
        if let Some(folder) = Self::existing(path)? {
            if folder.world != world {
                let (found, expected) = (folder.world.name(), world.name());
                return Err(TrialError::OtherWorld { path: set_path, found, expected });
            }
            let found = folder.nonce;
            return match nonce.filter(|wanted| *wanted != found) {
                None => Ok(Self { own, ..folder }),
                Some(wanted) => {
                    Err(TrialError::OtherSet { path: set_path, found: found.hex(), expected: wanted.hex() })
                }
            };
        }
        for name in [SEALS, ANSWERS] {
            if path.join(name).exists() {
                return Err(TrialError::Headless { path: path.join(name) });
            }
        }
        fs::create_dir_all(path).map_err(failed)?;
        let nonce = match nonce {
            Some(nonce) => nonce,
            None => Nonce::fresh().map_err(|cause| failed(io::Error::other(cause.to_string())))?,
        };
        let drawn = own.digest();
        let set =
            Set { format: "imucal-blind/1".to_owned(), nonce: nonce.hex(), world, drawn: drawn.clone() };
        let text = serde_json::to_string_pretty(&set).unwrap_or_default() + "\n";
        let mut files = OutputSet::sparing_all_but(Vec::new());
        files.add(&set_path, text.as_bytes())?;
        files.commit()?;
        Ok(Self { path: path.to_owned(), nonce, world, drawn, own })
    }

    fn set_of(path: &Path) -> Result<Option<FolderSet>, TrialError> {
        let path = path.join("set.json");
        let Some(text) = text_of(&path, Limits::read_small)? else { return Ok(None) };
        let set = serde_json::from_str::<Set>(&text).ok();
        let known = |set: Set| {
            Some(FolderSet { nonce: Nonce::parse(&set.nonce)?, world: set.world, drawn: set.drawn })
        };
        match set.and_then(known) {
            Some(set) => Ok(Some(set)),
            None => Err(TrialError::Damaged { path, line: 1, found: text.chars().take(80).collect() }),
        }
    }

    /// Its nonce.
    pub fn nonce(&self) -> Nonce {
        self.nonce
    }

    /// A user's own effects that it is run with.
    pub fn own(&self) -> &OwnEffects {
        &self.own
    }

    /// Its world.
    pub fn world(&self) -> WorldKind {
        self.world
    }

    /// Trials that are over, in the order of their names, each against its seal.
    ///
    /// # Errors
    ///
    /// [`TrialError`], but for simulations.
    pub fn finished(&self) -> Result<Vec<Finished>, TrialError> {
        let mut finished: Vec<Finished> = lines(&self.path.join(ANSWERS))?;
        finished.sort_by(|a, b| a.case.cmp(&b.case));
        finished.dedup_by(|a, b| a.case == b.case);
        let seals: Vec<Seal> = lines(&self.path.join(SEALS))?;
        for trial in &finished {
            let Some(seal) = seals.iter().find(|seal| seal.case == trial.case) else {
                return Err(TrialError::Unsealed { case: trial.case.clone() });
            };
            if seal.sha256 != trial.seal() {
                let (case, found, sealed) = (trial.case.clone(), trial.seal(), seal.sha256.clone());
                return Err(TrialError::Broken { case, found, sealed });
            }
        }
        Ok(finished)
    }

    /// Runs trials with the rig, see [`Self::run_in`].
    ///
    /// # Errors
    ///
    /// [`TrialError`].
    pub fn run(
        &self,
        cases: &[Case],
        jobs: usize,
        diagnose: &(dyn Fn(&Recording) -> Diagnosis + Sync),
        heard: &(dyn Fn(usize) + Sync),
    ) -> Result<(), TrialError> {
        self.run_in(&RigWorld { diagnose, own: &self.own }, cases, jobs, heard)
    }

    /// Runs those of the cases that are not over yet, so many at a time; `heard` is given how many of all are over.
    ///
    /// # Errors
    ///
    /// [`TrialError`].
    pub fn run_in(
        &self,
        world: &dyn World,
        cases: &[Case],
        jobs: usize,
        heard: &(dyn Fn(usize) + Sync),
    ) -> Result<(), TrialError> {
        if self.drawn != self.own.digest() {
            return Err(TrialError::OtherEffects { path: self.path.join("set.json") });
        }
        let over: Vec<String> = self.finished()?.into_iter().map(|trial| trial.case).collect();
        let left: Vec<Case> = cases.iter().copied().filter(|case| !over.contains(&case.name())).collect();
        let writer = Writer::open(&self.path)?;
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(cases.len() - left.len()));
        let failure: Mutex<Option<TrialError>> = Mutex::new(None);
        let work = || {
            while let Some(case) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
                if let Err(error) = trial(&self.nonce, *case, world, &writer) {
                    next.store(left.len(), Ordering::Relaxed);
                    failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner).get_or_insert(error);
                }
                heard(done.fetch_add(1, Ordering::Relaxed) + 1);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..jobs.max(1) {
                // Each in a pool of its own: a worker that waits must not begin another case meanwhile.
                scope.spawn(|| match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                    Ok(pool) => pool.install(work),
                    Err(_) => work(),
                });
            }
        });
        match failure.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}

/// The cases of a set, healthy and afflicted ones mingled, so that an interrupted set has some of both.
pub fn mingled(healthy: usize, afflicted: usize) -> Vec<Case> {
    let share = |index: usize, count: usize| (index as f64 + 0.5) / count as f64;
    let mut cases: Vec<(f64, Case)> = (0..healthy).map(|k| (share(k, healthy), Case::Healthy(k))).collect();
    cases.extend((0..afflicted).map(|k| (share(k, afflicted), Case::Afflicted(k))));
    cases.sort_by(|a, b| a.0.total_cmp(&b.0));
    cases.into_iter().map(|(_, case)| case).collect()
}

/// One trial: drawn, sealed, recorded, diagnosed, opened.
fn trial(nonce: &Nonce, case: Case, world: &dyn World, writer: &Writer) -> Result<(), TrialError> {
    let name = case.name();
    let failed = |cause| TrialError::Simulation { case: name.clone(), cause };
    let pending = world.draw(nonce, case).map_err(failed)?;
    let label = pending.label;
    writer.seals.write(&Seal { case: name.clone(), sha256: digest(&label) })?;
    let outcome = (pending.finish)().map_err(failed)?;
    let Outcome { answer, truly_closed, seconds } = outcome;
    writer.answers.write(&Finished { case: name, label, answer, truly_closed, seconds })
}

/// The files that grow.
struct Writer {
    seals: Lines,
    answers: Lines,
}

impl Writer {
    fn open(folder: &Path) -> Result<Self, TrialError> {
        Ok(Self { seals: Lines::open(folder.join(SEALS))?, answers: Lines::open(folder.join(ANSWERS))? })
    }
}

/// A file of JSON lines.
struct Lines {
    path: PathBuf,
    file: Mutex<File>,
}

impl Lines {
    fn open(path: PathBuf) -> Result<Self, TrialError> {
        let open = || {
            // What an interruption left of a line is cut off.
            let bytes = bytes_of(&path, Limits::read_large)?.unwrap_or_default();
            let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
            let file = OpenOptions::new().create(true).append(true).open(&path)?;
            file.set_len(whole as u64)?;
            Ok(file)
        };
        match open() {
            Ok(file) => Ok(Self { path, file: Mutex::new(file) }),
            Err(cause) => Err(TrialError::File { path, cause }),
        }
    }

    fn write(&self, value: &impl Serialize) -> Result<(), TrialError> {
        let failed = |cause| TrialError::File { path: self.path.clone(), cause };
        let line = serde_json::to_string(value).map_err(|cause| failed(io::Error::other(cause)))? + "\n";
        let mut file = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        file.write_all(line.as_bytes()).map_err(failed)
    }
}

type Reader = fn(&Limits, &Path) -> Result<Vec<u8>, ReadFault>;

/// A file's bytes; `None` without the file.
fn bytes_of(path: &Path, read: Reader) -> io::Result<Option<Vec<u8>>> {
    match read(&Limits::default(), path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(ReadFault::System(cause)) if cause.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(ReadFault::System(cause)) => Err(cause),
        Err(fault) => Err(io::Error::other(format!("found {fault}, expected the file of a set"))),
    }
}

/// A file's text; `None` without the file.
fn text_of(path: &Path, read: Reader) -> Result<Option<String>, TrialError> {
    let failed = |cause| TrialError::File { path: path.to_owned(), cause };
    let bytes = bytes_of(path, read).map_err(failed)?;
    bytes.map(|bytes| String::from_utf8(bytes).map_err(|cause| failed(io::Error::other(cause)))).transpose()
}

/// All whole lines of a file; none without the file.
fn lines<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<Vec<T>, TrialError> {
    let text = text_of(path, Limits::read_large)?.unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let read = |(at, line): (usize, &str)| {
        serde_json::from_str(line).map_err(|cause| TrialError::Damaged {
            path: path.to_owned(),
            line: at + 1,
            found: cause.to_string(),
        })
    };
    whole.lines().enumerate().map(read).collect()
}

#[cfg(test)]
mod tests;
