//! Robots that move: legged, wheeled and flying, with the stream that a simulator of them puts out.

pub mod deviation;
pub mod flying;
pub mod jet;
pub mod legged;
pub mod mismatch;
pub mod motion;
pub mod pair;
pub mod route;
pub mod trajectory;
pub mod vibration;
pub mod wheeled;

pub use self::{
    mismatch::MismatchKind,
    motion::RobotMotion,
    pair::{RobotPair, RobotScene},
    trajectory::{RobotKind, Trajectory},
};
