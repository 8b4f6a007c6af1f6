//! Trust: whether what is accepted is as good as it says, over hand recordings good and bad.

pub mod cell;
pub mod fault;
pub mod faulty;
pub mod hand;
pub mod healthy;
pub mod score;

pub use cell::Cell;
pub use hand::Hand;

/// The study's tables of so many healthy recordings of each cell and so many of each kind of fault, and whether its limits
/// are kept: they are printed with what breaks them.
pub fn report(each: u64, faulty: u64, seed: u64) -> (String, bool) {
    let trials = healthy::trials(each, seed);
    let lines = faulty::lines(fault::FAULTS, seed..seed + faulty);
    let broken: Vec<String> = healthy::broken(&trials).into_iter().chain(faulty::broken(&lines)).collect();
    let mut text = format!("{}\n{}", healthy::table(&trials), faulty::table(&lines));
    for said in &broken {
        text.push_str(&format!("LIMIT BROKEN: {said}\n"));
    }
    (text, broken.is_empty())
}
