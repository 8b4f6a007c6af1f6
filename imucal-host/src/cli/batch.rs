//! `imucal batch`

use std::{
    fs::File,
    io::{BufReader, Read},
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;

use super::{
    Ending,
    calibrate::today,
    columns::Columns,
    fitting::Fitting,
    html::Html,
    json::Json,
    output,
    overwrite::{Overwrite, Planned},
    progress::Progress,
    reading::Reading,
    warn,
};
use crate::{
    batch::{
        Batch, Done, Entry, Method, Shard, Standing, find,
        outlier::{Outliers, outliers},
        page,
        report::{self, Counts},
        summary::{self, SummaryFormat},
    },
    file::{Limits, OutputSet},
};

/// Names of recordings that a line gives at most.
const NAMED: usize = 3;
/// Bytes of a page within which its title is.
const HEAD: u64 = 4096;

#[derive(Args, Debug)]
#[command(
    after_help = "Exit status: 0 if every recording was calibrated as `imucal calibrate` ends with 0; 1 if one was refused; 2 if one \
                  is unreadable or failed. The other recordings are done all the same.\n\n\
                  Example:\n  imucal batch recordings --out calibrations --summary units.csv\n\n\
                  Started again with the same options it does what is left. On several machines, each with --shard 1/3 and so on, \
                  then once without --shard for the summary of all."
)]
pub(super) struct Arguments {
    /// Recordings: a folder, with the folders in it; a pattern in quotes, such as 'data/**/*.csv'; a list as TOML or CSV; or files
    #[arg(required = true, value_name = "DIR|GLOB|LIST")]
    recordings: Vec<PathBuf>,
    /// Folder of the calibrations: NAME.json, and NAME.toml and NAME.bin where a sensor was accepted
    #[arg(long, value_name = "OUTDIR")]
    out: PathBuf,
    /// Processors to use; all unless given
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    jobs: Option<usize>,
    /// Do every n-th recording in the order of names, beginning with the i-th
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Write a row for each recording and sensor: FILE.csv or FILE.parquet
    #[arg(long, value_name = "FILE", value_parser = summary_file)]
    summary: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    #[command(flatten)]
    html: Html,
    #[command(flatten)]
    fitting: Fitting,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|jobs| *jobs > 0).ok_or_else(|| "expected a whole number above 0".into())
}

fn summary_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match SummaryFormat::of(&path) {
        Ok(_) => Ok(path),
        Err(expected) => Err(format!("expected {expected}")),
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let method = Method {
        request: arguments.fitting.request(false)?,
        mapping: arguments.columns.mapping()?,
        limits: arguments.reading.limits(),
        date: today(),
    };
    let excluded: Vec<PathBuf> =
        [Some(&arguments.out), arguments.summary.as_ref()].into_iter().flatten().cloned().collect();
    let mut sources = find(&arguments.recordings, &excluded, &method)?;
    let inputs: Vec<PathBuf> = sources.iter().map(|source| source.path.clone()).collect();
    if let Some(shard) = arguments.shard {
        sources = shard.of(sources);
    }
    let jobs =
        arguments.jobs.or_else(|| std::thread::available_parallelism().ok().map(Into::into)).unwrap_or(1);
    let batch = Batch { sources, out: arguments.out.clone(), jobs };
    batch.prepare()?;
    let files = planned(arguments, &inputs)?;
    let done = worked(arguments, &batch)?;
    said(&done);
    let entries: Vec<Entry> = done.into_iter().map(|done| done.entry).collect();
    finished(arguments, &entries, files)
}

/// The summary, the JSON and the page. Files of an earlier batch are its own; others are spared without --force.
fn planned(arguments: &Arguments, inputs: &[PathBuf]) -> anyhow::Result<[OutputSet; 3]> {
    let plan = |path: Option<&Path>, own: bool| {
        let outputs: Vec<Planned> = path.map(Planned::new).into_iter().collect();
        arguments.overwrite.or(own).plan(inputs, &outputs)
    };
    let summary = arguments.summary.as_deref();
    let own = summary.is_some_and(|path| SummaryFormat::of(path).is_ok_and(|format| format.is_summary(path)));
    let json = arguments.json.path();
    let html = arguments.html.path();
    Ok([
        plan(summary, own)?,
        plan(json, json.is_some_and(is_report))?,
        plan(html, html.is_some_and(is_page))?,
    ])
}

/// A file that an earlier batch has written as JSON.
fn is_report(path: &Path) -> bool {
    let read = File::open(path).map(|file| BufReader::new(file.take(Limits::default().size)));
    let head = read.ok().and_then(|file| serde_json::from_reader::<_, serde_json::Value>(file).ok());
    head.is_some_and(|head| head["format"] == report::FORMAT)
}

/// A page that an earlier batch has written.
fn is_page(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && page::is_page(&String::from_utf8_lossy(&head))
}

fn worked(arguments: &Arguments, batch: &Batch) -> anyhow::Result<Vec<Done>> {
    let may_replace = |inputs: &[PathBuf], outputs: &[(PathBuf, crate::store::form::Form)]| {
        let outputs: Vec<Planned> =
            outputs.iter().map(|(path, form)| Planned::calibration(path, *form)).collect();
        arguments.overwrite.plan(inputs, &outputs).map_err(|fault| format!("{fault:#}"))
    };
    let progress = Progress::of(batch.sources.len(), "recordings");
    Ok(batch.run(&may_replace, &|done| progress.done(done))?)
}

/// What is no calibration, and what was done again.
fn said(done: &[Done]) {
    for entry in done.iter().map(|done| &done.entry) {
        let word = entry.standing.name();
        if let Some(why) = &entry.error {
            output::report(word, why);
        } else if entry.standing == Standing::Refused {
            let sensors: Vec<String> = entry
                .sensors
                .iter()
                .map(|sensor| match &sensor.reason {
                    Some(reason) => format!("{} {} ({reason})", sensor.sensor, sensor.status),
                    None => format!("{} {}", sensor.sensor, sensor.status),
                })
                .collect();
            let sensors = if sensors.is_empty() { "it has no sensor".to_owned() } else { sensors.join(", ") };
            output::report(word, &format_args!("{}: {sensors}", entry.recording));
        }
    }
    let mut reasons: Vec<&str> = done.iter().filter_map(|done| done.again).collect();
    reasons.sort_unstable();
    reasons.dedup();
    for reason in reasons {
        let names: Vec<&str> = done
            .iter()
            .filter(|done| done.again == Some(reason))
            .map(|done| done.entry.name.as_str())
            .collect();
        let more = if names.len() > NAMED { ", …" } else { "" };
        let first: Vec<&str> = names.iter().copied().take(NAMED).collect();
        output::report("again", &format_args!("{} ({}{more}): {reason}", names.len(), first.join(", ")));
    }
    let before = done.iter().filter(|done| done.before).count();
    if before > 0 {
        output::report("resumed", &format_args!("{before} of {} recordings were already done", done.len()));
    }
}

fn finished(
    arguments: &Arguments,
    entries: &[Entry],
    [mut table_file, mut json_files, mut pages]: [OutputSet; 3],
) -> anyhow::Result<Ending> {
    let found = outliers(entries);
    let json = serde_json::to_string_pretty(&report::json(entries, &found))
        .context("the batch cannot be spelt as JSON")?
        + "\n";
    if let Some(path) = &arguments.summary {
        table_file.add(path, &summary_bytes(path, entries, &found)?)?;
    }
    if let Some(path) = arguments.json.path() {
        json_files.add(path, json.as_bytes())?;
    }
    let parts = || vec![page::batch(entries, &found)];
    arguments.html.add_of(&mut pages, &page::title(entries), &[], &Ok, &parts)?;
    for files in [table_file, json_files, pages] {
        files.commit()?;
    }
    for names in report::copies(entries) {
        warn(&format_args!(
            "{}: the same samples; they are compared with the others as if they were of several units",
            names.join(", ")
        ));
    }
    let counts = Counts::of(entries);
    match arguments.json.on_screen() {
        true => output::document(&json)?,
        false => output::text(&(report::text(&found) + &counts.line()))?,
    }
    Ok(match entries.iter().map(|entry| entry.standing.exit_status()).max() {
        Some(0) | None => Ending::Done,
        Some(1) => Ending::Refused,
        Some(_) => Ending::Unreadable,
    })
}

fn summary_bytes(path: &Path, entries: &[Entry], found: &Outliers) -> anyhow::Result<Vec<u8>> {
    let format = SummaryFormat::of(path).map_err(|expected| anyhow::anyhow!("expected {expected}"))?;
    let bytes = format.bytes(&summary::table(entries, found));
    bytes.with_context(|| format!("{}: cannot be written", path.display()))
}
