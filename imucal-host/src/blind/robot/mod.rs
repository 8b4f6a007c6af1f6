//! Sealed trials with robots: a recording with the stream of a simulator, and what distinguishes the two.
//!
//! As with the rig a nonce draws every case, and labels are hashed before the pair is diagnosed. Each pair has clocks and
//! a mount of its own. Apart from that it is healthy, or has one effect of the catalogue, or stretches in which the robot
//! moved otherwise than its simulator, or one mechanism from outside the catalogue, or an effect that a user has written down
//! and that is a candidate of the pair's diagnosis.

pub mod case;
pub mod judgement;
pub mod lambda;
pub mod outside;
pub mod own;
pub mod score;
mod setting;
mod table;
pub mod trial;
