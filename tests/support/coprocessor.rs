//! The emulated co-processor, and the fits that tests give it.

use std::path::Path;

use firmware_example::{drill, scene::Noise};
use imucal_core::{
    link::{FitModel, Observation},
    record::Date,
};
use imucal_host::device::{Address, Session, fit::BoardFit};

use crate::firmware::{Board, build};

/// Where the program finds the co-processor of a board, which is built for this.
///
/// # Panics
///
/// Where it does not build.
pub fn address(board: Board) -> String {
    let image = build(board, "coprocessor", &[]).unwrap_or_else(|refusal| panic!("{refusal}"));
    let machine = match board.machine {
        "mps2-an386" => "qemu",
        "mps2-an505" => "an505",
        other => other,
    };
    format!("{machine}:{}", image.display())
}

/// A conversation with it; `flash` is the file behind its flash.
///
/// # Panics
///
/// Where there is no answer.
pub fn session(board: Board, flash: Option<&Path>) -> Session {
    let address: Address = address(board).parse().expect("an address");
    Session::open(&address, flash).unwrap_or_else(|error| panic!("{error}"))
}

/// A fit of simulated observations.
pub fn drilled(model: FitModel, count: usize, seed: u32) -> BoardFit {
    let mut observations: Vec<Observation> = Vec::new();
    drill::observe(model, count, &mut Noise(seed), |observation| observations.push(observation));
    BoardFit { task: drill::task(model), observations }
}

/// Stack that a board has used, bytes, after a fit of every model, a swarm's search, a record stored and one put.
///
/// # Panics
///
/// Where one of them fails.
pub fn painted_stack(board: Board) -> u32 {
    let mut session = session(board, None);
    let poses = usize::from(session.identity().capacity.poses).min(16);
    let mut search = drilled(FitModel::K12, 4, 5);
    search.task.search = Some(1);
    let all = [(FitModel::T9, 40), (FitModel::I14, poses), (FitModel::E9, 40), (FitModel::K12, 4)];
    for fit in all.map(|(model, count)| drilled(model, count, 5)).iter().chain([&search]) {
        session.fit(fit, Date::from_days(20_000)).unwrap_or_else(|error| panic!("{error}"));
    }
    session.store_record(false).unwrap_or_else(|error| panic!("{error}"));
    let record = session.record().unwrap_or_else(|error| panic!("{error}")).expect("stored");
    session.put_record(&record, false).unwrap_or_else(|error| panic!("{error}"));
    let status = session.status().unwrap_or_else(|error| panic!("{error}"));
    status.stack.expect("the machine looks")
}
