//! What the core computes, against values worked out by hand: limits from both sides, problems with a known answer.

mod accept;
mod rows;
mod solver;
mod turn;
