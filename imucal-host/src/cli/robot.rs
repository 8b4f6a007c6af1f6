//! `imucal simulate --robot`

use std::path::{Path, PathBuf};

use anyhow::Context;

use super::{
    Ending,
    output::say,
    overwrite::{Overwrite, Planned},
};
use crate::{
    effect::Effect,
    recording::Manifest,
    simulator::{
        Dose,
        random::{Purpose, Random},
        robot::RobotScene,
    },
};

/// How far the unit is turned on the body, degrees.
const MOUNT: f64 = 1.0;

/// Simulates a robot's recording, NAME-real, and its simulator's stream, NAME-sim.
pub(super) fn simulate(
    mut scene: RobotScene,
    effects: &[(&'static Effect, f64)],
    inputs: &[PathBuf],
    out: &Path,
    overwrite: Overwrite,
) -> anyhow::Result<Ending> {
    let [real, simulated] = [part(out, "real")?, part(out, "sim")?];
    let mut planned = Planned::recording(&real);
    planned.extend(Planned::recording(&simulated));
    let mut files = overwrite.plan(inputs, &planned)?;
    let mut random = Random::new(scene.seed, Purpose::Rig);
    scene.mounting = random.normals().normalize() * MOUNT.to_radians();
    let dose = |(effect, size): &(&'static _, f64)| Dose::sized(effect, *size, scene.seed, scene.duration);
    scene.doses = effects.iter().map(dose).collect();
    let pair = scene.record(scene.kind.name())?;
    let rows = [pair.real.rows(), pair.simulated.rows()];
    pair.real.write_into(&real, &mut files)?;
    pair.simulated.write_into(&simulated, &mut files)?;
    files.commit()?;
    let [turn_x, turn_y, turn_z] = <[f64; 3]>::from(scene.mounting).map(f64::to_degrees);
    say!(
        "{}: {} rows, {:.0} s of a {} robot, unit {}, turned on the body by {turn_x:.3}, {turn_y:.3}, {turn_z:.3} degrees",
        real.display(),
        rows[0],
        scene.duration,
        scene.kind.name(),
        scene.unit.name(),
    );
    say!("{}: {} rows of its simulator", simulated.display(), rows[1]);
    for stretch in scene.moved()?.mismatch.stretches {
        say!("  another motion from {:.2} to {:.2} s", stretch.span.0, stretch.span.1);
    }
    super::simulate::say_doses(&scene.doses)?;
    Ok(Ending::Done)
}

/// `NAME-real.csv.gz` of `NAME.csv.gz`.
fn part(out: &Path, part: &str) -> anyhow::Result<PathBuf> {
    let refusal = || format!("{}: expected a name that ends in .csv or .csv.gz", out.display());
    let manifest = Manifest::path_for(out).with_context(refusal)?;
    let stem = manifest.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let name = out.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = name.strip_prefix(&stem).with_context(refusal)?;
    Ok(out.with_file_name(format!("{stem}-{part}{ending}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        recording::{Recording, Stream},
        simulator::robot::RobotKind,
    };

    #[test]
    fn a_pair_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let scene =
            RobotScene { kind: RobotKind::Flying, duration: 40.0, counts: false, ..RobotScene::default() };
        let out = folder.path().join("flight.csv.gz");
        let effect = crate::effect::find("clk.time_offset").unwrap();
        simulate(scene, &[(effect, 2.0)], &[], &out, Overwrite::default()).unwrap();
        let read =
            |part: &str| Recording::read(&folder.path().join(format!("flight-{part}.csv.gz"))).unwrap();
        let (real, simulated) = (read("real"), read("sim"));
        assert_eq!(real.rows(), 8000);
        let stream = Stream::of(&simulated).unwrap();
        assert_eq!((stream.name.as_str(), stream.time.len()), ("flying", 8000));
        assert!(stream.values.acc.is_some() && stream.values.gyr.is_some() && stream.values.mag.is_some());
    }

    #[test]
    fn parts_are_named_after_the_whole() {
        let of = |out: &str| part(Path::new(out), "sim").map(|path| path.display().to_string());
        assert_eq!(of("a/walk.csv").unwrap(), "a/walk-sim.csv");
        assert_eq!(of("walk.one.csv.gz").unwrap(), "walk.one-sim.csv.gz");
        assert!(of("walk").is_err());
    }
}
