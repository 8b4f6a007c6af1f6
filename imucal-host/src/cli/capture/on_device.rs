//! A session that a device runs.

use std::{
    path::Path,
    thread::sleep,
    time::{Duration, Instant},
};

use imucal_core::{
    link::{CaptureOutcome, CaptureTask, RecordState, SAMPLES},
    record::{self, CalibrationRecord, HigherOrder},
    session::guide::{Advice, Guide},
};

use super::{
    Arguments, HIGHER_ORDER, Lines, OTHER_UNIT, OWN_AXES, TOO_LITTLE, other_axes, recorded, refused,
    settings_of, shares, surer, task_of, warn_of_nothing, write,
};
use crate::{
    capture::{self, Capture},
    cli::{
        Ending,
        calibrate::today,
        columns,
        device::{ending, open},
        output::{self, say},
        refuse, warn,
    },
    device::{Address, Session},
    file::OutputSet,
    recording::{Manifest, SensorKind},
    report::{self, table::words},
    store::StoredCalibration,
};

/// How often the state of a session with the device's own sensors is asked for.
const EVERY: Duration = Duration::from_millis(200);

pub(super) fn run(
    arguments: &Arguments,
    device: &Address,
    recording: Option<&Path>,
    files: OutputSet,
) -> anyhow::Result<Ending> {
    ending(match recording {
        Some(path) => replay(arguments, device, path, files),
        None => live(arguments, device, files),
    })
}

/// Sends a recording's raw samples to the device.
fn replay(arguments: &Arguments, device: &Address, path: &Path, files: OutputSet) -> anyhow::Result<Ending> {
    let recording = columns::read(path, &arguments.columns, arguments.reading)?;
    let asked = recorded(&recording);
    let task = task_of(arguments, &recording, &asked)?;
    let mut session = open(device, arguments.flash.as_deref(), arguments.key.as_deref())?;
    say!("{}: sent to the session of {device}", recording.name);
    let mut lines = Lines::new(arguments, task.hold, &asked);
    let mut guide = session.start_capture(task)?.guide;
    let samples: Vec<_> = capture::samples(&recording).collect();
    for (batch, before) in samples.chunks(SAMPLES).zip((0..).step_by(SAMPLES)) {
        guide = session.push_samples(before, batch)?.guide;
        let time = batch.last().map_or(0.0, |last| last.time as f64 * 1e-6);
        lines.see(time, &guide)?;
    }
    let here = capture::replay(&recording, &task, &mut |_, _| {});
    end(arguments, session, &task, &guide, &asked, here.as_deref(), files)
}

/// Guides through a session to which the device's own sensors bring the samples.
fn live(arguments: &Arguments, device: &Address, files: OutputSet) -> anyhow::Result<Ending> {
    let manifest = match &arguments.manifest {
        Some(path) => {
            let (manifest, warnings) = Manifest::read(path)?;
            warnings.iter().for_each(|warning| warn(warning));
            manifest
        }
        None => Manifest::default(),
    };
    let asked: Vec<SensorKind> =
        SensorKind::ALL.into_iter().filter(|kind| arguments.target[*kind as usize] > 0.0).collect();
    let task = capture::task(&manifest, shares(arguments, &asked))?;
    let mut session = open(device, arguments.flash.as_deref(), arguments.key.as_deref())?;
    let mut lines = Lines::new(arguments, task.hold, &asked);
    lines.speed = None;
    let begin = Instant::now();
    let mut state = session.start_capture(task)?;
    let ends = |guide: &Guide| matches!(guide.advice, Advice::Enough | Advice::CorrectAxes);
    while !ends(&state.guide) && begin.elapsed().as_secs() < arguments.within.into() {
        sleep(EVERY);
        state = session.capture()?;
        lines.see(begin.elapsed().as_secs_f64(), &state.guide)?;
    }
    if state.samples == 0 {
        session.abort_capture()?;
        return Ok(refuse(
            &"the device's sensors have brought no sample; give a recording, or check its sensors",
        ));
    }
    end(arguments, session, &task, &state.guide, &asked, None, files)
}

/// Ends a session; stores what is accepted and surer than what was in use. `here`: the same session on this machine.
fn end(
    arguments: &Arguments,
    mut session: Session,
    task: &CaptureTask,
    guide: &Guide,
    asked: &[SensorKind],
    here: Option<&Capture>,
    mut files: OutputSet,
) -> anyhow::Result<Ending> {
    let before = held(&mut session)?;
    let outcomes = session.finish_capture(today())?;
    output::text(&report::capture::state(guide, &settings_of(task), asked))?;
    for kind in asked {
        match &outcomes[*kind as usize] {
            CaptureOutcome::Adopted => say!("{} is calibrated", words(*kind)),
            other => say!("{} is not calibrated: {}", words(*kind), reason(other, *kind, task)),
        }
    }
    let adopted = |kind: &SensorKind| matches!(outcomes[*kind as usize], CaptureOutcome::Adopted);
    if !asked.iter().any(adopted) {
        warn_of_nothing(arguments);
        return Ok(Ending::Refused);
    }
    say!("stored as record {}", session.store_record(false)?);
    let bytes = session.record()?.unwrap_or_default();
    let record = record::decode_as::<HigherOrder>(&bytes)?;
    let equal = asked
        .iter()
        .filter(|kind| adopted(kind))
        .all(|kind| here.is_none_or(|here| is_equal(here, task, before.as_ref(), &record, *kind)));
    if let Some(here) = here.filter(|_| adopted(&SensorKind::Mag)) {
        say!("{}", report::capture::axes(capture::axes_of_magnetometer(here)));
    }
    if here.is_some() {
        say!("the same session here: {}", if equal { "equal bit for bit" } else { "DIFFERENT" });
    }
    let stored = StoredCalibration::from_record(&record);
    write(arguments, &stored, &mut files)?;
    files.commit()?;
    let done = equal && guide.advice == Advice::Enough;
    Ok(if done { Ending::Done } else { Ending::Refused })
}

/// The record that the device uses.
fn held(session: &mut Session) -> anyhow::Result<Option<CalibrationRecord<HigherOrder>>> {
    let in_use = matches!(session.status()?.record, RecordState::InUse | RecordState::Unconfirmed);
    let bytes = if in_use { session.record()? } else { None };
    Ok(bytes.as_deref().map(record::decode_as).transpose()?)
}

/// Gain, bias and terms of temperature that the device has stored are those of the session here, to the bit, in the axes and the unit of
/// the record that it used before.
fn is_equal(
    here: &Capture,
    task: &CaptureTask,
    before: Option<&CalibrationRecord<HigherOrder>>,
    record: &CalibrationRecord<HigherOrder>,
    kind: SensorKind,
) -> bool {
    let sensor = kind.into();
    let units = |kind: SensorKind| task.sensors[kind as usize].units(kind.into());
    let axes = here.axes(&units(SensorKind::Acc), before.and_then(|before| before.acc.as_ref()));
    let stored = before.and_then(|before| before.triad(sensor));
    let own = here.better_at_temperatures(sensor, &units(kind), stored, &axes);
    let (Ok(own), Some(there)) = (own, record.triad(sensor)) else { return false };
    let bits = |gain: &[[f32; 3]; 3], bias: &[f32; 3]| -> Vec<u32> {
        gain.as_flattened().iter().chain(bias).map(|value| value.to_bits()).collect()
    };
    own.temperature == there.temperature && bits(&own.gain, &own.bias) == bits(&there.gain, &there.bias)
}

fn reason(outcome: &CaptureOutcome, kind: SensorKind, task: &CaptureTask) -> String {
    match outcome {
        CaptureOutcome::Refused(refusal) => refused(refusal, kind, task),
        CaptureOutcome::Surer { stored, new } => surer(*stored, *new),
        CaptureOutcome::Implausible(defect) => defect.to_string(),
        CaptureOutcome::HigherOrder => HIGHER_ORDER.into(),
        CaptureOutcome::OwnAxes => OWN_AXES.into(),
        CaptureOutcome::OtherAxes { strain, .. } => other_axes(*strain),
        CaptureOutcome::OtherUnit => OTHER_UNIT.into(),
        _ => TOO_LITTLE.into(),
    }
}
