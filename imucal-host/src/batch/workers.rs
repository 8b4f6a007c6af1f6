//! Several recordings at a time.
//!
//! Each worker does one recording after another, and reads and fits it in a pool of threads that all share. There is one worker more
//! than threads: while one waits for the disk, no thread is idle. So there is at most one recording more in memory than threads, and
//! the last recordings use what the others have left idle.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use super::{
    entry,
    source::{Source, place},
    task::{Done, Place, Task},
};
use crate::{
    file::{OutputError, OutputSet},
    recording::Manifest,
};

/// Bytes of a thread's stack: one that waits for its own fit may begin that of another worker.
const STACK: usize = 16 << 20;

/// Why a batch does not begin.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum BatchFault {
    /// The folder of the outputs cannot be made.
    #[error("{path}: cannot be made ({cause}), expected a folder or room for one; choose another --out")]
    Folder { path: PathBuf, cause: std::io::Error },
    /// Nothing can be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// An output would be taken for a recording's manifest.
    #[error(
        "{path}: found an output of the name of a recording's manifest, expected another folder; choose another --out"
    )]
    AmongRecordings { path: PathBuf },
    /// No threads.
    #[error("{jobs} workers cannot be started ({cause}); choose fewer --jobs")]
    Threads { jobs: usize, cause: String },
}

/// Recordings to be done.
#[derive(Clone, Debug)]
pub struct Batch {
    /// In the order of names.
    pub sources: Vec<Source>,
    /// Folder of the outputs.
    pub out: PathBuf,
    /// Threads that read and fit.
    pub jobs: usize,
}

impl Batch {
    /// Does all recordings that are not done; gives them in the order of names. `heard` is called with the number of those that are
    /// done.
    ///
    /// # Errors
    ///
    /// [`BatchFault`], before any recording is read.
    pub fn run(
        &self,
        may_replace: &Place<'_>,
        heard: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Done>, BatchFault> {
        self.prepare()?;
        let jobs = self.jobs.max(1);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).stack_size(STACK).build();
        let pool = pool.map_err(|cause| BatchFault::Threads { jobs, cause: cause.to_string() })?;
        let task = Task { out: &self.out, place: may_replace, pool: &pool };
        let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(self.sources.len())));
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(source) = self.sources.get(index) else { break };
                let one = task.run(source);
                let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
                done.push((index, one));
                heard(done.len());
            }
        };
        std::thread::scope(|scope| {
            (0..(jobs + 1).min(self.sources.len())).for_each(|_| drop(scope.spawn(work)))
        });
        let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
        done.sort_by_key(|(index, _)| *index);
        Ok(done.into_iter().map(|(_, one)| one).collect())
    }

    /// Makes the folder of the outputs, which must take files, and none that would be a recording's own.
    ///
    /// # Errors
    ///
    /// [`BatchFault`].
    pub fn prepare(&self) -> Result<(), BatchFault> {
        let entries = self.out.join(entry::FOLDER);
        fs::create_dir_all(&entries).map_err(|cause| BatchFault::Folder { path: self.out.clone(), cause })?;
        for folder in [&self.out, &entries] {
            // A part is made and dropped.
            OutputSet::default().create(&folder.join(".imucal-probe"))?;
        }
        let manifests: std::collections::BTreeSet<PathBuf> = self
            .sources
            .iter()
            .filter_map(|source| Some(place(&Manifest::path_for(&source.path)?)))
            .collect();
        let out = place(&self.out);
        let toml = |source: &Source| entry::output_path(Path::new(&out), &source.name, "toml");
        match self.sources.iter().map(toml).find(|path| manifests.contains(path)) {
            Some(path) => Err(BatchFault::AmongRecordings { path }),
            None => Ok(()),
        }
    }
}
