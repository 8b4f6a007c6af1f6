//! `imucal simulate`

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use serde_json::json;

use super::{
    Ending,
    output::{self, say},
    overwrite::{Overwrite, Planned},
    own_effects, robot, warn,
};
use crate::{
    blind::{
        case::{Omission, omission},
        seal::{Nonce, digest},
    },
    effect::{CATALOGUE, Effect, UnknownName, user},
    file::{Limits, OutputSet},
    recording::{Format, Manifest, Written, manifest::Axis, transfer::write_as_made},
    report,
    simulator::{
        Conditions, Dose, Parts, Programme, Simulation, SimulationError, UnitKind,
        random::{Purpose, Random},
        robot::{MismatchKind, RobotKind, RobotScene},
    },
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal simulate --programme full --effect acc.scale_cubic --out rig.csv")]
pub(super) struct Arguments {
    /// The recording: NAME.csv, .csv.gz or .parquet, and with --si .mcap; the manifest NAME.toml is written to the same folder
    #[arg(long, value_name = "REC", required_unless_present = "list")]
    out: Option<PathBuf>,
    /// List all effects: what causes them, and the usual size of their parameters
    #[arg(long)]
    list: bool,
    /// The unit: mtx or 3dm-gx2
    #[arg(long, value_name = "UNIT", default_value = "mtx", value_parser = unit)]
    unit: UnitKind,
    /// Simulate a robot instead of the rig: legged, wheeled or flying. Writes what it recorded, NAME-real, and what its
    /// simulator says, NAME-sim; 120 s if no length is given
    #[arg(long, value_name = "KIND", value_parser = robot_kind, conflicts_with_all = ["programme", "axes", "sealed"])]
    robot: Option<RobotKind>,
    /// Sampling rate of the robot's simulator
    #[arg(long, value_name = "HZ", default_value_t = 200.0, requires = "robot")]
    sim_rate: f64,
    /// Stretches in which the robot moves otherwise than its simulator says: slip, gait or contact
    #[arg(long, value_name = "KIND", value_parser = mismatch, requires = "robot")]
    mismatch: Option<MismatchKind>,
    /// What the rig does: multi-position, rates, sinusoids, gyroscope, thermal, full or mixed
    #[arg(long, value_name = "NAME", default_value = "full", value_parser = programme)]
    programme: Programme,
    /// An effect beyond the baseline, e.g. acc.lever_arm or mag.bias_step=3: its size in multiples of its usual one.
    /// Several parameters point in a direction drawn from the seed; for acc.axis_swap, gyr.axis_swap and mag.axis_swap the size
    /// is the code of the order, 8·order + signs, 0 to 47
    #[arg(long = "effect", value_name = "ID[=SIZE]", value_parser = size)]
    doses: Vec<(String, f64)>,
    /// Your own effects, in TOML, for --effect and --list (see docs/user_effects.md)
    #[arg(long, value_name = "FILE")]
    effects: Option<PathBuf>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Sampling rate
    #[arg(long, value_name = "HZ", default_value_t = 100.0)]
    rate: f64,
    /// Length in seconds; as long as the programme takes if not given. Rests are stretched or cut
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Gimbal axes, outermost first
    #[arg(long, value_name = "AXES", default_value = "zyx", value_parser = axes)]
    axes: [Axis; 3],
    /// Write SI units instead of raw counts
    #[arg(long)]
    si: bool,
    /// Leave out noise, drift, scatter and rounding
    #[arg(long)]
    no_noise: bool,
    /// Draw seed and effects from a fresh nonce, write them into NAME.label.json and print only its SHA-256
    #[arg(long, conflicts_with_all = ["doses", "effects", "seed"])]
    sealed: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

fn unit(text: &str) -> Result<UnitKind, String> {
    UnitKind::find(text).ok_or_else(|| unknown("unit", text, UnitKind::ALL.map(UnitKind::name)))
}

fn robot_kind(text: &str) -> Result<RobotKind, String> {
    RobotKind::find(text).ok_or_else(|| unknown("robot", text, RobotKind::ALL.map(RobotKind::name)))
}

fn mismatch(text: &str) -> Result<MismatchKind, String> {
    let names = MismatchKind::ALL.map(MismatchKind::name);
    MismatchKind::find(text).ok_or_else(|| unknown("mismatch", text, names))
}

fn programme(text: &str) -> Result<Programme, String> {
    Programme::find(text).ok_or_else(|| unknown("programme", text, Programme::ALL.map(Programme::name)))
}

/// An id and a size.
fn size(text: &str) -> Result<(String, f64), String> {
    let (id, size) = text.split_once('=').unwrap_or((text, "1"));
    let size: f64 = size
        .parse()
        .ok()
        .filter(|size: &f64| size.is_finite())
        .ok_or_else(|| format!("the size `{size}` of {id} is no number; expected for instance {id}=2"))?;
    Ok((id.to_owned(), size))
}

/// What was found, and the nearest name or all there are.
pub(super) fn unknown<'a>(
    what: &'static str,
    found: &str,
    names: impl IntoIterator<Item = &'a str> + Clone,
) -> String {
    UnknownName::of(what, found, names).to_string()
}

fn axes(text: &str) -> Result<[Axis; 3], String> {
    let axis = |letter: char| match letter {
        'x' => Some(Axis::X),
        'y' => Some(Axis::Y),
        'z' => Some(Axis::Z),
        _ => None,
    };
    let axes: Vec<Axis> = text.chars().filter_map(axis).collect();
    let apart = axes.windows(2).all(|pair| pair[0] != pair[1]) && text.chars().count() == 3;
    let refusal =
        || format!("`{text}` is no order of axes; expected three letters such as zyx, no two alike in a row");
    <[Axis; 3]>::try_from(axes).ok().filter(|_| apart).ok_or_else(refusal)
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let own = own_effects(arguments.effects.as_deref(), &Limits::default())?;
    let Some(out) = arguments.out.as_deref().filter(|_| !arguments.list) else {
        output::text(&report::catalogue::catalogue(&own))?;
        return Ok(Ending::Done);
    };
    let sized = |(id, size): &(String, f64)| -> anyhow::Result<(&'static Effect, f64)> {
        let effect = user::named("effect", id, &own).context("--effect")?;
        Ok((effect, *size))
    };
    let effects: Vec<_> = arguments.doses.iter().map(sized).collect::<Result<_, _>>()?;
    let inputs: Vec<PathBuf> = arguments.effects.iter().cloned().collect();
    if let Some(kind) = arguments.robot {
        return robot::simulate(scene(kind, arguments), &effects, &inputs, out, arguments.overwrite);
    }
    let mut simulation = Simulation {
        unit: arguments.unit,
        programme: arguments.programme,
        axes: arguments.axes,
        rate: arguments.rate,
        duration: arguments.duration,
        seed: arguments.seed,
        unit_seed: None,
        noise: !arguments.no_noise,
        conditions: Conditions::default(),
        counts: !arguments.si,
        doses: Vec::new(),
    };
    if arguments.sealed {
        return sealed(simulation, out, arguments.overwrite);
    }
    let mut files = arguments.overwrite.plan(&inputs, &Planned::recording(out))?;
    for (effect, size) in effects {
        simulation.add(effect, size)?;
    }
    let done = write(&simulation, out, &mut files)?;
    files.commit()?;
    say!("{done}");
    say_doses(&simulation.doses)?;
    Ok(Ending::Done)
}

/// What the arguments say of a robot.
fn scene(kind: RobotKind, arguments: &Arguments) -> RobotScene {
    let usual = RobotScene::default();
    RobotScene {
        kind,
        seed: arguments.seed,
        duration: arguments.duration.unwrap_or(usual.duration),
        real_rate: arguments.rate,
        sim_rate: arguments.sim_rate,
        unit: arguments.unit,
        noise: !arguments.no_noise,
        counts: !arguments.si,
        mismatch: arguments.mismatch.map(|kind| (kind, 1.0)),
        ..usual
    }
}

/// A line for each effect.
pub(super) fn say_doses(doses: &[Dose]) -> anyhow::Result<()> {
    for dose in doses {
        let values = dose.effect.parameters.iter().zip(&dose.values);
        let values: Vec<String> =
            values.map(|(p, value)| format!("{} = {value:.4e} {}", p.name, p.unit)).collect();
        say!("  {}: {}", dose.effect.id, values.join(", "));
    }
    Ok(())
}

/// Adds the recording to a set of files; what is to be said of it.
fn write(simulation: &Simulation, out: &Path, files: &mut OutputSet) -> anyhow::Result<String> {
    let name = out.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    // What a column of a format other than text holds follows from all rows.
    let written = match Format::of(out) {
        Ok(Format::Csv | Format::CsvGz) => write_parts(simulation.parts(&name)?, out, files)?,
        _ => simulation.record(&name)?.write_into(out, files)?,
    };
    written.left_out.iter().for_each(|warning| warn(warning));
    Ok(format!(
        "{}: {} rows, {:.0} s of the programme {}, unit {}",
        out.display(),
        written.rows,
        written.rows as f64 / simulation.rate,
        simulation.programme.name(),
        simulation.unit.name(),
    ))
}

/// Adds the recording that parts make up.
fn write_parts(parts: Parts<'_>, out: &Path, files: &mut OutputSet) -> anyhow::Result<Written> {
    let (made, written) = write_as_made(out, files, |writer| -> Result<(), SimulationError> {
        for part in parts {
            if writer.send(part?).is_err() {
                break;
            }
        }
        Ok(())
    });
    made?;
    Ok(written?)
}

/// None, one, two or three effects in a quarter, nearly half, a fifth and a tenth of all cases, of any size from a third of
/// the usual to ten times it; what a calibration takes up, and gross mistakes, are not drawn.
fn draw(simulation: &mut Simulation) -> anyhow::Result<()> {
    let mut random = Random::new(simulation.seed, Purpose::Case);
    let chance = random.share();
    let count = [0.25, 0.7, 0.9].iter().filter(|bound| chance >= **bound).count();
    let mut pool: Vec<&'static Effect> = CATALOGUE.iter().filter(|effect| is_drawn(effect)).collect();
    random.shuffle(&mut pool);
    for effect in pool.into_iter().take(count) {
        let sign = if random.share() < 0.5 { -1.0 } else { 1.0 };
        simulation.add(effect, sign * 0.3 * libm::pow(100.0 / 3.0, random.share()))?;
    }
    Ok(())
}

fn is_drawn(effect: &Effect) -> bool {
    !matches!(omission(effect), Some(Omission::Baseline | Omission::Convention | Omission::Reference))
}

fn sealed(mut simulation: Simulation, out: &Path, overwrite: Overwrite) -> anyhow::Result<Ending> {
    let label_path = label_for(out)?;
    let mut planned = Planned::recording(out);
    planned.push(Planned::new(&label_path));
    let mut files = overwrite.plan(&[], &planned)?;
    let nonce = Nonce::fresh().context("the system gave no random numbers")?;
    // Not the nonce itself, and one way: the recording says nothing of its label.
    simulation.seed = nonce.seed("imucal sealed seed");
    draw(&mut simulation)?;
    let effects: Vec<_> = simulation
        .doses
        .iter()
        .map(|dose| {
            let names = dose.effect.parameters.iter().map(|parameter| parameter.name.clone());
            let values: serde_json::Map<_, _> = names.zip(dose.values.iter().map(|v| json!(v))).collect();
            json!({ "effect": dose.effect.id, "parameters": values })
        })
        .collect();
    let label = json!({
        "format": "imucal-label/1",
        "salt": nonce.hex(),
        "seed": simulation.seed,
        "unit": simulation.unit.name(),
        "programme": simulation.programme.name(),
        "effects": effects,
    });
    let text = serde_json::to_string_pretty(&label)? + "\n";
    let done = write(&simulation, out, &mut files)?;
    files.add(&label_path, text.as_bytes())?;
    files.commit()?;
    say!("{done}");
    say!("{}: SHA-256 {}", label_path.display(), digest(&text));
    Ok(Ending::Done)
}

/// `NAME.label.json` for `NAME.csv.gz`.
fn label_for(out: &Path) -> anyhow::Result<PathBuf> {
    let manifest = Manifest::path_for(out)
        .with_context(|| format!("{}: expected a name that ends in .csv or .csv.gz", out.display()))?;
    Ok(manifest.with_extension("label.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_answered_with_the_nearest() {
        let known = |id: &str| user::named("effect", id, &[]).map_err(|unknown| unknown.to_string());
        assert!(known("acc.leverarm").unwrap_err().contains("did you mean `acc.lever_arm`"));
        assert!(programme("rate").unwrap_err().contains("`rates`"));
        assert!(unit("mti").unwrap_err().contains("`mtx`"));
        assert!(known("something else entirely").unwrap_err().contains("expected one of rig.level_tilt"));
    }

    #[test]
    fn a_size_must_be_a_number() {
        assert_eq!(size("gyr.warmup=-2.5").unwrap().1, -2.5);
        assert_eq!(size("gyr.warmup").unwrap().1, 1.0);
        for text in ["gyr.warmup=", "gyr.warmup=big", "gyr.warmup=inf"] {
            assert!(size(text).unwrap_err().contains("no number"), "{text}");
        }
    }

    #[test]
    fn axes_are_three_letters_no_two_alike_in_a_row() {
        assert_eq!(axes("zxy"), Ok([Axis::Z, Axis::X, Axis::Y]));
        assert!(axes("zxz").is_ok());
        for text in ["zz", "zzy", "zxyz", "abc", "z-y", "zayx"] {
            assert!(axes(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_sealed_case_has_its_label_in_the_same_folder_and_the_manifest_does_not_tell() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("case.csv");
        let simulation = Simulation { programme: Programme::Sinusoids, rate: 10.0, ..Simulation::default() };
        sealed(simulation, &out, Overwrite::default()).unwrap();
        let label = std::fs::read_to_string(folder.path().join("case.label.json")).unwrap();
        let label: serde_json::Value = serde_json::from_str(&label).unwrap();
        assert_eq!(label["salt"].as_str().unwrap().len(), 64);
        assert!(label["effects"].is_array());
        let manifest = std::fs::read_to_string(folder.path().join("case.toml")).unwrap();
        assert!(!manifest.contains(&label["seed"].to_string()), "{manifest}");
    }

    #[test]
    fn sealed_cases_vary_and_draw_neither_baseline_nor_gross_mistakes() {
        let mut counts = [0; 4];
        for seed in 0..200 {
            let mut simulation = Simulation { programme: Programme::Rates, seed, ..Simulation::default() };
            draw(&mut simulation).unwrap();
            counts[simulation.doses.len()] += 1;
            assert!(simulation.doses.iter().all(|dose| is_drawn(dose.effect)));
        }
        assert!(counts.iter().all(|count| *count > 5), "{counts:?}");
    }
}
