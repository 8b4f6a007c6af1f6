//! The emulated co-processor at the end of its UART, through the program and through its library.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use firmware_example::RECORD_2;
use imucal_core::{
    corrector::FullCorrector,
    link::FitModel,
    nonlinearity::NonlinearTerms,
    record::{self, Date, HigherOrder, NonlinearRecord, Order, TriadRecord},
};
use imucal_host::recording::{Recording, SensorKind};
use imucal_tests::{
    coprocessor::{address, drilled, session},
    data,
    firmware::{BOARDS, ready},
    program, simulated,
};
use nalgebra::{Matrix3, Rotation3, Vector3};

const PROGRAM: &str = env!("CARGO_BIN_EXE_imucal-under-test");
#[test]
fn both_boards_fit_store_and_correct_as_this_machine_does() {
    if !ready() {
        return;
    }
    for board in BOARDS {
        let mut session = session(board, None);
        let capacity = session.identity().capacity;
        for (model, count) in [(FitModel::T9, 40), (FitModel::E9, 40), (FitModel::K12, 4)] {
            let fit = drilled(model, count, 5);
            let report = session.fit(&fit, Date::from_days(20_000)).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(fit.is_here(&report), Some(true), "{model:?} on {}: {report:?}", board.core);
        }
        let count = usize::from(capacity.poses).min(16);
        let report = session.fit(&drilled(FitModel::I14, count, 5), Date::from_days(20_000));
        assert_eq!(report.unwrap_or_else(|error| panic!("{error}")).refusal, None, "{}", board.core);
        assert_eq!(session.store_record(false).unwrap_or_else(|error| panic!("{error}")), 1);
        let stored = session.record().unwrap_or_else(|error| panic!("{error}")).expect("stored");
        assert!(record::decode(&stored).is_ok_and(|record| record.acc.is_some()));
    }
}

#[test]
fn a_record_of_higher_order_is_used_to_the_bit_and_refused_by_the_board_with_little_memory() {
    if !ready() {
        return;
    }
    let record = record::decode_as::<HigherOrder>(RECORD_2).expect("it is golden");
    let corrector =
        FullCorrector::<f32>::try_from(record.acc.as_ref().expect("it has one")).expect("gentle terms");
    let raw: Vec<Vector3<f32>> = (0..60)
        .map(|k| k as f32)
        .map(|k| Vector3::new(27e3 + 180.0 * k, 38e3 - 170.0 * k, 31e3 + 9.0 * k))
        .collect();
    let temperature: Vec<f32> = (0..60).map(|k| 20.0 + 0.25 * k as f32).collect();
    let [large, small, _] = BOARDS;
    let mut board = session(large, None);
    board.put_record(RECORD_2, false).unwrap_or_else(|error| panic!("{error}"));
    let answers =
        board.correct_at(SensorKind::Acc, &raw, &temperature).unwrap_or_else(|error| panic!("{error}"));
    for ((raw, temperature), answer) in raw.iter().zip(&temperature).zip(&answers) {
        let here = corrector.apply_at(raw, *temperature);
        assert_eq!(answer.map(f32::to_bits), here.map(f32::to_bits), "{raw} at {temperature} °C");
    }
    let refused = session(small, None).put_record(RECORD_2, false).expect_err("a record of higher order");
    assert!(refused.to_string().contains("newer"), "{refused}");
}

#[test]
fn uptime_goes_on_while_nothing_comes() {
    if !ready() {
        return;
    }
    // Rounds of the timers that would be missed: of 24 bits, four or more.
    let idle = Duration::from_secs(3);
    let mut sessions = BOARDS.map(|board| session(board, None));
    let mut uptime = || {
        let asked = Instant::now();
        let all = sessions.each_mut().map(|session| {
            let status = session.status().unwrap_or_else(|error| panic!("{error}"));
            Duration::from_millis(status.uptime.into())
        });
        (asked, all)
    };
    let (before, first) = uptime();
    std::thread::sleep(idle);
    let (after, second) = uptime();
    for (board, (first, second)) in BOARDS.iter().zip(first.into_iter().zip(second)) {
        let (passed, true_time) = (second.saturating_sub(first), after - before);
        assert!(passed.abs_diff(true_time) < idle / 3, "{}: {passed:?} of {true_time:?}", board.core);
    }
}

#[test]
fn the_loop_of_the_readme_ends_where_it_began_after_each_power_cycle() {
    if !ready() {
        return;
    }
    let Some(folder) = data::folder() else { return };
    let recording = folder.join("real/xsens-mti.csv.gz");
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let at = |name: &str| scratch.path().join(name);
    let (device, flash) = (address(BOARDS[0]), at("unit.flash"));
    let run = |command: &[&str], paths: &[(&str, PathBuf)]| {
        let mut arguments: Vec<String> = vec!["device".into()];
        arguments.extend(command.iter().map(|word| (*word).to_owned()));
        for (option, path) in paths {
            arguments.extend([(*option).to_owned(), path.display().to_string()]);
        }
        // Each call starts the co-processor again, with nothing but its flash.
        arguments.extend(["--device".into(), device.clone(), "--flash".into(), flash.display().to_string()]);
        program::run(PROGRAM, &[], &arguments)
    };
    let path = recording.display().to_string();
    run(&["identify"], &[]).with(0).printing(&["record 0: none is stored"]);
    run(&["stream", &path], &[("--out", at("early.csv"))]).with(1).telling(&["no record is stored"]);
    run(&["calibrate", &path], &[]).with(0).printing(&[
        "T9",
        "K12",
        "equal bit for bit",
        "stored as record 1",
    ]);
    run(&["identify"], &[]).with(0).printing(&["record 1: in use, without a serial"]);
    run(&["get"], &[("--out", at("unit.bin"))]).with(0);

    // A second's worth of the recording, or QEMU's UART would take minutes.
    let mut short = Recording::read(&recording).unwrap_or_else(|error| panic!("{error}"));
    shorten(&mut short, 2_000);
    short.write(&at("short.csv")).unwrap_or_else(|error| panic!("{error}"));
    let short = at("short.csv").display().to_string();
    run(&["stream", &short], &[("--out", at("device.csv"))]).with(0);
    let host = ["apply", &short, "--calibration", &at("unit.bin").display().to_string(), "--out"]
        .map(str::to_owned)
        .into_iter()
        .chain([at("host.csv").display().to_string()]);
    program::run(PROGRAM, &[], &host.collect::<Vec<_>>()).with(0);
    let read = |name: &str| std::fs::read(at(name)).expect("it was written");
    assert_eq!(read("device.csv"), read("host.csv"));
}

fn shorten(recording: &mut Recording, rows: usize) {
    recording.time.truncate(rows);
    for triple in [&mut recording.acc, &mut recording.gyr, &mut recording.mag].into_iter().flatten() {
        triple.values.truncate(rows);
    }
    if let Some(temperature) = &mut recording.temperature {
        temperature.truncate(rows);
    }
}

#[test]
fn a_session_on_board_stores_what_this_machine_finds_and_gives_up_what_is_less_sure() {
    if !ready() {
        return;
    }
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let recording = simulated::write_small(scratch.path()).display().to_string();
    let flash = scratch.path().join("unit.flash").display().to_string();
    let (device, out) = (address(BOARDS[0]), scratch.path().join("unit.bin").display().to_string());
    let run = |command: &[&str]| {
        let arguments = [command, &["--device", &device, "--flash", &flash]].concat();
        program::run(PROGRAM, &[], &arguments.into_iter().map(str::to_owned).collect::<Vec<_>>())
    };
    run(&["capture", &recording, "--target", "1,1,1", "--record", &out]).with(0).printing(&[
        "point up, then keep it still for 2 s",
        "enough: every sensor has reached its target",
        "accelerometer is calibrated",
        "magnetometer is calibrated",
        "stored as record 1",
        "equal bit for bit",
    ]);
    assert!(std::fs::read(&out).is_ok_and(|bytes| record::decode(&bytes).is_ok()));
    // It starts again with that record: the same data are no surer.
    let again = run(&["capture", &recording, "--target", "1,1,1"]);
    again.with(1).printing(&["accelerometer is not calibrated: the one in use is surer"]);
    run(&["device", "restore"]).with(1).telling(&["no record is stored before the last one"]);
    run(&["device", "watch"]).with(1).telling(&["nothing was watched yet"]);
}

#[test]
fn a_session_on_board_is_turned_into_the_axes_of_its_record_as_on_this_machine() {
    if !ready() {
        return;
    }
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let recording = simulated::write_small(scratch.path()).display().to_string();
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let (device, flash, rig, out) = (address(BOARDS[0]), at("unit.flash"), at("rig.bin"), at("unit.bin"));
    let run = |command: &[&str]| {
        let arguments = [command, &["--device", &device, "--flash", &flash]].concat();
        program::run(PROGRAM, &[], &arguments.into_iter().map(str::to_owned).collect::<Vec<_>>())
    };
    run(&["capture", &recording, "--target", "1,1,1", "--record", &rig]).with(0);
    let mut held = record::decode(&std::fs::read(&rig).expect("a record")).expect("whole");
    // The same accelerometer in a table's axes, less sure than it is.
    let acc = held.acc.as_mut().expect("an accelerometer");
    let lies = Rotation3::new(Vector3::new(0.3f32, -0.7, 0.2)).into_inner();
    let turn = |triad: &mut TriadRecord| {
        triad.gain = (lies * Matrix3::from(triad.gain).transpose()).transpose().into();
        let largest = triad.quality.gain_std.iter().flatten().fold(0.0, |a: f32, b| a.max(*b));
        triad.quality.gain_std = [[10.0 * largest; 3]; 3];
    };
    turn(acc);
    held.mag.iter_mut().for_each(turn);
    let mut buffer = [0; record::MAX_LEN];
    std::fs::write(&rig, record::encode(&held, &mut buffer).expect("plausible")).expect("it is written");

    run(&["device", "put", &rig, "--replace"]).with(0);
    run(&["capture", &recording, "--target", "1,1,1", "--record", &out]).with(0).printing(&[
        "accelerometer is calibrated",
        "magnetometer is calibrated",
        "equal bit for bit",
    ]);
    let stored = record::decode(&std::fs::read(&out).expect("a record")).expect("whole");
    for (stored, rig) in [(stored.acc, held.acc), (stored.mag, held.mag)] {
        let (stored, rig) = (stored.expect("a triad"), rig.expect("a triad"));
        let (stored, rig) = (Matrix3::from(stored.gain), Matrix3::from(rig.gain));
        assert!((stored - rig).amax() < 1e-4 * rig.amax(), "{stored} {rig}");
    }
}

#[test]
fn a_session_on_board_leaves_a_triad_of_higher_order_and_replaces_the_others() {
    if !ready() {
        return;
    }
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let recording = simulated::write_small(scratch.path()).display().to_string();
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let (device, flash, bent, out) = (address(BOARDS[0]), at("unit.flash"), at("bent.bin"), at("unit.bin"));
    let run = |command: &[&str]| {
        let arguments = [command, &["--device", &device, "--flash", &flash]].concat();
        program::run(PROGRAM, &[], &arguments.into_iter().map(str::to_owned).collect::<Vec<_>>())
    };
    run(&["capture", &recording, "--target", "1,1,1", "--record", &bent]).with(0);
    let mut held = record::decode_as::<HigherOrder>(&std::fs::read(&bent).expect("a record")).expect("whole");
    let terms = NonlinearTerms { quadratic: [1e-8; 3], ..NonlinearTerms::none() };
    let bends = NonlinearRecord { range: 16_000.0, terms, std: NonlinearTerms::none() };
    held.acc.as_mut().expect("an accelerometer").order.nonlinearity = Some(bends);
    let mag = held.mag.as_mut().expect("a magnetometer");
    let largest = mag.quality.gain_std.iter().flatten().fold(0.0, |a: f32, b| a.max(*b));
    mag.quality.gain_std = [[10.0 * largest; 3]; 3];
    let mut buffer = [0; HigherOrder::MAX_LEN];
    std::fs::write(&bent, record::encode(&held, &mut buffer).expect("plausible")).expect("it is written");

    run(&["device", "put", &bent, "--replace"]).with(0);
    run(&["capture", &recording, "--target", "1,1,1", "--record", &out]).with(0).printing(&[
        "accelerometer is not calibrated: the one in use has nonlinear terms",
        "magnetometer is calibrated",
        "equal bit for bit",
    ]);
    let stored = record::decode_as::<HigherOrder>(&std::fs::read(&out).expect("a record")).expect("whole");
    assert_eq!(stored.acc, held.acc);
    assert_ne!(stored.mag, held.mag);
}

#[test]
fn a_board_without_the_memory_for_a_session_says_so() {
    if !ready() {
        return;
    }
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let recording = simulated::write_small(scratch.path()).display().to_string();
    let arguments = ["capture", &recording, "--device", &address(BOARDS[1])].map(str::to_owned);
    program::run(PROGRAM, &[], &arguments).with(1).telling(&["no memory for that"]);
}
