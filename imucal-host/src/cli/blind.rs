//! `imucal blind`

use std::{num::NonZeroUsize, path::PathBuf};

use anyhow::Context;
use clap::Args;

use super::{
    Ending,
    output::{self, say},
    overwrite::{Overwrite, Planned},
    own_effects,
    progress::Progress,
};
use crate::{
    blind::{
        case::{Case, draw_among},
        judgement::Judgement,
        score::score,
        seal::Nonce,
        trial::{Folder, OwnEffects, mingled},
    },
    diagnosis::{Options, diagnose},
    file::Limits,
};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Recordings with one, two or three effects of the catalogue, or with one from outside; the published figures are of 600
    #[arg(long, value_name = "N", default_value_t = 24)]
    cases: usize,
    /// Recordings without an effect; the published figures are of 1000
    #[arg(long, value_name = "N", default_value_t = 40)]
    healthy: usize,
    /// Folder of the set. An interrupted set is resumed, and a finished one can be extended
    #[arg(long, value_name = "DIR", default_value = "imucal-blind")]
    out: PathBuf,
    /// Draw the cases of this nonce, up to 64 hexadecimal digits, instead of a fresh one
    #[arg(long, value_name = "HEX", value_parser = nonce)]
    nonce: Option<Nonce>,
    /// Cases at a time (default: the number of cores)
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// List the missed cases, with the true effects and the answers
    #[arg(long)]
    misses: bool,
    /// Only score what the folder DIR holds
    #[arg(long, value_name = "DIR", conflicts_with_all = ["cases", "healthy", "out", "nonce", "jobs", "open", "effects"])]
    score: Option<PathBuf>,
    /// Only write the recording of this case, such as afflicted-0003, and its label into --out
    #[arg(long, value_name = "CASE", value_parser = case, requires = "nonce")]
    open: Option<Case>,
    /// Your own effects, in TOML: candidates like those of the catalogue (see docs/user_effects.md)
    #[arg(long, value_name = "FILE")]
    effects: Option<PathBuf>,
    /// Draw your own effects for the recordings, too
    #[arg(long, requires = "effects")]
    draw_effects: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

fn nonce(text: &str) -> Result<Nonce, String> {
    Nonce::parse(text).ok_or_else(|| format!("`{text}` is no nonce; expected one to 64 hexadecimal digits"))
}

fn case(text: &str) -> Result<Case, String> {
    Case::find(text)
        .ok_or_else(|| format!("there is no case `{text}`; expected such as healthy-0012 or afflicted-0003"))
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    if let (Some(case), Some(nonce)) = (arguments.open, arguments.nonce) {
        return open(nonce, case, arguments);
    }
    let folder = match &arguments.score {
        Some(path) => {
            anyhow::ensure!(
                path.is_dir(),
                "{}: found no folder, expected one of an earlier run",
                path.display()
            );
            anyhow::ensure!(
                path.join("set.json").is_file(),
                "{}: found no set of trials, expected the folder of an earlier run",
                path.display()
            );
            Folder::open(path, None)?
        }
        None => trials(arguments)?,
    };
    let judged: Vec<Judgement> = folder.finished()?.iter().filter_map(Judgement::of).collect();
    say!("Set of nonce {}.", folder.nonce().hex());
    output::text(&score(&judged).table())?;
    if arguments.misses {
        for judgement in judged.iter().filter(|judgement| judgement.is_missed()) {
            say!("{}", judgement.line());
        }
    }
    Ok(Ending::Done)
}

fn trials(arguments: &Arguments) -> anyhow::Result<Folder> {
    let own = own(arguments)?;
    let options = Options { effects: own.effects.clone(), ..Options::default() };
    let folder = Folder::open_with(&arguments.out, arguments.nonce, own)?;
    let cases = mingled(arguments.healthy, arguments.cases);
    let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let jobs = arguments.jobs.unwrap_or(cores).get();
    let progress = Progress::start();
    let heard = |over: usize| progress.stage(&format!("{over} of {} cases", cases.len()));
    folder.run(&cases, jobs, &|recording| diagnose(recording, &options, &|_| ()), &heard)?;
    Ok(folder)
}

fn own(arguments: &Arguments) -> anyhow::Result<OwnEffects> {
    let effects = own_effects(arguments.effects.as_deref(), &Limits::default())?;
    Ok(OwnEffects { effects, are_drawn: arguments.draw_effects })
}

/// Writes one case for a closer look.
fn open(nonce: Nonce, case: Case, arguments: &Arguments) -> anyhow::Result<Ending> {
    let folder = &arguments.out;
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    let name = format!("{}.csv.gz", case.name());
    let (path, label) = (folder.join(&name), folder.join(format!("{}.label.json", case.name())));
    let mut planned = Planned::recording(&path);
    planned.push(Planned::new(&label));
    let mut files = arguments.overwrite.plan(&[], &planned)?;
    let drawn = draw_among(&nonce, case, own(arguments)?.drawn())?;
    drawn.simulation.record(&name)?.write_into(&path, &mut files)?;
    files.add(&label, (serde_json::to_string_pretty(&drawn.label)? + "\n").as_bytes())?;
    files.commit()?;
    say!("{}", path.display());
    Ok(Ending::Done)
}
