//! Trust: whether what is accepted is as good as it says, over hand recordings good and bad.

pub mod cell;
pub mod hand;

pub use cell::Cell;
pub use hand::Hand;
