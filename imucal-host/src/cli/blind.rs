//! `imucal blind`

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;

use super::simulate::unknown;
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
        robot,
        score::score,
        seal::Nonce,
        trial::{Folder, OwnEffects, mingled},
        world::{RigWorld, World, WorldKind},
    },
    diagnosis::{Diagnosis, Options, diagnose},
    effect::Effect,
    file::Limits,
    recording::{Recording, Stream},
    simulator::robot::RobotPair,
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal blind --cases 40")]
pub(super) struct Arguments {
    /// What is simulated: rig, or robot: pairs of a recording and its simulator's stream
    #[arg(long, value_name = "WORLD", default_value = "rig", value_parser = world)]
    world: WorldKind,
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
    #[arg(long, value_name = "DIR", conflicts_with_all = ["world", "cases", "healthy", "out", "nonce", "jobs", "open", "effects"])]
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

fn world(text: &str) -> Result<WorldKind, String> {
    WorldKind::find(text).ok_or_else(|| unknown("world", text, WorldKind::ALL.map(WorldKind::name)))
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
            match Folder::existing(path)? {
                Some(folder) => folder,
                None => Folder::open(path, None)?,
            }
        }
        None => trials(arguments)?,
    };
    say!("Set of nonce {}.", folder.nonce().hex());
    let (table, misses) = scored(&folder)?;
    output::document(&table)?;
    for line in misses.iter().filter(|_| arguments.misses) {
        say!("{line}");
    }
    Ok(Ending::Done)
}

/// The table of a folder's trials, and the missed ones.
fn scored(folder: &Folder) -> anyhow::Result<(String, Vec<String>)> {
    let finished = folder.finished()?;
    Ok(match folder.world() {
        WorldKind::Rig => {
            let judged: Vec<Judgement> = finished.iter().filter_map(Judgement::of).collect();
            let missed = judged.iter().filter(|judgement| judgement.is_missed());
            (score(&judged).table(), missed.map(Judgement::line).collect())
        }
        WorldKind::Robot => {
            let of = robot::judgement::RobotJudgement::of;
            let judged: Vec<_> = finished.iter().filter_map(of).collect();
            let missed = judged.iter().filter(|judgement| judgement.is_missed());
            (robot::score::score(&judged).table(), missed.map(|judgement| judgement.line()).collect())
        }
    })
}

/// Diagnoses a robot's recording against its simulator's stream, with these effects of a user's as candidates.
fn diagnose_pair(pair: &RobotPair, own: &[&'static Effect]) -> Diagnosis {
    let options =
        Options { stream: Stream::of(&pair.simulated), effects: own.to_vec(), ..Options::default() };
    diagnose(&pair.real, &options, &|_| ())
}

fn trials(arguments: &Arguments) -> anyhow::Result<Folder> {
    let own = own(arguments)?;
    let options = Options { effects: own.effects.clone(), ..Options::default() };
    let folder = Folder::open_of(arguments.world, &arguments.out, arguments.nonce, own)?;
    let cases = mingled(arguments.healthy, arguments.cases);
    let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let jobs = arguments.jobs.unwrap_or(cores).get();
    let progress = Progress::of(cases.len(), "cases");
    let heard = |over: usize| progress.done(over);
    let diagnose_recording = |recording: &Recording| diagnose(recording, &options, &|_| ());
    let rig = RigWorld { diagnose: &diagnose_recording, own: folder.own() };
    let robots = robot::trial::RobotWorld { diagnose: &diagnose_pair, own: folder.own() };
    let world: &dyn World = match arguments.world {
        WorldKind::Rig => &rig,
        WorldKind::Robot => &robots,
    };
    folder.run_in(world, &cases, jobs, &heard)?;
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
    let label = folder.join(format!("{}.label.json", case.name()));
    if arguments.world == WorldKind::Robot {
        return open_pair(&robot::case::draw(&nonce, case, &own(arguments)?)?, case, &label, arguments);
    }
    let name = format!("{}.csv.gz", case.name());
    let path = folder.join(&name);
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

/// Likewise for a pair.
fn open_pair(
    drawn: &robot::case::RobotDrawn,
    case: Case,
    label: &Path,
    arguments: &Arguments,
) -> anyhow::Result<Ending> {
    let [real, simulated] =
        ["real", "sim"].map(|part| arguments.out.join(format!("{}-{part}.csv.gz", case.name())));
    let mut planned = Planned::recording(&real);
    planned.extend(Planned::recording(&simulated));
    planned.push(Planned::new(label));
    let mut files = arguments.overwrite.plan(&[], &planned)?;
    let pair = drawn.scene.record(&case.name())?;
    pair.real.write_into(&real, &mut files)?;
    pair.simulated.write_into(&simulated, &mut files)?;
    files.add(label, (serde_json::to_string_pretty(&drawn.label)? + "\n").as_bytes())?;
    files.commit()?;
    say!("{}", real.display());
    say!("{}", simulated.display());
    Ok(Ending::Done)
}
