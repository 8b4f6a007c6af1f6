//! Trust: whether what is accepted is as good as it says, over hand recordings good and bad.

pub mod cell;
pub mod hand;
pub mod healthy;
pub mod score;

pub use cell::Cell;
pub use hand::Hand;

/// The study's tables, and whether its limits are kept: they are printed with what breaks them.
pub fn report(each: u64, seed: u64) -> (String, bool) {
    let trials = healthy::trials(each, seed);
    let broken = healthy::broken(&trials);
    let mut text = healthy::table(&trials);
    for said in &broken {
        text.push_str(&format!("LIMIT BROKEN: {said}\n"));
    }
    (text, broken.is_empty())
}
